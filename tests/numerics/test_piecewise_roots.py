"""Roots of functions that are polynomials on pieces of their period."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import special

from firstorder.numerics import _piecewise_roots as roots

PIECES = 8


def test_a_polynomial_with_its_derivatives_is_that_of_numpy():
    c, u = np.array([0.3, -1.2, 0.5, 2.0, -0.7]), np.array([-1.0, 0.2, 0.9])
    found = roots.taylor(jnp.broadcast_to(c[:, None], (5, 3)), jnp.asarray(u), 4)
    for k, a in enumerate(found):
        true = np.polynomial.Polynomial(c).deriv(k)(u) if k else np.polynomial.Polynomial(c)(u)
        np.testing.assert_allclose(a, true, rtol=1e-13)


@pytest.mark.parametrize("eps", [2.0**-52, 2.0**-23])
@pytest.mark.parametrize("reach", [0.1, 0.8, 1.0, 3.0])
def test_the_degree_is_the_least_that_leaves_rounding(reach, eps):
    """By the remainder of the exponential series, which its first term gives."""
    n = roots.degree(reach, eps)
    assert reach ** (n + 1) / special.factorial(n + 1) <= 0.25 * eps
    assert reach**n / special.factorial(n) > 0.25 * eps


def pieces_of(level, phase, second=0.0):
    """cos(a) + second * sin(2 a)^3 - level with a = 2 pi s - phase, by Taylor series.

    The third power leaves place and height of the highest point, about which it is not even.
    """
    waves = [(1.0, 1, 0.0), (0.75 * second, 2, -0.5 * np.pi), (-0.25 * second, 6, -0.5 * np.pi)]
    m, turn = np.arange(40)[:, None], np.pi / PIECES
    middle = 2.0 * np.pi * (np.arange(PIECES) + 0.5) / PIECES - phase
    rows, value, slope = np.zeros((40, PIECES)), -level, 0.0
    for size, k, shift in waves:
        at, step = k * middle + shift, k * turn
        rows += size * np.cos(at + 0.5 * np.pi * m) * step**m / special.factorial(m)
        value = value + size * np.cos(at - step)
        slope = slope - size * step * np.sin(at - step)
    rows[0] -= level
    return jnp.asarray(rows), (jnp.asarray(value), jnp.asarray(slope))


def f(rows, u):
    return roots.taylor(rows, u, 3)


@pytest.mark.parametrize("level", [0.3, -0.9, 1.0 - 1e-4, 1.0 - 1e-10, -1.0 + 1e-13])
@pytest.mark.parametrize("phase", [0.0, 0.7, 2.9])
def test_both_roots_are_between_their_ends_however_close_they_are(level, phase):
    rows, ends = pieces_of(level, phase)
    found = roots.brackets(f, ends, lambda piece: rows[:, piece], 2)
    a, b = (np.asarray(found.piece + 0.5 + 0.5 * u) / PIECES for u in (found.low, found.high))
    there = np.asarray(found.found)
    true = np.mod((phase + np.arccos(level) * np.array([1.0, -1.0])) / (2.0 * np.pi), 1.0)
    assert there.sum() == 2
    slack = 1e-15
    for s in true:
        assert np.sum((a[there] - slack <= s) & (s <= b[there] + slack)) == 1


@pytest.mark.parametrize("below", [1e-6, 1e-10, 1e-13])
def test_a_pair_is_found_where_the_function_is_not_even_about_its_extremum(below):
    rows, ends = pieces_of(1.0 - below, 0.9, second=0.03)
    found = roots.brackets(f, ends, lambda piece: rows[:, piece], 2)
    top = 0.9 / (2.0 * np.pi)
    s = np.asarray(found.piece + 0.5 + 0.25 * (found.low + found.high)) / PIECES
    assert np.sum(np.asarray(found.found) & (np.abs(s - top) < 0.1)) == 2


def test_none_where_there_is_none():
    rows, ends = pieces_of(1.0 + 1e-10, 0.7)
    assert not bool(jnp.any(roots.brackets(f, ends, lambda piece: rows[:, piece], 2).found))
