"""Critical azimuths, at which the view of a vertical slice changes form, and nodes between them.

A slice through the receiver's normal meets the silhouettes of the blockers. Between two *events*
the angles at which it does are smooth functions of its azimuth. The events are

    a silhouette starts or ends     where a slice is tangent to an arc (an inverse square root in
                                    the rate of the edge angle, R07 footnote 4)
    a corner                        where two pieces of a silhouette meet
    a horizon                       where a silhouette comes up, or two horizons meet
    a crossing                      where two silhouettes are in line

Horizons are the receiver's and those of planes, beyond which a plane hides all.

A slice is half a great circle, over the pole, so that azimuths count modulo pi. Nodes are given as
an event and how far from it, so that the difference to that event is exact however small it is.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from firstorder._argument_checks import nan_unless
from firstorder._display import Module
from firstorder.numerics._order import order_of
from firstorder.numerics._quadrature import inverse_sqrt_panels
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._vectors import Coordinates, apart, cross, dot, norm, unit
from firstorder.space.receiver import Receiver, in_receiver_frame
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import Planes
from firstorder.space.silhouettes._crossings import (
    along_segment,
    on_cone,
    on_plane,
    segment_on_cone,
)
from firstorder.space.silhouettes._curves import SilhouetteArcs, SilhouetteSegments
from firstorder.space.silhouettes.analytic import silhouette

UP = np.array([0.0, 0.0, 1.0])
ROUNDINGS = 64.0  # in a coordinate of a corner, as a share of the largest one
STEEP = 16.0  # that largest one over its distance from the normal


class Part(Module):
    """The silhouettes of one kind of shape in the receiver's frame, a row for each shape.

    Each piece is in a unit of its own, a power of two near its size or distance: fourth powers of
    lengths would leave the range of single precision.

    Attributes:
        straight: segments, shape (count, s).
        curved: arcs, shape (count, c).
        units: of segments, shape (count, s), and of arcs, shape (count, c) [m].
        normal: of planes, towards the receiver, zero of those that hide nothing; None for other
            shapes.
        tangent: azimuths, folded, of the slices that are tangent to an arc, shape (count, c, 2).
        scale: of the arc's discriminant `scale sin(tangent_1 - phi) sin(phi - tangent_0)`.
        split: whether there are such slices.
    """

    straight: SilhouetteSegments
    curved: SilhouetteArcs
    units: tuple[Float[Array, "n s"], Float[Array, "n c"]]
    normal: Float[Array, "n 3"] | None
    tangent: Float[Array, "n c 2"]
    scale: Float[Array, "n c"]
    split: Bool[Array, "n c"]


class Nodes(Module):
    """Azimuths with weights: `phi = base + lag`, the base an event.

    Attributes:
        events: in increasing order; those that are equal up to rounding move together [rad].
        base, lag: [rad].
        weight: sums to pi.
        edge_weight: likewise, but zero on panels as long as a rounding. An edge along the normal
            crosses one of those at any speed; it is counted apart.
    """

    events: Float[Array, " m"]
    base: Float[Array, " k"]
    lag: Float[Array, " k"]
    weight: Float[Array, " k"]
    edge_weight: Float[Array, " k"]


def parts(scene: Scene, at: Receiver) -> list[Part]:
    """The silhouettes of all shapes, kind by kind, in the receiver's frame."""
    found, first = [], 0
    for group in scene.groups:
        alone = Scene((group,), scene.material, scene.environment, ())
        seen = silhouette(alone, at.position, jnp.asarray(at.on) - first)
        first += group.count
        rows = jax.tree.map(lambda a, n=group.count: a.reshape(n, -1, *a.shape[1:]), seen)
        straight, curved = _placed(rows.straight, rows.curved, at)
        normal = None
        if isinstance(group, Planes):
            # From a point in a plane none is seen of it, as of any flat shape.
            shown = jnp.any(curved.live, 1)[:, None]
            normal = jnp.where(shown, in_receiver_frame(at, _facing(group, at)), 0.0)
            curved = jax.tree.map(lambda a: a[:, :0], curved)
        straight, one = _in_own_unit(straight, ("start", "end"))
        curved, other = _in_own_unit(curved, ("center", "a", "b"))
        found.append(Part(straight, curved, (one, other), normal, *tangents(curved)))
    return found


