"""Radiance of one ray against closed forms: skies that are functions, glossy lobes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise
from firstorder.imaging import _exact_radiance
from firstorder.imaging._exact_radiance import gathered_light
from firstorder.imaging.camera import pinhole
from firstorder.imaging.images import _render_pixels
from firstorder.space import Receiver, Scene, primitive, receiver
from tests.imaging.worlds import GROUND, SKY, ball_over_floor, open_light

world = pytest.fixture(scope="module")(ball_over_floor)


def lit(world, sky, exponent, rays=2048):
    """Value and gradient by the receiver's place of what a lobe about the normal gathers."""
    scene = Scene(world.groups, world.material, sky, world.names)

    def light(x):
        at = Receiver(x, jnp.eye(3), jnp.zeros((2, 2)), jnp.asarray(1))
        return gathered_light(scene, at, jnp.array([0.0, 0.0, 1.0]), jnp.asarray(exponent), rays)

    return jax.jit(jax.value_and_grad(light))


def test_irradiance_under_a_sky_that_is_a_function(world):
    """The same uniform sky, as a function: gathered to a share, its gradient exact."""
    x = jnp.array([0.9, 0.3, 0.0])
    E, dE = lit(world, jax.tree_util.Partial(lambda w: SKY + 0.0 * w[2]), 0.0)(x)
    here = np.array([0.9, 0.3])
    slope = SKY * np.pi * 0.75 * here / (1.0 + here @ here) ** 2.5
    assert abs(float(E) / open_light(here) - 1.0) < 2e-3
    assert normwise(dE[:2], slope) < 1e-12


def test_a_lobe_of_exponent_zero_is_irradiance_whatever_its_axis():
    """Under a white sky; of exponent one, b off the normal, 2/3 ((pi - b) cos b + sin b)."""
    scene, cos, sin = Scene.of(primitive(GROUND), environment=1.0), 0.8, 0.6
    at, axis = receiver((0.1, 0.2, 0.0), on=0), jnp.array([sin, 0.0, cos])
    gathered = jax.jit(lambda e: gathered_light(scene, at, axis, e, 2048))
    assert float(gathered(0.0)) == pytest.approx(np.pi, rel=1e-12)
    leaning = ((np.pi - np.arccos(cos)) * cos + sin) / 1.5
    assert float(gathered(1.0)) == pytest.approx(leaning, rel=1e-3)


def cap_error(world):
    """Below the ball, lobe about the normal: the ball hides a cap of half-angle a, sin a = R / d.

    Light is left from a on: `2 pi / (e + 2) cos^(e+2) a`; nearer, a grows by `tan a / d`.
    """
    e, sine = 6.0, 0.5
    _, slope = lit(world, jax.tree_util.Partial(lambda w: 1.0 + 0.0 * w[2]), e)(jnp.zeros(3))
    exact = -2.0 * np.pi * sine**2 * (1.0 - sine**2) ** (0.5 * e)
    return normwise(slope, np.array([0.0, 0.0, exact]))


def test_the_gradient_of_a_glossy_lobe_behind_a_ball(world):
    assert cap_error(world) < 1e-12


@pytest.mark.parametrize("fault", ["no boundary term", "the weight forgets the lobe"])
def test_a_wrong_boundary_is_noticed(fault, world, monkeypatch):
    right = _exact_radiance.boundary_gradient
    wrong = {
        "no boundary term": lambda *a, **k: jnp.zeros(3),
        "the weight forgets the lobe": lambda s, at, weight: right(s, at),
    }[fault]
    monkeypatch.setattr(_exact_radiance, "boundary_gradient", wrong)
    error = cap_error(world)
    assert np.isfinite(error)
    assert error > 1e-3


def test_a_glossy_floor_under_a_white_sky_shows_its_share():
    floor = primitive(GROUND, albedo=0.3, specular=0.4, exponent=20.0)
    scene = Scene.of(floor, environment=1.0)
    camera = pinhole((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    value, gradient = _render_pixels(scene, camera, np.zeros((1, 2)), np.zeros(1, int), rays=4096)
    assert abs(value[0] - 0.7) < 1e-3
    assert np.max(np.abs(gradient)) < 1e-3
