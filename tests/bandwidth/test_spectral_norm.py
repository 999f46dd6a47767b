"""The larger singular value, against NumPy's, its gradient, and the range of its numbers."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.bandwidth._spectral_norm import _length, reach, spectral_norm

RNG = np.random.default_rng(0)
J = RNG.normal(size=(7, 5, 3, 2))
slope = jax.jit(jax.grad(spectral_norm))


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_it_is_numpys(rows):
    true = np.linalg.svd(J[..., :rows, :], compute_uv=False)[..., 0]
    np.testing.assert_allclose(spectral_norm(jnp.asarray(J[..., :rows, :])), true, rtol=1e-12)


def test_its_gradient_is_that_of_the_largest_singular_vectors():
    for one in J[0]:
        u, _, v = np.linalg.svd(one)
        np.testing.assert_allclose(
            slope(jnp.asarray(one)), np.outer(u[:, 0], v[0]), rtol=0.0, atol=1e-12
        )


@pytest.mark.parametrize("size", [1e-30, 1e-12, 1e12, 1e30])
def test_single_precision_holds_its_square_of_squares(size):
    one = np.float32(size) * J[0, 0].astype(np.float32)
    true = np.linalg.svd(J[0, 0], compute_uv=False)[0] * size
    with jax.enable_x64(False):
        found = spectral_norm(jnp.asarray(one))
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, true, rtol=1e-5)


def test_zeros_have_gradient_zero_and_equal_values_a_finite_one():
    zero = jnp.zeros((3, 2))
    assert spectral_norm(zero) == 0.0
    np.testing.assert_array_equal(slope(zero), 0.0)
    both = jnp.array([[2.0, 0.0], [0.0, 2.0], [0.0, 0.0]])
    assert spectral_norm(both) == pytest.approx(2.0)
    # Where both are equal, the mean of their gradients.
    np.testing.assert_allclose(slope(both), both / 4.0, rtol=0.0, atol=1e-12)


def test_what_is_not_finite_is_not_hidden():
    bad = jnp.array([[jnp.nan, 0.0], [0.0, 1.0]])
    assert jnp.isnan(spectral_norm(bad))
    assert not jnp.isfinite(spectral_norm(jnp.array([[jnp.inf, 0.0], [0.0, 1.0]])))


def test_lengths_are_euclids_with_gradient_zero_at_zero():
    np.testing.assert_allclose(_length(jnp.array([[3.0, 4.0], [0.0, -2.0]])), [5.0, 2.0])
    np.testing.assert_array_equal(jax.grad(_length)(jnp.zeros(2)), [0.0, 0.0])
    np.testing.assert_allclose(jax.grad(_length)(jnp.array([3.0, 4.0])), [0.6, 0.8])


def test_reach_is_a_product_and_nothing_of_an_endless_spectrum_that_does_not_turn():
    turn = jnp.array([0.0, 2.0, 3.0, jnp.nan])
    np.testing.assert_array_equal(reach(turn, 4.0), [0.0, 8.0, 12.0, np.nan])
    np.testing.assert_array_equal(reach(turn, np.inf), [0.0, np.inf, np.inf, np.nan])
    each = jnp.array([1.0, np.inf, 5.0, 1.0])
    np.testing.assert_array_equal(reach(turn, each), [0.0, np.inf, 15.0, np.nan])
    assert jax.grad(reach)(jnp.array(0.0), 4.0) == 4.0
    assert jax.grad(reach, 1)(jnp.array(3.0), 4.0) == 3.0