def rounding(found: list[Part], at: Receiver) -> Float[Array, ""]:
    """Of a corner, as a share of its largest coordinate: more where the world's origin is far."""
    where, share = jnp.max(jnp.abs(at.position)), jnp.ones((), at.position.dtype)
    for part in found:
        ratio = jnp.where(part.straight.live, where / part.units[0], 0.0)
        share = jnp.maximum(share, jnp.max(ratio, initial=0.0))
    return jax.lax.stop_gradient(ROUNDINGS * jnp.finfo(share.dtype).eps * share)


def is_known(scene: Scene, at: Receiver) -> Bool[Array, ""]:
    """Whether all numbers of shapes and receiver are some: slices do not meet what is nowhere."""
    numbers = jax.tree.leaves((scene.groups, at))
    return jnp.all(jnp.stack([jnp.all(jnp.isfinite(a)) for a in numbers]))


def _in_own_unit(pieces, names: tuple[str, ...]):
    """Pieces with those of their vectors in a unit of each, and the units [m]."""
    vectors = [getattr(pieces, name) for name in names]
    unit_of = power_of_two(jnp.concatenate(vectors, -1))
    ours = [vector / unit_of[..., None] for vector in vectors]
    return eqx.tree_at(lambda p: [getattr(p, name) for name in names], pieces, ours), unit_of


def tangents(arc: SilhouetteArcs) -> tuple[Array, Array, Array]:
    """Slices that are tangent to arcs: their azimuths in [0, pi), the scale, and whether they are.

    A slice meets `v . (center + a cos t + b sin t) = 0`, v = (-sin phi, cos phi, 0), where
    `(v . a)^2 + (v . b)^2 - (v . center)^2` is positive. That is `T + R cos 2 (phi - m)`, with two
    zeros if |T| < R: between them it is `2 R sin(m + h - phi) sin(phi - m + h)`.
    """
    fine = arc.live[..., None]
    a, b, c = (
        apart(jnp.where(fine, v, jnp.asarray(i, v.dtype)))
        for v, i in zip((arc.a, arc.b, arc.center), _STILL, strict=True)
    )
    xx, xy, yy = (a[i] * a[j] + b[i] * b[j] - c[i] * c[j] for i, j in ((0, 0), (0, 1), (1, 1)))
    # yy cos^2 - 2 xy sin cos + xx sin^2
    cosine, sine = 0.5 * (yy - xx), -xy
    wide = cosine**2 + sine**2
    det = _determinant(a, b, c)
    split = arc.live & (det < 0.0) & (wide > 0.0)
    wide, gap = jnp.where(split, wide, 1.0), jnp.where(split, -det, 1.0)
    middle = 0.5 * jnp.arctan2(jnp.where(split, sine, 0.0), jnp.where(split, cosine, 1.0))
    half = 0.5 * jnp.arctan2(jnp.sqrt(gap), jnp.where(split, -0.5 * (xx + yy), 0.0))
    low, turns_low = folded(middle - half)
    high, turns_high = folded(middle + half)
    sign = jnp.where((turns_low + turns_high) % 2 == 0, 1.0, -1.0)
    tangent = jnp.stack([low, high], -1)
    return tangent, 2.0 * jnp.sqrt(wide) * sign, split


def folded(phi: Float[Array, "*k"]) -> tuple[Float[Array, "*k"], Float[Array, "*k"]]:
    """Azimuths in [0, pi), and how many half turns were taken off."""
    turns = jnp.floor(jax.lax.stop_gradient(phi) / np.pi)
    return phi - np.pi * turns, turns


