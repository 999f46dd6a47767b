"""The shapes of space: affine images of a few canonical ones.

    point = center + axes @ q,        q on the canonical shape

An ellipsoid is the image of the unit ball, a box of the cube [-1, 1]^3, a cylinder of the unit
disc times [-1, 1], a rectangle of the square [-1, 1]^2 in the plane z = 0. Distances along a ray
survive the map, and so do tangency and silhouettes: each kind has one ray test and one silhouette,
written for the canonical shape.

A module holds many shapes of one kind along its leading axis; a single row, as `jax.vmap` and
`jax.lax.scan` take it, answers the questions. All shapes are convex. Normals point outwards; a flat
shape's along the third column of `axes`, the vector product of the first two.
"""

from __future__ import annotations

import abc
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder._argument_checks import (
    check_coordinates,
    check_finite,
    check_invertible,
    is_concrete,
)
from firstorder._display import Module
from firstorder.numerics._host import hosted
from firstorder.numerics._quadratic import first_root
from firstorder.numerics._select import either, grazing, larger, smaller
from firstorder.numerics._vectors import (
    Coordinates,
    cross_apart,
    dot,
    dot_apart,
    inverse_3x3,
    matvec,
    unit,
)
from firstorder.scene._sides import closed_front
from firstorder.space.shapes._prepared import Distance, Point, Prepared
from firstorder.space.shapes._slabs import EXACT, Rounding, level_along, rounding_of, slab
from firstorder.typing import as_array, as_float


class Shape(Module):
    """Shapes of one kind, as affine images of the canonical one.

    Args:
        center: where the canonical shape's origin goes [m].
        axes: columns, where its axes go [m].

    Raises:
        ValueError: if a number is not finite, the axes do not span space, or something has another
            shape.
    """

    # Whether the ray test asks for rounding, beside flat faces.
    faceted: ClassVar[bool] = True
    # How many of the axes are lengths: the third one of what is flat is a unit normal.
    spans: ClassVar[int] = 3

    center: Float[Array, "*n 3"]
    axes: Float[Array, "*n 3 3"]

    def __init__(self, center, axes):
        """Many shapes, or one, whose leading axis may be left out."""
        xp, center, axes = hosted(as_float(center), as_float(axes))
        check_coordinates("center", center)
        if np.shape(axes)[-2:] != (3, 3):
            raise ValueError(
                f"Argument `axes` must have shape (..., 3, 3), but has {np.shape(axes)}."
            )
        self.center = as_array(xp.atleast_2d(center))
        self.axes = as_array(axes[None] if axes.ndim == 2 else axes)

    def __check_init__(self):
        """Refuse what has no size."""
        check_finite("center", self.center)
        check_finite("axes", self.axes)
        if self.axes.shape[0] != self.center.shape[0]:
            raise ValueError(
                f"Argument `axes` must hold {self.center.shape[0]} shapes, "
                f"but holds {self.axes.shape[0]}."
            )
        if is_concrete(self.axes):
            for each in np.asarray(self.axes):
                check_invertible("axes", each)

    @property
    def count(self) -> int:
        """Number of shapes."""
        return self.center.shape[0]

    @property
    def closed(self) -> bool:
        """Whether the shapes have an inside."""
        return False

    def turned(self, which: Bool[Array, " n"]) -> Shape:
        """The shapes, those of `which` with front and back exchanged.

        Raises:
            ValueError: if the kind is closed: its front is its outside.
        """
        raise ValueError(closed_front(type(self).__name__))

    def height(self, p: np.ndarray) -> np.ndarray:
        """Where a point lies of each shape, by NumPy: positive before the front, negative behind.

        NaN for kinds that cannot tell it in microseconds. Only the sign means something.
        """
        return np.full(self.count, np.nan)

    def local(self, point: Point) -> Point:
        """World to canonical coordinates."""
        return matvec(inverse_3x3(self.axes), point - self.center)

    def world(self, q: Float[Array, "*k 3"]) -> Float[Array, "*k 3"]:
        """Canonical to world coordinates."""
        return self.center + matvec(self.axes, q)

    def distance(self, origin: Point, along: Point, own: Bool[Array, ""] | bool) -> Distance:
        """Distance along the unit vector at which a ray first meets the shape, infinity for none.

        Args:
            origin: of the ray [m].
            along: its direction, a unit vector.
            own: whether the origin lies on this shape, which a ray does not meet again.
        """
        return self.prepared().distance(origin, along, own)

    def prepared(self) -> Prepared:
        """The shapes as searches ask for their `distance`: what depends on no ray is found once."""
        turn = inverse_3x3(self.axes)
        place, way = rounding_of(turn, self.center, self.axes[..., : self.spans])
        return Prepared(self.center, turn, place, way, type(self))

    def normal(self, point: Point) -> Point:
        """The unit normal at a point of the surface."""
        turn = inverse_3x3(self.axes)
        n = self.canonical_normal(matvec(turn, point - self.center))
        return unit(matvec(jnp.swapaxes(turn, -1, -2), n))

    def inside(self, eye: Point) -> Bool[Array, ""]:
        """Whether an eye is on or in the shape, where it has no silhouette."""
        return self.canonical_inside(self.local(eye))

    @classmethod
    @abc.abstractmethod
    def canonical_distance(cls, o: Coordinates, d: Coordinates, off: Rounding = EXACT) -> Array:
        """Distance on the canonical shape, not positive or infinite for none: the ray test.

        What is flat reaches beyond its edges by the rounding `off`, so that no ray passes between
        two shapes that are joined there.

        The direction is no unit vector here. Of many rays at once each test is one loop over
        numbers side by side if a quotient or a root has one reader: with two XLA keeps it in
        memory, and what reads it from there goes ray by ray, three to ten times as slow.
        """

    @classmethod
    def canonical_normal(cls, q: Point) -> Point:
        """A vector along the normal of the canonical shape."""
        return jnp.zeros_like(q).at[2].set(1.0)

    @classmethod
    def canonical_inside(cls, e: Point) -> Bool[Array, ""]:
        """Whether a canonical eye sees no silhouette."""
        return jnp.asarray(False)

    def middle(self, eye: Point) -> Point:
        """A point whose direction is inside what an eye sees of the shape."""
        return self.center


