"""The renderer: shapes as `imaging.shading` has them, meshes as the shapes that they stand for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging._area_lights import SurfaceReflectance, lobe_radiance
from firstorder.imaging._reflection import SurfacePoint
from firstorder.imaging.camera import pinhole
from firstorder.imaging.shading import SurfaceMaps, shade_pixels
from firstorder.io import Embree, SpaceFile
from firstorder.io.scenes.space_toml import MeshModel
from firstorder.models.primitives import bumpy_sphere, displaced_ground, place_mesh
from firstorder.rendering._shadow_edges import beside_seen
from firstorder.rendering.renderer import Renderer, World
from firstorder.space import Scene, plane, primitive, sphere
from firstorder.space.meshes import mesh
from firstorder.space.skies import ConstantSky, GaussianSky
from tests import drawn_lamp

MATTER = dict(albedo=0.5, specular=0.2, exponent=20.0)
FLOOR = primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), albedo=0.6)
BALL = primitive(sphere((0.0, 0.0, 0.5), 0.5), **MATTER)
LAMP = Lamp((-1.0, -1.5, 2.5), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0), 8.0, 5, True)
CAMERA = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.4), gamma=2.4)
SHAPES = World(CAMERA, Scene.of(BALL, FLOOR), lamps=(LAMP,))


def meshed(levels=5):
    """The ball as a mesh; the floor stays what it is."""
    ball = place_mesh(bumpy_sphere(0.5, lambda v: 0.0 * v[:, 0], levels), (0.0, 0.0, 0.5))
    return World(CAMERA, Scene.of(FLOOR), (MeshModel(ball, "ball", MATTER),), (LAMP,))


def grid(n):
    x = (2.0 * np.arange(n) + 1.0) / n - 1.0
    return 0.8 * np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)


P = grid(16)


@pytest.fixture(scope="module")
def shapes():
    return Renderer(SHAPES)


@pytest.fixture(scope="module")
def models():
    return Renderer(meshed())


@pytest.mark.smoke
def test_shapes_are_shaded_as_ever(shapes):
    found, index = shapes.pixels(P)
    true = shade_pixels(SHAPES.scene, CAMERA, [LAMP], P, index)
    assert set(index) == {0, 1}
    for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(true), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12)


def test_a_fine_mesh_is_the_shape_that_it_stands_for(shapes, models):
    """Away from the limb; the ball's shadow on the floor, its own shade, and all terms."""
    (ball, one), (mesh, other) = shapes.pixels(P), models.pixels(P)
    same = (one == 0) == (other == 1)
    assert same.mean() > 0.98
    well = same & (ball.cosine > 0.3)
    for name, most in (("value", 0.02), ("gradient", 0.05), ("SV", 0.03), ("CDV", 0.03)):
        a, b = (np.asarray(getattr(f, name))[well] for f in (mesh, ball))
        assert np.sqrt(np.mean((a - b) ** 2)) < most * np.sqrt(np.mean(b**2)), name


def test_values_alone_are_the_same_values(models):
    whole, _ = models.pixels(P)
    value, _ = models.pixels(P, gradients=False)
    np.testing.assert_array_equal(whole.value > 0.0, value.value > 0.0)
    np.testing.assert_allclose(value.value, whole.value, rtol=1e-12)
    np.testing.assert_array_equal(value.gradient, 0.0)


def test_gradients_of_a_mesh_are_the_images(models):
    """Where nothing is shadowed: differences of values inside one face."""
    made = models
    at = np.array([(-0.15, 0.1), (-0.05, 0.15), (0.02, 0.05)])
    found, _ = made.pixels(at, shadows=False)
    h = 1e-5
    for k in (0, 1):
        step = h * np.eye(2)[k]
        ahead, behind = (made.pixels(at + s, shadows=False)[0].value for s in (step, -step))
        slope = (ahead - behind) / (2.0 * h)
        np.testing.assert_allclose(found.gradient[:, k], slope, rtol=1e-5)


