"""The silhouettes of shapes as levels over the rays of a plane.

A ray of the plane starts at `o = (x, y, 0)` and runs along `D = (-v, -w, 1)`, in the frame of the
plane. A straight edge from p to q is passed where

    D . ((p - o) x (q - o)) = 0,

which is of first degree in each of x, y, v and w: any line of rays along one coordinate passes it
once. The outline of a round shape is passed where a discriminant is zero, which is of second degree
in each coordinate, so a line of rays passes it twice: it is cut into two halves, on one of which
the discriminant rises along a chosen coordinate, and on the other of which it falls.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder.conventions import SPACE_SLOPE, Frame
from firstorder.fields.field import Affine, Field
from firstorder.fields.jet import Jet, autodiff_jet
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._vectors import cross, dot, inverse_3x3, matvec
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Planes,
    Rectangles,
    Shape,
    Triangles,
)
from firstorder.space.silhouettes._common_lines import common_line
from firstorder.space.silhouettes.analytic import BOX_ENDS
from firstorder.typing import Ray, Scalar

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


class StraightLevel(Field):
    """On which side a ray passes the line through two points: a level of first degree.

    `D . ((p - o) x (q - o))` with `o = (x, y, 0)`, `D = (-v, -w, 1)`.

    Args:
        start, end: the points p and q in the frame of the plane [m].
        frame: four coordinates, positions before slopes.
    """

    start: Float[Array, "3"]
    end: Float[Array, "3"]
    frame: Frame = eqx.field(static=True, default=SPACE_SLOPE)

    def at(self, u: Ray) -> Scalar:
        """The triple product, multiplied out."""
        x, y, v, w = u
        m, e = cross(self.start, self.end), self.end - self.start
        return m[2] - v * m[0] - w * m[1] - x * e[1] + y * e[0] + e[2] * (v * y - w * x)

    def jet(self, u: Ray) -> Jet:
        """A bilinear function's."""
        x, y, v, w = u
        m, e = cross(self.start, self.end), self.end - self.start
        gradient = jnp.stack([-e[1] - w * e[2], e[0] + v * e[2], y * e[2] - m[0], -m[1] - x * e[2]])
        mixed = np.zeros((4, 4))
        mixed[1, 2] = mixed[2, 1] = 1.0
        mixed[0, 3] = mixed[3, 0] = -1.0
        return Jet(self.at(u), gradient, e[2] * jnp.asarray(mixed, u.dtype), self.frame)


class RoundLevel(Field):
    """Whether a ray meets a round shape, on the half of its outline where that rises or falls.

    A discriminant F is of second degree along each coordinate, so that a line of rays along one may
    pass its zero twice. Where F changes with the sign `way` along `axis` the level is F; elsewhere
    it is the value at the vertex of that parabola, which has no zero along `axis`. Both meet with
    one tangent.

    Valid along `axis`; along another coordinate a line of rays may pass one half twice, and
    `Edge.crossing` then finds neither.

    Args:
        origin, axes: origin and axes of the plane in the coordinates of the canonical shape.
        kind: whole numbers a and b of its discriminant, one of `DISCRIMINANTS`.
        way: 1 for the half where F rises along `axis`, -1 for the other.
        axis: the coordinate along which the outline is cut into halves.
        frame: four coordinates, positions before slopes.
    """

    origin: Float[Array, "3"]
    axes: Float[Array, "3 3"]
    kind: Int[Array, "2 3"] = eqx.field(converter=jnp.asarray)
    way: Int[Array, ""] = eqx.field(converter=jnp.asarray)
    axis: int = eqx.field(static=True)
    frame: Frame = eqx.field(static=True, default=SPACE_SLOPE)

    def discriminant(self, u: Ray) -> Scalar:
        """F: positive where the line of the ray meets the shape."""
        t, b, n = (self.axes[:, i] for i in range(3))
        D = n - u[2] * t - u[3] * b
        side = cross(self.origin + u[0] * t + u[1] * b, D)
        return dot(self.kind[0] * D, D) - dot(self.kind[1] * side, side)

    def at(self, u: Ray) -> Scalar:
        """F or the vertex of its parabola along the axis."""
        step = jnp.zeros(4, u.dtype).at[self.axis].set(self._wide())
        here, after, before = jax.vmap(self.discriminant)(jnp.stack([u, u + step, u - step]))
        slope, bend = 0.5 * (after - before), 0.5 * (after + before) - here
        straight = bend == 0.0
        vertex = here - slope**2 / (4.0 * jnp.where(straight, 1.0, bend))
        beside = jnp.where(straight, 1.0, vertex)  # a parabola that is none has only one half
        return jnp.where(self.way * slope > 0.0, here, beside)

    def _wide(self) -> Scalar:
        """A step along the axis as wide as the shape, or as it is far, in any unit of length.

        The parabola's coefficients are differences: of shorter steps they are rounding alone.
        """
        reach = jnp.append(self.origin, 1.0) if self.axis < 2 else self.axes.ravel()
        return power_of_two(reach) / power_of_two(self.axes[:, self.axis % 2])

    def jet(self, u: Ray) -> Jet:
        """A polynomial's, by autodiff."""
        return autodiff_jet(self.at, u, self.frame)


