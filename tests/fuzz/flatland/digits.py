"""Irradiance in flatland to 60 digits, and differences of it that no rounding disturbs.

All directions at which what is seen can change are sorted; between two of them one ray tells what
is seen. It is written for truth and not for speed: some milliseconds a scene.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp, mpf

from tests.fuzz.flatland.layout import ARC, CIRCLE, Flat

DIGITS = 60
STEP = mpf(10) ** -20


def exact(s: Flat, row: int, eps: float, apart: float = 0.0) -> tuple[float, float]:
    """Irradiance of one scene, and a bound on its error: none.

    Args:
        s: scenes.
        row: which of them.
        eps: of the precision by which surfaces in one place are told apart.
        apart: what should be told apart; here everything is.
    """
    with mp.workdps(DIGITS):
        return float(_irradiance(along(s, row, s, 0), eps)), 0.0


def _irradiance(one: Flat, eps: float) -> Any:
    """Irradiance of one scene whose numbers are mpf."""
    angles = sorted({-mp.pi / 2, mp.pi / 2, *_edges(one)})
    total = mpf(0)
    for low, high in itertools.pairwise(angles):
        total += _seen(one, (low + high) / 2, eps) * (mp.sin(high) - mp.sin(low))
    return total


def along(s: Flat, row: int, steps: Flat, h: Any) -> Flat:
    """One scene moved by h times a direction, as mpf."""
    with mp.workdps(DIGITS):
        return Flat(*(_exact(a[row]) + h * _exact(b[row]) for a, b in zip(s, steps, strict=True)))


class Differences(NamedTuple):
    """Differences of irradiance along a direction, backward and forward.

    Attributes:
        first: they differ where two edges are in line.
        second: they differ where something appears, or first ones do.
    """

    first: tuple[float, float]
    second: tuple[float, float]


def differences(s: Flat, row: int, steps: Flat, eps: float) -> Differences:
    """Differences of one scene's irradiance along a direction."""
    with mp.workdps(DIGITS):
        E = [_irradiance(along(s, row, steps, k * STEP), eps) for k in (-2, -1, 0, 1, 2)]
        first = (E[2] - E[1]) / STEP, (E[3] - E[2]) / STEP
        second = (E[k] - 2 * E[k + 1] + E[k + 2] for k in (0, 2))
        return Differences(
            (float(first[0]), float(first[1])), tuple(float(d / STEP**2) for d in second)
        )


def _exact(a: np.ndarray) -> np.ndarray:
    return np.vectorize(lambda x: mpf(float(x)), otypes=[object])(np.asarray(a))


def _edges(one: Flat) -> list[Any]:
    """Angles from the normal, within the horizon, of ends and tangents."""
    rings = [one.arc[:3], *one.circles]
    points = [p for ends in one.segments for p in ends]
    points += [_on_ring(one.arc, share) for share in (0, 1)]
    found = []
    for x, y in points:
        way = x - one.at[0], y - one.at[1]
        if way != (0, 0):
            found.append(_angle(one, *way))
    for cx, cy, r in rings:
        wx, wy = cx - one.at[0], cy - one.at[1]
        far = mp.hypot(wx, wy)
        if far > r:
            middle, half = _angle(one, wx, wy), mp.asin(r / far)
            found += [_turned(middle - half), _turned(middle + half)]
    return [a for a in found if abs(a) < mp.pi / 2]


def _on_ring(arc: Any, share: int) -> tuple[Any, Any]:
    angle = arc[3] + share * arc[4]
    return arc[0] - arc[2] * mp.sin(angle), arc[1] + arc[2] * mp.cos(angle)


def _angle(one: Flat, x: Any, y: Any) -> Any:
    return _turned(mp.atan2(-x, y) - one.at[2])


def _turned(angle: Any) -> Any:
    """The same angle within half a turn."""
    return angle - 2 * mp.pi * mp.nint(angle / (2 * mp.pi))


def _seen(one: Flat, angle: Any, eps: float) -> Any:
    """Radiance from an angle."""
    n = one.at[2] + angle
    dx, dy = -mp.sin(n), mp.cos(n)
    hits, on = [], int(one.on)
    for k, ((ax, ay), (bx, by)) in enumerate(one.segments):
        if k != on:
            hits.append((_segment(ax - one.at[0], ay - one.at[1], bx - ax, by - ay, dx, dy), k))
    for k, ring in ((ARC, one.arc), (CIRCLE, one.circles[0]), (CIRCLE + 1, one.circles[1])):
        hits.append((_ring(ring, one.at, dx, dy, k == on), k))
    first = min(t for t, _ in hits)
    if not mp.isfinite(first):
        return mpf(0)
    behind = first * (1 + mpf(eps) ** 0.75) + 8 * eps * max(abs(one.at[0]), abs(one.at[1]))
    lit = [k for t, k in hits if t <= behind and k < ARC and max(one.emission[k]) > 0]
    if not lit:
        return mpf(0)
    (ax, ay), (bx, by) = one.segments[max(lit)]
    front = (bx - ax) * dy - (by - ay) * dx < 0
    return one.emission[max(lit)][0 if front else 1]


def _segment(wx, wy, ex, ey, dx, dy) -> Any:
    det = dx * ey - dy * ex
    if det == 0:
        return mp.inf
    t, share = (wx * ey - wy * ex) / det, (wx * dy - wy * dx) / det
    return t if t > 0 and 0 <= share <= 1 else mp.inf


def _ring(ring, at, dx, dy, own: bool) -> Any:
    wx, wy = ring[0] - at[0], ring[1] - at[1]
    middle, height = wx * dx + wy * dy, wx * dy - wy * dx
    inner = ring[2] ** 2 - height**2
    if inner <= 0:
        return mp.inf
    root = mp.sqrt(inner)
    ends = [middle - root, middle + root]
    if own:  # it starts at the one, whichever rounding left nearer
        ends = [max(ends, key=abs)]
    return min((t for t in ends if t > 0 and _swept(ring, at, t * dx, t * dy)), default=mp.inf)


def _swept(ring, at, x, y) -> bool:
    """Whether a point of a circle is on the arc; all are on a circle itself."""
    if len(ring) == 3:
        return True
    hx, hy = at[0] + x - ring[0], at[1] + y - ring[1]
    turned = (mp.atan2(-hx, hy) - ring[3]) * mp.sign(ring[4])
    return turned - 2 * mp.pi * mp.floor(turned / (2 * mp.pi)) <= abs(ring[4])