@pytest.mark.parametrize("bands", [None, 3])
def test_radiance_is_the_value_of_pixels_and_the_sum_of_their_gradients(bands):
    """Of a mesh and of the empty sky beside it, but for depths in single precision."""
    matter = MATTER if bands is None else dict(MATTER, albedo=(0.2, 0.5, 0.7))
    ball = MeshModel(meshed(3).models[0].mesh, "ball", matter)
    made = Renderer(World(CAMERA, models=(ball,), lamps=(LAMP,)))
    at = np.array([(-0.15, 0.1), (0.02, 0.05), (0.9, 0.9), (0.1, 0.25)])
    (whole, index), found = made.pixels(at), made.radiance(at)
    assert index.tolist() == found.index.tolist() == [0, 0, -1, 0]
    np.testing.assert_allclose(found.value, whole.value, rtol=1e-3)
    slope = np.asarray(whole.gradient + whole.edges)
    assert found.gradient is not None
    assert found.gradient.shape == slope.shape
    np.testing.assert_allclose(found.gradient, slope, rtol=1e-2, atol=1e-3)
    np.testing.assert_array_equal(found.value[2], 0.0)
    np.testing.assert_array_equal(found.gradient[2], 0.0)
    value = made.radiance(at, gradients=False)
    assert value.gradient is None
    np.testing.assert_allclose(value.value, found.value, rtol=1e-12)


def test_a_meshs_shadow_moves(models):
    """The floor behind the ball, with many nodes: differences of values."""
    lamp = Lamp(*(LAMP.center, LAMP.u, LAMP.v), 8.0, 32, True)
    made = Renderer(models.world._replace(lamps=(lamp,)))
    at, h = np.array([0.4667, -0.1333]), 0.01
    p = np.concatenate([[at], *([at + s, at - s] for s in h * np.eye(2))])
    found, index = made.pixels(p)
    assert set(index) == {0}
    slope = (found.value[1::2] - found.value[2::2]) / (2.0 * h)
    whole = found.gradient[0] + found.edges[0]
    assert np.linalg.norm(found.edges[0]) > 0.5 * np.linalg.norm(slope)
    assert np.linalg.norm(whole - slope) < 0.1 * np.linalg.norm(slope)


def test_what_hangs_behind_a_lamp_hides_none_of_its_nodes(models):
    """Shadows move as they do without it: a blocker's depth is asked beside edges alone."""
    at = np.array([[0.4667, -0.1333]])
    alone, _ = models.pixels(at)
    ceiling = primitive(plane((0.0, 0.0, 4.0), (0.0, 0.0, -1.0)), albedo=0.6)
    under = Renderer(models.world._replace(scene=Scene.of(FLOOR, ceiling)))
    found, index = under.pixels(at)
    assert index.tolist() == [0]
    assert np.linalg.norm(alone.edges) > 0.0
    for name in ("value", "gradient", "edges"):
        np.testing.assert_allclose(getattr(found, name), getattr(alone, name), rtol=1e-12)


def test_a_mesh_shades_from_afar():
    """A ball of 1 m hangs 12 m above the floor and hides the middle of a small sky."""
    high = (0.0, 0.0, 12.0)
    sky = GaussianSky((0.0, 0.0, 1.0), 0.03)
    ball = MeshModel(
        place_mesh(bumpy_sphere(0.5, lambda v: 0.0 * v[:, 0], 4), high), "ball", MATTER
    )
    given = dict(sky=sky, sky_rows=16, sky_nodes="luminance")
    eye = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.0), gamma=2.4)
    shape = World(eye, Scene.of(FLOOR, primitive(sphere(high, 0.5), **MATTER)), **given)
    at = np.array([(0.0, 0.0), (0.3, 0.0)])
    true, _ = Renderer(shape).pixels(at)
    bare, _ = Renderer(shape._replace(scene=Scene.of(FLOOR))).pixels(at)
    found, _ = Renderer(World(eye, Scene.of(FLOOR), (ball,), **given)).pixels(at)
    assert true.value[0] < 0.6 * bare.value[0]
    # The mesh's limb is 0.1 % of the radius inside the ball's, and no node lies between them: with
    # four times that (level 3) none does. So the same nodes are seen.
    np.testing.assert_allclose(found.value, true.value, rtol=1e-9)


