"""Roots of periodic functions, pairs of close ones among them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics import _roots as roots

TURN = 2.0 * np.pi


def wave(level):
    """cos(2 pi s) - level with its derivatives."""

    def f(s):
        c, q = jnp.cos(TURN * s), jnp.sin(TURN * s)
        return c - level, -TURN * q, -(TURN**2) * c

    return f


@pytest.mark.parametrize("level", [0.3, -0.9, 1.0 - 1e-10])
def test_both_roots_are_found(level):
    f = wave(level)
    low, high, found = roots.brackets(f, roots.even(8, jnp.float64))
    assert int(jnp.sum(found)) == 2
    s = [roots.bracketed_root(f, a, b) for a, b in zip(low[found], high[found], strict=True)]
    true = np.arccos(level) / TURN
    np.testing.assert_allclose(sorted(s), [true, 1.0 - true], rtol=0.0, atol=1e-9)


def test_none_where_there_is_none():
    assert not bool(jnp.any(roots.brackets(wave(1.0 + 1e-10), roots.even(8, jnp.float64))[2]))


def test_steps_carry_two_derivatives():
    def root(level):
        f = wave(level)
        return roots.newton(f, roots.newton(f, jnp.arccos(0.3) / TURN))

    def true(level):
        return jnp.arccos(level) / TURN

    for g in (jax.grad, lambda f: jax.grad(jax.grad(f))):
        np.testing.assert_allclose(g(root)(0.3), g(true)(0.3), rtol=1e-12)


def two_waves(level):
    """A wave with its half, extremum at s = 0.06: no cosine by which Newton converges faster."""

    def f(s):
        a = TURN * (s - 0.06)
        value = jnp.cos(a) + 0.4 * jnp.cos(2.0 * a + 1.2) + 0.8 * jnp.sin(1.2) * jnp.sin(a)
        first = -jnp.sin(a) - 0.8 * jnp.sin(2.0 * a + 1.2) + 0.8 * jnp.sin(1.2) * jnp.cos(a)
        second = -jnp.cos(a) - 1.6 * jnp.cos(2.0 * a + 1.2) - 0.8 * jnp.sin(1.2) * jnp.sin(a)
        return value - level, TURN * first, TURN**2 * second

    return f


@pytest.mark.parametrize("below", [1e-3, 1e-8, 1e-13])
def test_a_pair_is_found_however_close_it_is(below):
    top = 1.0 + 0.4 * np.cos(1.2)
    f = two_waves(top - below)
    low, high, found = roots.brackets(f, roots.even(16, jnp.float64))
    near = np.abs(np.asarray(high + low) / 2.0 - 0.06) < 0.04
    assert np.sum(np.asarray(found) & near) == 2
