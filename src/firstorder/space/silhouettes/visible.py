"""Visible parts of all silhouettes, and the shapes on either side of them.

Each silhouette is cut wherever another one crosses it, and at the horizon. Between two cuts nothing
changes: two rays, a small offset to either side of the middle, tell whether the shape is seen there
and what is seen beside it. What is seen beside it counts as cut off by this edge only if it goes on
behind the shape; if it ends there, an edge of its own says so. So shapes may touch and share edges.

Order and visibility have no derivative; the points and the cuts have. Where two edges are in line
(a visual event) derivatives are one-sided.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder._display import Module
from firstorder.numerics._batching import in_blocks
from firstorder.numerics._compiled import compiled
from firstorder.numerics._select import either
from firstorder.numerics._vectors import apart, cross, dot, rows
from firstorder.scene._arguments import check_asked_one
from firstorder.scene._intersect import MISS, highest, ranks
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene
from firstorder.space.silhouettes._closure import chords
from firstorder.space.silhouettes._common_lines import lines_of, with_common_lines
from firstorder.space.silhouettes._crossings import (
    arc_ends,
    arcs_on_planes,
    horizon_ends,
    line_ends,
    lines_on_cones,
    lines_on_planes,
)
from firstorder.space.silhouettes._curves import SilhouetteArcs, SilhouetteSegments
from firstorder.space.silhouettes._edge_integrals import arc_points, line_points
from firstorder.space.silhouettes._sides import SilhouetteSides
from firstorder.space.silhouettes.analytic import (
    IS_CENTER,
    _arcs_of,
    _Outlines,
    _outlines,
    _segments_of,
)

UP = np.array([0.0, 0.0, 1.0])
# A segment and an arc above the horizon, in place of those that do not live.
# Given their precision anew where they are used: JAX keeps that of an array which it captures.
SOME_LINE = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
SOME_ARC, SOME_ENDS = np.eye(3)[[2, 0, 1]], (0.0, 1.0)
ASKED = 2**20  # of parts of edges by shapes, at a time: of 128 boxes all would take 13 GB


class VisibleSilhouettes(Module):
    """Visible silhouettes of a scene in a receiver's frame, relative to the receiver.

    Attributes:
        straight: the segments that straight pieces are parts of.
        low, high: from where to where on those, in [0, 1].
        lines: what lies on either side of straight pieces.
        arcs: curved pieces.
        rims: what lies on either side of those.
        azimuths: ends of the parts of the horizon, shape (h + 1,) [rad].
        above: number of the shape seen just above each part, -1 for the sky.
        chords: the way in direction from the start to the end of each piece: of straight ones, of
            curved ones, of the parts of the horizon.
        sound: whether the receiver has a normal and is outside of all shapes.
        common: how many of the arcs, the last ones, are seen as lines in which two planes meet.
    """

    straight: SilhouetteSegments
    low: Float[Array, " s"]
    high: Float[Array, " s"]
    lines: SilhouetteSides
    arcs: SilhouetteArcs
    rims: SilhouetteSides
    azimuths: Float[Array, " h_1"]
    above: Int[Array, " h"]
    chords: Float[Array, "p 3"]
    sound: Bool[Array, ""]
    common: int = eqx.field(static=True, default=0)

    @property
    def start(self) -> Float[Array, "s 3"]:
        """Start points of straight pieces [m]."""
        return jax.vmap(SilhouetteSegments.point)(self.straight, self.low)

    @property
    def end(self) -> Float[Array, "s 3"]:
        """End points of straight pieces [m]."""
        return jax.vmap(SilhouetteSegments.point)(self.straight, self.high)

    def on_arcs(self, nodes: int) -> tuple[Array, Array, Array]:
        """Points, their derivatives and quadrature weights on curved pieces: (c, nodes, ...)."""
        arcs = self.arcs
        p, v, w = arc_points(arcs.center, arcs.a, arcs.b, arcs.first, arcs.last, nodes)
        if self.common:
            bent = len(p) - self.common
            line = lines_of(arcs.a[bent:], arcs.b[bent:], p[bent:])
            p, v = (jnp.concatenate([a[:bent], b]) for a, b in zip((p, v), line, strict=True))
        return p, v, w

    def on_lines(self, nodes: int) -> tuple[Array, Array, Array]:
        """Points, their derivatives and quadrature weights on straight pieces: (s, nodes, ...).

        They are even in the angle of sight.
        """
        return line_points(self.start, self.end, nodes)


class _Pieces(Module):
    """Parts of silhouettes between cuts, relative to a receiver and in its frame.

    Attributes:
        lines: start and end of the segments that straight parts belong to [unit of the owner].
        arcs: centre and conjugate radii of the arcs that curved parts belong to, likewise.
        low, high: from where to where on those, first of the straight parts in [0, 1], then of the
            curved ones [rad].
        sides: what lies on either side of the parts, likewise.
        azimuths: ends of the parts of the horizon [rad].
        above: number of the shape seen just above each part of the horizon, -1 for the sky.
        chords: the way in direction from the start to the end of each part, and of each of those of
            the horizon.
        straight: number of the straight parts.
    """

    lines: Float[Array, "s 2 3"]
    arcs: Float[Array, "c 3 3"]
    low: Float[Array, " s_c"]
    high: Float[Array, " s_c"]
    sides: SilhouetteSides
    azimuths: Float[Array, " h_1"]
    above: Int[Array, " h"]
    chords: Float[Array, "p 3"]
    straight: int = eqx.field(static=True)

    def apart(self, tree: Any) -> tuple[Any, Any]:
        """Of arrays with a row for each part those of the straight ones, and of the curved ones."""
        return _at(tree, self.straight)


@compiled
def visible_silhouettes(scene: Scene, at: Receiver) -> VisibleSilhouettes:
    """Visible silhouettes of a scene above a receiver's horizon.

    Args:
        scene: the shapes.
        at: the receiver; the shape on which it lies (`at.on`) covers nothing.

    Returns:
        Pieces of all silhouettes, those that are not seen among them, marked so.

    Raises:
        ValueError: for a row of receivers.

    Example:
        >>> from firstorder.space import receiver
        >>> from firstorder.space.library import sphere_over_plane
        >>> from firstorder.space import visible_silhouettes
        >>> seen = visible_silhouettes(sphere_over_plane(), receiver((0.0, 0.0, 0.1)))
        >>> seen.sound.item()  # the receiver is outside of the ball
        True
    """
    check_asked_one(scene, Scene, at, Receiver, bands=True)
    found = _outlines_from(scene, at)
    cut = _cut_outlines(found, at.axes, lambda a: a)
    metres = cut.apart(rows(found.unit, cut.sides.owner)[:, None, None])
    straight, curved = metres[0] * cut.lines, metres[1] * cut.arcs
    (low, first), (high, last) = cut.apart(cut.low), cut.apart(cut.high)
    lines, rims = cut.apart(cut.sides)
    return VisibleSilhouettes(
        _segments_of(straight, lines.owner, lines.seen),
        low,
        high,
        lines,
        _arcs_of(curved, first, last, rims.owner, rims.seen),
        rims,
        cut.azimuths,
        cut.above,
        cut.chords,
        _is_outside(scene, found) & jnp.all(jnp.isfinite(at.axes)),
        len(found.meeting) * len(rims.seen) // max(len(found.arcs), 1),
    )


def _outlines_from(scene: Scene, at: Receiver, *, common: bool = True) -> _Outlines:
    """All silhouettes relative to a receiver and in its frame.

    Args:
        scene: the shapes.
        at: the receiver.
        common: whether the lines in which planes meet are among them.
    """
    found = _outlines(scene, at.position, at.on, at.axes)
    if common:
        found = with_common_lines(found, scene, at.axes)
    rank = ranks(scene.material.emission)
    return eqx.tree_at(lambda o: o.rank, found, rank, is_leaf=lambda leaf: leaf is None)


def _is_outside(scene: Scene, found: _Outlines) -> Bool[Array, ""]:
    """Whether no shape is NaN, and no closed one holds the eye but that on which it lies.

    The unit of a shape that is NaN, or infinitely far, is infinite.
    """
    closed = np.repeat([g.closed for g in scene.groups], [g.count for g in scene.groups])
    return ~jnp.any(found.inside & ~found.own & closed | jnp.isinf(found.unit))


def _cut_outlines(
    found: _Outlines,
    axes: Float[Array, "3 3"],
    horizon: Callable[[Any], Any] = jax.lax.stop_gradient,
) -> _Pieces:
    """Cuts silhouettes where they cross, and asks what lies on either side of the parts.

    Args:
        found: all silhouettes, in the receiver's frame.
        axes: of that frame.
        horizon: of what the azimuths are made from, before they are; by default it loses its
            derivatives.
    """
    dtype = found.lines.dtype
    lines = either(found.lines_live[:, None, None], found.lines, SOME_LINE.astype(dtype))
    arcs = either(found.arcs_live[:, None, None], found.arcs, SOME_ARC.astype(dtype))
    begin = either(found.arcs_live, found.first, SOME_ENDS[0])
    end = either(found.arcs_live, found.last, SOME_ENDS[1])
    normals = cross(*jnp.unstack(lines, axis=1))
    planes = jnp.concatenate([jnp.asarray(UP, dtype)[None], normals])
    reach = jnp.max(jnp.abs(jax.lax.stop_gradient(lines)), -1)
    size = jnp.concatenate([jnp.ones(1, lines.dtype), jnp.prod(reach, -1)])
    on_lines = lines_on_planes(lines, planes, size)
    on_arcs = arcs_on_planes(arcs, begin, end, planes)
    cones = lines_on_cones(lines, normals, arcs, on_arcs[:, 1:])
    straight = line_ends(on_lines, cones, found.owners)
    curved = arc_ends(arcs, begin, end, on_arcs, found.owners)
    azimuths = horizon_ends(*horizon((lines, on_lines[:, 0], arcs, on_arcs[:, 0])))
    whose = _whose(lines, straight[:, 1:].size), _whose(arcs, curved[:, 1:].size)
    low, high = (
        jnp.concatenate([ends[:, part].ravel() for ends in (straight, curved)])
        for part in (slice(None, -1), slice(1, None))
    )
    sides, above = _seen(found, axes, lines, arcs, whose, low, high, azimuths)
    ways = chords(lines, arcs, straight, curved, azimuths)
    # What is not seen must not spoil sums or derivatives, wherever it is.
    low, high = (either(sides.seen, a, b) for a, b in zip((low, high), SOME_ENDS, strict=True))
    lines, arcs = _harmless_parts(found.lines, found.arcs, sides.seen, len(whose[0]))
    return _Pieces(lines, arcs, low, high, sides, azimuths, above, ways, len(whose[0]))


def _whose(pieces: Array, parts: int) -> np.ndarray:
    """For each part the number of its piece; all pieces have equally many."""
    return np.repeat(np.arange(len(pieces)), parts // max(len(pieces), 1))


def _harmless_parts(
    lines: Float[Array, "m 2 3"], arcs: Float[Array, "c 3 3"], seen: Bool[Array, " p"], n: int
) -> tuple[Float[Array, "n 2 3"], Float[Array, "k 3 3"]]:
    """For each part the segment or the arc that it belongs to; some other one if it is not seen.

    Args:
        lines: ends of the segments.
        arcs: centres and conjugate radii of the arcs.
        seen: which parts are seen.
        n: number of the straight ones, which come first.
    """
    found = []
    for pieces, one, live in zip((lines, arcs), (SOME_LINE, SOME_ARC), _at(seen, n), strict=True):
        if len(pieces):
            whose = _whose(pieces, len(live))
            pieces = either(live[:, None, None], rows(pieces, whose), one.astype(pieces.dtype))
        found.append(pieces)
    return found[0], found[1]


def _at(tree: Any, n: int) -> tuple[Any, Any]:
    """The first n rows of arrays, and the others."""
    return jax.tree.map(lambda a: a[:n], tree), jax.tree.map(lambda a: a[n:], tree)


# --- what is seen --------------------------------------------------------------------------------


def _epsilon(distance: Float[Array, "*m"], eps: float) -> Float[Array, "*m"]:
    """How far beside a point of an edge to trace a ray [unit of the shape].

    An edge of another shape that passes between the point and the ray is overlooked, so this is
    small. It is far above rounding: two edges that are one by design differ by some dozens of eps,
    and each must overlook the other. In the unit of a shape its place and its size are near one,
    and so is their rounding eps, however close the point is: a contour close by, where a ball all
    but touches the eye, asks for a large angle.

    Args:
        distance: of the point from the eye [unit of the shape].
        eps: of the precision.
    """
    return eps**0.7 * jnp.maximum(distance, 1.0)


def _eps(found: _Outlines, axes: Array) -> float:
    """The eps of a scene and a receiver; of both precisions that of the lower one."""
    numbers = found.eye, found.turn, found.lines, found.arcs, axes
    return max(float(jnp.finfo(a.dtype).eps) for a in numbers)


def _rise(lines: Array, arcs: Array, eps: float) -> Bool[Array, " m_c"]:
    """Which silhouettes rise above the rays along the horizon.

    One that lies in the horizon, like the lower edge of a lamp on the floor, is the horizon's: the
    rays just above that see the lamp, and an edge above or below it by rounding would count twice.
    """
    level = eps**0.7
    straight = jnp.any(lines[..., 2] > level * jnp.max(jnp.abs(lines), -1), -1)
    size, heights = jnp.abs(arcs), arcs[..., 2]
    highest_point = jnp.sum(either(IS_CENTER, heights, size[..., 2]), -1)
    bent = highest_point > level * jnp.max(size, (1, 2))
    return jnp.concatenate([straight, bent])


def _seen(found: _Outlines, axes, lines, arcs, whose, low, high, azimuths):
    """Shapes on either side of the middle of each part, and above each part of the horizon."""
    eye, turn, lines, arcs, low, high, azimuths = jax.lax.stop_gradient(
        (found.eye, found.turn @ axes, lines, arcs, low, high, azimuths)
    )
    p, v = _middles(lines, arcs, whose, low, high)
    eps = _eps(found, axes)
    owner = np.concatenate([a[k] for a, k in zip(found.owners, whose, strict=True)])
    alive = jnp.concatenate([found.lines_live, found.arcs_live]) & _rise(lines, arcs, eps)
    live = rows(alive, np.append(whose[0], len(lines) + whose[1])) & (high > low)
    side = cross(p, v)
    wide = dot(side, side)
    epsilon = _epsilon(jnp.sqrt(dot(p, p)), eps) / jnp.sqrt(either(wide > 0.0, wide, 1.0))
    epsilon = epsilon[:, None] * side
    middle = 0.5 * (azimuths[1:] + azimuths[:-1])
    level = jnp.ones_like(middle)
    around = jnp.stack([jnp.cos(middle), jnp.sin(middle), _epsilon(level, eps)], -1)
    numbers = np.arange(len(found.eye))[:, None]

    def beside(pair, more):
        m = len(pair[0])
        t, first = _ask(found, eye, turn, jnp.concatenate([*pair, *more]))
        behind = first[m : 2 * m]
        goes_on = jnp.any((t[:, :m] < jnp.inf) & (numbers == behind), 0)
        return (first[:m], behind, goes_on), first[2 * m :]

    pair, most = (p + epsilon, p - epsilon), ASKED // len(numbers)
    if len(p) <= most:
        (front, behind, goes_on), above = beside(pair, [around])
    else:
        front, behind, goes_on = in_blocks(lambda pair: beside(pair, [])[0], pair, max(1, most))
        _, above = _ask(found, eye, turn, around)
    sees, cut = (behind != owner) & (front == owner), (behind == MISS) | goes_on
    if found.meeting:
        # Where two planes meet both are as near, and either may be told to be in front.
        other = np.concatenate([np.full(len(whose[0]), MISS), _others_of(found)[whose[1]]])
        both = [(side == owner) | (side == other) for side in (front, behind)]
        meets = other != MISS
        sees, cut = either(meets, both[0] & both[1], sees), meets | cut
        behind = either(meets, other, behind)
    seen = live & (p[:, 2] > 0.0) & sees
    return SilhouetteSides(jnp.asarray(owner), seen, behind, cut), above


def _others_of(found: _Outlines) -> np.ndarray:
    """For each arc the plane that meets its owner there; of other arcs none."""
    others = np.full(len(found.arcs), MISS)
    others[len(others) - len(found.meeting) :] = [other for _, other in found.meeting]
    return others


def _middles(lines: Array, arcs: Array, whose, low: Array, high: Array) -> tuple[Array, Array]:
    """The middle of every part, and the way along it from end to end."""
    s, t = _at(0.5 * (low + high)[:, None], len(whose[0]))
    start, end = jnp.unstack(rows(lines, whose[0]), axis=1)
    center, a, b = jnp.unstack(rows(arcs, whose[1]), axis=1)
    along = end - start
    cos, sin = jnp.cos(t), jnp.sin(t)
    p = jnp.concatenate([start + s * along, center + a * cos + b * sin])
    v = jnp.concatenate([along, b * cos - a * sin])
    return p, (high - low)[:, None] * v


def _ask(found: _Outlines, eye: Array, turn: Array, w: Float[Array, "r 3"]):
    """Distances to all shapes along directions of the receiver's frame, and which is nearest.

    Of directions of any length; distances are in that length.
    """
    along = jnp.einsum("nij,rj->nri", turn, w)
    distances = [
        kind.canonical_distance(apart(e[:, None]), apart(d))
        for (kind, _), e, d in zip(found.kinds, found.apart(eye), found.apart(along), strict=True)
    ]
    t = found.unit[:, None] * jnp.concatenate(distances)
    t = either((t > 0.0) & ~found.own[:, None], t, jnp.inf)
    assert found.rank is not None  # `_outlines_from` gives it
    return t, highest(t, found.rank[:, None], t.shape[0])