@pytest.mark.parametrize("as_mesh", [False, True])
def test_a_leaning_normal_sees_nothing_through_its_own_surface(as_mesh):
    """A lamp stands on end, through the floor: what of it is below is hidden, by shapes and meshes.

    Its nodes are above the horizon of the shading normal, which leans towards it.
    """
    eye = pinhole((-1.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    lamp = Lamp((2.0, 0.0, 0.1), (0.0, 0.5, 0.0), (0.0, 0.0, -0.5), 8.0, 4, True)
    lean = SurfaceMaps(slopes=lambda index, x: jnp.array([-0.75, 0.0, 0.0]))
    floor = (MeshModel(displaced_ground(9.0, cells=1), "floor", MATTER),) if as_mesh else ()
    shapes = (
        None if as_mesh else Scene.of(primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), **MATTER))
    )
    made = Renderer(World(eye, shapes, floor, (lamp,), finish=lean))
    found, _ = made.pixels(np.zeros((1, 2)))

    above = np.asarray(lamp.position[:, 2] > 0.0)
    assert 0 < above.sum() < above.size
    up = jnp.array([0.6, 0.0, 0.8])
    point = SurfacePoint(jnp.zeros(3), jnp.eye(3)[:, :2], up, jnp.zeros((3, 2)))
    lobe = SurfaceReflectance(*(MATTER[k] for k in ("albedo", "specular", "exponent")))
    way = jnp.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0)
    seen, every = (
        sum(float(t.value) for t in lobe_radiance(lamp, share, point, way, lobe))
        for share in (jnp.asarray(above, float), jnp.ones(above.size))
    )
    assert seen < 0.9 * every
    np.testing.assert_allclose(found.value, seen, rtol=1e-9)
    np.testing.assert_allclose(
        found.edges, 0.0, rtol=0.0, atol=1e-12
    )  # a flat surface's horizon stands still


def test_layers_know_lamps_and_sky():
    eye = pinhole((0.0, -4.0, 1.0), (-1.0, -1.5, 2.5), gamma=1.0)
    sky = GaussianSky((0.0, 0.0, 1.0), 0.6)
    made = Renderer(World(eye, Scene.of(FLOOR), lamps=(LAMP,), sky=sky, sky_rows=4))
    layers = made.layers(np.array([(0.0, 0.0), (0.0, 0.9), (0.0, -0.9)]))
    assert layers["index"].tolist() == [1.0, -1.0, 0.0]
    assert layers["value"][0] == 8.0
    d = np.asarray(eye.direction(jnp.array([0.0, 0.9])))
    np.testing.assert_allclose(layers["value"][1], sky(jnp.asarray(d)), rtol=1e-12)
    assert layers["SV"][2] > 0.0 < layers["DV.diffuse"][2]
    for name in ("grad.u", "shadow.v", "CV", "CDV", "distance", "cosine", "curvature"):
        assert np.all(np.isfinite(layers[name]))


def test_lamps_are_numbered_behind_shapes_and_models(models):
    eye = pinhole((0.0, -4.0, 1.0), LAMP.center, gamma=1.0)
    beside = eye.eye + eye.direction(jnp.array([0.5, 0.0]))
    dim = Lamp(beside, (0.0, 0.1, 0.0), (0.1, 0.0, 0.0), 3.0, 5, True)
    made = Renderer(models.world._replace(camera=eye, lamps=(LAMP, dim)))
    layers = made.layers(np.array([(0.0, 0.0), (0.5, 0.0)]))
    assert layers["index"].tolist() == [2.0, 3.0]
    assert layers["value"].tolist() == [8.0, 3.0]


def test_passes_see_other_nodes_of_one_mean(shapes):
    lights = [shapes.lights_of(k)[0] for k in range(3)]
    np.testing.assert_array_equal(lights[0].shift, 0.0)
    assert len({tuple(np.asarray(a.shift)) for a in lights}) == 3
    assert all(np.all(np.abs(a.shift) <= 0.5) for a in lights)


def test_passes_in_pairs_gather_a_constant_sky_exactly():
    """A row's cells all light a surface as their middles do; out of them, by an odd power more."""
    eye = pinhole((0.0, -1.0, 2.0), (0.0, 0.0, 0.0))
    sky = World(eye, Scene.of(FLOOR), sky=ConstantSky(2.0), sky_rows=4, sky_nodes="cosine")
    made = Renderer(sky)
    found = [
        made.pixels(np.zeros((1, 2)), gradients=False, lights=made.lights_of(k))[0].value[0]
        for k in range(5)
    ]
    expected = 0.6 * 2.0
    np.testing.assert_allclose(found[0], expected, rtol=1e-12)
    assert min(abs(np.array(found[1:]) / expected - 1.0)) > 1e-3
    for pair in (found[1:3], found[3:5]):
        np.testing.assert_allclose(np.mean(pair), expected, rtol=1e-12)


