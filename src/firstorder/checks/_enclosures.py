"""Silhouettes and hits of segments and round shapes, in intervals that surely hold them.

Circles are arcs that have no ends. A shape too many, or a silhouette too many, is harmless: what
counts is that none is left out.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder._display import Module
from firstorder.checks._interval import (
    Interval,
    anything,
    choose,
    cross,
    dot,
    exact,
    left,
    scaled,
    square,
    turned,
)
from firstorder.checks._meetings import Meetings
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Arcs, Circles, Segments
from firstorder.scene._intersect import numbered


class Straight(Module):
    """All segments of a scene, and their numbers in it."""

    start: Float[Array, "s 2"]
    end: Float[Array, "s 2"]
    number: Int[Array, " s"]


class Round(Module):
    """All circles and arcs of a scene, and their numbers in it.

    Attributes:
        center, radius: of the whole circle [m].
        ends: first and last direction, counter-clockwise, from the centre; axes (r, end, 2).
        wide: whether an arc turns by more than pi.
        whole: whether there are no ends.
        inward: whether normals point to the centre.
    """

    center: Float[Array, "r 2"]
    radius: Float[Array, " r"]
    ends: Interval
    wide: Bool[Array, " r"]
    whole: Bool[Array, " r"]
    inward: Bool[Array, " r"]
    number: Int[Array, " r"]


class Silhouettes(NamedTuple):
    """Points at which a view may change.

    Attributes:
        way: from the receiver to each [m].
        valid: False for those that surely do not exist.
        place: of those that are numbers of the scene, the others NaN [m].
    """

    way: Interval
    valid: Bool[Array, " m"]
    place: Float[Array, "m 2"]


class Met(NamedTuple):
    """Hits of a ray, one for each segment and two for each round shape.

    Attributes:
        t: distance, in units of the direction's length; any positive number where it is in doubt.
        sure, possible: whether there surely is a hit, and whether there may be one.
        front: whether it would be on the side of the normal.
        number: of the shape.
    """

    t: Interval
    sure: Bool[Array, " h"]
    possible: Bool[Array, " h"]
    front: Bool[Array, " h"]
    number: Int[Array, " h"]


# --- what a scene holds ---------------------------------------------------------------------------


def straight_of(scene: Scene, dtype) -> Straight:
    """The segments of a scene."""
    start, end, number = [np.zeros((0, 2))], [np.zeros((0, 2))], [np.zeros(0, np.int32)]
    for group, numbers in numbered(scene.groups):
        if isinstance(group, Segments):
            start, end, number = [*start, group.start], [*end, group.end], [*number, numbers]
    of = [jnp.concatenate([jnp.asarray(a, dtype) for a in each]) for each in (start, end)]
    return Straight(*of, jnp.concatenate([jnp.asarray(a) for a in number]))


def round_of(scene: Scene, dtype) -> Round:
    """The circles and the arcs of a scene."""
    parts = [_arcs(group, numbers, dtype) for group, numbers in numbered(scene.groups)]
    none = _whole(jnp.zeros((0, 2), dtype), jnp.zeros(0, dtype), jnp.zeros(0, jnp.int32))
    return jax.tree.map(lambda *a: jnp.concatenate(a), none, *[p for p in parts if p is not None])


def _arcs(group, number, dtype) -> Round | None:
    """One group as arcs, if it is round."""
    if isinstance(group, Circles):
        return _whole(group.center.astype(dtype), group.radius.astype(dtype), number)
    if not isinstance(group, Arcs):
        return None
    start, sweep = exact(group.start.astype(dtype)), exact(group.sweep.astype(dtype))
    first, last = turned(start), turned(start + sweep)
    inward, size = sweep.lo > 0.0, jnp.abs(sweep.lo)
    low, high = choose(inward[:, None], first, last), choose(inward[:, None], last, first)
    ends = Interval(jnp.stack([low.lo, high.lo], 1), jnp.stack([low.hi, high.hi], 1))
    wide, whole = size > _up_to(np.pi, dtype), size > _up_to(2.0 * np.pi, dtype)
    return Round(
        group.center.astype(dtype), group.radius.astype(dtype), ends, wide, whole, inward, number
    )


def _whole(center, radius, number) -> Round:
    """Circles: arcs all around."""
    up = jnp.broadcast_to(jnp.asarray([0.0, 1.0], center.dtype), (len(radius), 2, 2))
    yes = jnp.ones(len(radius), bool)
    return Round(center, radius, exact(up), yes, yes, ~yes, number)


def _up_to(x: float, dtype) -> np.ndarray:
    """The largest number of a precision that is not above x, which double precision is below."""
    rounded = np.asarray(x, dtype)
    return np.nextafter(rounded, 0, dtype=dtype) if float(rounded) > x else rounded


# --- silhouettes ----------------------------------------------------------------------------------


def silhouettes(
    lines: Straight, rings: Round, pairs: Meetings, p: Float[Array, "2"], on: Int[Array, ""]
) -> Silhouettes:
    """Ends, points of tangency and crossings, as ways from a place."""
    parts = [
        (exact(lines.start) - exact(p), lines.number != on),
        (exact(lines.end) - exact(p), lines.number != on),
        *_tangents(rings, p, on),
        *_arc_ends(rings, p),
        _of_segments(lines, pairs.straight, p),
        *_of_segments_and_rings(lines, rings, pairs.mixed, p),
        *_of_rings(rings, pairs.round, p),
    ]
    way = jax.tree.map(lambda *a: jnp.concatenate(a), *[way for way, _ in parts])
    valid = jnp.concatenate([valid for _, valid in parts])
    ends = jnp.concatenate([lines.start, lines.end])
    unknown = jnp.full((valid.size - len(ends), 2), jnp.nan, ends.dtype)
    return Silhouettes(way, valid, jnp.concatenate([ends, unknown]))


def _from_center(rings: Round, p, on) -> tuple[Interval, Interval, Interval]:
    """The receiver from each centre, the square of that way, and what it exceeds radius^2 by.

    A receiver on the shape has a way of the radius' length: rounding of its place says nothing.
    """
    w = exact(p) - exact(rings.center)
    far = square(w)
    more = far - exact(rings.radius).square()
    own = rings.number == on
    return w, far, choose(own, exact(jnp.zeros_like(more.lo)), more)


def _tangents(rings: Round, p, on):
    """Both lines that touch each circle; on the circle itself, both ways along its tangent."""
    w, far, more = _from_center(rings, p, on)
    root, own = more.sqrt(), rings.number == on
    back, side = scaled(-root, w), scaled(exact(rings.radius), left(w))
    # A tangent's own direction does not need its length, which is zero on the circle itself.
    length = choose(own, exact(jnp.ones_like(root.lo)), root / far)
    length = choose(more.positive | own, length, exact(jnp.ones_like(root.lo)))
    return [(scaled(length, way), ~more.negative) for way in (back - side, back + side)]


def _arc_ends(rings: Round, p):
    """Both ends of each arc."""
    ways = []
    for k in range(2):
        end = scaled(exact(rings.radius), rings.ends[:, k])
        ways.append((exact(rings.center) - exact(p) + end, ~rings.whole))
    return ways


def _of_segments(lines: Straight, pairs, p):
    """Where segments cross."""
    a, b = (jax.tree.map(lambda leaf, k=k: leaf[pairs[:, k]], lines) for k in range(2))
    e, f = exact(a.end) - exact(a.start), exact(b.end) - exact(b.start)
    s = cross(exact(b.start) - exact(a.start), f) / cross(e, f)
    s = s.within(0.0, 1.0)
    return exact(a.start) - exact(p) + scaled(s, e), jnp.ones(len(pairs), bool)


def _of_segments_and_rings(lines: Straight, rings: Round, pairs, p):
    """Where segments meet circles: two points, if any."""
    a = jax.tree.map(lambda leaf: leaf[pairs[:, 0]], lines)
    b = jax.tree.map(lambda leaf: leaf[pairs[:, 1]], rings)
    e, w = exact(a.end) - exact(a.start), exact(a.start) - exact(b.center)
    size, along = square(e), dot(w, e)
    inner = size * exact(b.radius).square() - cross(w, e).square()
    ways = []
    for root in (inner.sqrt(), -inner.sqrt()):
        s = (root - along) / size
        there = ~(inner.negative | s.negative | (s.lo > 1.0))
        ways.append((exact(a.start) - exact(p) + scaled(s.within(0.0, 1.0), e), there))
    return ways


def _of_rings(rings: Round, pairs, p):
    """Where circles meet: two points, if any."""
    a, b = (jax.tree.map(lambda leaf, k=k: leaf[pairs[:, k]], rings) for k in range(2))
    apart = exact(b.center) - exact(a.center)
    far, r, s = square(apart), exact(a.radius).square(), exact(b.radius).square()
    along = (far + r - s) / (far + far)
    inner = r / far - along.square()
    foot = exact(a.center) - exact(p) + scaled(along, apart)
    side = scaled(inner.sqrt(), left(apart))
    return [(way, ~inner.negative) for way in (foot + side, foot - side)]


# --- hits -----------------------------------------------------------------------------------------


def hits(lines: Straight, rings: Round, p, d: Interval, on) -> Met:
    """All hits of the ray from p along d."""
    parts = [_line_hits(lines, p, d, on), *_ring_hits(rings, p, d, on)]
    return jax.tree.map(lambda *a: jnp.concatenate(a), *parts)


def _line_hits(lines: Straight, p, d, on) -> Met:
    """A segment is hit if its ends lie on both sides of the ray's line, and that is ahead."""
    u, v = exact(lines.start) - exact(p), exact(lines.end) - exact(p)
    a, b = cross(d, u), cross(d, v)
    through = (a.negative & b.positive) | (a.positive & b.negative)
    t = cross(u, exact(lines.end) - exact(lines.start)) / (b - a)
    aside = (a.positive & b.positive) | (a.negative & b.negative)
    own = lines.number == on
    sure = through & t.positive & ~own
    possible = ~(aside | (through & (t.hi <= 0.0)) | own)
    return Met(_ahead(sure, t), sure, possible, b.positive, lines.number)


