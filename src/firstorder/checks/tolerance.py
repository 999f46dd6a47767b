"""Tolerances: computed from precision, conditioning and grid, never grown until a test is green."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np


def _epsilon(dtype=None) -> float:
    """Machine epsilon of the given, or the default, floating type."""
    return float(np.finfo(dtype or jnp.result_type(float)).eps)


def rounding(operations: int = 1, condition: float = 1.0, dtype=None) -> float:
    """Bound on relative rounding error: `8 sqrt(operations) condition eps`.

    The square root is for errors of random sign; 8 is the one safety factor of the library.
    """
    return 8.0 * float(np.sqrt(max(operations, 1))) * max(condition, 1.0) * _epsilon(dtype)


def normwise(a, b) -> float:
    """Largest difference between a and b, relative to the largest magnitude of b.

    If b is zero everywhere, the absolute difference. NaN anywhere gives infinity, so that it
    can never pass.
    """
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape:
        raise ValueError(f"Arguments must have one shape, but have {a.shape} and {b.shape}.")
    difference = np.max(np.abs(a - b), initial=0.0)
    scale = np.max(np.abs(b), initial=0.0)
    error = float(difference / scale) if scale > 0 else float(difference)
    return error if np.isfinite(error) else float("inf")


def fitted_order(sizes, errors) -> float:
    """Slope of log error against log size: the order of an approximation."""
    return float(np.polyfit(np.log(np.asarray(sizes)), np.log(np.asarray(errors)), 1)[0])
