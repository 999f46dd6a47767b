"""Pixels lit by lamps: gradients against differences of pixels, terms against plain geometry."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging._interaction import surface_interaction
from firstorder.imaging._point_shading import shade_point
from firstorder.imaging.camera import pinhole
from firstorder.imaging.images import pixel_labels
from firstorder.imaging.shading import SurfaceMaps, _shade_pixel, _shadow_rays, shade_pixels
from firstorder.imaging.sky_lights import sky_light
from firstorder.space import ConstantSky, Scene, plane, primitive, sphere
from tests import drawn_lamp

SCENE = Scene.of(
    primitive(
        plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        name="floor",
        albedo=0.5,
        specular=0.2,
        exponent=20.0,
    ),
    primitive(sphere((-0.8, 0.0, 0.5), 0.5), name="dull", albedo=0.7),
    primitive(sphere((0.6, 0.2, 0.5), 0.5), name="bumpy", albedo=0.3, specular=0.4, exponent=30.0),
)
FLOOR, DULL, BUMPY = (SCENE.named(name)[0] for name in ("floor", "dull", "bumpy"))
LAMP = Lamp((-0.5, -1.0, 2.5), (0.5, 0.0, 0.0), (0.0, -0.4, -0.3), 8.0, 6, True)
CAMERA = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.4), gamma=2.0)
PENUMBRA = (-0.575, -0.225)
PLACES = np.array(
    [(-0.4, 0.05), (-0.35, -0.02), (0.33, 0.06), (0.25, 0.0), (0.05, -0.3), (0.9, 0.9)]
)
SHOWN = [DULL, DULL, BUMPY, BUMPY, FLOOR, -1]


def height(index, x):
    bumps = 0.01 * jnp.sin(20.0 * x[0]) * jnp.sin(20.0 * x[1]) * jnp.sin(20.0 * x[2])
    return jnp.where(index == BUMPY, bumps, 0.0)


def pixels(p=PLACES, **options):
    return shade_pixels(SCENE, CAMERA, [LAMP], p, np.array(SHOWN), SurfaceMaps(height), **options)


@pytest.fixture(scope="module")
def still():
    return pixels(shadows=False)


def test_the_places_show_what_they_should():
    index, _ = pixel_labels(SCENE, CAMERA, jnp.asarray(PLACES))
    np.testing.assert_array_equal(index, SHOWN)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_normal_map_of_bumps_is_these_bumps_from_both_sides(side):
    """One waved sheet: what is a bump from the front is a dip from behind, for its map too."""
    sheet = Scene.of(primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), albedo=0.5))
    eye = pinhole((0.3, -1.0, side), (0.0, 0.0, 0.0))

    def waves(index, x):
        return 0.02 * jnp.sin(9.0 * x[0] + 0.4) * jnp.cos(7.0 * x[1])

    at, index = jnp.array([0.1, -0.2]), jnp.array(0)
    bumps = surface_interaction(sheet, eye, at, index, SurfaceMaps(waves)).point
    mapped = surface_interaction(
        sheet, eye, at, index, SurfaceMaps(slopes=jax.grad(waves, 1))
    ).point
    leaning = jnp.append(jax.grad(waves, 1)(0, bumps.position)[:2], 0.0)
    assert side * bumps.normal[2] > 0.9
    up = jnp.array([0.0, 0.0, 1.0]) - leaning
    np.testing.assert_allclose(mapped.normal, side * up / jnp.sqrt(up @ up), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(mapped.normal, bumps.normal, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(mapped.turning, bumps.turning, rtol=0.0, atol=1e-12)


def test_the_gradient_is_the_images(still):
    """Sixth-order differences of the pixels' values; nothing is shadowed."""
    h = 1e-3
    for axis in (0, 1):
        step = h * np.eye(2)[axis]
        slope = sum(
            w * (pixels(PLACES + k * step, shadows=False).value
                 - pixels(PLACES - k * step, shadows=False).value)
            for k, w in ((1, 0.75), (2, -0.15), (3, 1.0 / 60.0))
        ) / h  # fmt: skip
        np.testing.assert_allclose(
            still.gradient[:, axis], slope, rtol=0.0, atol=2e-9 * np.ptp(slope)
        )
    assert np.all(np.linalg.norm(still.gradient[:5], axis=1) > 1e-3)


def test_without_shadow_rays_all_of_a_sky_is_seen():
    """Its rows and columns are not equally many."""
    at = surface_interaction(SCENE, CAMERA, jnp.asarray(PLACES[4]), jnp.array(FLOOR))
    dome = sky_light(ConstantSky(0.7), "even", 4)
    assert dome.shape == (4, 8)
    free, seen = eqx.filter_jit(
        lambda: [shade_point(at, [dome], s) for s in (None, [(jnp.ones(32), jnp.ones(32))])]
    )()
    assert free.value > 0.1
    np.testing.assert_allclose(free.value, seen.value, rtol=1e-14)
    np.testing.assert_allclose(free.gradient, seen.gradient, rtol=1e-12)


