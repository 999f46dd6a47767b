import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.numerics._quadrature import (
    composite_gauss_legendre,
    gauss_legendre,
    inverse_sqrt_panels,
    periodic_trapezoid,
    sorted_breaks,
)

END = st.floats(-2.0, 2.0)


@jax.jit
def step_integral(lower, upper, a, b):
    """int of a stair that climbs at a and at b."""
    t, w = composite_gauss_legendre(lower, upper, [a, b], 3)
    return jnp.sum(w * ((t > a) * 1.0 + (t > b) * 2.0))


def truth(lower, upper, a, b):
    def stair(x):
        return max(x - a, 0.0) + 2.0 * max(x - b, 0.0)

    return stair(upper) - stair(lower)


@given(END, END, END, END)
def test_a_stair_is_integrated_exactly_wherever_its_steps_and_the_ends_are(lower, upper, a, b):
    args = [jnp.asarray(v) for v in (lower, upper, a, b)]
    np.testing.assert_allclose(
        step_integral(*args), truth(lower, upper, a, b), rtol=0.0, atol=1e-13
    )


@given(st.integers(1, 12))
def test_gauss_legendre_is_exact_to_twice_its_nodes(n):
    t, w = gauss_legendre(n)
    for k in range(0, 2 * n, 2):
        np.testing.assert_allclose(np.sum(w * t**k), 2.0 / (k + 1), rtol=1e-13)


def test_breaks_carry_their_derivatives():
    def integral(a):
        t, w = composite_gauss_legendre(jnp.array(-1.0), jnp.array(2.0), [a], 4)
        return jnp.sum(w * jnp.where(t > a, t**2, 0.0))

    slopes = jax.grad(integral)(0.5), jax.grad(jax.grad(integral))(0.5)
    np.testing.assert_allclose(slopes, [-(0.5**2), -2.0 * 0.5], rtol=1e-13)


def test_an_empty_interval_keeps_the_derivative_of_its_ends():
    def integral(upper):
        t, w = composite_gauss_legendre(jnp.array(0.3), upper, [jnp.array(0.3), jnp.array(0.9)], 4)
        return jnp.sum(w * jnp.cos(t))

    assert integral(jnp.array(0.3)) == 0.0
    np.testing.assert_allclose(jax.grad(integral)(0.3), np.cos(0.3), rtol=1e-13)


def test_cuts_come_in_order_and_say_where_they_stood():
    ends, order = sorted_breaks(jnp.array(1.0), jnp.array(-1.0), [jnp.array(-0.5), jnp.array(3.0)])
    np.testing.assert_array_equal(ends, [1.0, 1.0, -0.5, -1.0])
    np.testing.assert_array_equal(order, [0, 2, 1, 3])


def test_a_trapezoid_on_the_circle_is_exact_below_its_own_frequency():
    t, w = periodic_trapezoid(2.0 * np.pi, 8)
    np.testing.assert_allclose(np.sum(w * np.cos(3.0 * t) ** 2), np.pi, rtol=1e-14)


def test_inverse_square_roots_at_the_ends_cost_nothing():
    """16 nodes: s is of degree one at either end, and the integrand smooth in it."""
    base, lag, weight = inverse_sqrt_panels(jnp.array([0.2, 1.0, 1.0, 3.0]), 16)
    t = base + lag
    ends = jnp.array([[0.2], [1.0], [1.0]]), jnp.array([[1.0], [1.0], [3.0]])
    near = jnp.where(weight > 0, (t - ends[0]) * (ends[1] - t), 1.0)
    found = jnp.sum(weight * jnp.cos(t) / jnp.sqrt(near), 1)
    # int_a^b cos(t) / sqrt((t - a) (b - t)) dt = pi cos(m) J_0(h), J_0 by its own integral
    turn = np.pi * (np.arange(64) + 0.5) / 64
    truth = [np.pi * np.cos(m) * np.mean(np.cos(h * np.cos(turn))) for m, h in ((0.6, 0.4), (2, 1))]
    np.testing.assert_allclose(found[jnp.array([0, 2])], truth, rtol=1e-12)
    assert found[1] == 0.0


def test_the_way_to_the_end_is_exact_however_short():
    base, lag, _ = inverse_sqrt_panels(jnp.array([1e6, 1e6 + 1.0]), 64)
    s = 0.5 * np.pi * (1.0 + gauss_legendre(64)[0])
    np.testing.assert_allclose(lag[0, :32], np.sin(0.5 * s[:32]) ** 2, rtol=1e-12)
    np.testing.assert_allclose(lag[0, 32:], -(np.cos(0.5 * s[32:]) ** 2), rtol=1e-12)
    assert set(np.asarray(base[0])) == {1e6, 1e6 + 1.0}


def test_a_rule_of_no_nodes_is_refused():
    with pytest.raises(ValueError, match="Argument `nodes` must be positive, but is 0"):
        gauss_legendre(0)


def test_a_rule_that_is_kept_cannot_be_changed_by_who_has_it():
    t, w = gauss_legendre(5)
    for a in (t, w):
        with pytest.raises(ValueError, match="read-only"):
            a += 1.0
