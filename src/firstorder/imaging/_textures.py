r"""Textures, heights and normals of surfaces: waves in space, and pictures over u and v.

`imaging.shading.SurfaceMaps` takes functions of a primitive's number and of a place; here are some.
Waves are products of sines of the position. Pictures lie over (u, v), which a surface tells of its
places: shapes by `shape_uv`, faces of meshes by those of their corners (`imaging.facets`). u runs
    along a
picture's rows and v upwards, both from 0 to 1; beyond, a picture repeats or holds its border.

A texture is bilinear between the middles of its pixels: continuous, and its gradient is exact but
on the lines through those middles, where it jumps. No picture is filtered: a pixel of the image
sees one place of it, and far away it aliases. Heights and normals want one derivative more,
and are cubic splines. With `uv` as a function of the position, J its derivative, and grad u and
grad v the parts of its rows along the surface,

    grad h = J^T dh/d(u, v),      t ~ X_u ~ grad v x (grad u x grad v),      b ~ X_v, normal to t

and a normal (m_1, m_2, m_3) in (t, b, n) leans as slopes `-(m_1 t + m_2 b) / m_3` do
(`_bumps.solid_tilted`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import check_between, check_finite, check_positive, is_concrete
from firstorder._display import Module
from firstorder.conventions import Frame
from firstorder.fields.spectrum import Grid
from firstorder.fields.spline import Spline
from firstorder.imaging._bumps import NormalMap
from firstorder.numerics._select import whole_below
from firstorder.numerics._vectors import cross, dot, near_one, unit
from firstorder.scene._bands import by_band
from firstorder.space.shapes.kinds import Boxes, Cylinders, Ellipsoids, Planes, Shape, Triangles
from firstorder.typing import Scalar, as_float

Direction = Float[Array, "3"]
UV = Float[Array, "2"]
STEEPEST = 0.05  # the least m_3 of a normal map: a normal leans by 87 degrees at most


# --- functions of the position -------------------------------------------------------------------


class SolidWaves(Module):
    r"""A product of sines in space: `mean + size prod_i sin(k_i . (x - origin))`.

    Args:
        waves: wave vectors k_i, shape (n, 3) [rad/m].
        size: of the product; of bumps in metres.
        mean: what it is added to.
        origin: where all sines are zero [m].

    Raises:
        ValueError: if a number is not finite.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import SolidWaves
        >>> SolidWaves([[jnp.pi, 0.0, 0.0]], size=0.25, mean=0.5)(jnp.array([0.5, 3.0, 0.0])).item()
        0.75
    """

    waves: Float[Array, "n 3"] = eqx.field(converter=as_float)
    size: Scalar = eqx.field(converter=as_float, default=1.0)
    mean: Scalar = eqx.field(converter=as_float, default=0.0)
    origin: Direction = eqx.field(converter=as_float, default=(0.0, 0.0, 0.0))

    def __check_init__(self):
        """Refuse what is no number."""
        for name in ("waves", "size", "mean", "origin"):
            check_finite(name, getattr(self, name))

    def __call__(self, x: Direction) -> Scalar:
        """Value at a position [m]."""
        return self.mean + self.size * jnp.prod(jnp.sin(self.waves @ (x - self.origin)))


class SolidSlopes(Module):
    """Slopes along one direction, everywhere or in waves: a normal map in space.

    Args:
        lean: what `_bumps.solid_tilted` takes; the normal leans against it.
        waves: by which it is multiplied, or None.

    Raises:
        ValueError: if a number is not finite.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import SolidSlopes
        >>> SolidSlopes((0.5, 0.0, 0.0))(jnp.zeros(3)).tolist()
        [0.5, 0.0, 0.0]
    """

    lean: Direction = eqx.field(converter=as_float)
    waves: SolidWaves | None = None

    def __check_init__(self):
        """Refuse what is no number."""
        check_finite("lean", self.lean)

    def __call__(self, x: Direction) -> Direction:
        """Slopes at a position [m]."""
        return self.lean if self.waves is None else self.lean * self.waves(x)


# --- functions of u and v ------------------------------------------------------------------------


class ImageTexture(Module):
    """A picture over u and v, bilinear between the middles of its pixels; perhaps of several bands.

    Differentiable in `values` too. In u and v it is, but on lines through middles of pixels, where
    the derivative is that of the side of larger u and smaller v.

    Args:
        values: rows from the top, shape (rows, columns) or (rows, columns, bands).
        repeat: times that it lies side by side in one unit of u, and of v; one number for both.
        hold: whether the border's values go on outside the picture, which then lies once, between 0
            and 1 / `repeat`. On a ball, a picture that does not hold blends its top and bottom rows
            within half a pixel of each pole, and one that holds has a seam where u jumps.

    Raises:
        ValueError: if the values are no picture or not finite, or `repeat` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import ImageTexture
        >>> two = ImageTexture([[0.0, 1.0]])
        >>> [two(jnp.array([u, 0.3])).item() for u in (0.25, 0.375, 0.75, 1.0)]
        [0.0, 0.25, 1.0, 0.5]
        >>> ImageTexture([[0.0, 1.0]], hold=True)(jnp.array([1.0, 0.3])).item()
        1.0
    """

    BANDED: ClassVar = {"values": 2}

    values: Float[Array, "r c *bands"] = eqx.field(converter=as_float)
    repeat: Float[Array, "2"] = eqx.field(
        converter=lambda a: as_float(_twice(a)), default=(1.0, 1.0)
    )
    hold: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse what is no picture."""
        if self.values.ndim not in (2, 3) or not self.values.size:
            raise ValueError(
                "Argument `values` must have shape (rows, columns) or (rows, columns, bands), but "
                f"has {self.values.shape}."
            )
        check_finite("values", self.values)
        check_positive("repeat", self.repeat)

    @by_band()
    def __call__(self, uv: UV) -> Float[Array, "*bands"]:
        """Value at a place of the surface."""
        rows, columns = self.values.shape
        u, v = as_float(uv) * self.repeat
        x, y = u * columns - 0.5, (1.0 - v) * rows - 0.5
        j, i = whole_below(x), whole_below(y)
        s, t = x - j, y - i
        (left, right), (high, low) = (
            self._numbers(a.astype(int), n) for a, n in ((j, columns), (i, rows))
        )
        A = self.values
        above = (1.0 - s) * A[high, left] + s * A[high, right]
        below = (1.0 - s) * A[low, left] + s * A[low, right]
        return (1.0 - t) * above + t * below

    def _numbers(self, k: Int[Array, ""], count: int) -> tuple[Array, Array]:
        """Numbers of a pixel and of the next one."""
        if self.hold:
            return jnp.clip(k, 0, count - 1), jnp.clip(k + 1, 0, count - 1)
        return k % count, (k + 1) % count


