"""Shapes that stand in the plane of the receiver, or touch it, in scenes that are turned anyhow."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from firstorder.space import Boxes, Receiver, Scene, irradiance, primitive, rectangle, sphere
from firstorder.space.azimuthal.transport import visibility_by_azimuth

TURNS = np.concatenate([np.eye(3)[None], Rotation.random(24, random_state=0).as_matrix()])
LAMPS = {"stands on it": (0.0, 1.0), "goes through it": (-1.0, 1.0)}  # from which height to which


def _box(lift, place):
    return (Boxes(place(0.2, 1.0, 0.25 + lift), 0.25 * place(*np.eye(3))),)


def _ball(lift, place):
    return (sphere(place(0.0, 1.0, 0.25 + lift), 0.25),)


BLOCKERS = {"nothing": lambda lift, place: (), "a box": _box, "a ball": _ball}


def _scene(blocker, heights, turn, step=(0.0, 0.0), lift=0.0):
    """A lamp before a receiver in the origin, which makes a step, behind what stands between."""

    def place(x, y, z):
        return turn @ jnp.stack([jnp.asarray(a, turn.dtype) for a in (x, y, z)])

    low, high = heights
    lamp = rectangle(
        place(0.0, 2.0, 0.5 * (low + high) + lift),
        place(1.0, 0.0, 0.0),
        place(0.0, 0.0, 0.5 * (high - low)),
    )
    between = [primitive(shape) for shape in BLOCKERS[blocker](lift, place)]
    at = Receiver.at(place(*step, 0.0), place(0.0, 0.0, 1.0))
    return Scene.of(primitive(lamp, emission=1.0), *between), at


def _lambert(corners) -> float:
    """Irradiance of the origin, with normal z, by a polygon of radiance one."""
    total = 0.0
    for p, q in zip(corners, np.roll(corners, -1, 0), strict=True):
        n = np.cross(p, q)
        total += 0.5 * np.arctan2(np.linalg.norm(n), p @ q) * n[2] / np.linalg.norm(n)
    return abs(total)


def _jet(blocker, heights):
    """Value and gradient, by the turn of the scene and by how much all in it is lifted."""

    def jet(turn, lift):
        def light(step):
            return irradiance(*_scene(blocker, heights, turn, step, lift))

        return jax.value_and_grad(light)(jnp.zeros(2, turn.dtype))

    return jax.jit(jax.vmap(jet, (0, None)))


@pytest.mark.parametrize("heights", LAMPS.values(), ids=LAMPS)
@pytest.mark.parametrize("blocker", BLOCKERS)
def test_what_stands_in_the_receivers_plane_gives_the_same_light_however_it_is_turned(
    blocker, heights
):
    jet = _jet(blocker, heights)
    E, gradient = jet(jnp.asarray(TURNS), 0.0)
    lifted, slope = (a[0] for a in jet(jnp.asarray(TURNS), 1e-7))
    if blocker == "nothing":
        wall = np.array([(-1.0, 2.0, 0.0), (1.0, 2.0, 0.0), (1.0, 2.0, 1.0), (-1.0, 2.0, 1.0)])
        np.testing.assert_allclose(E[0], _lambert(wall), rtol=1e-14)
    np.testing.assert_allclose(E[0], lifted, rtol=1e-6)
    np.testing.assert_allclose(E, E[0], rtol=1e-13)
    np.testing.assert_allclose(gradient[0], slope, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(
        gradient, np.broadcast_to(gradient[0], gradient.shape), rtol=0.0, atol=1e-14
    )


@pytest.mark.parametrize("blocker", ["nothing", "a box"])
def test_so_it_does_in_single_precision(blocker):
    turns = jnp.asarray(TURNS, jnp.float32)
    found = _jet(blocker, LAMPS["stands on it"])(turns, jnp.float32(0.0))
    for a in found:
        np.testing.assert_allclose(a, np.broadcast_to(a[0], a.shape), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("blocker", BLOCKERS)
def test_upright_edges_count_once_in_azimuth_however_they_are_turned(blocker):
    """The boundary term has them apart, and none of what their two ends are off by rounding."""

    @jax.jit
    def seen(turn):
        scene, at = _scene(blocker, LAMPS["stands on it"], turn)
        B = visibility_by_azimuth(scene, at, nodes=16)
        return B.value, turn.T @ (at.axes[:, :2] @ B.gradient.total)

    value, gradient = (np.stack(a) for a in zip(*map(seen, jnp.asarray(TURNS)), strict=True))
    np.testing.assert_allclose(value, value[0] + 0.0 * value, rtol=1e-12)
    np.testing.assert_allclose(gradient, gradient[0] + 0.0 * gradient, rtol=0.0, atol=1e-9)
    assert gradient[0, 1] < -0.1  # towards what hides the sky
