"""Visible parts of all silhouettes, and the shapes on either side of them.

Each silhouette is cut wherever another one crosses it, and at the horizon. Between two cuts nothing
changes: two rays, a small offset to either side of the middle, tell whether the shape is seen there
and what is seen beside it. What is seen beside it counts as cut off by this edge only if it goes on
behind the shape; if it ends there, an edge of its own says so. So shapes may touch and share edges.

Order and visibility have no derivative; the points and the cuts have. Where two edges are in line
(a visual event) derivatives are one-sided.
"""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder.numerics._vectors import cross, dot, inverse_3x3, matvec, settled, unit
from firstorder.numerics.quadrature import gauss_legendre
from firstorder.scene._arguments import check_asked
from firstorder.scene._intersect import MISS, numbered
from firstorder.space.receiver import Receiver, in_receiver_frame
from firstorder.space.scene import Scene
from firstorder.space.silhouettes._crossings import (
    along_segment,
    on_cone,
    on_plane,
    segment_on_cone,
)
from firstorder.space.silhouettes._edge_integrals import arc_points
from firstorder.space.silhouettes.analytic import (
    PIECES,
    SilhouetteArcs,
    SilhouetteSegments,
    silhouette,
)

UP = np.array([0.0, 0.0, 1.0])


class SilhouetteSides(eqx.Module):
    """The shapes on either side of silhouette pieces.

    Attributes:
        owner: number of the shape to the left, whose silhouette it is.
        seen: whether the owner is seen there.
        behind: number of the shape to the right, -1 for the sky.
        cut: whether that one goes on behind the owner, so that this piece is where it ends.
    """

    owner: Int[Array, "*m"]
    seen: Bool[Array, "*m"]
    behind: Int[Array, "*m"]
    cut: Bool[Array, "*m"]

    def jump(self, shown: Float[Array, " n_1"]) -> Float[Array, "*m"]:
        """Jump across each piece, owner less what it cuts off; zero for a piece that is hidden.

        Args:
            shown: one number for each shape, and last the sky's.
        """
        right = jnp.where(self.cut, shown[self.behind], 0.0)
        return jnp.where(self.seen, shown[self.owner] - right, 0.0)


class VisibleSilhouettes(eqx.Module):
    """Visible silhouettes of a scene in a receiver's frame, relative to the receiver.

    Attributes:
        straight: the segments that straight pieces are parts of.
        low, high: from where to where on those, in [0, 1].
        lines: what lies on either side of straight pieces.
        arcs: curved pieces.
        rims: what lies on either side of those.
        azimuths: ends of the parts of the horizon, shape (h + 1,) [rad].
        above: number of the shape seen just above each part, -1 for the sky.
        sound: whether the receiver is outside of all shapes.
    """

    straight: SilhouetteSegments
    low: Float[Array, " s"]
    high: Float[Array, " s"]
    lines: SilhouetteSides
    arcs: SilhouetteArcs
    rims: SilhouetteSides
    azimuths: Float[Array, " h_1"]
    above: Int[Array, " h"]
    sound: Bool[Array, ""]

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
        return arc_points(arcs.center, arcs.a, arcs.b, arcs.first, arcs.last, nodes)

    def on_lines(self, nodes: int) -> tuple[Array, Array, Array]:
        """Points, derivatives and quadrature weights on straight pieces: (s, nodes, ...)."""
        x, w = (jnp.asarray(a, self.low.dtype) for a in gauss_legendre(nodes))
        start, along = self.start, self.end - self.start
        v = jnp.broadcast_to(along[:, None], (len(start), nodes, 3))
        p = start[:, None] + (0.5 + 0.5 * x)[:, None] * v
        return p, v, jnp.broadcast_to(0.5 * w, p.shape[:2])