class HeightMap(Module):
    """Bumps from a picture over u and v: a cubic spline through its pixels, repeating.

    Args:
        spline: over (u, v) [m]. Make one with `HeightMap.of`.

    Example:
        >>> import jax.numpy as jnp
        >>> import numpy as np
        >>> from firstorder.imaging import HeightMap
        >>> waves = np.tile(np.cos(2 * np.pi * (np.arange(16) + 0.5) / 16), (4, 1))
        >>> round(HeightMap.of(0.01 * waves)(jnp.array([0.5, 0.2])).item(), 5)
        -0.01
    """

    spline: Spline

    @classmethod
    def of(cls, values: Any, repeat: Any = (1.0, 1.0)) -> HeightMap:
        """Height map from pixels.

        Args:
            values: rows from the top, at least 4 x 4 [m].
            repeat: times that they lie side by side in one unit of u, and of v; one number for
                both.

        Raises:
            ValueError: if they are no such picture or not finite, or `repeat` is not positive.
        """
        values = as_float(values)
        if values.ndim != 2:
            raise ValueError(
                f"Argument `values` must have shape (rows, columns), but has {values.shape}."
            )
        _check_smooth("values", values)
        check_finite("values", values)
        repeat = _twice(repeat)
        check_positive("repeat", repeat)
        half = tuple(0.5 / float(n) for n in repeat)
        grid = Grid.spanning(values.shape[::-1], half, half)
        return cls(Spline(upright(values), grid, Frame(("x", "y")), "periodic"))

    def __call__(self, uv: UV) -> Scalar:
        """Height at a place of the surface [m]."""
        return self.spline.at(uv)