def nodes_between(
    found: list[Part], count: int, most: int, dtype, blur: Float[Array, ""] | float
) -> Nodes:
    """Nodes on all panels between neighbouring events, `count` on each.

    Args:
        found: the silhouettes.
        count: nodes on a panel.
        most: panels; NaN if there are more.
        dtype: of the numbers.
        blur: rounding of the corners (`rounding`), by which events lie apart that are one.
    """
    phi, there = events(found, dtype)
    phi = jnp.where(there, folded(jnp.where(there, phi, 0.0))[0], jnp.inf)
    phi = jnp.append(phi, jnp.inf)  # one slot more than there can be events
    order = order_of(phi)[:most]
    phi, number = phi[order], jnp.sum(there)
    # Panels begin at the first event, so that none is cut for nothing; at 0 if there is none.
    first = jnp.where(number > 0, phi[0], 0.0)
    used = jnp.arange(order.size) < jnp.maximum(number, 1)
    ends = jnp.where(used, phi, 0.0).at[0].set(first)
    ends = jnp.append(jnp.where(used, ends, first + np.pi), first + np.pi)
    phi = nan_unless(number <= most, ends)
    long = jnp.diff(phi) > STEEP * blur
    phi = _together(phi, long)
    base, lag, weight = inverse_sqrt_panels(phi, count)
    edge_weight = jnp.where(long[:, None], weight.reshape(long.size, -1), 0.0)
    # The last event is the first one half a turn on, which is the same slice.
    base = jnp.where(base == phi[-1], phi[0], base)
    return Nodes(phi, base.ravel(), lag.ravel(), weight.ravel(), edge_weight.ravel())


def _together(phi: Float[Array, " m"], long: Bool[Array, " n"]) -> Float[Array, " m"]:
    """Events of which those that no long panel parts move as one: the first of them.

    On a panel without length a slice sees whatever rounding makes of an edge that lies in it. The
    last event is the first one half a turn on, and those beside it move as it does.
    """
    first = jax.lax.cummax(jnp.where(jnp.append(True, long), jnp.arange(phi.size), 0))
    one = phi[jnp.where(first == first[-1], phi.size - 1, first)]
    return jax.lax.stop_gradient(phi) + (one - jax.lax.stop_gradient(one))


def events(found: list[Part], dtype) -> tuple[Float[Array, " m"], Bool[Array, " m"]]:
    """Azimuths of all events and which of them there are."""
    points, there = [jnp.zeros((0, 3), dtype)], [jnp.zeros((0,), bool)]
    azimuths, split = [jnp.zeros((0,), dtype)], [jnp.zeros((0,), bool)]
    planes = [part.normal for part in found if part.normal is not None]
    horizons = jnp.concatenate([jnp.asarray(UP, dtype)[None], *planes])
    if planes:
        one, other = np.triu_indices(len(horizons), 1)
        level = cross(horizons[one], horizons[other])
        points.append(level)
        # Parallel planes have one horizon; where rounding would make the two cross is anywhere.
        there.append(norm(level) > ROUNDINGS * jnp.finfo(dtype).eps)
    for part in found:
        lines, arcs = _every(part.straight), _every(part.curved)
        azimuths.append(part.tangent.ravel())
        split.append(jnp.repeat(part.split.ravel(), 2))
        points.append(lines.start)
        there.append(lines.live)
        if part.curved.live.shape[1]:  # elsewhere silhouettes are closed polygons
            points.append(lines.end)
            there.append(lines.live)
        _cut(
            points,
            there,
            lines,
            arcs,
            lambda line: jax.vmap(lambda n: along_segment(line, n))(horizons),
            lambda arc: jax.vmap(lambda n: on_plane(arc, n))(horizons),
        )
    _crossings(found, points, there)
    p, ok = jnp.concatenate(points), jnp.concatenate(there)
    ok = ok & ((p[:, 0] != 0.0) | (p[:, 1] != 0.0))
    phi = jnp.arctan2(jnp.where(ok, p[:, 1], 0.0), jnp.where(ok, p[:, 0], 1.0))
    return jnp.concatenate([phi, *azimuths]), jnp.concatenate([ok, *split])


# --- small change --------------------------------------------------------------------------------

