"""Silhouettes of shapes in closed form: segments and elliptic arcs.

The silhouette of every canonical shape is made of straight segments and arcs of ellipses, and an
affine map keeps both:

    ellipsoid        one closed ellipse, where the polar plane of the eye cuts it
    box              the edges, 6 at most, that join a face seen from the front to one from behind
    cylinder         two lines along the wall, and an arc of each rim
    disc, rectangle, triangle     their edges
    plane            its horizon, a circle at an (almost) infinite distance

Pieces are given as points of the world, differentiable in the eye and in the shape to any order.
They run so that `(p - x) x dp` points to the side on which the shape is.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder.numerics._vectors import cross, dot, orthonormal_frame, settled, unit
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Planes,
    Point,
    Rectangles,
    Shape,
    Triangles,
)

TURN = 2.0 * np.pi


class SilhouetteSegments(eqx.Module):
    """Segments of silhouettes.

    Attributes:
        start, end: [m].
        owner: number of the shape.
        live: whether this is a silhouette from here; if not, the points mean nothing.
    """

    start: Float[Array, "*m 3"]
    end: Float[Array, "*m 3"]
    owner: Int[Array, "*m"]
    live: Bool[Array, "*m"]

    def point(self, t: Float[Array, "*t"]) -> Float[Array, "*t 3"]:
        """The point at t in [0, 1] of one segment."""
        return self.start + t[..., None] * (self.end - self.start)


class SilhouetteArcs(eqx.Module):
    """Elliptic arcs of silhouettes: `p(t) = center + a cos t + b sin t`.

    Attributes:
        center: [m].
        a, b: conjugate radii [m].
        first, last: where the arc starts and ends [rad].
        owner: number of the shape.
        live: whether this is a silhouette from here; if not, the points mean nothing.
    """

    center: Float[Array, "*m 3"]
    a: Float[Array, "*m 3"]
    b: Float[Array, "*m 3"]
    first: Float[Array, "*m"]
    last: Float[Array, "*m"]
    owner: Int[Array, "*m"]
    live: Bool[Array, "*m"]

    def point(self, t: Float[Array, "*t"]) -> Float[Array, "*t 3"]:
        """The point at t of one arc."""
        return self.center + self.a * jnp.cos(t)[..., None] + self.b * jnp.sin(t)[..., None]

    def velocity(self, t: Float[Array, "*t"]) -> Float[Array, "*t 3"]:
        """Derivative in t of the point."""
        return self.b * jnp.cos(t)[..., None] - self.a * jnp.sin(t)[..., None]


class Silhouette(eqx.Module):
    """All silhouettes of a scene as an eye sees them, hidden parts included."""

    straight: SilhouetteSegments
    curved: SilhouetteArcs


def silhouette(scene: Scene, eye: Point, on: ArrayLike = -1) -> Silhouette:
    """The silhouettes of all shapes of a scene.

    Args:
        scene: the shapes.
        eye: where they are seen from [m].
        on: the shape on which the eye lies, or -1; that one covers nothing above itself.

    Returns:
        Segments and arcs of all shapes, owners numbered as in the scene. An eye inside a closed
        shape, or in the plane of a flat one, sees no silhouette of it.
    """
    straight, curved, first = [_none(eye)[0]], [_none(eye)[1]], 0
    for group in scene.groups:
        numbers = jnp.arange(first, first + group.count)
        lines, arcs = jax.vmap(lambda shape, k: _row(shape, k, eye, jnp.asarray(on) == k))(
            group, numbers
        )
        straight.append(jax.tree.map(_flat, lines))
        curved.append(jax.tree.map(_flat, arcs))
        first += group.count
    return Silhouette(_joined(straight), _joined(curved))


def _row(shape: Shape, number, eye: Point, own) -> tuple[SilhouetteSegments, SilhouetteArcs]:
    """The silhouette of one shape."""
    e = settled(shape.local(eye))
    lines, arcs = settled(OUTLINES[type(shape)](shape, eye, e))
    seen = ~own & ~shape.inside(eye)
    middle = shape.middle(eye) - eye
    none = _none(eye)
    straight, curved = none
    if lines is not None:
        start, end, live = shape.world(lines[0]), shape.world(lines[1]), lines[2]
        half = 0.5 * (start + end) - eye
        back = dot(cross(half, end - start), middle) < 0.0
        straight = SilhouetteSegments(
            jnp.where(back[:, None], end, start),
            jnp.where(back[:, None], start, end),
            jnp.broadcast_to(number, live.shape),
            live & seen,
        )
    if arcs is not None:
        c, a, b, first, last, live = arcs
        curved = SilhouetteArcs(
            c, a, b, first, last, jnp.broadcast_to(number, live.shape), live & seen
        )
        t = 0.5 * (first + last)
        p = jax.vmap(lambda arc, t: arc.point(t))(curved, t) - eye
        v = jax.vmap(lambda arc, t: arc.velocity(t))(curved, t)
        # An arc is turned round by going through it with t -> -t.
        back = dot(cross(p, v), middle) < 0.0
        curved = SilhouetteArcs(
            c,
            a,
            jnp.where(back[:, None], -b, b),
            jnp.where(back, -last, first),
            jnp.where(back, -first, last),
            curved.owner,
            curved.live,
        )
    return settled((straight, curved))


def _ellipsoid(shape: Shape, eye: Point, e: Point):
    """Silhouette of an ellipsoid: the polar plane q . e = 1 cuts the unit ball."""
    square = dot(e, e)
    outside = square > 1.0
    square = jnp.where(outside, square, 4.0)
    e = jnp.where(outside, e, jnp.array([0.0, 0.0, 2.0], e.dtype))
    around = orthonormal_frame(e / jnp.sqrt(square))
    radius = jnp.sqrt(1.0 - 1.0 / square)
    return None, _world_arcs(
        shape,
        (e / square)[None],
        (radius * around[:, 0])[None],
        (radius * around[:, 1])[None],
        jnp.zeros((1,), e.dtype),
        jnp.full((1,), TURN, e.dtype),
        outside[None],
    )


def _box_edges() -> tuple[np.ndarray, np.ndarray]:
    """Ends of the 12 edges of the cube, and the two faces (axis, sign) that meet in each."""
    ends, faces = [], []
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        for si in (-1.0, 1.0):
            for sj in (-1.0, 1.0):
                low, high = np.zeros(3), np.zeros(3)
                low[[axis, i, j]] = -1.0, si, sj
                high[[axis, i, j]] = 1.0, si, sj
                ends.append((low, high))
                faces.append(((i, si), (j, sj)))
    return np.array(ends), np.array(faces)


BOX_ENDS, BOX_FACES = _box_edges()


def _box(shape: Shape, eye: Point, e: Point):
    """Silhouette of a box: edges between a visible face and a hidden one, six at most."""
    seen = e[BOX_FACES[:, :, 0].astype(int)] * BOX_FACES[:, :, 1] > 1.0
    between = seen[:, 0] != seen[:, 1]
    which = jnp.argsort(~between, stable=True)[: PIECES[Boxes][0]]
    ends = jnp.asarray(BOX_ENDS, e.dtype)[which]
    return (ends[:, 0], ends[:, 1], between[which]), None


def _cylinder(shape: Shape, eye: Point, e: Point):
    """Two lines along the wall and, of each rim, the arc between cap and wall of unlike sides."""
    square = e[0] ** 2 + e[1] ** 2
    beside = square > 1.0
    square = jnp.where(beside, square, 4.0)
    x, y = jnp.where(beside, e[0], 2.0), jnp.where(beside, e[1], 0.0)
    wide = jnp.sqrt(square - 1.0)
    touch = jnp.stack(
        [
            jnp.stack([x - wide * y, y + wide * x]) / square,
            jnp.stack([x + wide * y, y - wide * x]) / square,
        ]
    )
    level = jnp.ones((2, 1), e.dtype)
    lines = (
        jnp.concatenate([touch, -level], -1),
        jnp.concatenate([touch, level], -1),
        jnp.broadcast_to(beside, (2,)),
    )
    # The wall is seen from the front within beta of the eye's azimuth.
    azimuth, beta = jnp.arctan2(y, x), jnp.arctan(wide)
    up = jnp.array([-1.0, 1.0], e.dtype)
    cap = up * e[2] > 1.0
    half = jnp.where(beside, jnp.where(cap, np.pi - beta, beta), np.pi)
    middle = jnp.where(cap, azimuth + np.pi, azimuth)
    zero = jnp.zeros((2,), e.dtype)
    arcs = _world_arcs(
        shape,
        jnp.stack([zero, zero, up], -1),
        jnp.stack([zero + 1.0, zero, zero], -1),
        jnp.stack([zero, zero + 1.0, zero], -1),
        middle - half,
        middle + half,
        beside | cap,
    )
    return lines, arcs


def _disc(shape: Shape, eye: Point, e: Point):
    """Silhouette of a disc: its rim."""
    row = jnp.eye(3, dtype=e.dtype)
    zero = jnp.zeros((1,), e.dtype)
    return None, _world_arcs(
        shape, 0.0 * row[:1], row[:1], row[1:2], zero, zero + TURN, jnp.array([True])
    )


def _rectangle(shape: Shape, eye: Point, e: Point):
    """Silhouette of a rectangle: four edges."""
    corners = jnp.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], e.dtype)
    return (corners, jnp.roll(corners, -1, 0), jnp.ones((4,), bool)), None


def _triangle(shape: Shape, eye: Point, e: Point):
    """Silhouette of a triangle: three edges."""
    corners = jnp.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], e.dtype)
    return (corners, jnp.roll(corners, -1, 0), jnp.ones((3,), bool)), None


def _plane(shape: Shape, eye: Point, e: Point):
    """Silhouette of a plane: the horizon, so far away that it does not move against the eye."""
    far = jnp.asarray(1.0 / jnp.finfo(e.dtype).eps, e.dtype)
    u, v = unit(shape.axes[..., 0]), unit(shape.axes[..., 1])
    zero = jnp.zeros((1,), e.dtype)
    arcs = eye[None], far * u[None], far * v[None], zero, zero + TURN, jnp.array([True])
    return None, arcs


OUTLINES = {
    Ellipsoids: _ellipsoid,
    Boxes: _box,
    Cylinders: _cylinder,
    Discs: _disc,
    Rectangles: _rectangle,
    Triangles: _triangle,
    Planes: _plane,
}

# How many segments and arcs each kind has. One face of a box is seen within 4 edges, two or three
# within 6.
PIECES = {
    Ellipsoids: (0, 1),
    Boxes: (6, 0),
    Cylinders: (2, 2),
    Discs: (0, 1),
    Rectangles: (4, 0),
    Triangles: (3, 0),
    Planes: (0, 1),
}


def _world_arcs(shape: Shape, center, a, b, first, last, live):
    """Arcs of the canonical shape in the world."""
    turn = jax.vmap(lambda q: shape.world(q) - shape.center)
    return shape.world(center), turn(a), turn(b), first, last, live


def _none(eye: Point) -> tuple[SilhouetteSegments, SilhouetteArcs]:
    """No pieces, of the eye's precision."""
    points, numbers = jnp.zeros((0, 3), eye.dtype), jnp.zeros((0,), eye.dtype)
    owner, live = jnp.zeros((0,), int), jnp.zeros((0,), bool)
    return (
        SilhouetteSegments(points, points, owner, live),
        SilhouetteArcs(points, points, points, numbers, numbers, owner, live),
    )


def _flat(a: Array) -> Array:
    return a.reshape(-1, *a.shape[2:])


def _joined(parts: list):
    return jax.tree.map(lambda *leaves: jnp.concatenate(leaves), *parts)
