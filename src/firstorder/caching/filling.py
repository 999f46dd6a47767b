"""Filling a cache: candidates are visited in some order, and those that nothing covers are kept.

The order decides which, so that a single fill is one draw of many: fill in several orders and
report mean and spread. The threshold that gives a wanted number of records is found by halving;
since the number falls in steps, and not always, it may be missed, and this is said.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder.caching.cache import Candidates, _blend
from firstorder.caching.split_circle import split_circle_error
from firstorder.errors import check_positive


@jax.jit
def fill(
    candidates: Candidates, radius: Float[Array, " m"], visits: Int[Array, " v"]
) -> Bool[Array, " m"]:
    """Selection of records from candidates that are visited in the given order.

    A candidate is covered, and left out, if a record made before reaches it: if its error, the
    distance over the record's radius plus the sine of the turn, is below 1. The time is that of
    comparing each candidate with each.

    Args:
        candidates: places, with all that a record would hold.
        radius: of each candidate, positive [m].
        visits: indices of candidates, in the order of the visits.

    Returns:
        True for records. Every visited candidate is a record or covered by one.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Candidates, fill
        >>> some = Candidates.along(jnp.cos, jnp.linspace(0.0, 1.0, 5))
        >>> fill(some, jnp.full(5, 0.3), jnp.array([2, 0, 1, 3, 4])).tolist()
        [True, False, True, False, True]
    """
    return _filled(candidates, radius, visits)


def _filled(candidates: Candidates, radius: Array, visits: Array) -> Array:
    x, n = candidates.x, candidates.n

    def visit(covered, i):
        new = ~covered[i]
        reached = split_circle_error(x - x[i], radius[i], n - n[i]) < 1.0
        return covered | (new & reached), new

    _, new = jax.lax.scan(visit, jnp.zeros(x.shape, bool), visits)
    return jnp.zeros(x.shape, bool).at[visits].max(new)


_fill_each = jax.jit(jax.vmap(_filled, in_axes=(None, 0, 0)))


def random_orders(count: int, orders: int, seed: int = 0) -> np.ndarray:
    """Random orders of insertion: an array (orders, count) of indices."""
    rng = np.random.default_rng(seed)
    return np.stack([rng.permutation(count) for _ in range(orders)])


class Fit(NamedTuple):
    """Caches of a wanted number of records, one for each order of insertion.

    Attributes:
        threshold: what was found, one for each order.
        size: records that it gives.
        records: which candidates they are.
        radius: of each candidate, at that threshold [m].
        clamp: what acted on it.
        exact: whether the count is the wanted one; where it is not, the count jumped over it, and
            the nearest that was met is given.
    """

    threshold: Float[Array, " o"]
    size: Int[Array, " o"]
    records: Bool[Array, "o m"]
    radius: Float[Array, "o m"]
    clamp: Int[Array, "o m"]
    exact: Bool[Array, " o"]


def fit(
    candidates: Candidates,
    radii: Callable[[Array], tuple[Array, Array]],
    visits: ArrayLike,
    target: int,
    *,
    low: float,
    high: float,
    halvings: int = 40,
) -> Fit:
    """Caches of `target` records, one for each order of insertion, by halving the log threshold.

    Args:
        candidates: to choose from.
        radii: thresholds of shape (o, 1) to radii of shape (o, m) with their clamps, growing with
            the threshold: a tolerance for Hessians, the accepted error for the split circle.
        visits: orders of insertion, (o, m) indices.
        target: wanted number of records.
        low: threshold that gives more records than that.
        high: threshold that gives fewer.
        halvings: how often the bracket is halved at most.

    Raises:
        ValueError: if `low` gives fewer records than wanted, or `high` more, in some order.
    """
    for name, number in (("target", target), ("low", low), ("high", high)):
        check_positive(name, number)
    visits = jnp.asarray(visits)
    o = visits.shape[0]

    def count(threshold):
        found = radii(jnp.asarray(threshold)[:, None])
        records = _fill_each(candidates, jnp.broadcast_to(found[0], visits.shape), visits)
        return np.asarray(jnp.sum(records, axis=1)), records, found

    a, b = np.full(o, float(low)), np.full(o, float(high))
    for name, ends, wrong in (("low", a, np.less), ("high", b, np.greater)):
        there = count(ends)[0]
        if np.any(wrong(there, target)):
            raise ValueError(
                f"Argument `{name}` must be a threshold on its side of {target} records, "
                f"but gives {int(there[np.argmax(wrong(there, target))])}."
            )
    best, miss = a.copy(), np.full(o, np.inf)
    for _ in range(halvings):
        m = np.sqrt(a * b)
        got = count(m)[0]
        nearer = np.abs(got - target) < miss
        best, miss = np.where(nearer, m, best), np.where(nearer, np.abs(got - target), miss)
        if not miss.any():
            break
        many = got > target
        a, b = np.where(many, m, a), np.where(many, b, m)
    got, records, (radius, clamp) = count(best)
    shape = visits.shape
    return Fit(
        jnp.asarray(best),
        jnp.asarray(got),
        records,
        jnp.broadcast_to(radius, shape),
        jnp.broadcast_to(clamp, shape),
        jnp.asarray(got == target),
    )


def interpolate(
    candidates: Candidates, fitted: Fit, x: ArrayLike, *, order: int = 1, fade: bool = False
) -> tuple[Float[Array, "o p"], Bool[Array, "o p"]]:
    """Irradiance at places x from the cache of every order of insertion, and which are covered.

    What `Cache` answers, for many caches over the same candidates at once.
    """
    records = np.asarray(fitted.records)
    # Rounded up, so that few sizes are compiled.
    most = min(-(-int(records.sum(axis=1).max()) // 16) * 16, records.shape[1])
    rows = np.argsort(~records, axis=1, kind="stable")[:, :most]
    valid = np.take_along_axis(records, rows, axis=1)
    radius = jnp.take_along_axis(fitted.radius, jnp.asarray(rows), axis=1)
    return _blend_each(candidates, jnp.asarray(rows), valid, radius, jnp.asarray(x), order, fade)


@eqx.filter_jit
def _blend_each(candidates, rows, valid, radius, x, order: int, fade: bool):
    def one(given):
        rows, valid, radius = given
        records = (candidates.x[rows], candidates.n[rows], candidates.derivatives[rows], radius)
        normal = jnp.interp(x, candidates.x, candidates.n)
        return jax.vmap(lambda x, n: _blend(x, n, records, valid, order, fade))(x, normal)

    return jax.lax.map(one, (rows, valid, radius))
