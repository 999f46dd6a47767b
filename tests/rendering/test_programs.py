"""Programs of blocks of pixels, against rays, balls and lamps by hand."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging._light_terms import light_frame
from firstorder.imaging._point_shading import shade_point
from firstorder.imaging.camera import pinhole
from firstorder.imaging.facets import mesh_facets
from firstorder.imaging.sky_lights import distant_lamp, sky_light
from firstorder.rendering import _programs as programs
from firstorder.space import Scene, plane, primitive, sphere
from firstorder.space.meshes.triangle_mesh import mesh
from firstorder.space.primitives import Material
from firstorder.space.skies import GaussianSky

Z = np.array([0.0, 0.0, 1.0])
CENTER, RADIUS = np.array([0.0, 0.0, 1.0]), 0.5
EYE = np.array([0.3, -3.0, 2.5])
CAMERA = pinhole(EYE, (0.0, 0.0, 0.6), gamma=2.0)
RGB = np.array([0.1, 0.4, 0.7])
# The ball's number is 0 or 1, as scenes sort shapes by kind.
SCENE = Scene.of(
    primitive(plane((0, 0, 0), Z), name="floor", albedo=RGB),
    primitive(sphere(CENTER, RADIUS), name="ball", albedo=0.5 * RGB, specular=0.3, exponent=9.0),
)
NAMES = [name or "" for name in SCENE.names]
FLOOR, BALL = NAMES.index("floor"), NAMES.index("ball")
GREY = Scene.of(
    primitive(plane((0, 0, 0), Z), name="floor", albedo=0.6),
    primitive(sphere(CENTER, RADIUS), name="ball", albedo=0.5),
)
# A face far away, and one in front of all, leaning, which is number 2 of the materials.
CORNERS = np.array([(-0.2, -1.5, 1.2), (0.6, -1.5, 1.3), (0.1, -1.3, 2.0)])
FACETS = mesh_facets(
    mesh(np.vstack([CORNERS + 9.0, CORNERS]), [[0, 1, 2], [3, 4, 5]]), None, [0, 2]
)
ALBEDO = np.zeros((3, 2, 3))
ALBEDO[2] = 0.2, 0.5, 0.8
MATTER = Material(
    jnp.zeros((3, 2)), jnp.asarray(ALBEDO), jnp.array([0.0, 0.0, 0.1]), jnp.array([1.0, 1.0, 4.0])
)
# The ball, the floor to its left, the floor behind it to the right.
P = np.array([[0.02, 0.1], [-0.5, -0.1], [0.7, 0.05]])
LAMP = Lamp((0.4, 0.2, 3.0), (0.0, 0.3, 0.0), (0.3, 0.0, 0.0), 2.0, 4, True)


def toward(p):
    """Unit rays of the camera, from its axes."""
    d = np.column_stack([p, np.full(len(p), -2.0)]) @ np.asarray(CAMERA.axes).T
    return d / np.linalg.norm(d, axis=1)[:, None]


def ball_way(x, d):
    """The share of d after which rays from x meet the ball, infinity for none."""
    w = x - CENTER
    a, b, c = np.sum(d * d, -1), np.sum(w * d, -1), np.sum(w * w, -1) - RADIUS**2
    square = b * b - a * c
    t = (-b - np.sqrt(np.maximum(square, 0.0))) / a
    return np.where((square > 0.0) & (t > 0.0), t, np.inf)


def floor_way(x, d):
    t = -x[..., 2] / d[..., 2]
    return np.where(t > 0.0, t, np.inf)


def test_camera_rays_and_what_they_meet():
    d = programs.directions(CAMERA, jnp.asarray(P))
    np.testing.assert_allclose(d, toward(P), rtol=1e-14)
    t, index = programs.met(SCENE, jnp.asarray(EYE), d)
    ways = np.stack([floor_way(EYE, toward(P)), ball_way(EYE, toward(P))])
    np.testing.assert_allclose(t, ways.min(0), rtol=1e-12)
    np.testing.assert_array_equal(index, np.array([FLOOR, BALL])[ways.argmin(0)])
    assert len(set(ways.argmin(0))) == 2


def test_the_sky_behind_has_a_gradient_in_the_image_in_every_band():
    power = np.array([1.0, 2.0, 5.0])
    sky, grey = (GaussianSky((0.3, 2.0, 1.0), 0.4, L) for L in (power, 1.0))
    value, gradient = programs.sky_of(sky, CAMERA, jnp.asarray(P))

    def of(p):
        return np.asarray(jax.vmap(grey)(jnp.asarray(toward(p))))

    h = 1e-5
    slope = np.stack([(of(P + h * e) - of(P - h * e)) / (2.0 * h) for e in np.eye(2)], -1)
    np.testing.assert_allclose(value, of(P)[:, None] * power, rtol=1e-12)
    np.testing.assert_allclose(gradient, slope[:, None] * power[:, None], rtol=1e-7)


# --- what a block shows --------------------------------------------------------------------------


def looked_at(scene, known, p, index, face, material=MATTER):
    one = (scene, known, material, CAMERA, None, jnp.asarray(p), jnp.asarray(index), face)
    return programs.looked_at((*one[:-1], jnp.asarray(face)))


def face_at(p):
    """Where camera rays meet the plane of the face, and its normal towards them."""
    up = np.cross(CORNERS[1] - CORNERS[0], CORNERS[2] - CORNERS[0])
    up = up / np.linalg.norm(up)
    d = toward(p)
    x = EYE + d * (((CORNERS[0] - EYE) @ up) / (d @ up))[:, None]
    return x, up * -np.sign(d @ up)[:, None]


Q = np.array([[0.02, 0.1], [-0.5, -0.1], [0.05, 0.3]])  # ball, floor, face


def true_block():
    """Positions, normals, numbers, albedos in bands, glossy shares and exponents at Q."""
    d = toward(Q)
    x = EYE + d * np.array([ball_way(EYE, d)[0], floor_way(EYE, d)[1], 1.0])[:, None]
    x[2:], n = face_at(Q[2:])
    up = np.stack([(x[0] - CENTER) / RADIUS, Z, n[0]])
    return x, up, [BALL, FLOOR, -1], np.stack([0.5 * RGB, RGB, [0.2, 0.5, 0.8]])


@pytest.fixture(scope="module")
def block():
    return looked_at(SCENE, FACETS, Q, [BALL, FLOOR, FLOOR], [-1, -1, 1])


def test_a_block_shows_shapes_and_models(block):
    x, up, on, albedo = true_block()
    np.testing.assert_allclose(block.point.position, x, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(block.up, up, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(block.point.normal, up, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(block.on, on)
    np.testing.assert_allclose(block.albedo, albedo, rtol=1e-12)
    np.testing.assert_array_equal(block.slope, np.zeros((3, 3, 3)))
    np.testing.assert_allclose(block.specular, [0.3, 0.0, 0.1])
    np.testing.assert_allclose(block.exponent, [9.0, 1e-6, 4.0])
    np.testing.assert_allclose(block.view.to_eye, -toward(Q), rtol=1e-12)
    np.testing.assert_allclose(block.S[0], -np.eye(2) / RADIUS, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(block.S[1:], 0.0, rtol=0.0, atol=1e-10)


def test_a_block_of_shapes_alone_or_of_a_model_alone_shows_them_likewise(block):
    first, last = slice(0, 2), slice(2, 3)
    shapes = looked_at(SCENE, None, Q[first], [BALL, FLOOR], [-1, -1])
    model = looked_at(None, FACETS, Q[last], [5], [1])
    for found, rows in ((shapes, first), (model, last)):
        jax.tree.map(
            lambda a, b, rows=rows: np.testing.assert_allclose(a, b[rows], rtol=0.0, atol=1e-12),
            found,
            block,
        )


def test_one_band_of_a_block_is_a_surface_interaction(block):
    band = eqx.tree_at(lambda a: (a.albedo, a.slope), block, (block.albedo[:, 1], jnp.ones((3, 3))))
    found = band.interaction
    assert found.point is not None
    np.testing.assert_array_equal(found.point.position, block.point.position)
    np.testing.assert_array_equal(found.view.distance, block.view.distance)
    np.testing.assert_array_equal(found.S, block.S)
    np.testing.assert_array_equal(found.lobe.albedo, block.albedo[:, 1])
    np.testing.assert_array_equal(found.lobe.specular, block.specular)
    np.testing.assert_array_equal(found.lobe.exponent, block.exponent)
    np.testing.assert_array_equal(found.lobe.slope, 1.0)


# --- ways to lights ------------------------------------------------------------------------------

SKY = sky_light(GaussianSky((0.3, 0.2, 1.0), 0.6, 2.0), "even", 3)
# It looks down and to the left: what is to its right lies behind it.
TURNED = Lamp((0.0, 0.0, 0.4), (0.0, 0.3, 0.0), (0.2, 0.0, -0.3), 2.0, 2)
LIGHTS = [LAMP, SKY, TURNED]


def test_ways_go_to_the_nodes_above_the_surface_that_shine_on_it(block):
    x, up, *_ = true_block()
    found = programs.ways(block, LIGHTS)
    for light, (way, lit) in zip(LIGHTS, found, strict=True):
        nodes, area = (np.asarray(a) for a in light.toward(jnp.zeros(3)))
        true = nodes - x[:, None] if light.near else np.broadcast_to(nodes, (3, *nodes.shape))
        np.testing.assert_allclose(way, true, rtol=0.0, atol=1e-12)
        ahead = np.sum(true * up[:, None], -1) > 0.0
        np.testing.assert_array_equal(lit, ahead & (np.sum(true * area, -1) < 0.0))
    assert 0 < np.sum(found[1].lit) < found[1].lit.size
    assert 0 < np.sum(found[2].lit) < found[2].lit.size


def hidden_shares(x, on, ways):
    """By hand: the ball hides, unless it is what the point lies on; the floor never does here."""
    t = ball_way(x[:, None], ways)
    return np.where((np.asarray(on) == BALL)[:, None], np.inf, t)


@pytest.fixture(scope="module")
def floor_block():
    """Three points of the floor of one band: in the penumbra, in the light, in the shadow."""
    at = np.array([[0.55, -0.1, 0.0], [1.5, 0.5, 0.0], [-0.15, -0.05, 0.0]])
    d = at - EYE
    local = d @ np.asarray(CAMERA.axes)
    p = -2.0 * local[:, :2] / local[:, 2:]
    return at, looked_at(GREY, None, p, [FLOOR] * 3, [-1] * 3, None)


def test_shapes_hide_nodes_at_shares_of_their_ways(floor_block):
    at, seen = floor_block
    found = programs.shares(seen, GREY, [LAMP, SKY])
    for light, share in zip((LAMP, SKY), found, strict=True):
        nodes = np.asarray(light.toward(jnp.zeros(3))[0])
        way = nodes - at[:, None] if light.near else np.broadcast_to(nodes, (3, *nodes.shape))
        up = way[..., 2] > 0.0
        true = hidden_shares(at, [FLOOR] * 3, way)
        np.testing.assert_allclose(np.asarray(share)[up], true[up], rtol=1e-9)
    hides = np.isfinite(found[0])
    assert 0 < hides[0].sum() < 16
    assert not hides[1].any()
    assert hides[2].all()


@pytest.mark.parametrize("name", ["near", "far"])
def test_what_hides_a_node_does_so_on_the_way_to_it(name):
    light = LAMP if name == "near" else distant_lamp(LAMP, jnp.zeros(3))
    x, up = np.array([[0.1, 0.2, 0.3]]), np.array([Z])
    nodes = light_frame(light, jnp.asarray(x), jnp.asarray(up))
    share = np.full((1, 16), np.inf)
    share[0, :3] = 0.25, 0.999, 3.0
    seen, depth = programs._occlusion(nodes, jnp.asarray(share), jnp.asarray(x))
    way = np.asarray(light.toward(jnp.asarray(x[0]))[0])
    if name == "near":  # what is behind a lamp hides nothing; depths are shares
        true, hidden = [0.25, 0.999], 2
    else:  # depths are metres
        true, hidden = share[0, :3] * np.linalg.norm(way[:3], axis=1), 3
    np.testing.assert_array_equal(seen[0], np.arange(16) >= hidden)
    np.testing.assert_allclose(depth[0, :hidden], true, rtol=1e-12)
    np.testing.assert_array_equal(depth[0, hidden:], 0.0)


# --- shading -------------------------------------------------------------------------------------


def by_hand(at, seen):
    """Diffuse radiance under LAMP: `albedo / pi sum L cos cos' dA / r^2` over its 16 nodes."""
    k = (2.0 * np.arange(4) + 1.0) / 4.0 - 1.0
    s, t = (a.ravel() for a in np.meshgrid(k, k, indexing="ij"))
    node = np.array([0.4, 0.2, 3.0]) + np.stack([0.3 * t, 0.3 * s, 0.0 * s], -1)
    way = node - at[:, None]
    r2 = np.sum(way**2, -1)
    return 0.6 / np.pi * 2.0 * np.sum(seen * way[..., 2] ** 2 / r2**2, -1) * 0.36 / 16.0


def test_a_block_is_shaded_with_and_without_shadows(floor_block):
    at, shown = floor_block
    share = programs.shares(shown, GREY, [LAMP])
    clear = programs.pixels(shown, [LAMP], None)
    shadowed = programs.pixels(shown, [LAMP], share)
    seen = ~np.isfinite(share[0])
    np.testing.assert_allclose(clear.value, by_hand(at, np.ones((3, 16))), rtol=1e-12)
    np.testing.assert_allclose(shadowed.value, by_hand(at, seen), rtol=1e-12, atol=1e-16)
    np.testing.assert_array_equal(clear.edges, 0.0)
    both = programs.pixels(shown, [LAMP, LAMP], [*share, *share])
    np.testing.assert_allclose(both.value, 2.0 * shadowed.value, rtol=1e-12)
    alone = programs.values(shown, [LAMP], share)
    np.testing.assert_array_equal(alone.value, shadowed.value)
    for name in ("gradient", "edges", "SV", "DV", "CV", "CDV", "distance", "cosine", "curvature"):
        np.testing.assert_array_equal(getattr(alone, name), 0.0)


def test_moving_shadows_are_those_of_points_one_by_one(floor_block):
    _, shown = floor_block
    share = np.asarray(programs.shares(shown, GREY, [LAMP])[0])
    found = programs.pixels(shown, [LAMP], [jnp.asarray(share)])
    first = jax.tree.map(lambda a: a[0], shown.interaction)
    hidden = np.isfinite(share[0])
    depth = np.where(hidden, share[0], 0.0)
    true = eqx.filter_jit(shade_point)(first, [LAMP], [(jnp.asarray(~hidden), jnp.asarray(depth))])
    assert np.abs(true.edges).max() > 1e-3
    np.testing.assert_allclose(found.edges[0], true.edges, rtol=1e-10)
    np.testing.assert_allclose(found.gradient[0], true.gradient, rtol=1e-10)


def test_bands_are_shaded_each_for_itself(block):
    found = programs.pixels(block, [LAMP], None)
    for k in range(3):
        band = eqx.tree_at(
            lambda a: (a.albedo, a.slope), block, (block.albedo[:, k], block.slope[..., k])
        )
        one = programs.pixels(band, [LAMP], None)
        for name in ("value", "gradient", "SV", "CDV"):
            np.testing.assert_allclose(getattr(found, name)[:, k], getattr(one, name), rtol=1e-12)
        np.testing.assert_allclose(found.CV, one.CV)
