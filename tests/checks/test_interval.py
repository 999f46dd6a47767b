import operator
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from mpmath import cos, mpf, sin, workdps

from firstorder.checks import _interval as intervals
from firstorder.checks._interval import Interval, anything, choose, exact, total, turned

COUNT = 300
OPERATIONS = [operator.add, operator.sub, operator.mul, operator.truediv]


def wide(rng, dtype, count=COUNT):
    """Intervals of all sizes, some of them around zero and some of one number."""
    a = rng.normal(size=count) * 10.0 ** rng.integers(-6, 7, count)
    b = a * (1.0 + rng.choice([0.0, 1e-12, 1e-3, -3.0], count))
    a, b = (x.astype(dtype) for x in (a, b))
    return Interval(jnp.minimum(a, b), jnp.maximum(a, b))


def fractions(x):
    return [Fraction(float(v)) for v in x]


def holds(found, true):
    return all(
        lo <= t <= hi
        for lo, t, hi in zip(fractions(found.lo), true, fractions(found.hi), strict=True)
    )


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("operation", OPERATIONS)
def test_what_comes_of_any_two_numbers_of_two_intervals_is_held(operation, dtype):
    rng = np.random.default_rng(0)
    a, b = wide(rng, dtype), wide(rng, dtype)
    through_zero = (b.lo <= 0.0) & (b.hi >= 0.0)
    if operation is operator.truediv:
        a, b = a[~through_zero], b[~through_zero]
    found = jax.jit(operation)(a, b)
    for x in (a.lo, a.hi):
        for y in (b.lo, b.hi):
            assert holds(found, map(operation, fractions(x), fractions(y)))


@pytest.mark.parametrize("operation", OPERATIONS)
def test_without_rounding_outwards_it_is_not(operation, monkeypatch):
    monkeypatch.setattr(intervals, "outwards", Interval)
    a, b = (exact(jnp.asarray(np.random.default_rng(k).normal(size=COUNT))) for k in range(2))
    assert not holds(operation(a, b), map(operation, fractions(a.lo), fractions(b.lo)))


def test_an_exact_zero_stays_one():
    a = exact(jnp.array([0.5, -0.25]))
    assert (a - a).lo.tolist() == (a - a).hi.tolist() == [0.0, 0.0]
    up = turned(exact(jnp.zeros(1)))
    assert up.lo.tolist() == up.hi.tolist() == [[-0.0, 1.0]]


def test_a_quotient_by_what_may_be_zero_may_be_anything():
    found = exact(jnp.array(1.0)) / Interval(jnp.array(-1e-9), jnp.array(1.0))
    assert (found.lo.item(), found.hi.item()) == (-np.inf, np.inf)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_roots_and_squares_are_held(dtype):
    a = wide(np.random.default_rng(1), dtype)
    squares, roots = jax.jit(lambda a: (a.square(), a.square().sqrt()))(a)
    for x in (a.lo, a.hi):
        assert holds(squares, [v * v for v in fractions(x)])
        assert holds(roots, [abs(v) for v in fractions(x)])
    assert jnp.all(roots.lo >= 0.0)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_directions_are_held_within_the_stated_error_of_sine_and_cosine(dtype):
    rng = np.random.default_rng(2)
    near = rng.integers(-6, 7, COUNT) * 0.5 * np.pi + rng.choice([0.0, 1e-9, 1e-4], COUNT)
    angle = jnp.asarray(np.concatenate([near, rng.uniform(-20.0, 20.0, COUNT)]).astype(dtype))
    found = jax.jit(turned)(exact(angle))
    with workdps(40):
        for k, of in ((0, lambda a: -sin(a)), (1, cos)):
            true = [of(mpf(float(a))) for a in angle]
            ends = zip(found.lo[:, k], true, found.hi[:, k], strict=True)
            assert all(mpf(float(lo)) <= t <= mpf(float(hi)) for lo, t, hi in ends)


def test_a_sum_is_held_in_whatever_order_it_is_added():
    x = jnp.asarray(np.random.default_rng(3).normal(size=4000) * 1e3)
    assert holds(jax.tree.map(lambda end: end[None], total(exact(x))), [sum(fractions(x))])


def test_nothing_is_sure_of_what_is_not_a_number():
    unknown = exact(jnp.array(jnp.nan))
    assert not unknown.positive
    assert not unknown.negative
    assert choose(jnp.array(True), anything(jnp.zeros(())), unknown).hi.item() == np.inf
