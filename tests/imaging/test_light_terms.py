"""Terms of blocks of points: those of one point after the other, for every kind of light."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging import _light_terms as module
from firstorder.imaging._area_lights import SurfaceReflectance, lobe_radiance, shadow_edge_terms
from firstorder.imaging._interaction import SurfaceInteraction
from firstorder.imaging._point_shading import oriented_light
from firstorder.imaging._reflection import SurfacePoint
from firstorder.imaging.camera import PixelFootprint
from firstorder.imaging.sky_lights import distant_lamp, sky_light
from firstorder.numerics._vectors import orthonormal_frame, unit
from firstorder.space.skies import GaussianSky
from tests.precision import as_dtype

SKY = GaussianSky((0.3, 0.2, 1.0), 0.4, 2.0)
POINTS = 7
LAMP = Lamp((0.3, -0.2, 2.0), (0.1, 0.5, 0.0), (0.7, 0.2, 0.1), 3.0, 5, True, (0.2, -0.1))
LIGHTS = {
    "lamp": LAMP,
    "lamp of Gauss": Lamp((0.3, -0.2, 2.0), (0.1, 0.5, 0.0), (0.7, 0.2, 0.1), 3.0, 5),
    "even": sky_light(SKY, "even", 4, (0.1, -0.2)),
    "cosine": sky_light(SKY, "cosine", 4, (0.1, -0.2)),
    "luminance": sky_light(SKY, "luminance", 4),
    "far": distant_lamp(LAMP, jnp.zeros(3)),
}


@functools.cache
@jax.jit
def points():
    """Bumpy, curved, glossy, textured points about the floor's middle."""
    rng = np.random.default_rng(5)

    def about(up, spread):
        return unit(jnp.asarray(up + spread * rng.normal(size=(POINTS, 3))))

    base = about(np.array([0.0, 0.0, 1.0]), 0.4)
    tangents = orthonormal_frame(base)[:, :, :2]
    turn = jnp.asarray(rng.normal(size=(POINTS, 3, 2)))
    x = jnp.asarray(0.3 * rng.normal(size=(POINTS, 3)))
    point = jax.vmap(SurfacePoint)(x, tangents, about(base, 0.2), turn)
    none = jnp.zeros((POINTS, 3, 2))
    to_eye = about(np.array([0.0, -1.0, 1.0]), 0.3)
    view = jax.vmap(PixelFootprint)(x, to_eye, jnp.ones(POINTS), none, none)
    number = [jnp.asarray(rng.uniform(a, b, POINTS)) for a, b in ((0.2, 0.9), (0.1, 0.5), (2, 40))]
    lobe = jax.vmap(SurfaceReflectance)(*number, jnp.asarray(rng.normal(size=(POINTS, 3))))
    return jax.vmap(SurfaceInteraction)(point, view, lobe, jnp.zeros((POINTS, 2, 2)))


def shadows(light):
    """Visibility in patches, so that there are edges of all kinds, and depths."""
    rng = np.random.default_rng(6)
    rows, columns = light.shape
    low = rng.random((POINTS, rows // 2 + 1, columns // 2 + 1)) < 0.5
    seen = low.repeat(2, 1).repeat(2, 2)[:, :rows, :columns].reshape(POINTS, -1)
    depth = np.where(seen, 0.0, rng.uniform(0.3, 0.5, seen.shape))
    return jnp.asarray(seen, float), jnp.asarray(depth)


@eqx.filter_jit
def one_by_one(light, at, seen, depth):
    def one(at, seen, depth):
        lamp = oriented_light(light, at.point.base_normal)
        above = lamp.toward(at.point.position)[0] @ at.point.base_normal > 0.0
        seen, depth = jnp.where(above, seen, 0.0), jnp.where(above, depth, 0.0)
        terms = lobe_radiance(lamp, seen, at.point, at.view.to_eye, at.lobe)
        if not lamp.even:
            return terms, jnp.zeros((2, 2))
        moved = shadow_edge_terms(lamp, seen, depth, at.point, at.view.to_eye, at.lobe)
        return terms, jnp.stack(moved)

    return jax.vmap(one)(at, seen, depth)


def apart(light):
    """Largest difference of each term from the one by one, over the term's size."""
    at, given = points(), shadows(light)
    found = eqx.filter_jit(lambda *a: module.light_terms(*a))(light, at, *given)
    true = one_by_one(light, at, *given)
    sizes = [
        np.max(np.abs(a - b)) / max(float(np.max(np.abs(b))), 1e-300)
        for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(true), strict=True)
    ]
    return max(sizes)


@pytest.mark.parametrize("name", LIGHTS)
def test_a_block_has_the_terms_of_its_points(name):
    assert apart(LIGHTS[name]) < 1e-11


def test_without_shadows_all_nodes_above_the_shading_horizon_count():
    @jax.jit
    def both(at):
        def one(at):
            return lobe_radiance(LAMP, jnp.ones(25), at.point, at.view.to_eye, at.lobe)[0].value

        return module.light_terms(LAMP, at), jax.vmap(one)(at)

    ((diffuse, _), moved), true = both(points())
    np.testing.assert_allclose(diffuse.value, true, rtol=1e-12)
    np.testing.assert_array_equal(moved, 0.0)


def _unwrapped(V, depth, axis, wraps, near, kind=module._edge_weights):
    return kind(V, depth, axis, False, near)


FAULTS = {
    "the contour is not continued": ("TO_LIMB", 0.0, "lamp"),
    "a sky's last column has no neighbour": ("_edge_weights", _unwrapped, "even"),
    "the surface's frame is turned back": (
        "orthonormal_frame",
        lambda n: jnp.swapaxes(orthonormal_frame(n), -1, -2),
        "cosine",
    ),
    "the mirror leans the other way": (
        "half_turn",
        lambda n: jnp.eye(3) - 2.0 * jnp.outer(n, n),
        "lamp",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_seen(monkeypatch, fault):
    name, wrong, light = FAULTS[fault]
    monkeypatch.setattr(module, name, wrong)
    assert apart(LIGHTS[light]) > 1e-4


@eqx.filter_jit
def values_and_slopes(*given):
    both, moved = module.light_terms(*given)
    return [t.value for t in both], [*(jax.vmap(lambda t: t.spatial)(t) for t in both), moved]


@pytest.mark.parametrize("unit", [1e-10, 1e-9, 1e9])
def test_the_unit_of_length_is_of_no_matter_in_single_precision(unit):
    def terms(unit):
        edges = [unit * np.asarray(a) for a in (LAMP.center, LAMP.u, LAMP.v)]
        lamp = Lamp(*edges, 3.0, 4, True)
        at = points()
        at = eqx.tree_at(
            lambda a: (a.point.position, a.point.turning, a.lobe.slope),
            at,
            (unit * at.point.position, at.point.turning / unit, at.lobe.slope / unit),
        )
        seen = jnp.broadcast_to((jnp.arange(16) % 4 < 2) * 1.0, (POINTS, 16))
        given = as_dtype((lamp, at, seen, jnp.full((POINTS, 16), 0.4)), "float32")
        values, slopes = values_and_slopes(*given)
        return [*values, *(unit * a for a in slopes)]

    for a, b in zip(terms(unit), terms(1.0), strict=True):
        assert a.dtype == np.float32
        np.testing.assert_allclose(a, b, rtol=1e-3, atol=1e-4 * np.max(np.abs(b)))
