import jax
import jax.numpy as jnp
import mpmath
import pytest

from firstorder.numerics._planar import cross_2d, dot_2d, left, sine_and_cosine


def test_vectors_of_the_plane():
    a, b = jnp.array([2.0, 1.0]), jnp.array([-1.0, 3.0])
    assert cross_2d(a, b) == 7.0
    assert dot_2d(a, b) == 1.0
    assert left(a).tolist() == [-1.0, 2.0]
    assert cross_2d(a, left(a)) == dot_2d(a, a)


@pytest.mark.parametrize("slope", [1e-6, 0.3, 1.0, 50.0, 1e6])
def test_sine_and_cosine_keep_their_digits_in_every_derivative(slope):
    # Of a vector (x^2, slope): near the axes one of the two is near one, and moves very little.
    def both(x):
        return sine_and_cosine(x * x, jnp.asarray(slope))

    def exact(which):
        return lambda x: (x * x, mpmath.mpf(slope))[which] / mpmath.sqrt(x**4 + slope**2)

    at = jnp.asarray(0.7)
    found = [both(at), jax.jacfwd(both)(at), jax.jacfwd(jax.jacrev(both))(at)]
    for order, pair in enumerate(found):
        for which, number in enumerate(pair):
            with mpmath.workdps(60):
                truth = float(mpmath.diff(exact(which), mpmath.mpf(float(at)), order))
            assert abs(float(number) / truth - 1.0) < 2e-14
