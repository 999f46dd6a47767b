"""Distances to records and their weights, and checks of what chooses among candidates."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._argument_checks import check_finite


def reached(error: Any) -> Any:
    """Whether a place at that distance from a record lies inside its region: `e < 1 - 8 eps`.

    A place exactly on the rim is outside, however its distance was rounded: candidates on a regular
    grid whose pitch is the smallest radius lie there. One rule for a line and for a plane, for the
    filling of a cache and for its answers; for arrays of NumPy and of JAX.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching._records import reached
        >>> reached(np.array([0.5, 1.0 - 1e-15, 1.0])).tolist()
        [True, False, False]
    """
    return error < rim(error.dtype)


def rim(dtype: Any) -> float:
    """The rim of a region in a precision: eight roundings within 1."""
    return 1.0 - 8.0 * float(np.finfo(dtype).eps)


def distance(matrix: Float[Array, "r d d"], dx: Float[Array, "r d"]) -> Float[Array, " r"]:
    """Steps measured by the regions of records: `|M dx|`, with a finite slope at zero."""
    d = dx.shape[-1]
    parts = [sum(matrix[:, a, b] * dx[:, b] for b in range(d)) for a in range(d)]
    if d == 1:
        return jnp.abs(parts[0])
    return _norm(sum(u * u for u in parts))


def turning(turn: Float[Array, "r d"]) -> Float[Array, " r"]:
    """The share of an error that is due to a turn of the normal: its sine, 1 from a right angle.

    Along a line it is the difference of two angles, of which one may have gone around.
    """
    d = turn.shape[-1]
    if d == 1:
        return jnp.where(jnp.cos(turn[:, 0]) <= 0.0, 1.0, jnp.abs(jnp.sin(turn[:, 0])))
    angle = _norm(sum(turn[:, a] ** 2 for a in range(d)))
    return jnp.sin(jnp.minimum(angle, 0.5 * np.pi))


def _norm(square: Array) -> Array:
    """Square root; at zero it is next to nothing, and its slope zero."""
    return jnp.sqrt(jnp.maximum(square, jnp.finfo(square.dtype).tiny))


class Weights(NamedTuple):
    """Weights of the records at a place; only their ratios matter.

    Attributes:
        weight: of each record, zero where it is not used.
        used: whether it is.
        covered: whether any record is in reach of the place.
    """

    weight: Float[Array, " r"]
    used: Bool[Array, " r"]
    covered: Bool[Array, ""]


def weights(error: Float[Array, " r"], valid: Bool[Array, " r"], fade: bool = False) -> Weights:
    """Weights `1 / e` of the records that reach a place (`reached`).

    Where none does the one with the smallest error counts alone. With `fade` they are `1 / e - 1`.

    Args:
        error: e of each record, without unit.
        valid: which of them are records.
        fade: whether the weights end at zero.

    Reference: J12 eq. 34.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching._records import weights
        >>> found = weights(jnp.array([0.25, 0.5, 2.0]), jnp.ones(3, bool))
        >>> print((found.weight / found.weight.sum()).round(4))
        [0.6667 0.3333 0.    ]
    """
    error = jnp.where(valid, error, jnp.inf)
    nearest = jnp.min(jax.lax.stop_gradient(error))
    covered = reached(nearest)
    used = jnp.where(covered, reached(error), valid & (error == nearest))
    # Only ratios of weights count. Scaled by the smallest error they stay finite on a record.
    tiny = jnp.finfo(error.dtype).eps
    weight = (nearest + tiny) / (jnp.where(used, error, 1.0) + tiny)
    if fade:
        weight = jnp.where(covered, weight * jnp.where(used, 1.0 - error, 0.0), weight)
    return Weights(jnp.where(used, weight, 0.0), used, covered)


def kept(chosen: ArrayLike | None, count: int) -> Int[np.ndarray, " r"]:
    """Numbers of the chosen candidates; of all if none are named.

    Raises:
        ValueError: if there is not one truth value for each candidate.
    """
    if chosen is None:
        return np.arange(count)
    mask = np.asarray(chosen)
    if mask.dtype != bool or mask.shape != (count,):
        raise ValueError(
            f"Argument `chosen` must hold {count} truth values, one for each candidate, but is of "
            f"type {mask.dtype} and shape {mask.shape}."
        )
    return np.flatnonzero(mask)


def checked_visits(visits: Any, count: int) -> Int[np.ndarray, " v"]:
    """Numbers of candidates in the order of the visits.

    Raises:
        ValueError: if they are no such numbers in a row.
    """
    found = np.asarray(visits)
    if found.ndim != 1 or (found.size and found.dtype.kind not in "iu"):
        raise ValueError(
            "Argument `visits` must hold numbers of candidates in a row, but is of type "
            f"{found.dtype} and shape {found.shape}."
        )
    wrong = found[(found < 0) | (found >= count)]
    if wrong.size:
        raise ValueError(
            f"Argument `visits` must hold numbers from 0 to {count - 1}, but holds {wrong[0]}."
        )
    return found.astype(int)


def checked_order(order: int) -> int:
    """An order of extrapolation, which must be 0, 1 or 2."""
    if not isinstance(order, (int, np.integer)) or order not in (0, 1, 2):
        raise ValueError(f"Argument `order` must be 0, 1 or 2, but is {order!r}.")
    return order


def checked_places(position: ArrayLike) -> Float[np.ndarray, "m 2"]:
    """Places on a floor, which must be finite and have two coordinates.

    Raises:
        ValueError: if they are not.
    """
    x = np.asarray(position, float)
    if x.ndim != 2 or x.shape[1] != 2:
        raise ValueError(f"Argument `position` must have shape (m, 2), but has {x.shape}.")
    check_finite("position", x)
    return x
