"""Crossings of shapes with each other: found once on the host, followed by Newton's method.

What an eye sees changes at a crossing without any silhouette there. Which pairs cross is looked for
when a scene is made of concrete shapes; the point itself is computed from the shapes wherever it is
needed, so that it moves with them and has derivatives.
"""

from __future__ import annotations

import itertools
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder._argument_checks import is_concrete
from firstorder._display import Module
from firstorder.flatland.shapes._base import Shape, own_unit
from firstorder.numerics._planar import cross_2d, dot_2d
from firstorder.scene._intersect import tie
from firstorder.typing import as_array

PIECES = 128  # chords by which a curve is searched
SKEW = 0.381966  # of a piece: how far corners stand off the simple fractions of a curve
# How many pairs are compared, of shapes whose boxes overlap and of their chords, and may cross.
MOST_PAIRS, MOST_CHORD_PAIRS, MOST_CROSSINGS = 10_000_000, 500_000_000, 1_000_000
_AT_ONCE = 2**20


class Crossings(Module):
    """Pairs of shapes that cross, and where on each of them, roughly.

    The numbers are no leaves, so that `jax.grad` takes a scene: all that is left are floats.

    Args:
        numbers: of the two shapes of each pair.
        near: start of the search: the parameters on both.
    """

    numbers: tuple[tuple[int, int], ...] = eqx.field(static=True, converter=lambda p: _pairs(p))
    near: Float[Array, "c 2"]

    @property
    def pairs(self) -> Int[np.ndarray, "c 2"]:
        """Numbers of the two shapes of each pair, as an array."""
        return np.asarray(self.numbers, np.int32).reshape(-1, 2)


def _pairs(numbers: Any) -> tuple[tuple[int, int], ...]:
    """Pairs of integers from an array or a list of them."""
    return tuple((int(a), int(b)) for a, b in np.asarray(numbers))


def find_crossings(groups: list) -> Crossings:
    """All crossings of concrete shapes, by their chords; none for traced ones.

    Ends that merely touch are no crossings: an end is an event of its own. Round shapes that
    overlap by less than a chord's height, (pi / 128)^2 / 2 of the radius, may be missed, and a
    curve is not looked at for crossing itself.

    Raises:
        ValueError: if more pairs overlap than can be compared in seconds, or too many cross.
    """
    pairs, near = np.zeros((0, 2), int), np.zeros((0, 2))
    if is_concrete(groups):
        with jax.ensure_compile_time_eval():  # a jitted function may build concrete shapes
            pairs, near = _crossed(*_chords(groups))
    dtype = jnp.result_type(*(leaf.dtype for leaf in jax.tree.leaves(groups)))
    return Crossings(
        _pairs(pairs),
        jnp.asarray(np.asarray(near, dtype=float).reshape(-1, 2), dtype),
    )


def any_crossing(groups: list, shines: Bool[Array, " n"]) -> Bool[Array, ""]:
    """Whether traced segments or circles cross each other; of other kinds nothing is known.

    Touching ends and tangent circles do not cross, and a crossing of two shapes that do not shine
    makes no edge.

    Args:
        groups: the shapes.
        shines: which of them emit light.
    """
    unit = own_unit(groups)
    groups = [group.in_unit(unit) for group in groups]
    first = np.cumsum([0, *(g.count for g in groups)])
    kinds = [(g, shines[a:b]) for g, (a, b) in zip(groups, itertools.pairwise(first), strict=True)]
    lines = [(g, lit) for g, lit in kinds if hasattr(g, "end")]
    rings = [(g, lit) for g, lit in kinds if g.closed and hasattr(g, "radius")]
    found = jnp.zeros((), bool)
    for group, lit in lines:
        found |= _segments_cross(group, lit)
    for group, lit in rings:
        found |= _circles_cross(group, lit)
    for (segments, lit), (circles, glow) in itertools.product(lines, rings):
        found |= _segments_cross_circles(segments, lit, circles, glow)
    return found