def test_depths_are_asked_where_edges_are():
    hidden = np.zeros((1, 6, 6), bool)
    hidden[0, :, 2:] = True
    np.testing.assert_array_equal(beside_seen(hidden, False)[0, 0], [0, 0, 1, 1, 0, 0])
    np.testing.assert_array_equal(beside_seen(hidden, True)[0, 0], [0, 0, 1, 1, 1, 1])


def test_there_must_be_something_to_see():
    with pytest.raises(ValueError, match="must have a shape or a model, but has none"):
        Renderer(World(CAMERA, lamps=(LAMP,)))
    with pytest.raises(ValueError, match="must have a lamp or a sky, but has none"):
        Renderer(World(CAMERA, Scene.of(FLOOR)))
    assert Embree(meshed(1).models[0].mesh).mesh.count == 80


def test_a_world_of_other_things_is_one_sentence():
    file = SpaceFile((primitive(sphere((0.0, 0.0, 0.0), 1.0)),))
    with pytest.raises(TypeError, match=r"^Argument `scene` must be a Scene"):
        Renderer(World(CAMERA, file, lamps=(LAMP,)))
    with pytest.raises(TypeError, match=r"^Argument `lamps` must be a tuple of lamps: write"):
        Renderer(World(CAMERA, file.scene, lamps=LAMP))
    with pytest.raises(TypeError, match=r"^Argument `camera` must be a camera, as"):
        Renderer(World(None, file.scene, lamps=(LAMP,)))


@pytest.mark.parametrize("ask", ["pixels", "radiance"])
def test_a_place_that_is_nan_is_no_pixel_of_the_sky(shapes, ask):
    with pytest.raises(ValueError, match=r"^Argument `p` must be finite, but is nan\.$"):
        getattr(shapes, ask)(np.array([[0.1, np.nan]]))


def test_normals_are_given_for_each_model():
    with pytest.raises(ValueError, match=r"`normals` must have one entry for each of 1"):
        Renderer(meshed(1)._replace(normals=(None, None)))


def test_shapes_do_not_hide_the_lamp_that_is_drawn_on_them():
    floor = primitive(drawn_lamp.board(0.0, 5.0), albedo=0.5)
    ceiling = primitive(drawn_lamp.board(1.0, 5.0, up=False))
    lamp = drawn_lamp.LAMP
    lamp = Lamp(lamp.center + 0.3 * drawn_lamp.Q[:, 2], lamp.u, lamp.v, 1.0, 8, True)
    lit, alone = (
        Renderer(World(drawn_lamp.CAMERA, scene, lamps=(lamp,))).pixels(drawn_lamp.PLACES)[0].value
        for scene in (Scene.of(floor, ceiling), Scene.of(floor))
    )
    assert np.all(alone > 0.0)
    np.testing.assert_allclose(lit, alone, rtol=1e-9)


def test_meshes_do_not_hide_the_lamp_that_is_drawn_on_them():
    def card(z):
        corners = drawn_lamp.corners(z, 3.0)
        return MeshModel(mesh(corners, [[0, 1, 2], [0, 2, 3]]), "card", {"albedo": 0.5})

    models = card(0.0), card(drawn_lamp.HEIGHT)
    room, alone = (
        Renderer(World(drawn_lamp.CAMERA, None, some, (drawn_lamp.LAMP,)))
        for some in (models, models[:1])
    )
    p = drawn_lamp.PLACES
    expected = alone.pixels(p)[0].value
    assert np.all(expected > 0.0)
    # Shadow rays end a little before the lamp, and not on the nodes.
    np.testing.assert_allclose(room.pixels(p)[0].value, expected, rtol=1e-3)
    np.testing.assert_allclose(room.radiance(p).value, expected, rtol=1e-3)
    p = np.meshgrid(np.linspace(-0.15, 0.3, 40), np.linspace(0.2, 0.45, 40))
    p = np.stack(p, -1).reshape(-1, 2)
    shown = alone.seen(p).index == 1
    assert np.sum(shown) > 100
    np.testing.assert_array_equal(room.seen(p).index == 2, shown)
