import jax.numpy as jnp

from firstorder.numerics.planar import cross, dot, left


def test_vectors_of_the_plane():
    a, b = jnp.array([2.0, 1.0]), jnp.array([-1.0, 3.0])
    assert cross(a, b) == 7.0
    assert dot(a, b) == 1.0
    assert left(a).tolist() == [-1.0, 2.0]
    assert cross(a, left(a)) == dot(a, a)
