"""Products written out, against NumPy's."""

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.numerics._small_matrices import (
    congruence,
    identity_with,
    inner,
    product,
    quadratic,
)

RNG = np.random.default_rng(2)
P, H, M = (jnp.asarray(RNG.normal(size=s)) for s in [(2, 3), (3, 3), (3, 2)])
h = jnp.asarray(RNG.normal(size=3))


def test_products_are_those_of_matrices():
    np.testing.assert_allclose(inner(h, H[0]), h @ H[0])
    np.testing.assert_allclose(product(P, h), P @ h)
    np.testing.assert_allclose(quadratic(H, h), h @ H @ h)
    np.testing.assert_allclose(congruence(M, H), M.T @ H @ M)


def test_an_identity_has_other_entries_in_some_places():
    true = np.array([[1.0, 5.0, 0.0], [0.0, 1.0, 0.0], [7.0, 0.0, 1.0]])
    entries = np.array([5.0, 7.0])
    for found in (
        identity_with(3, [0, 2], [1, 0], entries),
        jax.jit(lambda e: identity_with(3, [0, 2], [1, 0], e))(entries),
    ):
        np.testing.assert_array_equal(found, true)
    assert identity_with(2, [0], [1], np.float32([0.5])).dtype == np.float32
