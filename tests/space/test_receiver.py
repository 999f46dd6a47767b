"""Receivers on surfaces: a walk on a ball of radius R is a walk on that ball."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from firstorder.space import Receiver, receiver

R = 1.7
AT = receiver((0.0, 0.0, 0.0))


def on_ball():
    n = np.array([0.3, -0.4, 0.6])
    n /= np.linalg.norm(n)
    return receiver(R * n, n, S=-np.eye(2) / R), n


def test_a_walk_on_a_ball_to_second_order():
    at, n = on_ball()

    def true(x):
        """Along the great circle."""
        way = at.axes[:, :2] @ x
        s = jnp.sqrt(jnp.sum(x**2) + 1e-30)
        return R * (jnp.cos(s / R) * n + jnp.sin(s / R) * way / s)

    x = jnp.array([1e-3, -2e-3])
    moved = at.moved(x)
    np.testing.assert_allclose(moved.position, true(x), rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(moved.normal, true(x) / R, rtol=0.0, atol=1e-8)
    second = jax.hessian(lambda x: at.moved(x).position)(jnp.zeros(2))
    np.testing.assert_allclose(
        second, -np.einsum("k,ij->kij", n, np.eye(2)) / R, rtol=0.0, atol=1e-14
    )
    slope = jax.jacobian(lambda x: at.moved(x).normal)(jnp.zeros(2))
    np.testing.assert_allclose(slope, at.axes[:, :2] / R, rtol=0.0, atol=1e-14)
    bend = jax.hessian(lambda x: at.moved(x).normal)(jnp.zeros(2))
    np.testing.assert_allclose(
        bend, -np.einsum("k,ij->kij", n, np.eye(2)) / R**2, rtol=0.0, atol=1e-12
    )


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (1e-9, 0.0), (0.3, -0.7), (2.0, 1.0)])
def test_a_tilt_is_a_turn(tilt):
    at, n = on_ball()
    turned = at.tilted(jnp.array(tilt))
    np.testing.assert_allclose(turned.axes.T @ turned.axes, np.eye(3), rtol=0.0, atol=1e-14)
    size = np.hypot(*tilt)
    way = at.axes[:, :2] @ np.array(tilt) / max(size, 1e-300)
    np.testing.assert_allclose(
        turned.normal, np.cos(size) * n + np.sin(size) * way, rtol=0.0, atol=1e-12
    )


@pytest.mark.parametrize("size", 10.0 ** -np.arange(1.0, 8.0))
def test_second_derivatives_of_a_small_turn_in_single_precision(size):
    """Exactly, at no turn: `d2 n = -n`, and of the tangents what moves along the normal."""

    def bends(dtype):
        at = receiver(jnp.zeros(3, dtype), jnp.array([0.0, 0.0, 1.0], dtype))
        tilt = jnp.asarray(size * np.array([1.0, 0.3]), dtype)
        return jax.jacfwd(jax.jacfwd(lambda tilt: at.tilted(tilt).axes))(tilt)

    np.testing.assert_allclose(bends(jnp.float32), bends(jnp.float64), rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(
        bends(jnp.float64)[:, 2, 0, 0], [0.0, 0.0, -1.0], rtol=0.0, atol=1.1 * size
    )


@pytest.mark.parametrize("size", [0.0, 1e-6, 1.22e-4, 1.23e-4, 0.03, 0.3])
def test_a_turn_is_its_exponential_on_either_side_of_its_series(size):
    tilt, at = size * np.array([0.6, -0.8]), receiver((0.0, 0.0, 0.0))
    K = np.zeros((3, 3))
    K[:2, 2], K[2, :2] = tilt, -tilt
    np.testing.assert_allclose(at.tilted(tilt).axes, expm(K), rtol=0.0, atol=1e-15)
    # Of the exponential of [[K, dK], [0, K]] the upper right is the derivative along dK.
    for i in range(2):
        dK = np.zeros((3, 3))
        dK[i, 2], dK[2, i] = 1.0, -1.0
        both = expm(np.block([[K, dK], [np.zeros((3, 3)), K]]))
        slope = jax.jacfwd(lambda tilt: at.tilted(tilt).axes)(jnp.asarray(tilt))
        np.testing.assert_allclose(slope[..., i], both[:3, 3:], rtol=0.0, atol=1e-14)


def test_steps_of_a_receiver_are_along_its_axes_and_its_normal_leans_as_a_tilt_says():
    at, n = on_ball()
    new = at.displaced(jnp.array([0.3, -0.2, 0.5, 0.1, -0.4]))
    np.testing.assert_allclose((new.position - at.position) @ n, 0.5, rtol=1e-14)
    np.testing.assert_allclose(
        np.linalg.norm(new.position - at.position), np.sqrt(0.38), rtol=1e-14
    )
    np.testing.assert_allclose(at.axes[:, 0] @ (new.position - at.position), 0.3, rtol=1e-14)
    np.testing.assert_allclose(new.axes, at.tilted(jnp.array([0.1, -0.4])).axes, rtol=1e-14)


def test_a_flat_receiver_keeps_its_frame():
    at = receiver((1.0, 2.0, 3.0), (0.0, 1.0, 0.0))
    moved = at.moved(jnp.array([0.5, -0.25]))
    np.testing.assert_allclose(moved.axes, at.axes)
    np.testing.assert_allclose(
        moved.position - at.position, at.axes[:, :2] @ np.array([0.5, -0.25])
    )


def test_bad_receivers_are_refused():
    with pytest.raises(ValueError, match=r"^Argument `normal` must have a length, but is the zero"):
        receiver((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"^Argument `position` must be finite, but is inf\.$"):
        receiver((0.0, 0.0, np.inf))


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: receiver((0, 0, 0), S=2.0), "`S` must have shape (..., 2, 2), but has ()."),
        (lambda: receiver((0, 0, 0), S=(1, 2)), "`S` must have shape (..., 2, 2), but has (2,)."),
        (lambda: AT.moved(1.0), "`x` must have shape (2,), but has ()."),
        (lambda: AT.moved(np.ones(3)), "`x` must have shape (2,), but has (3,)."),
        (lambda: AT.tilted(np.ones(3)), "`tilt` must have shape (2,), but has (3,)."),
        (lambda: AT.displaced(np.ones(2)), "`u` must have shape (5,), but has (2,)."),
    ],
)
def test_what_has_another_shape_is_refused_in_one_sentence(ask, words):
    """A number for S would be broadcast to a matrix of equal entries, which is no ball's."""
    with pytest.raises(ValueError, match="Argument") as found:
        ask()
    assert str(found.value) == f"Argument {words}"


def test_a_receiver_by_its_class_is_the_one_of_the_old_name():
    S = jnp.diag(jnp.array([0.5, -1.0]))
    new = Receiver.at((0.0, 1.0, 2.0), (0.3, -0.4, 0.6), on=2, S=S)
    old = receiver((0.0, 1.0, 2.0), (0.3, -0.4, 0.6), S, 2)
    assert [a.tolist() for a in jax.tree.leaves(new)] == [b.tolist() for b in jax.tree.leaves(old)]


def test_a_traced_normal_without_length_is_nan():
    with pytest.raises(ValueError, match="`normal` must have a length"):
        Receiver.at((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    made = jax.jit(lambda n: Receiver.at((0.0, 0.0, 0.0), n))(jnp.zeros(3))
    assert np.isnan(made.normal).all()
