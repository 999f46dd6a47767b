"""Regions of validity of records: segments of a line, circles and ellipses on a plane.

A region holds the steps dx with `|M dx| < 1`. A circle's M is the identity over its radius.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import (
    check_not_negative,
    check_positive,
    check_shape,
    is_concrete,
    nan_unless,
)
from firstorder._display import in_print
from firstorder.imaging import Pinhole
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

    __repr__ = in_print

    @property
    def radius(self) -> Float[Array, "..."]:
        """The radius; of an ellipse, that of the circle of its area [m]."""
        det = jnp.abs(_determinant(as_float(self.matrix)))
        return 1.0 / (det if self.matrix.shape[-1] == 1 else jnp.sqrt(det))

    def at(self, rows: Any) -> ValidityRegion:
        """Regions of some records: numbers of rows, a mask or a slice."""
        clamp = jnp.broadcast_to(jnp.asarray(self.clamp), self.matrix.shape[:-2])
        rows = np.asarray(rows) if isinstance(rows, (list, tuple)) else rows
        return ValidityRegion(jnp.asarray(self.matrix)[rows], clamp[rows])

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Semi-axes, the longer first [m], and the angle of that from x [rad]; by NumPy."""
        _, sizes, turned = np.linalg.svd(np.asarray(self.matrix))
        # The smallest singular value belongs to the longest axis, which is the last row.
        along = turned[..., -1, :]
        angle = np.arctan2(along[..., -1], along[..., 0]) % np.pi
        return 1.0 / sizes[..., ::-1], angle if along.shape[-1] == 2 else np.zeros(angle.shape)


def _check_regions(region: Any, count: int, dims: int) -> None:
    """Refuse what is not one region for each of `count` candidates along a line or on a plane.

    Raises:
        TypeError: if it is no region.
        ValueError: if it has other dimensions, or there are not as many.
    """
    if not isinstance(region, ValidityRegion):
        raise TypeError(
            "Argument `region` must be a ValidityRegion, as `circular_regions` makes of radii, but "
            f"is a {type(region).__name__}."
        )
    if region.matrix.shape[-1] != dims:
        raise ValueError(
            f"Argument `region` must have {dims} dimension{'s' * (dims > 1)}, as the candidates "
            f"have, but has {region.matrix.shape[-1]}: `circular_regions` takes `dims`."
        )
    check_shape("region", region.matrix, (count, dims, dims))


def _determinant(matrix: Float[Array, "... d d"]) -> Float[Array, "..."]:
    """Determinant of matrices of one or two rows."""
    if matrix.shape[-1] == 1:
        return matrix[..., 0, 0]
    return matrix[..., 0, 0] * matrix[..., 1, 1] - matrix[..., 0, 1] * matrix[..., 1, 0]


def _checked_limits(low: ArrayLike, high: ArrayLike) -> tuple[Array, Array]:
    """Limits of radii as arrays; traced ones that are none are NaN.

    Raises:
        ValueError: if one is not positive, or `low` is above `high`.
    """
    for name, limit in (("low", low), ("high", high)):
        check_positive(name, limit)
    low, high = as_float(low), as_float(high)
    if is_concrete((low, high)) and bool(jnp.any(low > high)):
        first = np.argmax(low > high)
        least, most = (np.broadcast_arrays(low, high)[i].flat[first] for i in (0, 1))
        raise ValueError(f"Argument `high` must be at least {least:g}, but is {most:g}.")
    if is_concrete((low, high)):
        return low, high
    sound = (low > 0.0) & (low <= high) & (high < jnp.inf)
    return nan_unless(sound, low), nan_unless(sound, high)


def _clamped(radius: ArrayLike, low: ArrayLike, high: ArrayLike) -> tuple[Array, Array]:
    """Radii held within [low, high], and the limit that acted on each; a NaN stays NaN."""
    low, high = _checked_limits(low, high)
    radius = as_float(radius)
    check_not_negative("radius", jnp.where(jnp.isposinf(radius) | jnp.isnan(radius), 0.0, radius))
    code = jnp.where(radius < low, RAISED, jnp.where(radius > high, CUT, FREE))
    held = jnp.where(code == RAISED, low, jnp.where(code == CUT, high, radius))
    return nan_unless((radius >= 0.0) & (low <= high), held), code


def circular_regions(
    radius: ArrayLike, low: ArrayLike, high: ArrayLike, dims: int = 1
) -> ValidityRegion:
    """Regions of the given radii, held within [low, high]: segments of a line, or discs.

    No metric does without limits: the distance to the nearest surface is zero in a corner, and the
    Hessian vanishes at an inflection, where the radius is infinite.

    Args:
        radius: an array, not negative, may be infinite [m].
        low: smallest, a positive number, or one for each radius (`screen_limits`) [m].
        high: largest, likewise, at least `low` and finite [m].
        dims: 1 along a line, 2 on a plane.

    Returns:
        Their matrices, and codes: 0 where no limit acted, -1 where the radius was raised to `low`,
        1 where it was cut at `high`. A radius that is NaN stays NaN, and traced numbers that would
        be refused give NaN.

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


def screen_limits(
    camera: Pinhole,
    position: Float[ArrayLike, "*r 3"],
    pixel: float,
    *,
    pixels: tuple[float, float] = (1.5, 30.0),
    world: tuple[float, float] = (0.0, math.inf),
) -> tuple[Float[Array, "*r"], Float[Array, "*r"]]:
    """Smallest and largest radii of records that a camera sees, by pixels and by metres.

    A length across the line of sight to the image plane, at depth z before the camera, is seen as
    `gamma / z` of it. So n pixels of width `pixel` are `n pixel z / gamma` there: records far away
    may be large where near ones must not, and none is smaller than what a pixel shows. A surface
    seen aslant has more of its length in a pixel; that is left out, so that a disc may look
    thinner.

    Where the limits in pixels and in metres disagree, those in metres hold.

    Args:
        camera: that looks at the records.
        position: of the records [m].
        pixel: width of a pixel, in units of the camera's image.
        pixels: smallest and largest radius on screen [pixels].
        world: smallest and largest radius [m].

    Returns:
        `low` and `high` for `circular_regions` and `elliptic_regions` [m].

    Raises:
        ValueError: if a record is not before the camera, `pixel` is not positive, or limits are not
            in order. A traced record that is not before the camera gives NaN.

    Reference: J12 §2.2 and §8.2; Tabellion and Lamorlette 2004.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import screen_limits
        >>> from firstorder.imaging import pinhole
        >>> camera = pinhole((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), gamma=2.0)
        >>> places = jnp.array([[0.0, 0.0, 0.0], [0.3, 0.0, -4.0]])
        >>> low, high = screen_limits(camera, places, 0.01, pixels=(2.0, 20.0), world=(0.0, 0.5))
        >>> low.tolist(), high.tolist()  # twice as far, twice as large; cut at half a metre
        ([0.04, 0.08], [0.4, 0.5])
    """
    check_positive("pixel", pixel)
    for name, (least, most) in (("pixels", pixels), ("world", world)):
        if not 0.0 <= least <= most or most == 0.0:
            raise ValueError(f"Argument `{name}` must be a range, but is ({least:g}, {most:g}).")
    depth = (camera.eye - as_float(position)) @ camera.axes[:, 2]
    check_positive("position", depth)
    seen = nan_unless(depth > 0.0, depth) * pixel / camera.gamma
    return jnp.clip(pixels[0] * seen, *world), jnp.clip(pixels[1] * seen, *world)
