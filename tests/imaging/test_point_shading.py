"""Shading of one pixel: what is summed, by NumPy; what is seen, by sums over nodes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging import _point_shading as shading
from firstorder.imaging._area_lights import LobeRadiance, SurfaceReflectance
from firstorder.imaging._interaction import SurfaceInteraction
from firstorder.imaging._reflection import SurfacePoint
from firstorder.imaging.camera import PixelFootprint
from firstorder.imaging.sky_lights import DistantLight, sky_light
from firstorder.space.skies import GaussianSky

RNG = np.random.default_rng(4)
LAMP = Lamp((0.3, -0.2, 2.0), (0.1, 0.5, 0.0), (0.7, 0.2, 0.1), 3.0, 4, True)


def some(*shape):
    return jnp.asarray(RNG.normal(size=shape))


def unit(a):
    return jnp.asarray(a) / np.linalg.norm(a)


def surface(normal=(0.1, -0.2, 1.0), specular=0.0):
    """A leaning, bumpy, curved point, and a camera's ray."""
    n = unit(normal)
    t = unit(np.cross((0.0, 1.0, 0.0), (0.2, 0.1, 1.0)))
    tangents = jnp.stack([t, unit(np.cross((0.2, 0.1, 1.0), t))], -1)
    view = PixelFootprint(
        jnp.zeros(3), unit((0.4, -1.0, 1.2)), jnp.array(2.5), some(3, 2), some(3, 2)
    )
    point = SurfacePoint(jnp.array([0.1, 0.2, 0.0]), tangents, n, some(3, 2))
    lobe = SurfaceReflectance(0.6, specular, 9.0, some(3))
    return SurfaceInteraction(point, view, lobe, some(2, 2))


def terms():
    return LobeRadiance(some(), some(2), some(3), some(3, 2), some(3), some(2))


# --- what a pixel is made of ---------------------------------------------------------------------


def test_a_pixel_sums_over_lights_and_lobes_and_takes_sizes_last():
    at = surface()
    found = [((terms(), terms()), some(2, 2)) for _ in range(3)]
    got = shading.shaded_pixel(at, found)
    both = [t for pair, _ in found for t in pair]
    x_D_p = np.asarray(at.point.tangents).T @ np.asarray(at.view.position_D_p)
    spatial = sum(np.asarray(t.SV + t.TV) + np.asarray(t.DV) @ np.asarray(t.CV) for t in both)
    angular = sum(np.asarray(t.angular) for t in both)
    np.testing.assert_allclose(got.value, sum(float(t.value) for t in both), rtol=1e-12)
    np.testing.assert_allclose(
        got.gradient, spatial @ x_D_p + angular @ np.asarray(at.view.to_eye_D_p), rtol=1e-12
    )
    moved = sum(np.asarray(m).sum(0) for _, m in found)
    np.testing.assert_allclose(got.edges, moved @ x_D_p, rtol=1e-12)
    for name in ("SV", "DV", "CDV"):
        sums = [sum(np.asarray(getattr(pair[k], name)) for pair, _ in found) for k in (0, 1)]
        np.testing.assert_allclose(getattr(got, name), np.linalg.norm(sums, axis=1), rtol=1e-12)
    n, dn = np.asarray(at.point.normal), np.asarray(at.point.turning)
    spin = np.linalg.norm(np.cross(n[:, None], dn, axis=0))
    np.testing.assert_allclose(got.CV, [spin, 2.0 * spin], rtol=1e-12)
    assert got.distance == 2.5
    up = np.cross(*np.asarray(at.point.tangents).T)
    np.testing.assert_allclose(got.cosine, up @ np.asarray(at.view.to_eye), rtol=1e-12)
    np.testing.assert_allclose(got.curvature, np.linalg.norm(np.asarray(at.S)), rtol=1e-12)


# --- what is seen --------------------------------------------------------------------------------


