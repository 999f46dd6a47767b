"""Scenes of bands: every function of them is that of one band, mapped, and sees shapes once."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, imaging, space
from firstorder.flatland import bounces as flat_bounces
from firstorder.flatland.discontinuities import visual_events
from firstorder.scene._bands import band_after_band, bands_of, by_band, merged_bands, one_band
from firstorder.space import bounces as space_bounces
from tests.first_calls import equations, numbers_computed

LAMP, RED, GREEN = (1.2, 1.0, 0.7), (0.8, 0.1, 0.05), (0.1, 0.6, 0.2)
ONE, OTHER = (1.0, 0.0, 0.5), (0.0, 1.0, 0.0)
WORLDS = {"flatland": flatland, "space": space}


def flat_scene(**lights):
    """A lamp, a red wall, a green ball and a grey floor."""
    return flatland.Scene.of(
        flatland.primitive(flatland.Segments((0.5, 1.0), (-0.5, 1.0)), emission=LAMP),
        flatland.primitive(flatland.Segments((-1.0, 1.0), (-1.0, 0.0)), albedo=RED),
        flatland.primitive(flatland.Circles((0.2, 0.5), 0.1), albedo=GREEN),
        flatland.primitive(flatland.Segments((-1.0, 0.0), (1.0, 0.0)), name="floor", albedo=0.7),
        **lights,
    )


def space_scene(**lights):
    """The same in space."""
    return space.Scene.of(
        space.primitive(space.rectangle((0, 0, 2), (0, 0.5, 0), (0.5, 0, 0)), emission=LAMP),
        space.primitive(space.rectangle((-1, 0, 1), (0, 1, 0), (0, 0, 1)), albedo=RED),
        space.primitive(space.sphere((0.3, 0.1, 0.9), 0.3), albedo=GREEN),
        space.primitive(space.rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), name="floor", albedo=0.7),
        **lights,
    )


def asked(world):
    """A scene under a sky of bands, and a receiver on its floor."""
    if world == "flatland":
        points = flatland.PointLights([[0.8, 0.9]], [[0.1, 0.2, 0.3]])
        sky = flatland.GaussianSky(0.2, 0.5, (0.1, 0.2, 0.4))
        scene = flat_scene(environment=sky, points=points)
        return scene, flatland.receiver(scene, scene.named("floor")[0], 0.6)
    scene = space_scene(environment=(0.1, 0.2, 0.4))
    return scene, space.receiver((0.1, 0.05, 0.0), on=scene.named("floor")[0])


def close(found, each, axis=-1, rtol=1e-12):
    """Whether every band is that of a scene of its own, and no two are the same."""
    found = np.moveaxis(np.asarray(found), axis, 0)
    assert len(found) == len(each) == 3
    for a, b in zip(found, each, strict=True):
        scale = max(1.0, float(np.max(np.abs(np.asarray(b)))))
        np.testing.assert_allclose(a, np.asarray(b), rtol=rtol, atol=rtol * scale)
    assert not np.allclose(found[0], found[1])


@pytest.mark.smoke
@pytest.mark.parametrize("world", WORLDS)
def test_irradiance_and_its_derivatives_are_those_of_three_scenes(world):
    scene, at = asked(world)
    assert scene.bands == 3
    assert scene.band(1).bands is None
    f = WORLDS[world].irradiance
    d = WORLDS[world].derivatives(f, scene, at)
    each = [WORLDS[world].derivatives(f, scene.band(k), at) for k in range(3)]
    close(f(scene, at), [f(scene.band(k), at) for k in range(3)])
    close(d.value, [e.value for e in each])
    close(d.gradient, [e.gradient for e in each], 0)  # freedoms come after the bands
    close(d.hessian, [e.hessian for e in each], 0, 1e-10)


@pytest.mark.parametrize("world", WORLDS)
def test_irradiance_is_differentiable_in_every_band_of_a_leaf(world):
    scene, at = asked(world)

    def brightened(L):
        lit = eqx.tree_at(lambda s: s.material.emission, scene, L * scene.material.emission)
        return WORLDS[world].irradiance(lit, at)

    J = jax.jacobian(brightened)(jnp.ones(3))
    assert J.shape == (3, 3)
    np.testing.assert_allclose(J, np.diag(np.diag(J)))  # no band becomes another
    assert np.all(np.diag(J) != 0.0)


@pytest.mark.parametrize("world", WORLDS)
def test_shapes_are_seen_once_for_all_bands(world):
    scene, at = asked(world)
    f = WORLDS[world].irradiance
    three = equations(lambda s: f(s, at), scene)
    one = equations(lambda s: f(s, at), scene.band(0))
    assert three < 1.1 * one


@pytest.mark.parametrize("world", WORLDS)
def test_what_is_seen_is_not_mapped_over_bands(world):
    scene, at = asked(world)
    f = WORLDS[world].irradiance
    one = numbers_computed(lambda s: f(s, at), scene.band(0))
    assert numbers_computed(lambda s: f(s, at), scene) < 1.25 * one


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("colours", [(ONE, OTHER), (OTHER, ONE)])
def test_of_lamps_in_one_place_the_later_one_is_seen_in_every_band(world, colours):
    """Also in those in which it is dark and the other is not."""
    shapes = {
        "flatland": flatland.Segments((0.5, 1.0), (-0.5, 1.0)),
        "space": space.rectangle((0, 0, 1), (0, 0.5, 0), (0.5, 0, 0)),
    }
    at = WORLDS[world].Receiver.at((0.0,) * (2 if world == "flatland" else 3))
    colours = [np.array([[c, (0.0,) * 3]]) for c in colours]

    def light(*colours):
        lamps = [WORLDS[world].primitive(shapes[world], emission=c) for c in colours]
        return WORLDS[world].irradiance(WORLDS[world].Scene.of(*lamps), at)

    np.testing.assert_allclose(light(*colours), light(colours[1]), rtol=1e-12)
    assert np.any(light(colours[1]) > 0.1)


@pytest.mark.parametrize("world", WORLDS)
def test_a_scene_of_one_band_is_the_program_that_it_was(world):
    scene, at = asked(world)
    f = WORLDS[world].irradiance
    plain = equations(lambda s: f.__wrapped__.__wrapped__(s, at), scene.band(0))
    assert equations(lambda s: f(s, at), scene.band(0)) == plain


def test_what_is_asked_of_a_direction_has_bands():
    scene, at = asked("flatland")
    two = flatland.weighted_irradiance(scene, at, weight=jnp.cos)
    np.testing.assert_allclose(two, flatland.irradiance(scene, at), rtol=1e-6)
    close(scene.sky(jnp.array(0.1)), [scene.band(k).sky(jnp.array(0.1)) for k in range(3)])
    lit, here = asked("space")
    close(
        space.vector_irradiance(lit, here),
        [space.vector_irradiance(lit.band(k), here) for k in range(3)],
    )
    close(
        space.boundary_gradient(lit, here),
        [space.boundary_gradient(lit.band(k), here) for k in range(3)],
    )


def test_skies_answer_in_bands():
    w = jnp.array([[0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
    values = np.random.default_rng(0).uniform(size=(4, 8, 3))
    sky = space.PanoramaSky(values)
    assert bands_of(sky) == 3
    assert sky(w).shape == (2, 3)
    close(sky(w), [space.PanoramaSky(values[..., k])(w) for k in range(3)])
    close(sky.harmonic(2)(w), [space.PanoramaSky(values[..., k]).harmonic(2)(w) for k in range(3)])
    lobe = space.GaussianSky((0, 0, 1), 0.5, LAMP)
    one = [space.GaussianSky((0, 0, 1), 0.5, L) for L in LAMP]
    close(lobe.gradient(w[0]), [sky.gradient(w[0]) for sky in one], -2)
    row = flatland.PanoramaSky(values[0])
    close(
        row.coarser(4)(0.3),
        [flatland.PanoramaSky(values[0, :, k]).coarser(4)(0.3) for k in range(3)],
    )


# --- many bounces --------------------------------------------------------------------------------


def test_radiosity_of_flatland_is_that_of_three_scenes():
    scene = flat_scene()
    floor = flatland.receiver(scene, scene.named("floor")[0], 0.1)
    coarse = flat_bounces.Discretization(nodes=4)
    solved = flat_bounces.solve_radiosity(scene, fineness=coarse)
    each = [flat_bounces.solve_radiosity(scene.band(k), fineness=coarse) for k in range(3)]
    close(solved.E, [one.E for one in each])
    close(solved.irradiance(floor), [one.irradiance(floor) for one in each])
    close(solved.reflected, [one.reflected for one in each])
    for a, b in zip(solved.flux(), zip(*(one.flux() for one in each), strict=True), strict=True):
        close(a, b)
    # Near the red wall light is redder than the lamp.
    share = solved.irradiance(floor) / flatland.irradiance(scene, floor)
    assert share[0] > 1.02 * share[1]


def test_radiance_maps_of_space_are_those_of_three_scenes():
    scene, how = space_scene(), dict(cells=4, bounces=2, rays=16, shadow=2)
    maps = space_bounces.solve_radiosity(scene, **how)
    each = [space_bounces.solve_radiosity(scene.band(k), **how) for k in range(3)]
    close(maps.L, [one.L for one in each])
    fine = space_bounces.refine_maps(maps, 8)
    close(fine.L, [space_bounces.refine_maps(one, 8).L for one in each])
    down = (jnp.zeros(2), jnp.zeros(2), -jnp.ones(2))
    start = (jnp.array([-0.8, 0.8]), jnp.zeros(2), jnp.ones(2))
    hits = space_bounces.trace_maps(maps, start, down, -1)
    assert hits.distance.shape == (2,)
    close(hits.radiance, [space_bounces.trace_maps(one, start, down, -1).radiance for one in each])


@pytest.mark.parametrize("world", WORLDS)
def test_paths_of_a_band_are_those_of_its_own_scene(world):
    scene = flat_scene() if world == "flatland" else space_scene()
    at = asked(world)[1]
    trace = {"flatland": flat_bounces, "space": space_bounces}[world].path_irradiance
    how = dict(key=jax.random.key(3), paths=8, bounces=2, lanes=2)
    found = trace(scene, at, **how)
    each = [trace(scene.band(k), at, **how) for k in range(3)]
    np.testing.assert_array_equal(found.mean, [one.mean for one in each])
    np.testing.assert_array_equal(found.error, [one.error for one in each])
    assert found.count.shape == ()


# --- images --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "sky", [(0.1, 0.2, 0.4), space.GaussianSky((0, 0, 1), 0.6, (0.1, 0.2, 0.4))]
)
def test_an_image_is_three_images(sky):
    scene = space_scene(environment=sky)
    camera = imaging.pinhole((0.9, -4.0, 2.0), (-0.1, 0.0, 0.7), gamma=2.0)
    image = imaging.render(scene, camera, 4, 3, rays=8)
    each = [imaging.render(scene.band(k), camera, 4, 3, rays=8) for k in range(3)]
    close(image.value, [one.value for one in each])
    close(image.gradient, [one.gradient for one in each], -2)
    assert image.picture.shape == (3, 4, 3)


# --- where bands cannot be, and how they are told ------------------------------------------------


def test_numbers_are_bands_where_they_can_be_nothing_else():
    one = space.sphere((0, 0, 1), 0.5)
    two = flatland.Segments(np.zeros((2, 2)), np.ones((2, 2)))

    def emission(shape, L, **how):
        world = space if shape is one else flatland
        return world.primitive(shape, emission=L, **how).material.emission

    assert emission(one, LAMP).tolist() == [[list(LAMP), [0.0] * 3]]
    assert emission(one, LAMP, two_sided=True).tolist() == [[list(LAMP)] * 2]
    assert emission(one, [LAMP, RED]).tolist() == [[list(LAMP), list(RED)]]
    assert emission(two, [LAMP, RED]).tolist() == [[list(LAMP), list(RED)]] * 2
    assert emission(two, np.ones((2, 2, 1))).shape == (2, 2, 1)
    assert emission(two, np.ones((1, 2, 2))).shape == (2, 2, 2)
    assert emission(two, np.ones((1, 4)))[1].tolist() == [[1.0] * 4, [0.0] * 4]
    three = flatland.Segments(np.zeros((3, 2)), np.ones((3, 2)))
    assert emission(three, (1.0, 2.0, 3.0))[:, 0].tolist() == [1.0, 2.0, 3.0]
    assert emission(three, [LAMP] * 3).shape == (3, 2, 3)


def test_a_grey_thing_has_its_number_in_every_band():
    scene = flat_scene()
    floor = scene.material.albedo[scene.named("floor")[0]]
    assert floor.tolist() == [[0.7] * 3] * 2


def test_a_share_of_more_than_all_in_one_band_is_refused():
    with pytest.raises(ValueError, match=r"must add up to at most 1, but add up to 1\.1\.$"):
        space.primitive(space.sphere((0, 0, 1), 0.5), albedo=(0.2, 0.9, 0.1), specular=0.2)


def test_things_that_disagree_are_refused_in_one_sentence():
    lamp = flatland.primitive(flatland.Segments((0.5, 1.0), (-0.5, 1.0)), emission=LAMP)
    ball = flatland.primitive(flatland.Circles((0.2, 0.5), 0.1), albedo=(0.1, 0.2, 0.3, 0.4))
    words = r"^All that has bands must have equally many, but there are things of 3 and 4\.$"
    with pytest.raises(ValueError, match=words):
        flatland.Scene.of(lamp, ball)
    with pytest.raises(ValueError, match=words):
        flatland.Scene.of(lamp, environment=flatland.ConstantSky(np.ones(4)))


@pytest.mark.parametrize("world", WORLDS)
def test_a_function_of_one_band_refuses_a_scene_of_three(world):
    scene, at = asked(world)
    words = r"^Argument `scene` must have no bands here, but has 3: ask for each, scene\.band\(0\)"
    with pytest.raises(ValueError, match=words):
        WORLDS[world].light_field(scene, at)
    if world == "flatland":
        with pytest.raises(ValueError, match=words):
            flat_bounces.trace_photons(scene, jax.random.key(0), 8)
        with pytest.raises(ValueError, match=words):
            visual_events(scene)


def test_what_only_looks_at_shapes_takes_any_scene():
    scene, at = asked("space")
    np.testing.assert_array_equal(
        space.net_visibility(scene, at), space.net_visibility(scene.band(2), at)
    )
    flat, here = asked("flatland")
    np.testing.assert_array_equal(
        flatland.view(flat, here).angles, flatland.view(flat.band(0), here).angles
    )


@pytest.mark.parametrize("number", [3, -1])
def test_a_band_that_is_not_there_is_refused(number):
    words = rf"^Argument `number` must be the number of a band, 0 to 2, but is {number}\.$"
    with pytest.raises(ValueError, match=words):
        flat_scene().band(number)


def test_merged_bands_differ_where_any_band_does():
    lights = flatland.PointLights(np.zeros((3, 2)), [[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    merged = merged_bands(lights).intensity
    assert merged.shape == (3,)
    assert merged[0] == merged[2] != merged[1]


def test_mapping_and_calling_one_by_one_agree():
    def share(sky, x):
        return sky(0.0) * x, x

    sky, x = flatland.ConstantSky(LAMP), jnp.arange(2.0)
    mapped, looped = (way((-1, None))(share)(sky, x) for way in (by_band, band_after_band))
    for a, b in zip(mapped, looped, strict=True):
        np.testing.assert_array_equal(a, b)
    assert [a.shape for a in mapped] == [(2, 3), (2,)]
    assert one_band(sky, 2).radiance.item() == pytest.approx(0.7)
