"""Regions of validity of records: segments of a line, circles and ellipses on a plane.

A region holds the steps dx with `|M dx| < 1`. A circle's M is the identity over its radius.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import check_not_negative, check_positive, is_concrete
from firstorder.typing import as_float

# What acted on a radius.
FREE, RAISED, CUT = 0, -1, 1
CLAMPS = {FREE: "", RAISED: "raised", CUT: "cut"}


class ValidityRegion(NamedTuple):
    """Region in which each record is valid: the steps dx with `|matrix @ dx| < 1`.

    Attributes:
        matrix: one over the radius along a line, identity over the radius for a circle [1/m].
        clamp: what acted on it: `FREE`, `RAISED` or `CUT`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import ValidityRegion
        >>> ValidityRegion(jnp.array([[[2.0]]])).radius.tolist()
        [0.5]
    """

    matrix: Float[Array, "... d d"]
    clamp: Int[Array, "..."] | int = FREE

    @property
    def radius(self) -> Float[Array, "..."]:
        """The radius; of an ellipse, that of the circle of its area [m]."""
        det = jnp.abs(_determinant(as_float(self.matrix)))
        return 1.0 / (det if self.matrix.shape[-1] == 1 else jnp.sqrt(det))

    def at(self, rows: Any) -> ValidityRegion:
        """Regions of some records: numbers of rows, a mask or a slice."""
        clamp = jnp.broadcast_to(jnp.asarray(self.clamp), self.matrix.shape[:-2])
        return ValidityRegion(jnp.asarray(self.matrix)[rows], clamp[rows])

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Semi-axes, the longer first [m], and the angle of that from x [rad]; by NumPy."""
        _, sizes, turned = np.linalg.svd(np.asarray(self.matrix))
        # The smallest singular value belongs to the longest axis, which is the last row.
        along = turned[..., -1, :]
        angle = np.arctan2(along[..., -1], along[..., 0]) % np.pi
        return 1.0 / sizes[..., ::-1], angle if along.shape[-1] == 2 else np.zeros(angle.shape)


def _determinant(matrix: Float[Array, "... d d"]) -> Float[Array, "..."]:
    """Determinant of matrices of one or two rows."""
    if matrix.shape[-1] == 1:
        return matrix[..., 0, 0]
    return matrix[..., 0, 0] * matrix[..., 1, 1] - matrix[..., 0, 1] * matrix[..., 1, 0]


def _clamped(radius: ArrayLike, low: ArrayLike, high: ArrayLike) -> tuple[Array, Array]:
    """Radii held within [low, high], and the limit that acted on each; a NaN stays NaN."""
    for name, limit in (("low", low), ("high", high)):
        check_positive(name, limit)
    radius, low, high = as_float(radius), as_float(low), as_float(high)
    check_not_negative("radius", jnp.where(jnp.isposinf(radius) | jnp.isnan(radius), 0.0, radius))
    if is_concrete((low, high)) and bool(jnp.any(low > high)):
        raise ValueError(
            f"Argument `high` must be at least {float(low):g}, but is {float(high):g}."
        )
    code = jnp.where(radius < low, RAISED, jnp.where(radius > high, CUT, FREE))
    return jnp.where(code == RAISED, low, jnp.where(code == CUT, high, radius)), code


def circular_regions(
    radius: ArrayLike, low: ArrayLike, high: ArrayLike, dims: int = 1
) -> ValidityRegion:
    """Regions of the given radii, held within [low, high]: segments of a line, or discs.

    No metric does without limits: the distance to the nearest surface is zero in a corner, and the
    Hessian vanishes at an inflection, where the radius is infinite.

    Args:
        radius: an array, not negative, may be infinite [m].
        low: smallest, a positive number [m].
        high: largest, a number, at least `low` and finite [m].
        dims: 1 along a line, 2 on a plane.

    Returns:
        Their matrices, and codes: 0 where no limit acted, -1 where the radius was raised to `low`,
        1 where it was cut at `high`. A radius that is NaN stays NaN.

    Raises:
        ValueError: if a radius is negative, `low` is not positive or above `high`, or for another
            number of dimensions.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import circular_regions
        >>> circular_regions(jnp.array([0.01, 0.2, jnp.inf]), 0.05, 1.0).clamp.tolist()
        [-1, 0, 1]
        >>> circular_regions(jnp.array([0.5]), 0.1, 2.0, dims=2).matrix.tolist()
        [[[2.0, 0.0], [0.0, 2.0]]]
    """
    held, code = _clamped(radius, low, high)
    inverse = 1.0 / held
    return ValidityRegion(
        inverse[..., None, None] * jnp.eye(_checked_dims(dims), dtype=inverse.dtype), code
    )


def _checked_dims(dims: int) -> int:
    """A number of dimensions, which must be 1 or 2."""
    if dims not in (1, 2):
        raise ValueError(f"Argument `dims` must be 1 or 2, but is {dims!r}.")
    return dims