def test_nodes_are_hidden_by_what_is_nearer_and_only_of_distant_light_by_all():
    t, far = jnp.array([1.0, 3.0, 5.0, jnp.inf]), jnp.array([4.0, 4.0, 4.0, 4.0])
    seen, depth = shading.node_occlusion(t, far, True)
    np.testing.assert_array_equal(seen, [False, False, True, True])
    np.testing.assert_allclose(depth, [0.25, 0.75, 0.0, 0.0], rtol=1e-14)
    seen, depth = shading.node_occlusion(t, far, False)
    np.testing.assert_array_equal(seen, [False, False, False, True])
    np.testing.assert_allclose(depth, [1.0, 3.0, 5.0, 0.0], rtol=1e-14)


def diffuse(at, light, seen):
    """`albedo / pi sum L (n.w) (-a.w) / |d|^2` over the nodes that are seen."""
    way, area = (np.asarray(a) for a in light.toward(at.point.position))
    r2 = np.sum(way**2, -1)
    share = np.maximum(way @ np.asarray(at.point.normal), 0.0) * np.maximum(
        -(way * area).sum(-1), 0.0
    )
    return 0.6 / np.pi * np.sum(np.asarray(light.radiance) * np.asarray(seen) * share / r2**2)


shade = eqx.filter_jit(shading.shade_point)
SKY = sky_light(GaussianSky((0.6, 0.2, 0.4), 0.5, 2.0), "even", 3)


def above(at, light):
    way = np.asarray(light.toward(at.point.position)[0])
    return way @ np.cross(*np.asarray(at.point.tangents).T) > 0.0


def test_without_shadows_all_nodes_above_the_shading_normals_horizon_count():
    at = surface()
    got = shade(at, [LAMP, SKY])
    assert not above(at, SKY).all()
    true = diffuse(at, LAMP, np.ones(16)) + diffuse(at, SKY, np.ones(18))
    np.testing.assert_allclose(got.value, true, rtol=1e-12)
    np.testing.assert_array_equal(got.edges, 0.0)


def test_with_shadows_what_is_seen_above_the_surface_itself_counts():
    at = surface((0.9, 0.3, 0.5))  # a bump sees some of the sky below the surface's horizon
    rng = np.random.default_rng(0)  # of its own: some of what is seen is below the surface
    seen = [jnp.asarray(rng.random(k) < 0.6) for k in (16, 18)]
    depth = [jnp.where(s, 1.0, 0.4) for s in seen]
    got = shade(at, [LAMP, SKY], list(zip(seen, depth, strict=True)))
    true = sum(
        diffuse(at, light, np.asarray(s) & above(at, light))
        for light, s in zip((LAMP, SKY), seen, strict=True)
    )
    np.testing.assert_allclose(got.value, true, rtol=1e-12)
    assert true < diffuse(at, LAMP, seen[0]) + diffuse(at, SKY, seen[1])


def test_the_horizon_of_the_surface_itself_is_no_moving_shadow():
    at = surface((0.9, 0.3, 0.5))
    assert not above(at, SKY).all()
    got = shade(at, [SKY], [(jnp.ones(18), jnp.ones(18))])
    np.testing.assert_array_equal(got.edges, 0.0)
    np.testing.assert_allclose(got.value, diffuse(at, SKY, above(at, SKY)), rtol=1e-12)


