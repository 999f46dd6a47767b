"""Filling in machine code: candidates in rows, of which a new record looks at those that it spans.

A strip along x (`_strips`) holds all candidates of a plane at that x. In rows as high as
candidates are apart, each sorted along x, a region meets few besides those that it covers.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from firstorder.caching._records import rim
from firstorder.caching._strips import BESIDE
from firstorder.caching.candidates import Candidates
from firstorder.caching.regions import ValidityRegion
from firstorder.numerics._native import native

exactly = functools.partial(native, fastmath=False)  # regions may be infinite, or NaN


class Rows(NamedTuple):
    """Candidates sorted by row, and in each row along x.

    Attributes:
        x: their places, shape (2, m); a line has the second component zero [m].
        tilt: of their normals, shape (t, m), t = 0 if all are parallel [rad].
        rank: which candidate stands at each place.
        place: where each candidate stands among the sorted.
        starts: of each row among them, and of the row after the last.
        low: where the first row begins [m].
        step: height of a row [m].
        rim: what covers a candidate has an error below it, as `_records.reached` has it.
    """

    x: np.ndarray
    tilt: np.ndarray
    rank: np.ndarray
    place: np.ndarray
    starts: np.ndarray
    low: float
    step: float
    rim: float

    @classmethod
    def of(cls, candidates: Candidates) -> Rows:
        """The candidates of a line, or of a plane, in as many rows as they are along a side."""
        position = np.asarray(candidates.position)
        m, d = position.shape
        x = np.zeros((2, m))
        x[:d] = position.T
        count = 1 if d == 1 else math.isqrt(m)
        low, size = np.min(x[1]), np.ptp(x[1])
        step = size / count if size > 0.0 else 1.0
        row = np.clip(np.floor((x[1] - low) / step), 0, count - 1)
        rank = np.lexsort((x[0], row))
        place = np.empty(m, int)
        place[rank] = np.arange(m)
        tilt = np.zeros((0, m)) if candidates.tilt is None else np.asarray(candidates.tilt, float).T
        starts = np.searchsorted(row[rank], np.arange(count + 1))
        sizes = float(low), float(step), rim(position.dtype)
        return cls(x[:, rank], tilt[:, rank], rank, place, starts, *sizes)

    def filled(self, region: ValidityRegion, visits: np.ndarray, most: int) -> np.ndarray:
        """Records among the visited, in their order, `most` of them."""
        m, d, _ = region.matrix.shape
        matrix = np.zeros((m, 2, 2))
        matrix[:, :d, :d] = region.matrix
        if d == 1:
            matrix[:, 1, 1] = 1.0
        records = np.zeros(m, bool)
        fill_rows(*self, matrix, np.asarray(visits), most, records)
        return records


@exactly
def fill_rows(x, tilt, rank, place, starts, low, step, rim, matrix, visits, most, records):
    """Marks the records, as `Rows.filled` tells; `matrix` is that of each region, (m, 2, 2)."""
    open_ = np.zeros(rank.size, np.bool_)
    for v in visits:
        open_[place[v]] = True
    count, rows = 0, starts.size - 1
    for v in visits:
        i = place[v]
        if not open_[i]:
            continue
        if count == most:
            return
        records[v] = True
        count += 1
        a, b, c, e = matrix[v, 0, 0], matrix[v, 0, 1], matrix[v, 1, 0], matrix[v, 1, 1]
        whole = abs(a * e - b * c)
        # Half of what the region spans along x and across: lengths of the inverse's rows.
        wide, high = math.inf, math.inf
        if 0.0 < whole < math.inf:
            wide, high = BESIDE * math.hypot(b, e) / whole, BESIDE * math.hypot(a, c) / whole
        x0, x1 = x[0, i], x[1, i]
        first = int(min(max((x1 - high - low) / step, 0.0), rows - 1.0))
        last = int(min(max((x1 + high - low) / step, 0.0), rows - 1.0))
        for row in range(first, last + 1):
            k = starts[row]
            k += np.searchsorted(x[0, k : starts[row + 1]], x0 - wide)
            while k < starts[row + 1] and x[0, k] <= x0 + wide:
                if open_[k]:
                    d0, d1 = x[0, k] - x0, x[1, k] - x1
                    error = math.sqrt((a * d0 + b * d1) ** 2 + (c * d0 + e * d1) ** 2)
                    if tilt.shape[0]:
                        error += _turned(tilt, i, k)
                    open_[k] = not error < rim
                k += 1


@exactly
def _turned(tilt, i, k):
    """Sine of the angle between two normals, 1 from a right angle on (`_records.turning`)."""
    if tilt.shape[0] == 1:
        turn = tilt[0, k] - tilt[0, i]
        return abs(math.sin(turn)) if math.cos(turn) > 0.0 else 1.0
    square = 0.0
    for a in range(tilt.shape[0]):
        square += (tilt[a, k] - tilt[a, i]) ** 2
    return math.sin(min(math.sqrt(square), 0.5 * math.pi))
