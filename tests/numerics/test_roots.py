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
    low, high, found = roots.brackets(f, 8, jnp.float64)
    assert int(jnp.sum(found)) == 2
    s = [roots.bracketed_root(f, a, b) for a, b in zip(low[found], high[found], strict=True)]
    true = np.arccos(level) / TURN
    np.testing.assert_allclose(sorted(s), [true, 1.0 - true], atol=1e-9)


def test_none_where_there_is_none():
    assert not bool(jnp.any(roots.brackets(wave(1.0 + 1e-10), 8, jnp.float64)[2]))


def test_steps_carry_two_derivatives():
    def root(level):
        f = wave(level)
        return roots.newton(f, roots.newton(f, jnp.arccos(0.3) / TURN))

    def true(level):
        return jnp.arccos(level) / TURN

    for g in (jax.grad, lambda f: jax.grad(jax.grad(f))):
        np.testing.assert_allclose(g(root)(0.3), g(true)(0.3), rtol=1e-12)