def test_moving_shadows_are_those_of_a_straight_edge():
    """Half of an even lamp is hidden, half-way: `dB = int F grad V` over the edge, by hand.

    The floor is flat and the lamp parallel: with tau = 1/2 the edge moves by -dx. Of 4 columns the
    two on the left are hidden: going right uncovers them.
    """
    lamp = Lamp((0.0, 0.0, 2.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), 3.0, 4, True)
    axes, none = jnp.eye(3), jnp.zeros((3, 2))
    point = SurfacePoint(jnp.zeros(3), axes[:, :2], axes[2], none)
    view = PixelFootprint(jnp.zeros(3), axes[2], jnp.array(1.0), 2.0 * axes[:, :2], none)
    at = SurfaceInteraction(point, view, SurfaceReflectance(0.6), jnp.zeros((2, 2)))
    node = np.asarray(lamp.position)
    seen = node[:, 0] > 0.0
    got = shade(at, [lamp], [(jnp.asarray(seen), jnp.where(jnp.asarray(seen), 1.0, 0.5))])
    flat = Lamp((0.0, 0.0, 2.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), 3.0, 4)
    dark = shade(at, [flat], [(jnp.asarray(seen), jnp.where(jnp.asarray(seen), 1.0, 0.5))])
    assert got.edges[0] > 0.1
    np.testing.assert_allclose(got.edges[1], 0.0, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(dark.edges, 0.0)
    # F at the cells beside the edge, times 2 m of height, times 2 m of the footprint per unit.
    beside = np.abs(node[:, 0]) < 0.5
    way = node[beside]
    F = 0.6 / np.pi * 3.0 * way[:, 2] ** 2 / np.sum(way**2, -1) ** 2
    np.testing.assert_allclose(got.edges[0], 2.0 * 2.0 * F.mean(), rtol=1e-12)


# --- many pixels ---------------------------------------------------------------------------------


def doubled(a, b):
    """A block's pixels, of which every leaf says which row it is."""
    one, two = jnp.asarray(a), jnp.asarray(b)
    return shading.ShadedPixels(one, two, 2.0 * two, two, two, two, two, one, -one, 3.0 * one)


@pytest.mark.parametrize("block", [1, 2, 5])
@pytest.mark.parametrize("abreast", [1, 2])
def test_rows_are_shaded_in_blocks_and_the_others_are_zeros(block, abreast):
    a, b = np.arange(1.0, 8.0), np.arange(14.0).reshape(7, 2)
    rows = np.array([5, 0, 3])
    sizes = []

    def of(*given):
        sizes.append(len(given[0]))
        return doubled(*given)

    got = shading.shade_rows(of, (a, b), rows, block, None, abreast)
    whole = np.zeros(7)
    whole[rows] = a[rows]
    np.testing.assert_array_equal(got.value, whole)
    np.testing.assert_array_equal(got.cosine, -whole)
    assert got.edges.shape == (7, 2)
    np.testing.assert_array_equal(got.edges[rows], 2.0 * b[rows])
    assert set(sizes) == {block}


@pytest.mark.parametrize("bands", [None, 3])
def test_without_rows_all_is_dark(bands):
    got = shading.shade_rows(doubled, (np.zeros((4, 2)),), np.zeros(0, int), 2, bands)
    more = () if bands is None else (3,)
    shapes = {
        "value": (4, *more), "gradient": (4, *more, 2), "edges": (4, *more, 2), "SV": (4, *more, 2),
        "DV": (4, *more, 2), "CV": (4, 2), "CDV": (4, *more, 2), "distance": (4,), "cosine": (4,),
        "curvature": (4,),
    }  # fmt: skip
    for name, shape in shapes.items():
        np.testing.assert_array_equal(getattr(got, name), np.zeros(shape))


def test_a_sky_by_the_cosine_stands_about_the_normal_and_other_light_stays():
    n = unit((0.3, -0.4, 0.8))
    assert shading.oriented_light(LAMP, n) is LAMP
    sky = sky_light(GaussianSky((0.3, 0.2, 1.0), 0.4, 2.0), "cosine", 3)
    about = shading.oriented_light(sky, n)
    assert isinstance(about, DistantLight)
    way, area = (np.asarray(a) for a in about.toward(jnp.zeros(3)))
    assert np.all(way @ np.asarray(n) > 0.0)
    # Each node has the same share of pi.
    np.testing.assert_allclose(-(way * area).sum(-1) * (way @ np.asarray(n)), np.pi / len(way))
    jax.tree.map(np.testing.assert_array_equal, about, sky.about(n))