def image_normal_map(pixels: Any, repeat: Any = (1.0, 1.0)) -> NormalMap:
    """A tangent-space normal map (`_bumps.NormalMap`) from a picture with rows from the top.

    Args:
        pixels: colours in [0, 1], shape (rows, columns, 3); blue, along the normal, above 1/2.
        repeat: times that they lie side by side in one unit of u, and of v; one number for both.

    Raises:
        ValueError: if they are no such picture, or `repeat` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> import numpy as np
        >>> from firstorder.imaging import image_normal_map
        >>> flat = np.broadcast_to([0.5, 0.5, 1.0], (4, 4, 3))
        >>> image_normal_map(flat)(jnp.array([0.3, 0.1])).tolist()
        [0.0, 0.0, 1.0]
    """
    pixels = as_float(pixels)
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise ValueError(
            f"Argument `pixels` must have shape (rows, columns, 3), but has {pixels.shape}."
        )
    _check_smooth("pixels", pixels)
    check_between("pixels", pixels, 0.0, 1.0)
    if is_concrete(pixels) and not np.min(np.asarray(pixels[..., 2])) > 0.5:
        raise ValueError(
            "Argument `pixels` must have blue above 0.5 (normals point outward), but has "
            f"{np.min(np.asarray(pixels[..., 2])):g}."
        )
    repeat = _twice(repeat)
    check_positive("repeat", repeat)
    return NormalMap.of(upright(pixels), (1.0 / float(repeat[0]), 1.0 / float(repeat[1])))


def _twice(repeat: Any) -> Any:
    """Repetitions in u and in v, from two numbers or from one for both.

    Raises:
        ValueError: if there are more.
    """
    if np.shape(repeat) not in ((), (2,)):
        raise ValueError(
            f"Argument `repeat` must be one number or two, but has shape {np.shape(repeat)}."
        )
    return np.broadcast_to(repeat, 2) if is_concrete(repeat) else repeat


def _check_smooth(name: str, pixels: Array) -> None:
    """Refuse a picture of fewer pixels than a spline needs."""
    if min(pixels.shape[:2]) < 4:
        raise ValueError(
            f"Argument `{name}` must be at least 4 x 4 pixels, but is "
            f"{pixels.shape[0]} x {pixels.shape[1]}."
        )


def upright(rows: Array) -> Array:
    """Picture with rows from the top as columns along u whose entries rise along v."""
    return jnp.swapaxes(rows[::-1], 0, 1)


# --- what surfaces make of them ------------------------------------------------------------------


def height_slopes(height: Callable[[UV], Scalar], uv: Callable[[Direction], UV]) -> Callable:
    """The gradient in space of heights over u and v, as `_bumps.solid_tilted` takes it.

    Args:
        height: h of (u, v) [m], twice differentiable.
        uv: of a position.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._textures import height_slopes
        >>> height_slopes(lambda uv: 3.0 * uv[0], lambda x: 2.0 * x[:2])(jnp.zeros(3)).tolist()
        [6.0, 0.0, 0.0]
    """
    return lambda x: jax.grad(height)(uv(x)) @ jax.jacfwd(uv)(x)


