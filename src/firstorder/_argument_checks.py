"""Argument checks at the public boundary: on the host, in one sentence.

Concrete arguments raise `ValueError`. Traced arguments cannot be looked at; where an invalid
one would give a plausible number, `nan_unless` turns the result into NaN instead.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from firstorder._symbols import SymbolicArray


def is_concrete(x: Any) -> bool:
    """Whether every leaf of `x` can be looked at on the host."""
    return not any(isinstance(leaf, (Tracer, SymbolicArray)) for leaf in jax.tree.leaves(x))


def _all(name: str, x: Any, ok, words: str) -> None:
    """Raise unless `ok` holds on all of `x`; a tree of placeholders is left alone."""
    if not is_concrete(x) or not isinstance(x, (int, float, np.ndarray, np.generic, jax.Array)):
        return
    a = np.asarray(x)
    good = ok(a)
    if not np.all(good):
        bad = a[~good].flat[0] if a.ndim else a[()]
        raise ValueError(f"Argument `{name}` must {words}, but is {bad}.")


def check_finite(name: str, x: Any) -> None:
    """Refuse NaN and infinity."""
    _all(name, x, np.isfinite, "be finite")


def check_positive(name: str, x: Any) -> None:
    """Refuse zero, negative numbers and NaN."""
    _all(name, x, lambda a: np.isfinite(a) & (a > 0), "be positive")


def check_not_negative(name: str, x: Any) -> None:
    """Refuse negative numbers and NaN."""
    _all(name, x, lambda a: np.isfinite(a) & (a >= 0), "not be negative")


def check_between(name: str, x: Any, low: float, high: float) -> None:
    """Refuse what lies outside [low, high]."""
    _all(name, x, lambda a: (a >= low) & (a <= high), f"lie in [{low:g}, {high:g}]")


def check_shape(name: str, x: Any, shape: tuple[int, ...]) -> None:
    """Refuse an array whose shape is not `shape`."""
    if hasattr(x, "shape") and tuple(x.shape) != tuple(shape):
        raise ValueError(f"Argument `{name}` must have shape {shape}, but has {tuple(x.shape)}.")


def check_invertible(name: str, M: Any) -> None:
    """Refuse a square matrix that is singular to working precision."""
    if not is_concrete(M) or not hasattr(M, "ndim") or M.ndim != 2 or M.shape[0] != M.shape[1]:
        return
    check_finite(name, M)
    a = np.asarray(M)
    if np.linalg.cond(a) > 1.0 / np.finfo(a.dtype).eps:
        raise ValueError(f"Argument `{name}` must be invertible, but its rank is too low.")


def nan_unless(ok: Any, x: Any) -> Any:
    """`x` where `ok`, NaN elsewhere: an invalid traced input never looks like an answer."""
    if is_concrete((ok, x)) and np.all(np.asarray(ok)):
        return x
    return jnp.where(ok, x, jnp.nan)


def check_unit(name: str, w: Float[Array, " 3"]) -> None:
    """Refuse a direction that is not a unit vector."""
    if is_concrete(w):
        length = float(np.linalg.norm(np.asarray(w)))
        if not abs(length - 1.0) < 1e-4:
            raise ValueError(f"Argument `{name}` must be a unit vector, but has length {length:g}.")