def _segments_cross(lines, lit) -> Bool[Array, ""]:
    a, e = lines.start, lines.end - lines.start
    q = a[None] - a[:, None]
    one, other = jnp.broadcast_to(e[:, None], q.shape), jnp.broadcast_to(e[None], q.shape)
    det = cross_2d(one, other)
    slant = jnp.abs(det) > _parallel(lines, e)
    safe = jnp.where(slant, det, 1.0)
    s, t = cross_2d(q, other) / safe, cross_2d(q, one) / safe
    return jnp.any((lit[None] | lit[:, None]) & slant & _inside(s) & _inside(t))


def _parallel(lines, e: Float[Array, "n 2"]) -> Float[Array, "n n"]:
    """The product of two segments up to which they are parallel, by share and by rounding [m^2].

    One that lies on another crosses it nowhere: which of them is seen is `_intersect.highest`'s.
    """
    length, eps = jnp.sqrt(dot_2d(e, e)), jnp.finfo(e.dtype).eps
    size = jnp.maximum(jnp.max(jnp.abs(lines.start)), jnp.max(jnp.abs(lines.end)))
    rounding = 8.0 * eps * size * (length[:, None] + length[None])
    return tie(e.dtype) * length[:, None] * length[None] + rounding


def _circles_cross(rings, lit) -> Bool[Array, ""]:
    apart = rings.center[None] - rings.center[:, None]
    far = jnp.sqrt(dot_2d(apart, apart))
    r, other = rings.radius[None], rings.radius[:, None]
    slack = jnp.finfo(far.dtype).eps ** 0.5 * (r + other)
    met = (far < r + other - slack) & (far > jnp.abs(r - other) + slack)
    return jnp.any((lit[None] | lit[:, None]) & met)


def _segments_cross_circles(lines, lit, rings, glow) -> Bool[Array, ""]:
    w = lines.start[:, None] - rings.center[None]
    e = jnp.broadcast_to((lines.end - lines.start)[:, None], w.shape)
    square, b = dot_2d(e, e), dot_2d(w, e)
    # b^2 - e.e (w.w - r^2), without its cancellation far from the middle of a long segment.
    height = cross_2d(w, e)
    inner = square * rings.radius[None] ** 2 - height**2
    real = inner > 0.0
    root = jnp.sqrt(jnp.where(real, inner, 0.0))
    safe = jnp.where(square == 0.0, 1.0, square)
    met = _inside((-b - root) / safe) | _inside((-b + root) / safe)
    return jnp.any((lit[:, None] | glow[None]) & real & met)


def _inside(s: Float[Array, "*n"]) -> Bool[Array, "*n"]:
    """Whether a parameter is away from the ends by more than rounding."""
    slack = jnp.finfo(s.dtype).eps ** 0.5
    return (s > slack) & (s < 1.0 - slack)


def _chords(groups: list):
    """Starts and ends of all chords, their shape, its being open, and their parameters."""
    start, end, shape, ends, s0, s1, first = [], [], [], [], [], [], 0
    for group in groups:
        s = _corners(group)
        points = np.asarray(points_of(group, as_array(s)))
        for i, p in enumerate(points):
            start.append(p[:-1])
            end.append(p[1:])
            shape.append(np.full(len(s) - 1, first + i))
            ends.append(np.full(len(s) - 1, not group.closed))
            s0.append(s[:-1])
            s1.append(s[1:])
        first += group.count
    return tuple(np.concatenate(a) for a in (start, end, shape, ends, s0, s1))


def _corners(group: Shape) -> np.ndarray:
    """Parameters between which there is one chord; of closed shapes from just past the start on.

    In a symmetric scene shapes cross at the simple fractions of their turn. A crossing at a corner
    lies on either chord or on none, as rounding will have it: so no corner stands there.
    """
    if not hasattr(group, "cosines") and hasattr(group, "end"):
        return np.array([0.0, 1.0])
    s = np.linspace(0.0, 1.0, PIECES + 1)
    return s + SKEW / PIECES * (1.0 if group.closed else 4.0 * s * (1.0 - s))


@jax.jit
def points_of(group: Shape, s: Float[Array, " k"]) -> Float[Array, "n k 2"]:
    """Points of each shape at parameters s."""
    return jax.vmap(lambda one: jax.vmap(lambda t: one.motion(t)[0])(s))(group)


