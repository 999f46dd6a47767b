"""Tolerances: computed from precision, conditioning and grid, never grown until a test is green."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_positive, check_real, check_shape


def _epsilon(dtype=None) -> float:
    """Machine epsilon of the given, or the default, floating type."""
    return float(np.finfo(dtype or jnp.result_type(float)).eps)


def rounding(operations: int = 1, condition: float = 1.0, dtype=None) -> float:
    """Bound on relative rounding error: `8 sqrt(operations) condition eps`.

    The square root is for errors of random sign; 8 is the one safety factor of the library.

    Args:
        operations: that round, one after the other.
        condition: by how much the result multiplies a relative error.
        dtype: of the numbers; the default precision, if left out.

    Example:
        >>> from firstorder.checks import rounding
        >>> rounding(4, dtype="float64") < 1e-14
        True
    """
    return 8.0 * float(np.sqrt(max(operations, 1))) * max(condition, 1.0) * _epsilon(dtype)


def normwise(a, b) -> float:
    """Largest difference between a and b, relative to the largest magnitude of b.

    If b is zero everywhere, the absolute difference. NaN anywhere gives infinity, so that it
    can never pass.

    Raises:
        ValueError: if both do not have one shape, or hold nothing: a check of nothing cannot fail.

    Example:
        >>> from firstorder.checks import normwise
        >>> normwise([1.0, 4.0], [2.0, 4.0])
        0.25
    """
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape:
        raise ValueError(f"Arguments must have one shape, but have {a.shape} and {b.shape}.")
    if not b.size:
        raise ValueError(f"Arguments must hold numbers to compare, but have shape {b.shape}.")
    difference, scale = np.max(np.abs(a - b)), np.max(np.abs(b))
    error = float(difference / scale) if scale > 0 else float(difference)
    return error if np.isfinite(error) else float("inf")


def fitted_order(sizes, errors) -> float:
    """Slope of log error against log size: the order of an approximation.

    Args:
        sizes: of steps, positive.
        errors: at each, positive.

    Raises:
        ValueError: if sizes or errors are not positive, not equally many, or all sizes are one.

    Example:
        >>> from firstorder.checks import fitted_order
        >>> round(fitted_order([0.1, 0.2, 0.4], [0.01, 0.04, 0.16]), 9)
        2.0
    """
    return float(np.polyfit(*_logarithms(sizes=sizes, errors=errors), 1)[0])


def _logarithms(**numbers: Any) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms of two rows of positive numbers, between which a power law is fitted.

    Args:
        numbers: the two rows by their names.

    Raises:
        ValueError: if they are not positive, not equally many, or the first holds a single number.

    Example:
        >>> from firstorder.checks.tolerance import _logarithms
        >>> [a.tolist() for a in _logarithms(sizes=[1.0, 1.0], errors=[1.0, 1.0])]
        Traceback (most recent call last):
            ...
        ValueError: Argument `sizes` must hold two different numbers, but holds [1. 1.].
    """
    (name, x), (other, y) = numbers.items()
    for key, a in numbers.items():
        check_real(key, np.asarray(a))
        check_positive(key, np.asarray(a, float))
    x, y = np.atleast_1d(np.asarray(x, float)), np.asarray(y, float)
    check_shape(name, x, (x.size,))
    check_shape(other, y, x.shape)
    if np.all(x == x[:1]):
        raise ValueError(f"Argument `{name}` must hold two different numbers, but holds {x}.")
    return np.log(x), np.log(y)
