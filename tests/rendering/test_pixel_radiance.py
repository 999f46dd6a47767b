"""The renderer's fast way: what `pixels` gives, in parts; blocks; rays as a fan."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging.camera import pinhole
from firstorder.imaging.shading import SurfaceMaps
from firstorder.imaging.sky_lights import sky_light
from firstorder.io import Embree
from firstorder.io.scenes.space_toml import MeshModel
from firstorder.models.primitives import bumpy_sphere, displaced_ground, place_mesh
from firstorder.rendering import Renderer, World, _pixel_radiance, _shadow_edges
from firstorder.rendering._pixel_radiance import blocks_of
from firstorder.space import Scene, plane, primitive
from firstorder.space.skies import GaussianSky

MATTER = dict(albedo=0.5, specular=0.2, exponent=20.0)
CAMERA = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.4), gamma=2.4)
LAMP = Lamp((-1.0, -1.5, 2.5), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0), 8.0, 9, True)
OTHER = Lamp((1.5, 0.5, 2.0), (0.0, 0.4, 0.1), (0.3, 0.0, 0.3), 4.0, 6, True)
# Rays start 1e-5 of the scene's 8 m off their surface, which depths of blockers some 0.1 m away
# and more see; `pixels` shifts their other ends too.
SINGLE = 1e-5 * 8.0 / 0.1


def height(index, x):
    return 0.01 * (index == 1) * jnp.sin(25.0 * x[0])


def world(albedo=0.5, **more) -> World:
    ball = place_mesh(bumpy_sphere(0.5, lambda v: 0.0 * v[:, 0], 4), (0.0, 0.0, 0.5))
    floor = displaced_ground(4.0, cells=1)
    models = (
        MeshModel(floor, "floor", dict(albedo=albedo)),
        MeshModel(ball, "ball", dict(MATTER, albedo=albedo)),
    )
    given = dict(models=models, lamps=(LAMP, OTHER), finish=SurfaceMaps(height))
    return World(CAMERA, **(given | more))


def grid(n):
    x = (2.0 * np.arange(n) + 1.0) / n - 1.0
    return 0.9 * np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)


P = grid(20)


@pytest.fixture(scope="module")
def made():
    return Renderer(world())


def off(made, **options):
    """Mean difference of values from `pixels`, over their mean; of gradients, over the edges'."""
    (whole, _), found = made.pixels(P, **options), made.radiance(P, **options)
    edges, slope = np.asarray(whole.edges), np.asarray(whole.gradient + whole.edges)
    value = np.asarray(whole.value)
    assert np.mean(abs(edges)) > 0.05 * np.mean(abs(slope))
    return max(
        np.mean(abs(found.value - value)) / np.mean(value),
        np.mean(abs(found.gradient - slope)) / np.mean(abs(edges)),
    )


@pytest.mark.smoke
def test_radiance_is_what_pixels_are(made):
    assert off(made) < SINGLE


def test_of_bands_and_of_distant_light_too():
    """Three bands of albedo; a sky whose nodes stand still, around which shadows move."""
    assert off(Renderer(world(albedo=(0.2, 0.5, 0.8)))) < SINGLE
    made = Renderer(world())
    lights = (LAMP, sky_light(GaussianSky((-0.3, -0.5, 0.8), 0.5), "even", 8))
    assert off(made, lights=lights) < 10.0 * SINGLE


def test_values_alone_are_the_same_values(made):
    both, alone = made.radiance(P), made.radiance(P, gradients=False)
    assert alone.gradient is None
    np.testing.assert_allclose(alone.value, both.value, rtol=1e-12)
    np.testing.assert_array_equal(alone.index, made.seen(P).index)


def test_shapes_are_left_to_pixels():
    floor = primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), albedo=0.6)
    models = world().models[1:]
    assert off(Renderer(world(models=models, scene=Scene.of(floor), finish=None))) < 1e-12


def test_blocks_change_nothing(made, monkeypatch):
    once = made.radiance(P)
    monkeypatch.setattr(_pixel_radiance, "STRETCH", 20000)
    monkeypatch.setattr(_pixel_radiance, "EDGES", 64)
    again = made.radiance(P)
    np.testing.assert_allclose(again.gradient, once.gradient, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    "fault", ["edges stand still", "limbs are met early", "jumps turned round"]
)
def test_faults_are_noticed(made, monkeypatch, fault):
    if fault == "edges stand still":
        monkeypatch.setattr(_pixel_radiance.MeshLight, "_move", lambda *a: None)
    elif fault == "limbs are met early":
        monkeypatch.setattr(_shadow_edges, "at_limb", lambda depth, before, hidden: depth)
    else:
        kept = _pixel_radiance.edge_weights

        monkeypatch.setattr(_pixel_radiance, "edge_weights", lambda *a: -kept(*a))
    assert off(made) > 10.0 * SINGLE


def test_blocks_hold_all_rows_once():
    for count in (0, 1, 15, 1000, 5000):
        rows = [s for s, size in blocks_of(count, 64) if s.stop - s.start <= size]
        assert [k for s in rows for k in range(s.start, s.stop)] == list(range(count))
    assert len({size for n in range(1, 3000) for _, size in blocks_of(n, 64)}) <= 5


# --- rays ----------------------------------------------------------------------------------------


def test_a_fan_is_rays_one_by_one():
    tracer = Embree(bumpy_sphere(0.5, lambda v: 0.0 * v[:, 0], 3))
    random = np.random.default_rng(0)
    a = np.append(random.uniform(-1.0, 1.0, (40, 2)), np.full((40, 1), -1.0), 1)
    b = np.append(random.uniform(-1.0, 1.0, (30, 2)), np.full((30, 1), 1.5), 1)
    start, end = np.repeat(a, 30, 0), np.tile(b, (40, 1))
    hidden = tracer.fan_occluded(a, b)
    assert 0.1 < hidden.mean() < 0.9
    np.testing.assert_array_equal(hidden.ravel(), tracer.between(start, end))
    share, true = tracer.first_share(start, end), tracer.nearest(start, end - start).t
    met = np.isfinite(share)
    np.testing.assert_array_equal(met, hidden.ravel())
    np.testing.assert_allclose(share[met], true[met], rtol=1e-5)


def test_a_fan_to_afar():
    tracer = Embree(bumpy_sphere(0.5, lambda v: 0.0 * v[:, 0], 3))
    a, ways = np.array([(0.0, 0.0, -2.0), (2.0, 0.0, -2.0)]), np.array([(0.0, 0.0, 0.1)])
    assert tracer.fan_occluded(a, ways, np.inf).ravel().tolist() == [True, False]
    found = tracer.first_share(a, np.repeat(ways, 2, 0), np.inf)
    np.testing.assert_allclose(found, [15.0, np.inf], rtol=1e-4)
