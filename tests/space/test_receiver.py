"""Receivers on surfaces: a walk on a ball of radius R is a walk on that ball."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import Receiver, receiver

R = 1.7


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
    np.testing.assert_allclose(moved.position, true(x), atol=1e-8)
    np.testing.assert_allclose(moved.normal, true(x) / R, atol=1e-8)
    second = jax.hessian(lambda x: at.moved(x).position)(jnp.zeros(2))
    np.testing.assert_allclose(second, -np.einsum("k,ij->kij", n, np.eye(2)) / R, atol=1e-14)
    slope = jax.jacobian(lambda x: at.moved(x).normal)(jnp.zeros(2))
    np.testing.assert_allclose(slope, at.axes[:, :2] / R, atol=1e-14)
    bend = jax.hessian(lambda x: at.moved(x).normal)(jnp.zeros(2))
    np.testing.assert_allclose(bend, -np.einsum("k,ij->kij", n, np.eye(2)) / R**2, atol=1e-12)


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (1e-9, 0.0), (0.3, -0.7), (2.0, 1.0)])
def test_a_tilt_is_a_turn(tilt):
    at, n = on_ball()
    turned = at.tilted(jnp.array(tilt))
    np.testing.assert_allclose(turned.axes.T @ turned.axes, np.eye(3), atol=1e-14)
    size = np.hypot(*tilt)
    way = at.axes[:, :2] @ np.array(tilt) / max(size, 1e-300)
    np.testing.assert_allclose(turned.normal, np.cos(size) * n + np.sin(size) * way, atol=1e-12)


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