def visible_silhouettes(scene: Scene, at: Receiver) -> VisibleSilhouettes:
    """Visible silhouettes of a scene above a receiver's horizon.

    Args:
        scene: the shapes.
        at: the receiver; the shape on which it lies (`at.on`) covers nothing.

    Returns:
        Pieces of all silhouettes, those that are not seen among them, marked so.
    """
    check_asked(scene, Scene, at, Receiver)
    found = silhouette(scene, at.position, at.on)
    owners, rims = _owners(scene)
    straight, curved = _in_frame(found.straight, found.curved, at)
    straight, curved = settled((_harmless_straight(straight), _harmless_curved(curved)))
    line, low, high = _cut_straight(straight, curved, owners, rims)
    arcs = _cut_curved(straight, curved, owners, rims)
    azimuths = _cut_horizon(straight, curved)
    owner = jnp.concatenate([line.owner, arcs.owner])
    live = jnp.concatenate([line.live, arcs.live])
    where = *_middles(line, low, high, arcs), azimuths
    sides, above = _seen(scene, at, jax.lax.stop_gradient(where), owner, live)
    first = low.shape[0]
    lines, round_ = (jax.tree.map(lambda a, s=s: a[s], sides) for s in _halves(first))
    # What is not seen must not spoil sums or derivatives, wherever it is.
    line = _harmless_straight(dataclasses.replace(line, live=lines.seen))
    low, high = jnp.where(line.live, low, 0.0), jnp.where(line.live, high, 1.0)
    arcs = _harmless_curved(dataclasses.replace(arcs, live=round_.seen))
    sound = ~scene.inside(at.position, at.on)
    return settled(VisibleSilhouettes(line, low, high, lines, arcs, round_, azimuths, above, sound))


def _middles(
    line: SilhouetteSegments, low: Array, high: Array, arcs: SilhouetteArcs
) -> tuple[Array, Array]:
    """The middle of every piece, and the way along it from end to end."""
    point, t = jax.vmap(SilhouetteSegments.point), 0.5 * (arcs.first + arcs.last)
    spans = (high - low)[:, None] * (line.end - line.start)
    bends = jax.vmap(SilhouetteArcs.velocity)(arcs, t) * (arcs.last - arcs.first)[:, None]
    middles = point(line, 0.5 * (low + high)), jax.vmap(SilhouetteArcs.point)(arcs, t)
    return jnp.concatenate(middles), jnp.concatenate([spans, bends])


def _halves(first: int) -> tuple[slice, slice]:
    return slice(None, first), slice(first, None)


# --- cuts ----------------------------------------------------------------------------------------


