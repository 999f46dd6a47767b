"""Derivatives in one pass, against those of JAX one by one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics._derivatives import twice


@pytest.mark.parametrize(
    "f",
    [
        lambda u: jnp.sin(u[0]) * u[1] ** 3,
        lambda u: jnp.stack([u[0] * u[1], jnp.exp(u[1]), u[0] ** 2 + u[1]]),
    ],
    ids=["a number", "a vector"],
)
def test_all_three_are_those_of_jax(f):
    u = jnp.array([0.7, -0.3])
    value, first, second = jax.jit(lambda u: twice(f, u))(u)
    np.testing.assert_allclose(value, f(u), rtol=1e-15)
    np.testing.assert_allclose(first, jax.jacrev(f)(u), rtol=1e-14)
    np.testing.assert_allclose(second, jax.jacrev(jax.jacrev(f))(u), rtol=1e-13, atol=1e-15)


def test_the_function_is_traced_once():
    traced = []
    jax.make_jaxpr(lambda u: twice(lambda u: traced.append(u) or u[0] * u[1], u))(jnp.ones(2))
    assert len(traced) == 1
