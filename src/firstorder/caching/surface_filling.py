"""Filling of a cache on a surface, from tables that were gathered once.

Candidates are visited in some order, and those that no record covers are kept. All of it happens on
a per-pixel table, so that thresholds can be halved and orders of insertion varied without gathering
again. As along a line, the order decides which candidates are kept: report the spread.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from jaxtyping import ArrayLike
from scipy.spatial import KDTree

from firstorder.caching.ellipses import ValidityRegion, circular_regions
from firstorder.errors import check_positive

ENOUGH = 4  # times the wanted number of records are too many, however many more there would be

Indices: TypeAlias = ArrayLike | Sequence


def fill_surface(
    position: ArrayLike, matrix: ArrayLike, visits: Indices, most: int | None = None
) -> np.ndarray:
    """Selection of records from candidates that are visited in the given order.

    A candidate is left out if a record made before covers it: `|M (x - x_i)| < 1`. A tree finds
    those near each new record: a thousand records among 128 x 128 take less than a tenth of a
    second.

    Args:
        position: of the candidates (m, 2) [m].
        matrix: of the ellipse that each would have (m, 2, 2) [1/m].
        visits: indices of candidates, in the order of the visits.
        most: give up after so many records; none if not given.

    Returns:
        True for records. Every visited candidate is a record or covered by one, unless there would
        be more than `most` of them.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching import fill_surface
        >>> x = np.array([[0.0, 0.0], [0.5, 0.0], [2.0, 0.0]])
        >>> fill_surface(x, np.broadcast_to(np.eye(2), (3, 2, 2)), [0, 1, 2]).tolist()
        [True, False, True]
    """
    x, M = np.asarray(position), np.asarray(matrix)
    most = len(x) if most is None else most
    return _filled(x, M, np.asarray(visits), np.zeros(len(x), bool), most)


def _filled(
    x: np.ndarray, M: np.ndarray, waiting: np.ndarray, records: np.ndarray, most: int
) -> np.ndarray:
    """Records with those added for the candidates that wait, in their order, `most` of them."""
    tree, far, left = KDTree(x), _longest(M), most
    open_ = np.zeros(len(x), bool)
    open_[waiting] = True
    for i in waiting.tolist():
        if not open_[i]:
            continue
        if left == 0:
            break
        left -= 1
        records[i] = True
        near = np.array(tree.query_ball_point(x[i], far[i], return_sorted=False))
        dx, dy = x[near, 0] - x[i, 0], x[near, 1] - x[i, 1]
        (a, b), (c, d) = M[i]
        open_[near[(a * dx + b * dy) ** 2 + (c * dx + d * dy) ** 2 < 1.0]] = False
    return records


def _longest(M: np.ndarray) -> np.ndarray:
    """Longest semi-axis of every ellipse, or a little more."""
    square = 0.5 * np.sum(M * M, axis=(1, 2))
    det = M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0]
    largest = square + np.sqrt(np.maximum(square * square - det * det, 0.0))
    return 1.0001 * np.sqrt(largest) / np.abs(det)


def _fill_with_neighbours(
    position: ArrayLike,
    length: ArrayLike,
    accuracy: float,
    visits: Indices,
    low: float,
    high: float,
    *,
    passes: int = 8,
) -> tuple[np.ndarray, ValidityRegion]:
    """Selection of records whose lengths are cut by their neighbours', as they are inserted.

    A new record's length is cut to `R_j + |x - x_j|` for every record j, and theirs to its own by
    the same rule. Its reach is the accuracy times the length, held within [low, high]. What a
    record had covered may be open again after it was cut: the visits are repeated until nothing is.

    Args:
        position: of the candidates (m, 2) [m].
        length: minimum or harmonic mean of the rays' lengths, of each [m].
        accuracy: by which the lengths are multiplied.
        visits: indices of candidates, in the order of the visits.
        low: smallest reach [m].
        high: largest [m].
        passes: at most; what is open after the last becomes a record without cutting others.

    Returns:
        True for records, and the reach of every candidate (cut for records).

    Reference: Krivanek et al. 2006.
    """
    x, R = np.asarray(position), np.array(length, dtype=float)
    visits = np.asarray(visits)
    records = np.zeros(len(x), bool)
    rows = np.zeros(0, int)
    waiting = visits
    reach = circular_regions(accuracy * R, low, high)
    for _ in range(passes):
        while len(waiting):
            i = waiting[0]
            distance = np.hypot(x[rows, 0] - x[i, 0], x[rows, 1] - x[i, 1])
            R[i] = min(R[i], np.min(R[rows] + distance, initial=np.inf))
            R[rows] = np.minimum(R[rows], R[i] + distance)
            rows = np.append(rows, i)
            records[i] = True
            reach = np.clip(accuracy * R[i], low, high)
            away = (x[waiting, 0] - x[i, 0]) ** 2 + (x[waiting, 1] - x[i, 1]) ** 2
            open_ = away >= reach**2
            open_[0] = False
            waiting = waiting[open_]
        reach = circular_regions(accuracy * R, low, high)
        waiting = visits[~_covered(x, np.asarray(reach.matrix), rows, visits)]
        if len(waiting) == 0:
            return records, reach
    _filled(x, np.asarray(reach.matrix), waiting, records, len(x))
    return records, reach


def _covered(x: np.ndarray, M: np.ndarray, rows: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Mask of the places that some record covers."""
    left = np.arange(len(where))
    px, py = x[where, 0], x[where, 1]
    covered = np.zeros(len(where), bool)
    covered[np.isin(where, rows)] = True
    for i in rows:
        dx, dy = px - x[i, 0], py - x[i, 1]
        (a, b), (c, d) = M[i]
        inside = (a * dx + b * dy) ** 2 + (c * dx + d * dy) ** 2 < 1.0
        covered[left[inside]] = True
        left, px, py = left[~inside], px[~inside], py[~inside]
    return covered