class Ellipsoids(Shape):
    """Ellipsoids; the columns of `axes` are their semi-axes, or any conjugate radii.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Ellipsoids
        >>> Ellipsoids(jnp.zeros((2, 3)), jnp.stack([jnp.eye(3)] * 2)).count
        2
    """

    faceted = False

    @property
    def closed(self) -> bool:
        """Whether the shapes have an inside: they do."""
        return True

    @classmethod
    def canonical_distance(cls, o, d, off=EXACT):
        """Distance to the unit ball; |o x d|^2 keeps the digits that b^2 - a c loses far away."""
        a, b, c = dot_apart(d, d), dot_apart(o, d), dot_apart(o, o) - 1.0
        side = cross_apart(o, d)
        square = a - dot_apart(side, side)
        over, under, ahead = first_root(a, b, c, square, a)
        return either((square > 0.0) & ahead, over / under, jnp.inf)

    @classmethod
    def canonical_normal(cls, q):
        """Radius vector of the ball."""
        return q

    @classmethod
    def canonical_inside(cls, e):
        """Whether the eye is not outside the ball."""
        return dot(e, e) <= 1.0


class Boxes(Shape):
    """Parallelepipeds; the columns of `axes` run from the centre to the centres of faces.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Boxes
        >>> cube = Boxes(jnp.zeros(3), jnp.eye(3))  # two metres wide
        >>> cube.count, cube.closed
        (1, True)
    """

    @property
    def closed(self) -> bool:
        """Whether the shapes have an inside: they do."""
        return True

    @classmethod
    def canonical_distance(cls, o, d, off=EXACT):
        """Distance to the intersection of three slabs."""
        slabs = [slab(*a) for a in zip(o, d, level_along(d, off.way), off.place, strict=True)]
        enter, leave = slabs[0]
        for near, far in slabs[1:]:
            enter, leave = larger(enter, near), smaller(leave, far)
        return either(enter <= leave, either(enter > 0.0, enter, leave), jnp.inf)

    @classmethod
    def canonical_normal(cls, q):
        """Normal of the face that is nearest."""
        which = jnp.argmax(jnp.abs(q))
        return either(jnp.arange(3) == which, jnp.sign(q), 0.0)

    @classmethod
    def canonical_inside(cls, e):
        """Whether the eye is not outside of any face."""
        return jnp.all(jnp.abs(e) <= 1.0)


class Cylinders(Shape):
    """Cylinders with caps; the first two columns of `axes` span the cross section.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Cylinders
        >>> Cylinders(jnp.zeros(3), jnp.eye(3)).closed
        True
    """

    @property
    def closed(self) -> bool:
        """Whether the shapes have an inside: they do."""
        return True

    @classmethod
    def canonical_distance(cls, o, d, off=EXACT):
        """Distance to the round wall within the slab of the caps."""
        flat, level = d[0] ** 2 + d[1] ** 2, level_along(d, off.way)
        upright = level[0] & level[1]
        a = either(upright, 1.0, flat)
        b = o[0] * d[0] + o[1] * d[1]
        square = a - (o[0] * d[1] - o[1] * d[0]) ** 2
        within = o[0] ** 2 + o[1] ** 2 < 1.0
        hit = either(upright, within, square > 0.0)
        # Chosen once more, the root has one reader.
        root = either(hit, jnp.sqrt(either(hit & ~upright, square, grazing(a))), 0.0)
        low, high = slab(o[2], d[2], level[2], off.place[2])
        enter = larger(either(upright, -jnp.inf, (-b - root) / a), low)
        leave = smaller(either(upright, jnp.inf, (root - b) / a), high)
        hit = hit & (enter <= leave)
        return either(hit, either(enter > 0.0, enter, leave), jnp.inf)

    @classmethod
    def canonical_normal(cls, q):
        """Normal of the cap if the point is nearer to it than to the wall."""
        rho = jnp.sqrt(q[0] ** 2 + q[1] ** 2)
        cap = jnp.abs(jnp.abs(q[2]) - 1.0) < jnp.abs(rho - 1.0)
        zero = jnp.zeros_like(q[2])
        wall = jnp.stack([q[0], q[1], zero])
        return either(cap, jnp.stack([zero, zero, jnp.sign(q[2])]), wall)

    @classmethod
    def canonical_inside(cls, e):
        """Whether the eye is not outside of wall or caps."""
        return (e[0] ** 2 + e[1] ** 2 <= 1.0) & (jnp.abs(e[2]) <= 1.0)