def test_the_sky_is_zeros(still):
    for field in jax.tree.leaves(still):
        np.testing.assert_array_equal(field[-1], 0.0)


def test_curvature_and_view_are_plain_geometry(still):
    eye = np.array([0.0, -4.0, 2.0])
    d = np.array([np.asarray(CAMERA.direction(jnp.asarray(p))) for p in PLACES[:5]])
    x = eye + still.distance[:5, None] * d
    np.testing.assert_allclose(np.linalg.norm(x[:2] - (-0.8, 0.0, 0.5), axis=1), 0.5, rtol=1e-12)
    np.testing.assert_allclose(x[4, 2], 0.0, rtol=0.0, atol=1e-12)
    normal = np.array([*((x[:2] - (-0.8, 0.0, 0.5)) / 0.5), *((x[2:4] - (0.6, 0.2, 0.5)) / 0.5),
                       (0.0, 0.0, 1.0)])  # fmt: skip
    np.testing.assert_allclose(still.cosine[:5], -np.sum(normal * d, 1), rtol=1e-12)
    radii = np.array([0.5, 0.5, 0.5, 0.5, np.inf])
    np.testing.assert_allclose(still.curvature[:5], np.sqrt(2.0) / radii, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(
        still.CV[:2], np.sqrt(2.0) / 0.5 * np.array([[1, 2]] * 2), rtol=1e-12
    )
    assert np.all(still.CV[2:4, 0] > 2.0 * np.sqrt(2.0))  # the bumps turn it faster
    np.testing.assert_array_equal(still.CDV[4], 0.0)  # a flat floor
    np.testing.assert_array_equal(still.SV[:2, 1], 0.0)  # no gloss


def test_shadows_darken_and_move():
    """The floor in a penumbra: differences of values along the image, over many nodes."""
    lamp = Lamp((-0.5, -1.0, 2.5), (0.5, 0.0, 0.0), (0.0, -0.4, -0.3), 8.0, 64, True)
    at, h = np.array(PENUMBRA), 0.02
    steps = [k * s for k in (0.5, 1.0) for s in h * np.eye(2)]
    p = np.concatenate([[at], *([at + s, at - s] for s in steps)])

    @eqx.filter_jit
    def seen(p, shadows):
        def one(p):
            return _shade_pixel(SCENE, CAMERA, [lamp], p, jnp.array(FLOOR), shadows=shadows)

        return jax.vmap(one)(p)

    here, bright = seen(jnp.asarray(p), True), seen(jnp.asarray(p[:1]), False)
    assert 0.1 < here.value[0] / bright.value[0] < 0.9
    half, whole = ((here.value[1::2] - here.value[2::2]) / (2.0 * h)).reshape(2, 2)
    slope = (4.0 * 2.0 * half - whole) / 3.0  # the error of second order drops out
    with_edges = here.gradient[0] + here.edges[0]
    assert np.linalg.norm(with_edges - slope) < 0.02 * np.linalg.norm(slope)
    assert np.linalg.norm(here.gradient[0] - slope) > 0.5 * np.linalg.norm(slope)


def test_what_hides_a_node_lies_at_its_share_of_the_way():
    scene = Scene.of(primitive(sphere((0.0, 0.0, 1.0), 0.2)))
    lamp = Lamp((0.0, 0.0, 3.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), 1.0, 3, True)
    seen, depth = _shadow_rays(scene, jnp.zeros(3), lamp, jnp.array(-1))
    np.testing.assert_array_equal(seen, np.arange(9) != 4)
    np.testing.assert_allclose(depth, np.where(np.arange(9) == 4, 0.8 / 3.0, 0.0), rtol=1e-15)


def test_without_a_lamp_there_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `lamps` must hold a light, but is empty\."):
        shade_pixels(SCENE, CAMERA, [], PLACES, np.array(SHOWN))


def test_a_ceiling_does_not_hide_the_lamp_that_is_drawn_on_it():
    floor = primitive(drawn_lamp.board(0.0, 5.0), albedo=0.5)
    ceiling = primitive(drawn_lamp.board(drawn_lamp.HEIGHT, 5.0, up=False))
    lit, alone = (
        shade_pixels(
            scene, drawn_lamp.CAMERA, [drawn_lamp.LAMP], drawn_lamp.PLACES, np.zeros(2, int)
        )
        for scene in (Scene.of(floor, ceiling), Scene.of(floor))
    )
    assert np.all(alone.value > 0.0)
    np.testing.assert_allclose(lit.value, alone.value, rtol=1e-9)