class SurfaceFit(NamedTuple):
    """Choices of about a wanted number of records, one for each order of insertion.

    Attributes:
        threshold: what was found, one for each order.
        size: records that it gives.
        records: which candidates they are, (o, m).
        reach: of each candidate, at that threshold, one for each order.
        exact: whether the count is the wanted one. Where it is not, it was within the slack, or
            the count jumped over it, and the nearest that was met is given.
    """

    threshold: np.ndarray
    size: np.ndarray
    records: np.ndarray
    reach: tuple[ValidityRegion, ...]
    exact: np.ndarray


def fit_surface(
    position: ArrayLike,
    radii: Callable[[float], ValidityRegion],
    visits: Indices,
    target: int,
    *,
    low: float,
    high: float,
    slack: int | None = None,
    halvings: int = 40,
) -> SurfaceFit:
    """Records, `target` for each order of insertion, by halving the log of the threshold.

    Args:
        position: of the candidates (m, 2) [m].
        radii: threshold to the reach of each candidate, growing with it: a tolerance for Hessians,
            the accuracy for the split sphere.
        visits: orders of insertion, (o, m) indices, as `random_orders` gives them.
        target: wanted number of records.
        low: threshold that gives more records than that.
        high: threshold that gives fewer.
        slack: records more or fewer that do as well: 0.2 % of the target if not given.
        halvings: how often the bracket is halved at most.

    Raises:
        ValueError: if `low` gives fewer records than wanted, or `high` more, in some order.
    """

    def make(threshold, visit):
        reach = radii(threshold)
        return fill_surface(position, reach.matrix, visit, ENOUGH * target), reach

    return _fit_with(make, visits, target, low=low, high=high, slack=slack, halvings=halvings)


def _fit_with(
    make: Callable[[float, np.ndarray], tuple[np.ndarray, ValidityRegion]],
    visits: Indices,
    target: int,
    *,
    low: float,
    high: float,
    slack: int | None = None,
    halvings: int = 40,
) -> SurfaceFit:
    """`fit_surface` for any way of filling, such as `_fill_with_neighbours`.

    Args:
        make: a threshold and an order of insertion to records and reach.
        visits: orders of insertion, (o, m) indices.
        target: wanted number of records.
        low: threshold that gives more records than that.
        high: threshold that gives fewer.
        slack: records more or fewer that do as well: 0.2 % of the target if not given.
        halvings: how often the bracket is halved at most.

    Raises:
        ValueError: as there.
    """
    for name, number in (("target", target), ("low", low), ("high", high)):
        check_positive(name, number)
    slack = target // 500 if slack is None else slack
    found = [
        _halved(make, np.asarray(visit), target, low, high, slack, halvings)
        for visit in np.atleast_2d(np.asarray(visits))
    ]
    threshold, records, reach = zip(*found, strict=True)
    size = np.array([r.sum() for r in records])
    return SurfaceFit(np.array(threshold), size, np.stack(records), reach, size == target)


def _halved(make, visit, target, low, high, slack, halvings):
    """One order of insertion: bracket in the log, by false position and halving in turn."""

    def tried(threshold):
        records, reach = make(float(threshold), visit)
        return int(records.sum()), (float(threshold), records, reach)

    (many, first), (few, last) = tried(low), tried(high)
    for name, count, wrong in (("low", many, many < target), ("high", few, few > target)):
        if wrong:
            raise ValueError(
                f"Argument `{name}` must be a threshold on its side of {target} records, "
                f"but gives {count}."
            )
    ends = ((abs(many - target), first), (abs(few - target), last))
    miss, best = min(ends, key=lambda end: end[0])
    a, b = np.log(low), np.log(high)
    for turn in range(halvings):
        if miss <= slack:
            break
        # Counts fall as a power of the threshold: straight lines in both logs.
        share = (
            np.log(many / target) / np.log(many / few)
            if turn % 3 < 2 and ENOUGH * target > many > few
            else 0.5
        )
        middle = a + min(max(share, 0.02), 0.98) * (b - a)
        count, this = tried(np.exp(middle))
        if abs(count - target) < miss:
            best, miss = this, abs(count - target)
        if count > target:
            a, many = middle, count
        else:
            b, few = middle, count
    return best