def _ring_hits(rings: Round, p, d, on) -> tuple[Met, Met]:
    """Where a ray enters each circle and where it leaves it, if that is on the arc."""
    w, _, more = _from_center(rings, p, on)
    d = Interval(*(jnp.broadcast_to(end, w.lo.shape) for end in (d.lo, d.hi)))
    own = rings.number == on
    a, b = square(d), dot(w, d)
    inner = a * exact(rings.radius).square() - cross(w, d).square()
    root = choose(own, -b, inner.sqrt())  # on the circle only b < 0 leads into it
    into, out = more.positive & b.negative & ~own, more.negative | (own & b.negative)
    enters = inner.positive & into
    leaves = (inner.positive | own) & (out | into)
    outside_away = more.positive & (b.lo >= 0.0)
    never_enters = inner.negative | more.negative | outside_away | own
    never_leaves = (inner.negative & ~own) | outside_away | (own & (b.lo >= 0.0))
    near = more / (root - b)
    far = choose(more.negative & b.positive, -more / (root + b), (root - b) / a)
    return (
        _on_arc(rings, w, d, near, enters, ~never_enters, ~rings.inward),
        _on_arc(rings, w, d, far, leaves, ~never_leaves, rings.inward),
    )


def _on_arc(rings: Round, w, d, t: Interval, sure, possible, front) -> Met:
    """Hits with a circle as those with the arc on it."""
    t = _ahead(sure, t)
    h = w + scaled(t, d)
    after, before = cross(rings.ends[:, 0], h), cross(h, rings.ends[:, 1])
    a, b = after.lo >= 0.0, before.lo >= 0.0
    held = rings.whole | jnp.where(rings.wide, a | b, a & b)
    a, b = after.negative, before.negative
    missed = ~rings.whole & jnp.where(rings.wide, a & b, a | b)
    sure, possible = sure & held, possible & ~missed
    return Met(_ahead(sure, t), sure, possible, front, rings.number)


def _ahead(sure, t: Interval) -> Interval:
    """A distance that is known, or any positive one."""
    nothing = anything(t.lo)
    return choose(sure, t, Interval(jnp.zeros_like(nothing.lo), nothing.hi))
