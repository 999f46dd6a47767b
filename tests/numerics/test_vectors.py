"""Vectors of space against NumPy's."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics import _vectors as vectors
from firstorder.numerics import norm

A, B = np.random.default_rng(1).normal(size=(2, 7, 3))
M = np.random.default_rng(2).normal(size=(7, 3, 3))


def test_products():
    np.testing.assert_allclose(vectors.cross(jnp.asarray(A), jnp.asarray(B)), np.cross(A, B))
    np.testing.assert_allclose(vectors.dot(jnp.asarray(A), jnp.asarray(B)), np.sum(A * B, -1))
    np.testing.assert_allclose(
        vectors.matvec(jnp.asarray(M), jnp.asarray(A)), np.einsum("nij,nj->ni", M, A)
    )
    np.testing.assert_allclose(vectors.inverse_3x3(jnp.asarray(M)), np.linalg.inv(M))
    np.testing.assert_allclose(vectors.inverse_and_det(jnp.asarray(M))[1], np.linalg.det(M))


def test_products_of_coordinates():
    a, b = vectors.apart(jnp.asarray(A)), vectors.apart(jnp.asarray(B))
    np.testing.assert_allclose(np.stack(vectors.cross_apart(a, b), -1), np.cross(A, B))
    np.testing.assert_allclose(vectors.dot_apart(a, b), np.sum(A * B, -1))


def test_an_inverse_has_two_derivatives():
    """Those of JAX's own inverse; none for a matrix whose columns lie on one line."""
    found, wanted = (
        [f(jnp.asarray(M[0])) for f in (jax.jacrev(inverse), jax.hessian(inverse))]
        for inverse in (vectors.inverse_3x3, jnp.linalg.inv)
    )
    for a, b in zip(found, wanted, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)
    assert np.all(jax.jacrev(vectors.inverse_3x3)(jnp.ones((3, 3))) == 0.0)


def test_lengths_have_derivatives_at_zero():
    zero = jnp.zeros(3)
    assert vectors.norm(zero) == 0.0
    assert np.all(vectors.unit(zero) == 0.0)
    assert np.all(jax.grad(vectors.norm)(zero) == 0.0)
    assert np.all(np.isfinite(jax.jacobian(vectors.unit)(zero)))


@pytest.mark.parametrize("n", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0, -0.8), (0, 0.6, 0.8)])
def test_frames_are_right_handed_and_smooth(n):
    n = jnp.asarray(n, float)
    found = np.asarray(vectors.orthonormal_frame(n))
    np.testing.assert_allclose(found.T @ found, np.eye(3), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(found), 1.0)
    np.testing.assert_allclose(found[:, 2], n)
    assert np.all(np.isfinite(jax.jacobian(vectors.orthonormal_frame)(n)))


@pytest.mark.parametrize("unit", [1e-200, 1.0, 1e200])
def test_a_frame_along_vectors_has_no_unit(unit):
    found = np.asarray(vectors.frame_along(jnp.asarray(unit * A)))
    np.testing.assert_allclose(found[..., 2], A / np.linalg.norm(A, axis=1, keepdims=True))
    np.testing.assert_allclose(
        np.swapaxes(found, 1, 2) @ found, [np.eye(3)] * 7, rtol=0.0, atol=1e-15
    )


def test_many_rays_from_one_point_in_the_frames_of_several_shapes():
    """As sums over rows, the CPU compiler of jaxlib 0.10 to 0.12 gets these wrong."""
    rng = np.random.default_rng(5)
    M, center, p = rng.normal(size=(3, 3, 3)), rng.normal(size=(3, 3)), rng.normal(size=3)

    @jax.jit
    def turned(M, center, p):
        origins = jnp.broadcast_to(p, (1000, 3))
        return vectors.matvec(M, origins[:, None] - center)

    truth = np.einsum("kij,kj->ki", M, p - center)
    np.testing.assert_allclose(turned(M, center, p), np.broadcast_to(truth, (1000, 3, 3)))


def test_the_length_of_nan_is_nan():
    assert np.isnan(norm(jnp.array([jnp.nan, 3.0, 4.0])))
