"""Irradiance in flatland by rays: NumPy in its longest precision, nothing of the library's code.

A share `eps^(3/4)` of the distance, or rounding of the coordinates, tells surfaces in one place
apart, as `Scene.of` says: the one that shines is seen, and of two the later one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from tests.fuzz.flatland.layout import ARC, CIRCLE, Flat, direction

LONG = np.longdouble
# Directions at which what is seen can change: 8 ends, 2 of the arc, 2 tangents to each of 3 rings.
MOST_EDGES = 16


def by_rays(s: Flat, row: int, eps: float, rays: int) -> tuple[float, float]:
    """Irradiance of one scene by rays evenly spaced in the sine, and a bound on its error.

    Each edge moves the sum by half a ray at most.

    Args:
        s: scenes.
        row: which of them.
        eps: of the precision whose numbers are judged.
        rays: how many.
    """
    one = Flat(*(np.asarray(a[row], LONG) for a in s))
    sines = (2.0 * np.arange(rays, dtype=LONG) + 1.0) / rays - 1.0
    cosines, n = np.sqrt((1.0 - sines) * (1.0 + sines)), one.at[2]
    x = -np.sin(n) * cosines - np.cos(n) * sines
    y = np.cos(n) * cosines - np.sin(n) * sines
    radiance = seen(one, np.stack([x, y], -1), eps)
    bound = MOST_EDGES * float(np.max(one.emission)) / rays
    return float(2.0 * np.mean(radiance)), bound


def seen(one: Flat, d: np.ndarray, eps: float) -> np.ndarray:
    """Radiance that arrives from directions."""
    origin, on = one.at[:2], int(one.on)
    hits = [_segment(ends, origin, d, k == on) for k, ends in enumerate(one.segments)]
    hits.append(_ring(one.arc[:3], origin, d, on == ARC, one.arc[3:]))
    hits += [_ring(c, origin, d, k == on) for k, c in enumerate(one.circles, CIRCLE)]
    t = np.stack(hits)
    first = np.min(t, 0)
    behind = first * (1.0 + eps**0.75) + 8.0 * eps * np.max(np.abs(origin))
    together = (t <= behind) & np.isfinite(t)
    radiance = np.zeros(len(d), LONG)
    for k, (ends, sent) in enumerate(zip(one.segments, one.emission, strict=True)):
        front = _cross(ends[1] - ends[0], d) < 0.0
        shines = together[k] & bool(np.any(sent > 0.0))
        radiance = np.where(shines, np.where(front, sent[0], sent[1]), radiance)
    return radiance


def _cross(a: Any, b: Any) -> Any:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _segment(ends, origin, d, own: bool) -> np.ndarray:
    """Distances by Cramer's rule; infinity for a miss."""
    edge, way = ends[1] - ends[0], ends[0] - origin
    det = _cross(d, edge)
    safe = np.where(det == 0.0, 1.0, det)
    t, share = _cross(way, edge) / safe, _cross(way, d) / safe
    hit = (det != 0.0) & (t > 0.0) & (share >= 0.0) & (share <= 1.0)
    return np.where(hit & (not own), t, np.inf)


def _ring(ring, origin, d, own: bool, swept: Any = None) -> np.ndarray:
    """Distances to a circle, or to what of it is swept; of its own two roots the far one counts."""
    way = ring[:2] - origin
    middle = d @ way
    inner = ring[2] ** 2 - _cross(way[None], d) ** 2
    root = np.sqrt(np.where(inner > 0.0, inner, 0.0))
    best = np.full(len(d), np.inf, LONG)
    ends = (middle - root, middle + root)
    for t in ends:
        hit = (inner > 0.0) & (t > 0.0)
        if own:
            other = ends[1] if t is ends[0] else ends[0]
            hit &= np.abs(t) > np.abs(other)
        if swept is not None:
            h = origin + t[:, None] * d - ring[:2]
            turned = (np.arctan2(-h[:, 0], h[:, 1]) - swept[0]) * np.sign(swept[1])
            hit &= np.mod(turned, 2.0 * np.pi) <= np.abs(swept[1])
        best = np.where(hit & (t < best), t, best)
    return best