_STILL = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def _cut(points, there, lines: SilhouetteSegments, arcs: SilhouetteArcs, cut_line, cut_arc) -> None:
    """Points where pieces are cut, and which cuts are real: within the piece."""
    if lines.live.size:
        t = jax.vmap(cut_line)(lines).reshape(lines.live.size, -1)
        p = lines.start[:, None] + t[..., None] * (lines.end - lines.start)[:, None]
        points.append(p.reshape(-1, 3))
        there.append((lines.live[:, None] & (t > 0.0) & (t < 1.0)).ravel())
    if arcs.live.size:
        t = jax.vmap(cut_arc)(arcs).reshape(arcs.live.size, -1)
        p = jax.vmap(lambda arc, t: arc.point(t))(arcs, t)
        points.append(p.reshape(-1, 3))
        inside = (t > arcs.first[:, None]) & (t < arcs.last[:, None])
        there.append((arcs.live[:, None] & inside).ravel())


def _crossings(found: list[Part], points, there) -> None:
    """Azimuths at which the silhouettes of two shapes are in line: each pair of shapes once."""
    rows = [(part, i) for part in found for i in range(part.split.shape[0])]
    for k, (one, i) in enumerate(rows):
        mine = jax.tree.map(lambda a, i=i: a[i], (one.straight, one.curved))
        others = [jax.tree.map(lambda a, j=j: a[j], (b.straight, b.curved)) for b, j in rows[:k]]
        if not others:
            continue
        lines, arcs = (
            jax.tree.map(lambda *a: jnp.concatenate(a), *(o[w] for o in others)) for w in (0, 1)
        )
        if lines.live.size:
            normal = cross(lines.start, lines.end)
            ok = lines.live
            _cut_pair(points, there, *mine, normal, ok, along_segment, on_plane)
        if arcs.live.size:
            _cut_pair(points, there, *mine, arcs, arcs.live, segment_on_cone, on_cone)


def _cut_pair(points, there, lines, arcs, others, ok, cut_line, cut_arc) -> None:
    """Cuts of one shape's pieces by all pieces of others."""

    def by(cut):
        def cuts(piece):
            t = jax.vmap(lambda other: cut(piece, other))(others)
            return jnp.where(ok.reshape(-1, *[1] * (t.ndim - 1)), t, -1e9).ravel()

        return cuts

    _cut(points, there, lines, arcs, by(cut_line), by(cut_arc))


def _every(pieces):
    """All pieces of all rows in one list."""
    return jax.tree.map(lambda a: a.reshape(-1, *a.shape[2:]), pieces)


def _determinant(a: Coordinates, b: Coordinates, c: Coordinates) -> Array:
    """Determinant of `a a^T + b b^T - c c^T` in x and y, by Cauchy and Binet."""
    ab = a[0] * b[1] - a[1] * b[0]
    ac = a[0] * c[1] - a[1] * c[0]
    bc = b[0] * c[1] - b[1] * c[0]
    return ab * ab - ac * ac - bc * bc


def _facing(group: Planes, at: Receiver) -> Float[Array, "n 3"]:
    """Unit normals of planes on the receiver's side."""
    n = unit(cross(group.axes[..., 0], group.axes[..., 1]))
    side = dot(n, at.position - group.center)
    return jnp.where((side < 0.0)[:, None], -n, n)


def _placed(
    straight: SilhouetteSegments, curved: SilhouetteArcs, at: Receiver
) -> tuple[SilhouetteSegments, SilhouetteArcs]:
    """Pieces in the receiver's frame; harmless ones where there is no silhouette."""

    def seen(a, live, instead):
        return jnp.where(live[..., None], in_receiver_frame(at, a), jnp.asarray(instead, a.dtype))

    s, c = straight.live, curved.live
    return (
        SilhouetteSegments(
            seen(straight.start - at.position, s, (1.0, 0.0, 1.0)),
            seen(straight.end - at.position, s, (0.0, 1.0, 1.0)),
            straight.owner,
            s,
        ),
        SilhouetteArcs(
            seen(curved.center - at.position, c, (0.0, 0.0, 1.0)),
            seen(curved.a, c, (1.0, 0.0, 0.0)),
            seen(curved.b, c, (0.0, 1.0, 0.0)),
            jnp.where(c, curved.first, 0.0),
            jnp.where(c, curved.last, 1.0),
            curved.owner,
            c,
        ),
    )
