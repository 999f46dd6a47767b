import jax.numpy as jnp

from firstorder.numerics._planar import cross_2d, dot_2d, left


def test_vectors_of_the_plane():
    a, b = jnp.array([2.0, 1.0]), jnp.array([-1.0, 3.0])
    assert cross_2d(a, b) == 7.0
    assert dot_2d(a, b) == 1.0
    assert left(a).tolist() == [-1.0, 2.0]
    assert cross_2d(a, left(a)) == dot_2d(a, a)