# --- what the library says of itself that it cannot answer ---------------------------------------


def refused(s: Flat, eps: float) -> np.ndarray:
    """Scenes that may be NaN: a segment or a circle crosses, or touches, a segment that shines.

    `Scene.of` says so of traced ones.
    """
    slack, found = 16.0 * eps * s.size, np.zeros(len(s.at), bool)
    for k, lit in _shining(s):
        for other in range(4):
            dark = ~np.any(s.emission[:, other] > 0.0, -1)
            found |= lit & dark & _meet(s.segments[:, k], s.segments[:, other], slack)
        for ring in (s.circles[:, 0], s.circles[:, 1]):
            found |= lit & _meets_ring(s.segments[:, k], ring, slack)
    return found


def unanswered(s: Flat, eps: float) -> np.ndarray:
    """Scenes that may be wrong: the receiver is on a shape that it does not name, or within dozens
    of roundings of an arc's end, or an arc crosses a segment that shines.

    `Receiver.on` says the first, and `Scene.of` that traced arcs are taken not to cross the last.
    An arc reaches beyond its ends by some roundings, so that no ray passes between what is joined.
    """
    slack = 16.0 * eps * s.size
    found, touch = np.zeros(len(s.at), bool), eps * s.size
    for k, lit in _shining(s):
        found |= lit & _meets_ring(s.segments[:, k], s.arc[:, :3], slack)
        found |= (s.on != k) & (_distance(s.segments[:, k], s.at[:, :2]) <= touch)
    for k, ring in ((ARC, s.arc), (CIRCLE, s.circles[:, 0]), (CIRCLE + 1, s.circles[:, 1])):
        off = np.abs(np.linalg.norm(s.at[:, :2] - ring[:, :2], axis=-1) - ring[:, 2])
        found |= (s.on != k) & (off <= touch)
    for angle in (s.arc[:, 3], s.arc[:, 3] + s.arc[:, 4]):
        end = s.arc[:, :2] + s.arc[:, 2:3] * direction(angle)
        found |= (s.on != ARC) & (np.linalg.norm(s.at[:, :2] - end, axis=-1) <= 4.0 * slack)
    return found


def _shining(s: Flat) -> Iterator[tuple[int, np.ndarray]]:
    """Numbers of segments, and in which scenes they shine."""
    return ((k, np.any(s.emission[:, k] > 0.0, -1)) for k in range(4))


def _meet(one, other, slack) -> np.ndarray:
    """Whether two segments come within a slack of each other; by the sides of their ends."""

    def sides(a, b):
        edge = a[:, 1] - a[:, 0]
        length = np.maximum(np.linalg.norm(edge, axis=-1), 1e-300)
        heights = _cross(edge[:, None], b - a[:, :1]) / length[:, None]
        return (np.min(heights, 1) <= slack) & (np.max(heights, 1) >= -slack)

    return sides(one, other) & sides(other, one)


def _meets_ring(ends, ring, slack) -> np.ndarray:
    """Whether a segment comes as near to a centre as the radius, and reaches as far."""
    farthest = np.max(np.linalg.norm(ends - ring[:, None, :2], axis=-1), 1)
    return (_distance(ends, ring[:, :2]) <= ring[:, 2] + slack) & (farthest >= ring[:, 2] - slack)


def _distance(ends, points) -> np.ndarray:
    """From points to segments."""
    start, edge = ends[:, 0], ends[:, 1] - ends[:, 0]
    square = np.maximum(np.sum(edge**2, -1), 1e-300)
    share = np.clip(np.sum((points - start) * edge, -1) / square, 0.0, 1.0)
    return np.linalg.norm(start + share[:, None] * edge - points, axis=-1)
