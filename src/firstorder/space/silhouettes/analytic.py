"""Silhouettes of shapes in closed form: segments and elliptic arcs.

The silhouette of every canonical shape is made of straight segments and arcs of ellipses, and an
affine map keeps both:

    ellipsoid        one closed ellipse, where the polar plane of the eye cuts it
    box              the edges, 6 at most, that join a face seen from the front to one from behind
    cylinder         two lines along the wall, and an arc of each rim
    disc, rectangle, triangle     their edges
    plane            its horizon, a circle at an (almost) infinite distance

Pieces are differentiable in the eye and in the shape to any order. They run so that `(p - x) x dp`
points to the side on which the shape is.

Inside the library each shape is seen in a unit of its own, a power of two near its distance or its
size: directions stay what they are, and no product of coordinates leaves the range of the
precision, whatever the unit of the scene is.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._display import Module
from firstorder.numerics._compiled import compiled
from firstorder.numerics._order import order_of
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import either
from firstorder.numerics._vectors import dot, inverse_and_det, orthonormal_frame, rows, unit
from firstorder.scene._arguments import numbers
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
from firstorder.space.silhouettes._curves import TURN, SilhouetteArcs, SilhouetteSegments


class Silhouette(Module):
    """All silhouettes of a scene as an eye sees them, hidden parts included."""

    straight: SilhouetteSegments
    curved: SilhouetteArcs


class _Outlines(Module):
    """Silhouettes of all shapes, and where the eye is to each canonical shape.

    Attributes:
        lines: start and end of segments, relative to the eye, shape (m, 2, 3) [unit of the owner].
        arcs: centre and both conjugate radii of arcs, shape (c, 3, 3) [unit of the owner].
        first, last: where arcs start and end [rad].
        lines_live, arcs_live: which are silhouettes from here; others mean nothing.
        unit: of each shape, a power of two without derivative [m].
        turn: world to canonical coordinates, for each shape [1/unit].
        eye: in canonical coordinates, for each shape.
        inside: whether the eye is on or in a shape, or in the plane of a flat one.
        own: whether it is said to lie on that shape.
        kinds: class and number of the shapes, kind by kind.
        rank: which shape counts, where several are in the same place; None where nobody asks.
        meeting: both planes of the last arcs, which are lines in which two meet: the owner first.
    """

    lines: Float[Array, "m 2 3"]
    arcs: Float[Array, "c 3 3"]
    first: Float[Array, " c"]
    last: Float[Array, " c"]
    lines_live: Bool[Array, " m"]
    arcs_live: Bool[Array, " c"]
    unit: Float[Array, " n"]
    turn: Float[Array, "n 3 3"]
    eye: Float[Array, "n 3"]
    inside: Bool[Array, " n"]
    own: Bool[Array, " n"]
    kinds: tuple[tuple[type[Shape], int], ...] = eqx.field(static=True)
    rank: Int[Array, " n"] | None = None
    meeting: tuple[tuple[int, int], ...] = eqx.field(static=True, default=())

    @property
    def owners(self) -> tuple[np.ndarray, np.ndarray]:
        """Owner of every segment and of every arc, known without an eye."""
        lines, rims = _owners(self.kinds)
        return lines, np.append(rims, [owner for owner, _ in self.meeting]).astype(int)

    @property
    def in_metres(self) -> tuple[Float[Array, "m 2 3"], Float[Array, "c 3 3"]]:
        """Segments and arcs, relative to the eye [m]."""
        lines, arcs = (rows(self.unit, owner)[:, None, None] for owner in self.owners)
        return lines * self.lines, arcs * self.arcs

    def apart(self, a: Array) -> list[Array]:
        """Of an array with a row for each shape the rows of each kind."""
        return _split(a, self.kinds)


class _Lines(NamedTuple):
    """Segments of one canonical shape: ends (k, 2, 3), which to turn round, which live."""

    ends: Array
    back: Array
    live: Array


class _Arcs(NamedTuple):
    """Arcs of one canonical shape: centre and radii (k, 3, 3), ends, which to turn round, live."""

    points: Array
    first: Array
    last: Array
    back: Array
    live: Array


@compiled
def silhouette(scene: Scene, eye: ArrayLike, on: ArrayLike = -1) -> Silhouette:
    """The silhouettes of all shapes of a scene.

    Args:
        scene: the shapes.
        eye: where they are seen from, shape (3,) [m].
        on: the shape on which the eye lies, or -1; that one covers nothing above itself.

    Returns:
        Segments and arcs of all shapes, owners numbered as in the scene. An eye inside a closed
        shape, or in the plane of a flat one, sees no silhouette of it.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space.library import sphere_over_plane
        >>> from firstorder.space import silhouette
        >>> seen = silhouette(sphere_over_plane(), jnp.array([0.0, 0.0, 0.1]))
        >>> seen.curved.owner.tolist()  # the ball's outline, and the plane's horizon
        [0, 1]
    """
    eye = numbers("eye", eye)
    found = _outlines(scene, eye, on)
    straight, curved = found.in_metres
    lines, arcs = (jnp.asarray(owner) for owner in found.owners)
    return Silhouette(
        _segments_of(straight + eye, lines, found.lines_live),
        _arcs_of(curved + _of_center(eye), found.first, found.last, arcs, found.arcs_live),
    )


def _segments_of(lines: Array, owner: Array, live: Array) -> SilhouetteSegments:
    """Segments from their ends side by side."""
    return SilhouetteSegments(*jnp.unstack(lines, axis=-2), owner, live)


def _arcs_of(arcs: Array, first: Array, last: Array, owner: Array, live: Array) -> SilhouetteArcs:
    """Arcs from their centres and radii side by side."""
    return SilhouetteArcs(*jnp.unstack(arcs, axis=-2), first, last, owner, live)


def _outlines(
    scene: Scene,
    eye: Point,
    on: ArrayLike,
    frame: Float[Array, "3 3"] | None = None,
) -> _Outlines:
    """The silhouettes of all shapes, all at once.

    Each outline is found in canonical coordinates; one product then places the points of all. The
    affine map keeps the side on which a shape lies to its silhouette, unless it mirrors.

    Args:
        scene: the shapes.
        eye: where they are seen from [m].
        on: the shape on which the eye lies, or -1.
        frame: the axes along which to give them, as columns; left out, the world's.
    """
    kinds = tuple((type(group), group.count) for group in scene.groups)
    center, axes = (_joined([getattr(g, a) for g in scene.groups]) for a in ("center", "axes"))
    away, axes, unit_of = _in_own_units(center - eye, axes, kinds)
    turn, det = inverse_and_det(axes)
    e = -jnp.einsum("nij,nj->ni", turn, away)
    eyes, still = _split(e, kinds), _split(jax.lax.stop_gradient(e), kinds)
    inside = _joined(
        [jax.vmap(k.canonical_inside)(c) for (k, _), c in zip(kinds, still, strict=True)]
    )
    own = np.arange(len(center)) == jnp.asarray(on)
    base, spread = _places(kinds, away, axes)
    if frame is not None:
        base, spread = base @ frame, jnp.einsum("ji,njk->nik", frame, spread)
    found = [jax.vmap(OUTLINES[k])(c, d) for (k, _), c, d in zip(kinds, eyes, still, strict=True)]
    owners = _owners(kinds)
    mirrored, alive = det < 0.0, ~(inside | own)
    lines, arcs = (_flattened([pair[i] for pair in found]) for i in (0, 1))
    ends, lines_live = jnp.zeros((0, 2, 3), e.dtype), jnp.zeros((0,), bool)
    points, arcs_live = jnp.zeros((0, 3, 3), e.dtype), jnp.zeros((0,), bool)
    first = last = jnp.zeros((0,), e.dtype)
    if lines:
        ends, back, live = lines
        back = back ^ rows(mirrored, owners[0])
        ends = either(back[:, None, None], ends[:, ::-1], ends)
        ends = jnp.einsum("mij,mkj->mki", rows(spread, owners[0]), ends)
        ends = ends + rows(base, owners[0])[:, None]
        lines_live = live & rows(alive, owners[0])
    if arcs:
        points, first, last, back, live = arcs
        # An arc is turned round by going through it with t -> -t.
        back = back ^ rows(mirrored, owners[1])
        turned = either(back[:, None] & IS_B, jnp.asarray(-1.0, e.dtype), 1.0)
        points = jnp.einsum("mij,mkj->mki", rows(spread, owners[1]), points * turned[..., None])
        points = points + _of_center(rows(base, owners[1])[:, None])
        first, last = either(back, -last, first), either(back, -first, last)
        arcs_live = live & rows(alive, owners[1])
    live = lines_live, arcs_live
    return _Outlines(ends, points, first, last, *live, unit_of, turn, e, inside, own, kinds)


# Which row of an arc, center, a and b, is which.
IS_CENTER, IS_B = np.array([True, False, False]), np.array([False, False, True])


def _of_center(shift: Float[Array, "*#m 3"]) -> Float[Array, "*#m 3 3"]:
    """A shift of arcs: of their centers, and not of their radii."""
    only = jnp.asarray(IS_CENTER[:, None], shift.dtype)  # anew, or JAX keeps its precision
    return only * shift


def _owners(kinds) -> tuple[np.ndarray, np.ndarray]:
    """Owner of every segment and of every arc of the shapes."""
    each = np.array([PIECES[kind] for kind, count in kinds for _ in range(count)])
    numbers = np.arange(len(each))
    return np.repeat(numbers, each[:, 0]), np.repeat(numbers, each[:, 1])


def _split(a: Array, kinds) -> list[Array]:
    """The rows of each kind."""
    ends = np.cumsum([count for _, count in kinds])
    return jnp.split(a, ends[:-1]) if len(kinds) > 1 else [a]


def _in_own_units(away: Float[Array, "n 3"], axes: Float[Array, "n 3 3"], kinds):
    """Centres and axes of shapes in a unit of each, near the larger of distance and size.

    Columns of `axes` that only point stay as they are: what they measure is in the unit too.

    Args:
        away: from the eye to each centre [m].
        axes: of the shapes [m].
        kinds: class and number of the shapes.

    Returns:
        Both in the units, and the units, powers of two [m].
    """
    sized = np.array([LENGTHS[kind] for kind, count in kinds for _ in range(count)])
    lengths = (axes * sized[:, None].astype(axes.dtype)).reshape(-1, 9)
    one = power_of_two(jnp.concatenate([away, lengths], -1))[:, None]
    return away / one, axes / either(sized, one, 1.0)[:, None], one[:, 0]


def _places(kinds, away: Array, axes: Array) -> tuple[Array, Array]:
    """Of every shape's silhouette the middle, relative to the eye, and the axes.

    A plane's horizon is so far away that it does not move against the eye.
    """
    first = 0
    for kind, count in kinds:
        here, first = slice(first, first + count), first + count
        if kind is Planes:
            far = jnp.asarray(1.0 / jnp.finfo(away.dtype).eps, away.dtype)
            along = jnp.swapaxes(unit(jnp.swapaxes(axes[here], -1, -2)), -1, -2)
            away, axes = away.at[here].set(0.0), axes.at[here].set(far * along)
    return away, axes


def _flattened(parts: list) -> list[Array]:
    """Pieces of all shapes behind each other."""
    parts = [[a.reshape(-1, *a.shape[2:]) for a in part] for part in parts if part is not None]
    return [_joined(list(columns)) for columns in zip(*parts, strict=True)]


def _joined(parts: list) -> Array:
    return parts[0] if len(parts) == 1 else jnp.concatenate(parts)


# --- canonical shapes ----------------------------------------------------------------------------
#
# Of an eye, and of the same eye without derivatives, the pieces as they come, and which of them
# have the shape to the right: with c inside the shape, those with ((p - e) x dp) . (c - e) < 0.


def _ellipsoid(e: Point, still: Point):
    """Silhouette of a ball: the polar plane q . e = 1 cuts it."""
    outside = dot(still, still) > 1.0
    e = either(outside, e, jnp.array([0.0, 0.0, 2.0], e.dtype))
    inverse = 1.0 / dot(e, e)
    around = orthonormal_frame(e * jnp.sqrt(inverse))
    radii = jnp.sqrt(1.0 - inverse) * around[:, :2].T
    return None, _closed(jnp.concatenate([(e * inverse)[None], radii]), True, outside)


def _closed(points: Array, back, live) -> _Arcs:
    """One arc all around."""
    first = jnp.zeros((1,), points.dtype)
    back, live = (jnp.reshape(jnp.asarray(a), (1,)) for a in (back, live))
    return _Arcs(points[None], first, first + TURN, back, live)


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


def _box(e: Point, still: Point):
    """Silhouette of a box: edges between a visible face and a hidden one, six at most."""
    signs = BOX_FACES[:, :, 1].astype(still.dtype)
    seen = rows(still, BOX_FACES[:, :, 0].astype(int)) * signs > 1.0
    one, other = jnp.unstack(seen, axis=1)
    between = one != other
    which = order_of(~between)[: PIECES[Boxes][0]]
    back = one == (BOX_FACES[:, 0, 1] == BOX_FACES[:, 1, 1])
    ends = rows(jnp.asarray(BOX_ENDS, e.dtype), which)
    return _Lines(ends, rows(back, which), rows(between, which)), None


def _cylinder(e: Point, still: Point):
    """Two lines along the wall and, of each rim, the arc between cap and wall of unlike sides."""
    square = e[0] ** 2 + e[1] ** 2
    beside = square > 1.0
    square = either(beside, square, 4.0)
    x, y = either(beside, e[0], 2.0), either(beside, e[1], 0.0)
    wide = jnp.sqrt(square - 1.0)
    touch = jnp.stack([x - wide * y, y + wide * x, x + wide * y, y - wide * x]) / square
    touch = touch.reshape(2, 1, 2)
    level = jnp.broadcast_to(jnp.array([[-1.0], [1.0]], e.dtype), (2, 2, 1))
    ends = jnp.concatenate([jnp.broadcast_to(touch, (2, 2, 2)), level], -1)
    lines = _Lines(ends, jnp.array([True, False]), jnp.broadcast_to(beside, (2,)))
    # The wall is seen from the front within beta of the eye's azimuth.
    azimuth, beta = jnp.arctan2(y, x), jnp.arctan(wide)
    up = jnp.array([-1.0, 1.0], e.dtype)
    cap = up * e[2] > 1.0
    half = either(beside, either(cap, np.pi - beta, beta), np.pi)
    middle = either(cap, azimuth + np.pi, azimuth)
    rims = jnp.array([[[0, 0, -1], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 0, 0], [0, 1, 0]]])
    back = cap == (up > 0.0)
    return lines, _Arcs(rims.astype(e.dtype), middle - half, middle + half, back, beside | cap)


def _disc(e: Point, still: Point):
    """Silhouette of a disc: its rim; and of a plane its horizon."""
    return None, _closed(jnp.asarray(RIM, e.dtype), still[2] > 0.0, True)


def _polygon(corners: list[list[int]]):
    """Silhouette of a flat shape: all its edges."""
    start = np.array(corners)
    ends = np.stack([start, np.roll(start, -1, 0)], 1)

    def edges(e: Point, still: Point):
        many = (len(ends),)
        back = jnp.broadcast_to(still[2] > 0.0, many)
        return _Lines(jnp.asarray(ends, e.dtype), back, jnp.ones(many, bool)), None

    return edges


RIM = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])

OUTLINES = {
    Ellipsoids: _ellipsoid,
    Boxes: _box,
    Cylinders: _cylinder,
    Discs: _disc,
    Rectangles: _polygon([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]),
    Triangles: _polygon([[0, 0, 0], [1, 0, 0], [0, 1, 0]]),
    Planes: _disc,
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

# Which columns of the axes of each kind are lengths; the others only point.
LENGTHS = {
    Ellipsoids: (True, True, True),
    Boxes: (True, True, True),
    Cylinders: (True, True, True),
    Discs: (True, True, False),
    Rectangles: (True, True, False),
    Triangles: (True, True, False),
    Planes: (False, False, False),
}
