"""Lights as a place samples them: by flux, evenly in the parameter, with the density they say."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from firstorder.checks.statistics import LEVEL, chi_square, sampler_p_value, z_test_of
from firstorder.flatland import PointLights, Scene, Segments, primitive
from firstorder.flatland.bounces import _light_sampling as sampling
from firstorder.flatland.bounces._light_sampling import density_of_sky
from firstorder.sampling import estimate
from tests.flatland.worlds import all_lights
from tests.samplers import COUNT, biased, turn_share, uniform_p_value

HERE = np.array([0.1, 0.05])
lights = eqx.filter_jit(sampling.lights)
sample_light = eqx.filter_jit(sampling.sample_light)
density_of_shape = eqx.filter_jit(sampling.density_of_shape)


@functools.cache
def drawn(bias=None):
    """Many samples from one place, with the lights; numbers may have a biased column."""
    scene = all_lights()
    where = lights(scene)
    u = np.asarray(jax.random.uniform(jax.random.key(12), (2 * COUNT, 2)))
    u = u if bias is None else biased(u, bias)
    place = jnp.broadcast_to(HERE, u.shape)
    return where, sample_light(scene, where, place, jnp.asarray(u))


def p_values(where, found):
    """Of picks, of places on the lamp and on the circle, and of directions of the sky."""
    on, end = np.asarray(found.on), np.asarray(found.end)
    point = np.asarray(found.point)
    sky = (on < 0) & ~point
    counts = [point.sum(), (on == 0).sum(), (on == 2).sum(), sky.sum()]
    chance = np.asarray(where.pick.probability)[[0, 1, 3, -1]]
    around = end[on == 2] - (1.5, 0.5)
    along = np.asarray(found.along)[sky]
    return {
        "pick": chi_square(counts, len(on) * chance),
        "lamp": uniform_p_value(end[on == 0][:, 0] + 0.5),
        "circle": uniform_p_value(turn_share(np.arctan2(around[:, 1], around[:, 0]))),
        "sky": sampler_p_value(
            np.arctan2(-along[:, 0], along[:, 1]), where.sky.density, -np.pi, np.pi
        ),
    }


def test_every_light_is_picked_by_the_flux_that_it_sends():
    """`2 pi I` of a point, `2 L length` of a side, `2 R int L` of the sky; backs are dark."""
    where, _ = drawn()
    sky, _ = quad(all_lights().environment, -np.pi, np.pi)
    lit = [2.0 * np.pi * 0.2, 2.0 * 1.0 * 1.0, 0.0, 2.0 * 0.8 * 2.0 * np.pi * 0.2]
    truth = np.array([*lit, 0.0, 0.0, 0.0, 2.0 * where.radius * sky])
    np.testing.assert_allclose(where.flux, truth, rtol=1e-12)
    np.testing.assert_allclose(where.pick.probability, truth / truth.sum(), rtol=1e-12)


def test_lights_and_places_on_them_follow_their_law():
    found = p_values(*drawn())
    assert min(found.values()) > LEVEL / len(found), found
    for bias, seen in ((0, {"pick"}), (1, {"lamp", "circle"})):
        assert {name for name, p in p_values(*drawn(bias)).items() if p < LEVEL} >= seen


def test_inverse_densities_add_up_to_the_angle_that_a_light_fills():
    """The lamp from its ends, the circle by its tangents, the sky all around."""
    _, found = drawn()
    on, shines = np.asarray(found.on), np.asarray(found.value) > 0.0
    inverse = 1.0 / np.asarray(found.density)
    lamp = np.sum(np.arctan((0.5 + np.array([-1.0, 1.0]) * HERE[0]) / (1.0 - HERE[1])))
    circle = 2.0 * np.arcsin(0.2 / np.hypot(*(HERE - (1.5, 0.5))))
    sky = (on < 0) & ~np.asarray(found.point)
    for mask, angle in ((on == 0, lamp), (on == 2, circle), (sky, 2.0 * np.pi)):
        seen = estimate(jnp.asarray(np.where(mask & shines, inverse, 0.0)))
        assert z_test_of(seen, angle).passed
        assert not z_test_of(seen, 1.3 * angle).passed


def test_a_direction_met_by_chance_has_the_density_with_which_it_is_sampled():
    """Of each side its own share of the flux: one board shows its front, the other its back."""
    boards = np.array([[(0.9, 1.0), (-0.4, 1.3)], [(-1.5, 0.2), (-1.0, 1.2)]])
    emission, place = np.array([(1.0, 0.3), (0.2, 0.7)]), np.broadcast_to(HERE, (64, 2))
    scene = Scene.of(
        *(primitive(Segments(*b), emission=e) for b, e in zip(boards, emission, strict=True)),
        points=PointLights((0.0, 3.0), 0.4),
    )
    where = lights(scene)
    u = np.random.default_rng(0).uniform(0.0, 1.0, (64, 2))
    found = sample_light(scene, where, place, jnp.asarray(u))
    met = np.asarray((found.on >= 0) & (found.value > 0.0))
    on, way = np.asarray(found.on)[met], (np.asarray(found.end) - HERE)[met]
    front = emission[on, 0] == np.asarray(found.value)[met]
    assert {*zip(on.tolist(), front.tolist(), strict=True)} == {(0, True), (1, False)}
    step, r = (boards[:, 1] - boards[:, 0])[on], np.linalg.norm(way, axis=1)
    seen = abs(way[:, 0] * step[:, 1] - way[:, 1] * step[:, 0]) / r
    flux = 2.0 * emission * np.linalg.norm(boards[:, 1] - boards[:, 0], axis=1)[:, None]
    side = np.where(front, 0, 1)
    true = flux[on, side] / (flux.sum() + 2.0 * np.pi * 0.4) * r / seen
    np.testing.assert_allclose(np.asarray(found.density)[met], true, rtol=1e-12)
    chance = density_of_shape(scene, where, *map(jnp.asarray, (on, front, seen, r)))
    np.testing.assert_allclose(chance, true, rtol=1e-12)
    none = density_of_shape(scene, where, *map(jnp.asarray, (on - 2, front, 0.0 * seen, r)))
    np.testing.assert_array_equal(none, 0.0)


def test_a_direction_of_the_sky_has_the_density_with_which_it_is_sampled():
    where, found = drawn()
    sky = np.asarray((found.on < 0) & ~found.point)
    chance = density_of_sky(where, found.along[sky])
    np.testing.assert_allclose(chance, found.density[sky], rtol=1e-9)


def test_each_point_light_is_where_it_is_and_as_bright():
    position, intensity = np.array([(-1.0, 0.4), (0.3, 0.9), (0.8, 0.2)]), np.array([0.2, 1.0, 0.5])
    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))
    scene = Scene.of(floor, points=PointLights(position, intensity))
    u = (np.cumsum(intensity) - 0.5 * intensity) / intensity.sum()  # in the middle of each share
    place = jnp.broadcast_to(HERE, (3, 2))
    found = sample_light(scene, lights(scene), place, jnp.stack([u, u], -1))
    way = position - HERE
    far = np.linalg.norm(way, axis=1)
    assert np.all(found.point)
    np.testing.assert_allclose(found.end, position)
    np.testing.assert_allclose(found.along, way / far[:, None], rtol=1e-14)
    np.testing.assert_allclose(found.value, intensity / far, rtol=1e-14)
    np.testing.assert_allclose(found.density, intensity / intensity.sum(), rtol=1e-14)
