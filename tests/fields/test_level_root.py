"""Roots of levels and their derivatives, against closed forms; parameters move them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.fields._level_root import root_between

# Level of (t, p), ends, the root of p: all of one zero between the ends.
LEVELS = {
    "a line": (lambda t, p: p - 2.0 * t, -1.0, 3.0, lambda p: p / 2.0),
    "a falling line": (lambda t, p: 2.0 * t - p, -1.0, 3.0, lambda p: p / 2.0),
    "a square": (lambda t, p: t**2 - p, 0.0, 5.0, np.sqrt),
    "a bent one": (lambda t, p: jnp.exp(t) - p, -2.0, 4.0, np.log),
    "a pole at its end": (lambda t, p: jnp.tan(t) - p, -0.5 * np.pi, 0.5 * np.pi, np.arctan),
    "a kink": (lambda t, p: jnp.abs(t - 3.0) - p, 0.0, 3.0, lambda p: 3.0 - p),
}


def solved(level, lower, upper):
    lower, upper = jnp.asarray(lower), jnp.asarray(upper)
    return lambda p: root_between(lambda t: level(t, p), lower, upper)


@pytest.mark.parametrize("name", LEVELS)
def test_roots_and_two_derivatives_are_those_of_the_closed_form(name):
    level, lower, upper, true = LEVELS[name]
    root = solved(level, lower, upper)

    @jax.jit
    def all_of_it(p):
        def alone(p):
            return root(p)[0]

        return root(p), jax.grad(alone)(p), jax.grad(jax.grad(alone))(p)

    p, h = 1.7, 1e-4
    (t, met), first, second = all_of_it(jnp.asarray(p))
    assert met
    assert t == pytest.approx(true(p), rel=1e-12)
    assert first == pytest.approx((true(p + h) - true(p - h)) / (2 * h), rel=1e-6)
    bend = (true(p + h) - 2.0 * true(p) + true(p - h)) / h**2
    assert second == pytest.approx(bend, rel=1e-5, abs=1e-6)


def test_a_level_without_a_root_gives_the_upper_end():
    for level in (lambda t, p: t**2 + p, lambda t, p: -(t**2) - p, lambda t, p: t - p):
        found, met = solved(level, 2.0, 7.0)(jnp.array(0.5))
        assert not met
        assert found == 7.0


def test_a_root_at_an_end_is_beside_the_interval():
    """The end itself, which may be a pole, is not looked at; what lies a little within is."""
    for p, there in ((0.0, False), (1e-12, True), (3.0 - 1e-12, True), (3.0, False)):
        assert bool(solved(lambda t, p: t - p, 0.0, 3.0)(jnp.array(p))[1]) == there


@pytest.mark.parametrize("end", [0.0, 1000.0])
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("upper", [False, True])
def test_an_end_at_which_a_level_is_no_number_is_not_looked_at(end, upper, backwards):
    """`sin(s) / s` of the distance s from the end is a half at 1.8955."""
    lower, higher = (end - 3.0, end) if upper else (end, end + 3.0)
    lower, higher = (higher, lower) if backwards else (lower, higher)
    level = lambda t: jnp.sin(t - end) / (t - end) - 0.5  # noqa: E731
    t, met = root_between(level, jnp.array(lower), jnp.array(higher))
    assert met
    assert abs(t - end) == pytest.approx(1.895494267, rel=1e-8)


def test_a_pole_at_the_end_of_a_short_interval_in_single_precision():
    """There a quarter of a turn is rounded to beyond the pole, where the tangent is negative."""
    with jax.enable_x64(False):
        lower, upper = jnp.float32(1.5), jnp.float32(0.5 * np.pi)
        assert jnp.tan(upper) < 0.0
        t, met = root_between(lambda t: jnp.tan(t) - 20.0, lower, upper)
        assert met
        np.testing.assert_allclose(t, np.arctan(20.0), rtol=1e-6)


def test_ends_carry_no_derivative_of_a_root_but_of_none():
    def of(upper, p):
        return root_between(lambda t: t - p, jnp.array(0.0), upper)[0]

    slope = jax.jit(jax.grad(of))
    assert slope(jnp.array(5.0), jnp.array(2.0)) == 0.0
    assert slope(jnp.array(5.0), jnp.array(9.0)) == 1.0


def test_a_root_in_single_precision():
    with jax.enable_x64(False):
        t, met = root_between(lambda t: t**3 - 2.0, jnp.float32(0.0), jnp.float32(4.0))
        assert met
        assert t.dtype == np.float32
        np.testing.assert_allclose(t, 2.0 ** (1.0 / 3.0), rtol=3e-7)


def test_a_level_that_is_flat_at_its_root_or_jumps_there_has_it():
    """Newton finds no slope where a level jumps: its root is that of the bisection."""
    for level, error in ((lambda t: (t - 1.3) ** 3, 1e-7), (lambda t: jnp.sign(t - 1.3), 1e-7)):
        t, met = root_between(level, jnp.array(0.0), jnp.array(2.0))
        assert met
        assert t == pytest.approx(1.3, abs=error)


def test_the_root_of_a_level_that_jumps_and_rises_is_where_it_jumps():
    found, met = root_between(
        lambda t: jnp.where(t < 0.3, t - 1.0, t + 1.0), *jnp.array([0.0, 1.0])
    )
    np.testing.assert_allclose(found, 0.3, rtol=0.0, atol=1e-7)
    assert bool(met)


@pytest.mark.parametrize("level", [lambda t, p: jnp.sign(t - p), lambda t, p: 1.0 + 0.0 * t * p])
def test_a_root_without_a_slope_and_none_at_all_move_by_nothing(level):
    root = solved(level, 0.0, 2.0)
    for way in (jax.grad, jax.jacfwd):
        assert jax.jit(way(lambda p: root(p)[0]))(jnp.array(0.7)) == 0.0