def _crossed(start, end, shape, ends, s0, s1):
    """Pairs of chords of different shapes that cross in their interiors, in order.

    Only the chords of shapes whose boxes overlap are compared.
    """
    edge = end - start
    low, high = np.minimum(start, end), np.maximum(start, end)
    first = np.searchsorted(shape, np.arange(int(shape[-1]) + 2))
    boxes = np.minimum.reduceat(low, first[:-1]), np.maximum.reduceat(high, first[:-1])
    found, count = [np.zeros((0, 4))], 0
    for a, b in _touching(_overlapping(*boxes), first, low, high):
        e, f, q = edge[a], edge[b], start[b] - start[a]
        det = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (q[:, 0] * f[:, 1] - q[:, 1] * f[:, 0]) / det
            v = (q[:, 0] * e[:, 1] - q[:, 1] * e[:, 0]) / det
        inside = (u >= 0.0) & (u < 1.0) & (v >= 0.0) & (v < 1.0)
        a, b, u, v = a[inside], b[inside], u[inside], v[inside]
        sa, sb = s0[a] + u * (s1[a] - s0[a]), s0[b] + v * (s1[b] - s0[b])
        inner = ~(_is_end(sa, ends[a]) | _is_end(sb, ends[b]))
        found.append(np.stack([a, b, sa, sb], 1)[inner])
        count += len(found[-1])
        _check_most(count, MOST_CROSSINGS, "crossings of shapes")
    a, b, sa, sb = np.concatenate(found).T
    order = np.lexsort((b, a))
    chords, s = np.stack([a, b], 1).astype(int)[order], np.stack([sa, sb], 1)[order]
    return shape[chords], np.where(ends[chords], s, s % 1.0)


def _overlapping(low, high):
    """Pairs of boxes that overlap: for each, those that begin before it ends, from left to right.

    Args:
        low: corners of the boxes, shape (n, 2).
        high: the opposite ones.

    Returns:
        Numbers of the boxes, the smaller first, shape (m, 2).
    """
    order = np.argsort(low[:, 0], kind="stable")
    (x0, y0), (x1, y1) = np.ascontiguousarray(low[order].T), np.ascontiguousarray(high[order].T)
    stop = np.searchsorted(x0, x1, "right")
    found, count = [np.zeros((0, 2), int)], 0
    for k in np.flatnonzero(stop > np.arange(len(order)) + 1):
        others = slice(k + 1, stop[k])
        close = order[others][(y0[others] <= y1[k]) & (y1[others] >= y0[k])]
        if len(close):
            found.append(np.stack([np.full(len(close), order[k]), close], 1))
            count += len(close)
            _check_most(count, MOST_PAIRS, "pairs of shapes whose boxes overlap")
    return np.sort(np.concatenate(found), axis=1)


def _touching(pairs, first, low, high):
    """Pairs of chords whose boxes overlap, of given pairs of shapes, some at a time.

    Args:
        pairs: numbers of shapes, shape (m, 2).
        first: number of the first chord of each shape, and at last that of all chords.
        low: corners of the chords' boxes, shape (c, 2).
        high: the opposite ones.
    """
    sizes = np.diff(first)[pairs]
    chords = int(np.sum(sizes[:, 0] * sizes[:, 1]))
    _check_most(chords, MOST_CHORD_PAIRS, "pairs of chords, 128 for a round shape, to compare")
    for own, other in np.unique(sizes, axis=0):
        alike = pairs[(sizes[:, 0] == own) & (sizes[:, 1] == other)]
        for some in np.array_split(alike, -(-len(alike) * own * other // _AT_ONCE)):
            a = first[some[:, :1]] + np.arange(own)
            b = first[some[:, 1:]] + np.arange(other)
            met = np.ones((len(some), own, other), bool)
            for axis in range(2):
                met &= low[b, axis][:, None] <= high[a, axis][..., None]
                met &= high[b, axis][:, None] >= low[a, axis][..., None]
            pair, i, j = np.nonzero(met)
            yield a[pair, i], b[pair, j]


def _check_most(count: int, most: int, what: str) -> None:
    """Refuses what would take minutes."""
    if count > most:
        raise ValueError(f"a scene must have at most {most} {what}, but has more.")


def _is_end(s: np.ndarray, has_ends: np.ndarray) -> np.ndarray:
    """Whether parameters are those of ends, at which a shape is cut or touches."""
    return has_ends & ~((s > 1e-9) & (s < 1.0 - 1e-9))