def normal_map_slopes(
    normals: Callable[[UV], Direction],
    uv: Callable[[Direction], UV],
    up: Callable[[Direction], Direction],
) -> Callable:
    """A tangent-space normal map as slopes in space: `_bumps.normal_mapped` without a chart.

    Where u and v are not known (their gradients are parallel, to half of all digits) nothing leans.

    Args:
        normals: (m_1, m_2, m_3) of (u, v), m_3 > 0, differentiable.
        uv: of a position, twice differentiable.
        up: the base surface's unit normal there, on either side; differentiable.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging._textures import normal_map_slopes
        >>> up = jnp.array([0.0, 0.0, 1.0])
        >>> slopes = normal_map_slopes(lambda uv: jnp.array([0.6, 0.0, 0.8]), lambda x: x[:2],
        ...     lambda x: up)
        >>> [round(a, 9) for a in slopes(jnp.zeros(3)).tolist()]
        [-0.75, 0.0, 0.0]
    """

    def slopes(x):
        J, base = jax.jacfwd(uv)(x), up(x)
        along_u, along_v = near_one(J - (J @ base)[:, None] * base)  # lengths do not matter
        n = cross(along_u, along_v)
        least = jnp.finfo(x.dtype).eps * dot(along_u, along_u) * dot(along_v, along_v)
        n = jnp.where(dot(n, n) > least, n, 0.0)
        t = unit(cross(along_v, n))
        b = unit(cross(n, t))
        m = normals(uv(x))
        return -(m[0] * t + m[1] * b) / jnp.maximum(m[2], STEEPEST)

    return slopes


def shape_uv(shape: Shape, x: Direction) -> UV:
    """The (u, v) of a place on a shape, from its canonical coordinates q (`space.shapes.kinds`).

    | shape | u, v |
    |---|---|
    | rectangle, disc | `(q_1 + 1) / 2, (q_2 + 1) / 2`: along its half-edges, or radii |
    | triangle | `q_1, q_2`: along the edges from its first corner |
    | plane | `q_1, q_2` [m] |
    | ellipsoid | azimuth and latitude, each from 0 to 1; poles along q_3 |
    | cylinder | azimuth, and height from 0 to 1; a lid has no v of its own |
    | box | as a rectangle, from the two coordinates that follow that of the face |

    The azimuth is 1/2 along q_1 and grows towards q_2. At poles u has no derivative, and 0 is
    returned for it; nor has v in the middle.

    Args:
        shape: one row.
        x: on it [m].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import rectangle
        >>> from firstorder.imaging._textures import shape_uv
        >>> wall = jax.tree.map(lambda a: a[0], rectangle((0, 0, 0), (2, 0, 0), (0, 1, 0)))
        >>> shape_uv(wall, jnp.array([1.0, 0.5, 0.0])).tolist()
        [0.75, 0.75]
    """
    q = shape.local(x)
    match shape:
        case Triangles() | Planes():
            return q[:2]
        case Ellipsoids():
            flat, round_ = _azimuth(q)
            there = (flat > 0.0) | (q[2] != 0.0)
            up, out = jnp.where(there, q[2], 0.0), jnp.where(there, flat, 1.0)
            return jnp.stack([round_, 0.5 + jnp.arctan2(up, out) / jnp.pi])
        case Cylinders():
            return jnp.stack([_azimuth(q)[1], 0.5 * (q[2] + 1.0)])
        case Boxes():
            k = jnp.argmax(jnp.abs(q))
            return 0.5 * (jnp.stack([q[(k + 1) % 3], q[(k + 2) % 3]]) + 1.0)
    return 0.5 * (q[:2] + 1.0)


def _azimuth(q: Direction) -> tuple[Scalar, Scalar]:
    """Distance from the axis, and the azimuth from 0 to 1."""
    squared = q[0] ** 2 + q[1] ** 2
    there = squared > 0.0
    x, y = jnp.where(there, q[0], 1.0), jnp.where(there, q[1], 0.0)
    flat = jnp.where(there, jnp.sqrt(jnp.where(there, squared, 1.0)), 0.0)
    return flat, 0.5 + jnp.arctan2(y, x) / (2.0 * jnp.pi)