# A line from o along D meets a canonical shape where `a . D^2 - b . (o x D)^2` is positive, squares
# taken by component: the unit ball, the unit cylinder without ends, the unit disc in z = 0. As
# numbers, so that all round levels of a scene are one program.
DISCRIMINANTS = {
    "ball": np.array([[1, 1, 1], [1, 1, 1]]),
    "wall": np.array([[1, 1, 0], [0, 0, 1]]),
    "disc": np.array([[0, 0, 1], [1, 1, 0]]),
}


def levels(scene: Scene, plane: Receiver, frame: Frame, axis: int) -> Iterator[tuple[int, Field]]:
    """The number of each shape, with a level for each part of its outline.

    A box has its twelve edges, of which six at most are part of an outline; the level of a plane is
    its horizon, and two planes have one for the line in which they meet.

    Args:
        scene: the shapes.
        plane: a point of the plane of rays, and its axes.
        frame: four coordinates, positions before slopes.
        axis: the coordinate along which round outlines are cut into halves.
    """
    shapes = [jax.tree.map(lambda a, i=i: a[i], g) for g in scene.groups for i in range(g.count)]
    for number, shape in enumerate(shapes):
        for level in _of(shape, plane, frame, axis):
            yield number, level
    planes = [(number, shape) for number, shape in enumerate(shapes) if isinstance(shape, Planes)]
    for (number, one), (_, other) in itertools.combinations(planes, 2):
        yield number, _common_line(one, other, plane, frame)


def _of(shape: Shape, plane: Receiver, frame: Frame, axis: int) -> Sequence[Field]:
    """The levels of one shape."""
    if isinstance(shape, Planes):
        n = shape.normal(shape.center) @ plane.axes
        zero = jnp.zeros_like(n[0])
        return [Affine(jnp.stack([zero, zero, -n[0], -n[1]]), n[2], frame)]
    if isinstance(shape, Boxes | Rectangles | Triangles):
        corners = CORNER if isinstance(shape, Triangles) else SQUARE
        ends = (
            np.swapaxes(BOX_ENDS, 0, 1)
            if isinstance(shape, Boxes)
            else np.stack([corners, np.roll(corners, -1, 0)])
        )
        points = shape.world(jnp.asarray(ends, shape.center.dtype)) - plane.position
        start, end = points @ plane.axes
        return [StraightLevel(p, q, frame) for p, q in zip(start, end, strict=True)]
    return [
        RoundLevel(origin, axes, DISCRIMINANTS[kind], way, axis, frame)
        for kind, origin, axes in _round(shape, plane)
        for way in (1, -1)
    ]


def _common_line(one: Planes, other: Planes, plane: Receiver, frame: Frame) -> StraightLevel:
    """The level of the line in which two planes meet; of parallel ones some line of the first."""
    n, m = one.normal(one.center), other.normal(other.center)
    ways = one.center - plane.position, other.center - plane.position
    start, along, _ = common_line(n, m, dot(n, ways[0]), dot(m, ways[1]))
    end = start + power_of_two(start) * along
    return StraightLevel(start @ plane.axes, end @ plane.axes, frame)


def _round(shape: Shape, plane: Receiver) -> list[tuple[str, Array, Array]]:
    """Kinds of discriminants, with the plane of rays in canonical coordinates."""
    origin = shape.local(plane.position)
    axes = jnp.stack([matvec(inverse_3x3(shape.axes), plane.axes[:, i]) for i in range(3)], 1)
    match shape:
        case Ellipsoids():
            return [("ball", origin, axes)]
        case Discs():
            return [("disc", origin, axes)]
        case Cylinders():
            up = jnp.array([0.0, 0.0, 1.0], origin.dtype)
            rims = [("disc", origin - up, axes), ("disc", origin + up, axes)]
            return [("wall", origin, axes), *rims]
    raise TypeError(f"Argument `scene` must hold known shapes, but has {type(shape).__name__}.")