class _Flat(Shape):
    """Base of the shapes that lie in a plane."""

    spans = 2

    def height(self, p):
        """By the side of each plane."""
        w = p - np.asarray(self.center)
        return np.sum(w * np.asarray(self.axes)[..., 2], -1)

    def turned(self, which):
        """The first two columns of `axes` exchanged, which keeps the points, and the third turned.

        The frame stays right-handed: every kind holds (y, x) if it holds (x, y).
        """
        u, v, n = (self.axes[..., i] for i in range(3))
        swapped = jnp.stack([v, u, -n], -1)
        return type(self)(self.center, either(which[:, None, None], swapped, self.axes))

    @classmethod
    def canonical_distance(cls, o, d, off=EXACT):
        """Distance to the plane z = 0, if the point in it counts."""
        # A level ray meets nothing, even where a compiler rounds its d in two ways (`level_along`).
        level = d[2] == 0.0
        t = either(level, -1.0, -o[2] / either(level, jnp.inf, d[2]))
        there = cls.holds(o[0] + t * d[0], o[1] + t * d[1], *off.place[:2])
        return either(there, t, jnp.inf)

    @classmethod
    def canonical_inside(cls, e):
        """Whether the eye is in the plane, up to rounding: seen edge-on it covers nothing."""
        return jnp.abs(e[2]) <= 8.0 * jnp.finfo(e.dtype).eps * jnp.maximum(1.0, jnp.sqrt(dot(e, e)))

    @classmethod
    @abc.abstractmethod
    def holds(
        cls, x: Array, y: Array, across: ArrayLike = 0.0, along: ArrayLike = 0.0
    ) -> Bool[Array, ""]:
        """Whether a point of the plane belongs to the canonical shape.

        Args:
            x: one coordinate of the point.
            y: the other.
            across: by how much x may be off where an edge is straight.
            along: likewise y.
        """


class Discs(_Flat):
    """Elliptic discs; the first two columns of `axes` are conjugate radii.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Discs
        >>> Discs(jnp.zeros(3), jnp.eye(3)).closed
        False
    """

    @classmethod
    def holds(cls, x, y, across=0.0, along=0.0):
        """Whether a point is in the unit disc."""
        return x * x + y * y <= 1.0


class Rectangles(_Flat):
    """Parallelograms; the first two columns of `axes` run from the centre to edges' middles.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Rectangles
        >>> Rectangles(jnp.zeros(3), jnp.eye(3)).count
        1
    """

    @classmethod
    def holds(cls, x, y, across=0.0, along=0.0):
        """Whether a point is in the square [-1, 1]^2."""
        return (jnp.abs(x) <= 1.0 + across) & (jnp.abs(y) <= 1.0 + along)


class Triangles(_Flat):
    """Triangles; `center` is a corner, the first two columns of `axes` are the edges from it.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Triangles
        >>> Triangles(jnp.zeros(3), jnp.eye(3)).count
        1
    """

    @classmethod
    def holds(cls, x, y, across=0.0, along=0.0):
        """Whether a point is in the corner triangle."""
        x, y = x + across, y + along
        return (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0 + 2.0 * (across + along))

    def middle(self, eye):
        """The centroid."""
        return self.center + (self.axes[..., 0] + self.axes[..., 1]) / 3.0


class Planes(_Flat):
    """Planes without end.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Planes
        >>> Planes(jnp.zeros(3), jnp.eye(3)).count
        1
    """

    @classmethod
    def holds(cls, x, y, across=0.0, along=0.0):
        """Whether a point is in the plane: all are."""
        return jnp.asarray(True)

    def middle(self, eye):
        """The foot of the perpendicular."""
        n = self.normal(self.center)
        return eye - dot(eye - self.center, n) * n


# Scenes keep shapes in this order.
KINDS = (Ellipsoids, Boxes, Cylinders, Discs, Rectangles, Triangles, Planes)
