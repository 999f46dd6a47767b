"""Which shapes of a concrete scene may cross, or lie on one line: decided before any receiver.

Segments are judged by fractions, without rounding. Of pairs with a round shape all are kept that
are not surely apart: a crossing that does not exist is one silhouette too many and does no harm.
"""

from __future__ import annotations

import itertools
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

SLACK = 1e-5  # share of all lengths by which a pair must miss each other to be left out


class Meetings(NamedTuple):
    """Pairs of shapes, by their rows among the segments and among the round shapes.

    Attributes:
        straight: segments that cross each other in their interiors.
        mixed: segments and round shapes that may cross.
        round: round shapes that may cross.
        in_line: segments that lie on one line and overlap.
    """

    straight: Int[np.ndarray, "a 2"]
    mixed: Int[np.ndarray, "b 2"]
    round: Int[np.ndarray, "c 2"]
    in_line: Int[np.ndarray, "d 2"]


def meetings(
    start: Float[np.ndarray, "s 2"],
    end: Float[np.ndarray, "s 2"],
    center: Float[np.ndarray, "r 2"],
    radius: Float[np.ndarray, " r"],
) -> Meetings:
    """All pairs that may meet.

    Args:
        start: of the segments [m].
        end: of the segments [m].
        center: of the circles, and of those that arcs lie on [m].
        radius: of the same [m].

    Example:
        >>> import numpy as np
        >>> from firstorder.checks._meetings import meetings
        >>> start, end = np.array([[-1.0, 0.0], [0.0, -1.0]]), np.array([[1.0, 0.0], [0.0, 1.0]])
        >>> meetings(start, end, np.zeros((0, 2)), np.zeros(0)).straight.tolist()
        [[0, 1]]
    """
    straight, in_line = [], []
    low, high = np.minimum(start, end), np.maximum(start, end)
    for i in range(len(start)):
        touching = np.all((low[i + 1 :] <= high[i]) & (high[i + 1 :] >= low[i]), -1)
        for j in i + 1 + np.flatnonzero(touching):
            crossed, lined = _segments(start[i], end[i], start[j], end[j])
            straight += [(i, j)] if crossed else []
            in_line += [(i, j)] if lined else []
    reach = SLACK * max(np.max(np.abs(a), initial=0.0) for a in (start, end, center, radius))
    mixed = [
        (i, j)
        for i, j in itertools.product(range(len(start)), range(len(center)))
        if _may_cross(start[i], end[i], center[j], radius[j], reach)
    ]
    of_round = [
        (i, j)
        for i, j in itertools.combinations(range(len(center)), 2)
        if _may_overlap(center[i], radius[i], center[j], radius[j], reach)
    ]
    return Meetings(
        *(np.array(p, np.int32).reshape(-1, 2) for p in (straight, mixed, of_round, in_line))
    )


def _side(a, b, p) -> Fraction:
    """Twice the area of a triangle, without rounding: on which side of a line a point lies."""
    (ax, ay), (bx, by), (px, py) = (map(Fraction, map(float, q)) for q in (a, b, p))
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


def _segments(a, b, p, q) -> tuple[bool, bool]:
    """Whether two segments cross in their interiors, and whether they lie on one line."""
    sides = _side(a, b, p), _side(a, b, q), _side(p, q, a), _side(p, q, b)
    crossed = sides[0] * sides[1] < 0 and sides[2] * sides[3] < 0
    return crossed, not any(sides)


def _may_cross(a, b, center, radius, reach) -> bool:
    """Whether a segment may meet a circle."""
    edge, w = b - a, center - a
    s = np.clip(w @ edge / (edge @ edge), 0.0, 1.0)
    nearest = np.linalg.norm(w - s * edge)
    farthest = max(np.linalg.norm(w), np.linalg.norm(center - b))
    return bool(nearest <= radius + reach and farthest >= radius - reach)


def _may_overlap(a, r, b, s, reach) -> bool:
    """Whether two circles may meet; those about one centre are one, or never do."""
    far = np.linalg.norm(b - a)
    return bool(np.any(a != b) and far <= r + s + reach and far >= abs(r - s) - reach)
