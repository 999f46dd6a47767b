"""Filling of a cache: candidates are visited in some order, and those that nothing covers are kept.

The order decides which, so that a single fill is one draw of many: fill in several orders and
report mean and spread. The threshold that gives a wanted number of records is found by halving;
since the number falls in steps, and not always, it may be missed, and this is said.

All of it happens on the host, on candidates that were computed once. They are sorted along x, and a
new record looks at the strip that its region spans (`_strips`). Many candidates are sorted in rows,
and filled by machine code, where numba is there to make it (`_fill_rows`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from firstorder._argument_checks import (
    check_count,
    check_integer,
    check_not_negative,
    check_positive,
    check_shape,
)
from firstorder._display import in_print
from firstorder.caching._records import checked_visits
from firstorder.caching._strips import Strips
from firstorder.caching.cache import Cache, Lookup, _answers_of_many, _tabled
from firstorder.caching.candidates import Candidates
from firstorder.caching.regions import ValidityRegion, _check_regions
from firstorder.numerics._native import HAVE_NATIVE
from firstorder.typing import as_float

MANY = 4096  # candidates from which on machine code is worth loading
ENOUGH = 4  # times the wanted number of records are too many, however many more there would be

Indices: TypeAlias = ArrayLike | Sequence


def random_orders(count: int, orders: int, seed: int = 0) -> np.ndarray:
    """Random orders of insertion: an array (orders, count) of indices.

    Raises:
        ValueError: if a number is no positive integer.

    Example:
        >>> from firstorder.caching import random_orders
        >>> sorted(random_orders(4, 2)[0].tolist())
        [0, 1, 2, 3]
    """
    check_count("count", count)
    check_count("orders", orders)
    rng = np.random.default_rng(seed)
    return np.stack([rng.permutation(count) for _ in range(orders)])


def fill(
    candidates: Candidates, region: ValidityRegion, visits: Indices, most: int | None = None
) -> np.ndarray:
    """Selection of records from candidates that are visited in the given order.

    A candidate is left out if a record made before covers it: if its error, `|M dx|` plus the sine
    of the turn, is below 1; on the rim of a region it is outside (`e < 1 - 8 eps`, as in `Cache`).
    A thousand records among 384 x 384 candidates take some 5 ms with numba and 80 without, twenty
    among 256 a tenth of one.

    Args:
        candidates: places, with all that a record would hold.
        region: that each would have.
        visits: indices of candidates, in the order of the visits.
        most: give up after so many records; none if not given.

    Returns:
        An array of m truth values, true for records. Every visited candidate is a record or covered
        by one, unless there would be more than `most` of them.

    Raises:
        ValueError: if regions and candidates are not as many, a visit is no candidate's number, or
            `most` is negative.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Candidates, circular_regions, fill
        >>> line = Candidates.from_function(jnp.cos, jnp.linspace(0.0, 1.0, 5))
        >>> fill(line, circular_regions(jnp.full(5, 0.3), 0.1, 1.0), [2, 0, 1, 3, 4]).tolist()
        [True, False, True, False, True]
    """
    if most is not None:
        check_integer("most", most)
        check_not_negative("most", most)
    return _filler(candidates)(region, checked_visits(visits, candidates.count), most)


def _filler(candidates: Candidates) -> Callable[[ValidityRegion, np.ndarray, int | None], Any]:
    """A function of regions, visits and the most records that does what `fill` tells.

    What does not depend on the regions is prepared once.
    """
    m, d = candidates.count, candidates.dims
    rows = None
    if HAVE_NATIVE and m >= MANY:
        from firstorder.caching._fill_rows import Rows  # half a second for numba

        rows = Rows.of(candidates)

    def filled(region, visits, most):
        _check_regions(region, m, d)
        most = m if most is None else most
        if rows is None:
            return Strips(candidates, region).filled(visits, most)
        return rows.filled(region, visits, most)

    return filled


class Fit(NamedTuple):
    """Choices of about a wanted number of records, one for each order of insertion.

    Attributes:
        threshold: what was found, an array with one for each order.
        size: numbers of records that it gives, likewise.
        records: which candidates they are, (o, m).
        region: of each candidate, at that threshold, with a leading axis of orders.
        exact: whether the count is the wanted one, an array likewise. Where it is not, it was
            within the slack, or the count jumped over it, and the nearest that was met is given.
    """

    threshold: np.ndarray
    size: np.ndarray
    records: np.ndarray
    region: ValidityRegion
    exact: np.ndarray

    __repr__ = in_print

    def cache(
        self, candidates: Candidates, which: int, *, order: int = 1, fade: bool = False
    ) -> Cache:
        """The cache of one order of insertion."""
        clamp = jnp.asarray(self.region.clamp)[which]
        region = ValidityRegion(jnp.asarray(self.region.matrix[which]), clamp)
        return Cache.of(candidates, region, self.records[which], order=order, fade=fade)

    def lookup(
        self,
        candidates: Candidates,
        x: ArrayLike,
        tilt: ArrayLike | None = None,
        *,
        order: int = 1,
        fade: bool = False,
    ) -> Lookup:
        """Answers of the caches of all orders of insertion at places (p, d), at once: (o, p).

        Along a line normals are interpolated between the candidates' if `tilt` is left out.
        """
        x = as_float(x)
        check_shape("x", x, (x.shape[0] if x.ndim else 1, candidates.dims))
        if candidates.tilt is not None:
            if tilt is None and candidates.dims == 1:
                rising = jnp.argsort(candidates.position[:, 0])
                along, angle = (a[rising, 0] for a in (candidates.position, candidates.tilt))
                tilt = jnp.interp(x[:, 0], along, jnp.unwrap(angle))[:, None]
            tilt = jnp.broadcast_to(as_float(0.0 if tilt is None else tilt), x.shape)
        # Rounded up, so that few sizes are compiled.
        most = min(-(-int(self.size.max()) // 16) * 16, self.records.shape[1])
        rows = np.argsort(~self.records, axis=1, kind="stable")[:, :most]
        valid = jnp.asarray(np.take_along_axis(self.records, rows, axis=1))
        matrix = np.take_along_axis(np.asarray(self.region.matrix), rows[..., None, None], axis=1)
        tables = _tabled(candidates, rows, jnp.asarray(matrix, x.dtype), valid, order)
        return Lookup(*_answers_of_many(tables, x, tilt, order, fade))


def fit(
    candidates: Candidates,
    regions: Callable[[float], ValidityRegion],
    visits: Indices,
    target: int,
    *,
    low: float,
    high: float,
    slack: int | None = None,
    halvings: int = 40,
) -> Fit:
    """Records, `target` for each order of insertion, by halving the log of the threshold.

    Args:
        candidates: to choose from.
        regions: threshold to the region of each candidate, growing with it: a tolerance for
            Hessians, the accepted error for distances alone.
        visits: orders of insertion, (o, m) indices, as `random_orders` gives them.
        target: wanted number of records.
        low: threshold that gives more records than that.
        high: threshold that gives fewer.
        slack: records more or fewer that do as well: 0.2 % of the target if not given.
        halvings: how often the bracket is halved at most.

    Raises:
        ValueError: if `low` gives fewer records than wanted, or `high` more, in some order, or if
            there is no order, or one visits what is no candidate.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Candidates, circular_regions, fit, random_orders
        >>> line = Candidates.from_function(jnp.cos, jnp.linspace(0.0, 1.0, 65))
        >>> regions = lambda radius: circular_regions(jnp.full(65, radius), 1e-3, 2.0)
        >>> found = fit(line, regions, random_orders(65, 2), 8, low=0.01, high=1.0)
        >>> found.records.shape
        (2, 65)
    """
    filled, visits = _filler(candidates), np.atleast_2d(np.asarray(visits))
    if not len(visits):
        raise ValueError("Argument `visits` must hold at least one order, but is empty.")
    visits = np.stack([checked_visits(one, candidates.count) for one in visits])

    for name, count in (("target", target), ("halvings", halvings)):
        check_integer(name, count)
    for name, number in (("target", target), ("low", low), ("high", high)):
        check_positive(name, number)
    slack = target // 500 if slack is None else slack

    def make(threshold, visit):
        region = regions(threshold)
        return filled(region, visit, ENOUGH * target), region

    found = [_halved(make, visit, target, low, high, slack, halvings) for visit in visits]
    threshold, records, held = zip(*found, strict=True)
    size = np.array([r.sum() for r in records])
    matrix = np.stack([np.asarray(r.matrix) for r in held])
    clamp = np.stack([np.broadcast_to(np.asarray(r.clamp), matrix.shape[1:2]) for r in held])
    region = ValidityRegion(matrix, clamp)
    return Fit(np.array(threshold), size, np.stack(records), region, size == target)


def _halved(make, visit, target, low, high, slack, halvings):
    """One order of insertion: bracket in the log, by false position and halving in turn."""

    def tried(threshold):
        records, region = make(float(threshold), visit)
        return int(records.sum()), (float(threshold), records, region)

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
