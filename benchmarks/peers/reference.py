"""Truth for the soft shadows that shares no code with ours: quadrature, and its differences.

A row of the lamp at v sees the place through gaps that each convex body cuts out of it, an interval
by a quadratic or by slabs; what is left of the row is a closed form, and SciPy's adaptive
quadrature does the rows. Central differences of two steps give gradients and, from how far they are
apart, their error.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad

from benchmarks.peers.soft_shadows import HALF, HEIGHT, RADIANCE, Ball, Block, SoftShadow

STEP = 1e-3  # of the differences [m]
Interval = tuple[float, float]
EMPTY: Interval = (math.inf, -math.inf)


class Gradients(NamedTuple):
    """Gradients at places (n, 2) [W/m^3], and the largest error that differences show."""

    value: np.ndarray
    error: float


def irradiance(shadow: SoftShadow, place: np.ndarray, step: np.ndarray) -> float:
    """E at a place, the first body moved by a step [W/m^2]."""
    x, y = map(float, place)
    moves = [step, *[np.zeros(2)] * (len(shadow.bodies) - 1)]
    bodies = [_seen_from(b, x, y, m) for b, m in zip(shadow.bodies, moves, strict=True)]
    ends = (-HALF - x, HALF - x)
    kinks = [y + k for b in bodies for k in b.kinks(ends) if abs(y + k) < HALF]
    rows = quad(
        lambda v: _row(v - y, ends, [b.hidden(v - y) for b in bodies]),
        -HALF, HALF, points=sorted(set(kinks)) or None, epsabs=1e-13, epsrel=1e-12, limit=400,
    )  # fmt: skip
    return RADIANCE * HEIGHT**2 * rows[0]


def gradients(shadow: SoftShadow, places: np.ndarray, question: str) -> Gradients:
    """The gradient at each place, for the receiver or for the blocker."""
    coarse, fine = (_differences(shadow, places, question, h) for h in (STEP, 0.5 * STEP))
    # Central differences of order 4: half the step has a sixteenth of the error.
    return Gradients(fine, float(np.max(np.abs(coarse - fine))))


def _differences(shadow, places, question: str, h: float) -> np.ndarray:
    def along(place, axis):
        step = np.eye(2)[axis]

        def E(d):
            return (
                irradiance(shadow, place + d * step, np.zeros(2))
                if question == "receiver"
                else irradiance(shadow, place, d * step)
            )

        near, far = E(h) - E(-h), E(2.0 * h) - E(-2.0 * h)
        return (8.0 * near - far) / (12.0 * h)

    return np.array([[along(place, axis) for axis in (0, 1)] for place in places])


def _row(down: float, ends: Interval, hidden: list[Interval]) -> float:
    """Integral over the open part of a row of the lamp, all lengths from the place."""
    square = down * down + HEIGHT * HEIGHT
    total, (start, right) = 0.0, ends
    for low, high in sorted(cut for cut in hidden if cut != EMPTY):
        if low > start:
            total += _closed(min(low, right), square) - _closed(start, square)
        start = min(max(start, high), right)
    return total + _closed(right, square) - _closed(start, square)


def _closed(w: float, square: float) -> float:
    """Antiderivative of 1 / (w^2 + a^2)^2."""
    a = math.sqrt(square)
    return w / (2.0 * square * (w * w + square)) + math.atan(w / a) / (2.0 * square * a)


# --- what a body hides of a row ------------------------------------------------------------------


class _SeenBall(NamedTuple):
    """A ball by its centre from the place: ways D = (w, down, HEIGHT) with (D.c)^2 >= m D^2."""

    center: tuple[float, float, float]
    radius: float

    def kinks(self, ends: Interval) -> list[float]:
        """Rows that quadrature must know of: it finds those of a ball itself."""
        return []

    def hidden(self, down: float) -> Interval:
        """The interval of w that it hides."""
        cx, cy, cz = self.center
        m = cx * cx + cy * cy + cz * cz - self.radius**2
        k = down * cy + HEIGHT * cz
        lead, half, rest = cx * cx - m, cx * k, k * k - m * (down * down + HEIGHT * HEIGHT)
        inside = half * half - lead * rest
        if inside <= 0.0:
            return EMPTY
        root = math.sqrt(inside)
        return (root - half) / lead, (-root - half) / lead  # lead is negative


class _SeenBlock(NamedTuple):
    """A block from the place, its heights as shares of the lamp's."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]

    def kinks(self, ends: Interval) -> list[float]:
        """Rows in which a corner begins or an edge leaves the lamp."""
        x = [self.low[0], self.high[0]]
        heights = [self.low[2], self.high[2], *(a / w for a in x for w in ends if w)]
        return [b / t for b in (self.low[1], self.high[1]) for t in heights if t > 0.0]

    def hidden(self, down: float) -> Interval:
        """Slabs: the ways that are, at some height of the block, within its x and y."""
        start, end = self.low[2], self.high[2]
        if down == 0.0:
            inside = self.low[1] <= 0.0 <= self.high[1]
            start, end = (start, end) if inside else EMPTY
        else:
            one, other = sorted((self.low[1] / down, self.high[1] / down))
            start, end = max(start, one), min(end, other)
        if start >= end:
            return EMPTY
        left = _over(self.low[0], end if self.low[0] > 0.0 else start)
        right = _over(self.high[0], start if self.high[0] > 0.0 else end)
        return left, right


def _over(a: float, t: float) -> float:
    """The quotient, infinite where a block stands on the floor."""
    return a / t if t > 0.0 else math.copysign(math.inf, a)


def _seen_from(body: Ball | Block, x: float, y: float, step: np.ndarray):
    """A body with its first two coordinates from the place, after a step."""
    dx, dy = step[0] - x, step[1] - y
    if isinstance(body, Ball):
        a, b, c = body.center
        return _SeenBall((a + dx, b + dy, c), body.radius)
    low, high = (((c[0] + dx, c[1] + dy, c[2] / HEIGHT)) for c in (body.low, body.high))
    return _SeenBlock(low, high)