def _owners(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Owner of every segment and of every arc of the silhouette, known without an eye."""
    segments, arcs, first = [np.zeros(0, int)], [np.zeros(0, int)], 0
    for group in scene.groups:
        numbers = np.arange(first, first + group.count)
        lines, curves = PIECES[type(group)]
        segments.append(np.repeat(numbers, lines))
        arcs.append(np.repeat(numbers, curves))
        first += group.count
    return np.concatenate(segments), np.concatenate(arcs)


def _in_frame(
    straight: SilhouetteSegments, curved: SilhouetteArcs, at: Receiver
) -> tuple[SilhouetteSegments, SilhouetteArcs]:
    """Pieces relative to the receiver and in its frame."""
    here = at.position
    return (
        SilhouetteSegments(
            in_receiver_frame(at, straight.start - here),
            in_receiver_frame(at, straight.end - here),
            straight.owner,
            straight.live,
        ),
        SilhouetteArcs(
            in_receiver_frame(at, curved.center - here),
            in_receiver_frame(at, curved.a),
            in_receiver_frame(at, curved.b),
            curved.first,
            curved.last,
            curved.owner,
            curved.live,
        ),
    )


def _harmless_straight(line: SilhouetteSegments) -> SilhouetteSegments:
    """Some segment above the horizon in place of those that do not live."""
    live = line.live[:, None]
    start, end = (jnp.asarray(a, line.start.dtype) for a in ((1.0, 0.0, 1.0), (0.0, 1.0, 1.0)))
    return SilhouetteSegments(
        jnp.where(live, line.start, start), jnp.where(live, line.end, end), line.owner, line.live
    )


def _harmless_curved(arc: SilhouetteArcs) -> SilhouetteArcs:
    """Some arc above the horizon in place of those that do not live."""
    live, x = arc.live[:, None], jnp.eye(3, dtype=arc.a.dtype)
    return SilhouetteArcs(
        jnp.where(live, arc.center, x[2]),
        jnp.where(live, arc.a, x[0]),
        jnp.where(live, arc.b, x[1]),
        jnp.where(arc.live, arc.first, 0.0),
        jnp.where(arc.live, arc.last, 1.0),
        arc.owner,
        arc.live,
    )


def _others(mine: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """For each piece the numbers of those of other shapes; rows are filled up with -1."""
    rows = [np.flatnonzero(theirs != owner) for owner in mine]
    most = max((len(r) for r in rows), default=0)
    return np.array([np.pad(r, (0, most - len(r)), constant_values=-1) for r in rows], int).reshape(
        len(mine), most
    )


def _chosen(parts, rows: np.ndarray):
    """Pieces by number, one row each; and which are there and live."""
    there = jnp.asarray(rows >= 0)
    if rows.size == 0:
        return None, there
    parts = jax.tree.map(lambda a: a[np.maximum(rows, 0)], parts)
    return parts, there & parts.live


def _ordered(inner: Float[Array, "m k"], first: Array, last: Array):
    """Ends of the parts between the cuts, in order: shape (m, k + 2)."""
    inner = jnp.clip(inner, first[:, None], last[:, None])
    order = jnp.argsort(jax.lax.stop_gradient(inner), axis=-1)
    inner = jnp.take_along_axis(inner, order, -1)
    return settled(jnp.concatenate([first[:, None], inner, last[:, None]], -1))


def _cut_straight(straight: SilhouetteSegments, curved: SilhouetteArcs, owners, rims):
    """Straight pieces between cuts: the segments that they are of, from where and to where."""
    m, dtype = len(owners), straight.start.dtype
    if m == 0:
        return straight, jnp.zeros((0,), dtype), jnp.zeros((0,), dtype)
    up = jnp.asarray(UP, dtype)
    cuts = [jax.vmap(lambda line: along_segment(line, up))(straight)[:, None]]
    others, there = _chosen(straight, _others(owners, owners))
    if others is not None:
        normals = settled(cross(others.start, others.end))
        t = jax.vmap(jax.vmap(along_segment, (None, 0)))(straight, normals)
        cuts.append(jnp.where(there, t, 0.0))
    others, there = _chosen(curved, _others(owners, rims))
    if others is not None:
        t = jax.vmap(jax.vmap(segment_on_cone, (None, 0)))(straight, others)
        cuts.append(jnp.where(there[..., None], t, 0.0).reshape(m, -1))
    ends = _ordered(settled(jnp.concatenate(cuts, -1)), jnp.zeros((m,)), jnp.ones((m,)))
    low, high, spread = _parts(ends, straight)
    return dataclasses.replace(spread, live=spread.live & (high > low)), low, high


def _cut_curved(
    straight: SilhouetteSegments, curved: SilhouetteArcs, owners, rims
) -> SilhouetteArcs:
    """Curved pieces between cuts."""
    m, up = len(rims), jnp.asarray(UP, curved.a.dtype)
    if m == 0:
        return curved
    cuts = [jax.vmap(lambda arc: on_plane(arc, up))(curved)]
    others, there = _chosen(straight, _others(rims, owners))
    if others is not None:
        normals = settled(cross(others.start, others.end))
        t = jax.vmap(jax.vmap(on_plane, (None, 0)))(curved, normals)
        cuts.append(jnp.where(there[..., None], t, curved.first[:, None, None]).reshape(m, -1))
    others, there = _chosen(curved, _others(rims, rims))
    if others is not None:
        t = jax.vmap(jax.vmap(on_cone, (None, 0)))(curved, others)
        cuts.append(jnp.where(there[..., None], t, curved.first[:, None, None]).reshape(m, -1))
    ends = _ordered(settled(jnp.concatenate(cuts, -1)), curved.first, curved.last)
    low, high, spread = _parts(ends, curved)
    live = spread.live & (high > low)
    return SilhouetteArcs(spread.center, spread.a, spread.b, low, high, spread.owner, live)


def _parts(ends: Float[Array, "m k_1"], pieces):
    """Lower and upper ends of all parts, and for each the piece that it is of."""
    low, high = ends[:, :-1], ends[:, 1:]
    spread = jax.tree.map(lambda a: jnp.repeat(a, low.shape[1], 0), pieces)
    return low.ravel(), high.ravel(), spread


def _cut_horizon(straight: SilhouetteSegments, curved: SilhouetteArcs) -> Float[Array, " h_1"]:
    """Azimuths at which a silhouette crosses the horizon, from -pi to pi.

    What does not cross gives one of its own points, which cuts in vain.
    """
    up = jnp.asarray(UP, straight.start.dtype)
    points = []
    if straight.owner.shape[0]:
        t = jax.vmap(lambda line: along_segment(line, up))(straight)
        points.append(jax.vmap(SilhouetteSegments.point)(straight, t))
    if curved.owner.shape[0]:
        t = jax.vmap(lambda arc: on_plane(arc, up))(curved)
        points.append(jax.vmap(SilhouetteArcs.point)(curved, t).reshape(-1, 3))
    p = settled(jnp.concatenate(points))
    there = (p[:, 0] != 0.0) | (p[:, 1] != 0.0)
    x, y = jnp.where(there, p[:, 0], 1.0), jnp.where(there, p[:, 1], 0.0)
    turn = jnp.full((1,), np.pi, p.dtype)
    return _ordered(jnp.arctan2(y, x)[None], -turn, turn)[0]


# --- what is seen --------------------------------------------------------------------------------


def _hair(length: Float[Array, "*m"]) -> Float[Array, "*m"]:
    """Angular offset beside an edge of that angular length, at which to trace a ray [rad]."""
    eps = jnp.finfo(length.dtype).eps
    return jnp.clip(0.01 * length, eps**0.6, eps**0.4)


def _seen(scene: Scene, at: Receiver, where, owner, live) -> tuple[SilhouetteSides, Array]:
    """Shapes on either side of the middle of each piece, and above each part of the horizon."""
    (scene, at), (p, v, azimuths) = jax.lax.stop_gradient((scene, at)), where
    w, left = unit(p), unit(cross(p, v))
    hair = _hair(jnp.sqrt(dot(v, v) / dot(p, p)))[:, None] * left
    middle = 0.5 * (azimuths[1:] + azimuths[:-1])
    height = _hair(azimuths[1:] - azimuths[:-1])
    low = jnp.stack([jnp.cos(middle), jnp.sin(middle), height], -1)
    t, first = _ask(scene, at, unit(settled(jnp.concatenate([w + hair, w - hair, low]))))
    m = p.shape[0]
    inner, behind = t[:m], first[m : 2 * m]
    live = live & (w[:, 2] > 0.0) & (behind != owner)
    goes_on = jnp.take_along_axis(inner, jnp.maximum(behind, 0)[:, None], -1)[:, 0] < jnp.inf
    cut = (behind == MISS) | goes_on
    return SilhouetteSides(owner, live & (first[:m] == owner), behind, cut), first[2 * m :]


def _ask(scene: Scene, at: Receiver, w: Float[Array, "m 3"]):
    """Distances to all shapes along directions of the receiver's frame, and which is nearest."""
    world, distances = settled(w @ at.axes.T), []
    for group, numbers in numbered(scene.groups):

        def look(shape, own):
            """All rays against one shape, in its own coordinates, made once for each ray."""
            turn = inverse_3x3(shape.axes)
            start, along = settled((matvec(turn, at.position - shape.center), world @ turn.T))
            t = jax.vmap(lambda d: shape.canonical_distance(start, d))(along)
            return jnp.where((t > 0.0) & ~own, t, jnp.inf)

        distances.append(jax.vmap(look, out_axes=1)(group, numbers == at.on))
    t = settled(jnp.concatenate(distances, -1))
    return t, jnp.where(jnp.isfinite(jnp.min(t, -1)), jnp.argmin(t, -1), MISS)
