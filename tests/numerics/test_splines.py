"""The cubic B-spline, as four boxes folded with each other."""

import jax
import numpy as np
import pytest

from firstorder.numerics._splines import cubic_b_spline


@pytest.mark.parametrize("u", [-2.5, -1.9, -1.0, -0.3, 0.0, 0.2, 0.99, 1.01, 1.7, 2.0, 3.0])
def test_it_is_a_sum_of_truncated_cubes_and_so_are_its_derivatives(u):
    """`sum over k of (-1)^k C(4, k) (u + 2 - k)_+^3 / 6`."""
    weights, cut = np.array([1, -4, 6, -4, 1]), np.maximum(u + 2.0 - np.arange(5), 0.0)
    true = [weights @ cut**3 / 6.0, weights @ cut**2 / 2.0, weights @ cut]
    np.testing.assert_allclose(cubic_b_spline(u), true, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("u", [-2.0, -1.0, -0.3, 0.0, 0.3, 1.0, 2.0])
def test_the_derivatives_of_each_are_the_next_at_nodes_too(u):
    for order in (0, 1):
        for differentiate in (jax.jacfwd, jax.grad):
            slope = differentiate(lambda u, k=order: cubic_b_spline(u)[k])(u)
            np.testing.assert_allclose(slope, cubic_b_spline(u)[order + 1], rtol=0.0, atol=1e-14)
    bend = jax.hessian(lambda u: cubic_b_spline(u)[0])(u)
    np.testing.assert_allclose(bend, cubic_b_spline(u)[2], rtol=0.0, atol=1e-14)


def test_shifted_ones_add_to_one():
    b, d, bend = jax.vmap(cubic_b_spline)(0.37 + np.arange(-3.0, 3.0))
    np.testing.assert_allclose(
        [b.sum(), d.sum(), bend.sum()], [1.0, 0.0, 0.0], rtol=0.0, atol=1e-14
    )
