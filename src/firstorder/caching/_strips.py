"""Candidates in strips: sorted along x, and how far each region spans there."""

from __future__ import annotations

import numpy as np

from firstorder.caching._records import reached
from firstorder.caching.candidates import Candidates
from firstorder.caching.regions import ValidityRegion

BESIDE = 1.0001  # of what a region spans is looked at


class Strips:
    """Candidates sorted along x, and how far the region of each spans there.

    Attributes:
        place: where each candidate stands among the sorted.
        rank: which candidate stands at each place.
    """

    def __init__(self, candidates: Candidates, region: ValidityRegion):
        x, M = np.asarray(candidates.position), np.asarray(region.matrix)
        m, d = x.shape
        self.rank = np.argsort(x[:, 0], kind="stable")
        self.place = np.empty(m, int)
        self.place[self.rank] = np.arange(m)
        self.x, self.matrix = np.ascontiguousarray(x[self.rank].T), M[self.rank]
        self.tilt = None
        if candidates.tilt is not None:
            tilt = np.asarray(candidates.tilt)
            if np.any(tilt != tilt[:1]):
                self.tilt = np.ascontiguousarray(tilt[self.rank].T)
        # Half the extent along x, the length of the first row of the inverse, and a little more.
        if d == 1:
            size = np.abs(self.matrix[:, 0, 0])
            span = np.divide(1.0, size, out=np.full_like(size, np.inf), where=size > 0.0)
        else:
            (a, b), (c, e) = np.moveaxis(self.matrix, 0, -1)
            whole, wide = np.abs(a * e - b * c), np.hypot(b, e)
            # A region without an end spans everything.
            span = np.divide(wide, whole, out=np.full_like(wide, np.inf), where=whole > 0.0)
        self.first = np.searchsorted(self.x[0], self.x[0] - BESIDE * span).tolist()
        self.last = np.searchsorted(self.x[0], self.x[0] + BESIDE * span, "right").tolist()

    def covered_by(self, i: int) -> tuple[slice, np.ndarray]:
        """The strip of the record at a place, and what it covers there."""
        strip = slice(self.first[i], self.last[i])
        u = self.matrix[i] @ (self.x[:, strip] - self.x[:, i : i + 1])
        error = _length(u)
        if self.tilt is not None:
            error = error + _turned(self.tilt[:, strip] - self.tilt[:, i : i + 1])
        return strip, reached(error)

    def filled(self, visits: np.ndarray, most: int) -> np.ndarray:
        """Records among the visited, in their order, `most` of them."""
        visits = self.place[visits]
        open_, new = np.zeros(len(self.rank), bool), []
        open_[visits] = True
        for i in visits.tolist():
            if not open_[i]:
                continue
            if len(new) == most:
                break
            new.append(i)
            strip, covered = self.covered_by(i)
            open_[strip] &= ~covered
        records = np.zeros(len(self.rank), bool)
        records[self.rank[new]] = True
        return records


def _turned(turn: np.ndarray) -> np.ndarray:
    """The share of errors that is due to turns of the normal, as `_records.turning` has it."""
    if len(turn) == 1:
        return np.where(np.cos(turn[0]) > 0.0, np.abs(np.sin(turn[0])), 1.0)
    return np.sin(np.minimum(_length(turn), 0.5 * np.pi))


def _length(u: np.ndarray) -> np.ndarray:
    """Lengths of vectors given by their components."""
    return np.abs(u[0]) if len(u) == 1 else np.sqrt(np.sum(u * u, axis=0))
