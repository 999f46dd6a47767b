"""The first root ahead of a quadratic equation, against both roots by NumPy."""

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.numerics._quadratic import first_root, root_sum

RNG = np.random.default_rng(21)
COUNT = 2000
A, B, C = RNG.uniform(0.1, 3.0, COUNT), RNG.normal(size=COUNT), RNG.normal(size=COUNT)


def found(a, b, c):
    a, b, c = map(jnp.asarray, (a, b, c))
    square = b * b - a * c
    over, under, ahead = first_root(a, b, c, square, b * b)
    return np.where((square > 0.0) & ahead, over / under, np.inf)


def test_it_is_the_least_positive_root():
    true = np.full(COUNT, np.inf)
    for k in range(COUNT):
        roots = np.roots([A[k], 2.0 * B[k], C[k]])
        ahead = roots.real[(roots.imag == 0.0) & (roots.real > 0.0)]
        true[k] = ahead.min(initial=np.inf)
    assert 0.3 < np.mean(np.isfinite(true)) < 0.9
    np.testing.assert_allclose(found(A, B, C), true, rtol=1e-9)


def test_from_the_shape_itself_only_the_other_side_is_ahead():
    np.testing.assert_allclose(found(2.0, np.array([-3.0, 3.0]), 0.0), [3.0, np.inf])


def test_a_root_near_zero_keeps_its_digits():
    """`c / (2 b)` where the other root is 1e16 times as far."""
    np.testing.assert_allclose(found(1.0, -1e8, 1.0), 0.5e-8, rtol=1e-15)


def test_a_difference_that_is_not_positive_has_the_root_of_its_rounding():
    b, most, eps = jnp.array(-2.0), jnp.array(4.0), np.finfo(float).eps
    for square in (0.0, -1e-16):
        sum_of, _ = root_sum(b, jnp.array(square), most)
        np.testing.assert_allclose(sum_of - 2.0, 2.0 * np.sqrt(eps), rtol=1e-6)


def test_rays_that_start_nearest_to_the_middle_move_with_their_start():
    """A ray in a ball turns from coming nearer to going farther; rounding has either sign there.

    Its end is at `sqrt(1 - |o|^2)`, and as much nearer as the start is moved along the ray.
    """
    o, other = RNG.normal(size=(2, COUNT, 3))
    o *= 0.3 / np.linalg.norm(o, axis=1, keepdims=True)
    d = np.cross(o, other)
    d /= np.linalg.norm(d, axis=1, keepdims=True)

    def length(o, d):
        a, b, c = d @ d, o @ d, o @ o - 1.0
        over, under, _ = first_root(a, b, c, b * b - a * c, b * b)
        return over / under

    for differentiate in (jax.grad, jax.jacfwd):
        change = jax.jit(jax.vmap(differentiate(length)))(o, d)
        np.testing.assert_allclose(np.sum(change * d, 1), -1.0, rtol=1e-12)
        np.testing.assert_allclose(np.sum(change * o, 1), -0.09 / np.sqrt(0.91), rtol=1e-12)
