"""All models of a world under one tracer, against planes of triangles by hand."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging.sky_lights import distant_lamp
from firstorder.io.scenes.space_toml import MeshModel
from firstorder.rendering._pixel_radiance import OFF
from firstorder.rendering._traced_models import TracedModels
from firstorder.space.meshes.triangle_mesh import mesh

# A leaning square high up of two triangles, and one triangle below it, to the right.
SQUARE = np.array([(-1.0, -1.0, 2.0), (1.0, -1.0, 2.4), (1.0, 1.0, 2.4), (-1.0, 1.0, 2.0)])
LEAF = np.array([(2.0, -1.0, 1.0), (4.0, -1.0, 1.0), (2.0, 1.0, 1.5)])
FACES = [[0, 1, 2], [0, 2, 3]]
UV = np.arange(12.0).reshape(2, 3, 2)
LEAN = np.array([(0.6, 0.0, 0.8), (0.0, 0.0, 1.0), (0.0, 0.6, 0.8)])


def models():
    square = MeshModel(mesh(SQUARE, FACES), "square", {}, UV)
    leaf = MeshModel(mesh(LEAF, [[0, 1, 2]]), "leaf", {})
    return TracedModels([square, leaf], [None, LEAN], 3)


@pytest.fixture(scope="module")
def traced():
    return models()


def plane_way(corners, x, d):
    """The share of d at which it meets the plane of three points."""
    up = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return (corners[0] - x) @ up / (d @ up)


def test_faces_of_all_models_count_on(traced):
    facets = traced.facets
    np.testing.assert_array_equal(facets.part, [3, 3, 4])
    corners = [SQUARE[[0, 1, 2]], SQUARE[[0, 2, 3]], LEAF]
    np.testing.assert_array_equal(facets.corners, corners)
    np.testing.assert_array_equal(traced.embree.mesh.corners, corners)
    np.testing.assert_array_equal(facets.normals[2], LEAN)
    np.testing.assert_allclose(facets.normals[0, 0], np.array([-0.2, 0, 1]) / 1.04**0.5, rtol=1e-6)
    np.testing.assert_array_equal(facets.uv[:2], UV)
    np.testing.assert_array_equal(facets.uv[2], np.zeros((3, 2)))


def test_normals_are_the_vertices_own_if_none_are_given():
    one = TracedModels([MeshModel(mesh(LEAF, [[0, 1, 2]]), "leaf", {})], None, 0)
    up = np.cross(LEAF[1] - LEAF[0], LEAF[2] - LEAF[0])
    np.testing.assert_allclose(one.facets.normals[0], [up / np.linalg.norm(up)] * 3, rtol=1e-6)
    np.testing.assert_array_equal(one.facets.part, [0])


def test_rays_from_an_eye_meet_faces_of_models(traced):
    eye = np.array([0.0, 0.0, 5.0])
    to = np.array([(0.5, -0.3, 2.3), (-0.4, 0.6, 2.0), (2.5, -0.5, 1.2)])
    d = (to - eye) / np.linalg.norm(to - eye, axis=1)[:, None]
    t, face, number = traced.seen_from(eye, d)
    np.testing.assert_array_equal(face, [0, 1, 2])
    np.testing.assert_array_equal(number, [3, 3, 4])
    true = [plane_way(c, eye, w) for c, w in zip((SQUARE, SQUARE, LEAF), d, strict=True)]
    np.testing.assert_allclose(t, true, rtol=1e-12)


def test_normals_look_against_rays(traced):
    up = np.array([[-0.2, 0.0, 1.0], [-0.2, 0.0, 1.0], [0.0, -0.25, 1.0]])
    up = up / np.linalg.norm(up, axis=1)[:, None]
    down = np.array([(0.1, 0.2, -1.0), (-0.6, 0.0, 0.3), (0.9, 0.5, -0.2)])
    # The second ray goes with its face's front, the others against it.
    found = traced.normals_against(np.array([0, 1, 2]), down)
    np.testing.assert_allclose(found, up * np.array([[1.0], [-1.0], [1.0]]), rtol=1e-6)
    np.testing.assert_allclose(traced.normals_against(np.array([0, 1, 2]), -down), -found)


def test_a_face_without_area_has_no_normal_and_a_small_one_a_unit_one():
    flat = mesh([(0, 0, 0), (0.5, 0, 0), (1, 0, 0), (0, 0.5, 0)], [[0, 1, 2], [0, 1, 3]])
    one = TracedModels([MeshModel(flat, "flat", {})], None, 0)
    found = one.normals_against(np.array([0, 1]), np.array([(0.0, 0.0, 1.0)] * 2))
    np.testing.assert_array_equal(found, [(0.0, 0.0, 0.0), (0.0, 0.0, -1.0)])


# --- what hides nodes ----------------------------------------------------------------------------

LAMP = Lamp((0.2, 0.1, 4.0), (0.0, 1.5, 0.0), (1.5, 0.0, 0.0), 1.0, 6, True)
X = np.array([(0.0, 0.0, 0.0), (-1.6, 0.2, 0.0), (0.1, 0.2, 3.0)])
Z = np.tile((0.0, 0.0, 1.0), (3, 1))


def inside(q):
    """Whether places on the square's plane lie on the square: its shadow from above is one."""
    return np.all(np.abs(q[..., :2]) < 1.0, -1)


def ways_of(light):
    nodes = np.asarray(light.toward(jnp.zeros(3))[0])
    return nodes - X[:, None] if light.near else np.broadcast_to(nodes, (3, *nodes.shape)).copy()


def by_hand(way):
    """Shares of the ways at which the square hides them; the leaf lies away from them all."""
    start = X + OFF * 4.2 * Z  # the box around all is some 5 m
    share = np.array(
        [[plane_way(SQUARE, s, d) for d in row] for s, row in zip(start, way, strict=True)]
    )
    hits = inside(start[:, None] + share[..., None] * way) & (share > 0.0)
    return np.where(hits, share, np.inf)


def hidden(traced, light, depths, lit=None, share=None):
    way = ways_of(light)
    lit = np.full(way.shape[:2], True) if lit is None else lit
    share = np.full(way.shape[:2], np.inf) if share is None else share
    return traced.hidden(X, Z, way, lit, share, light, depths)


@pytest.mark.parametrize("name", ["near", "far"])
def test_nodes_are_hidden_by_models_on_the_way(traced, name):
    light = LAMP if name == "near" else distant_lamp(LAMP, jnp.zeros(3))
    true = by_hand(ways_of(light))
    if light.near:
        true[true > 1.0] = np.inf
    found = hidden(traced, light, False)
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(true))
    assert 0 < np.isfinite(true[1]).sum() < 36
    assert not np.isfinite(true[2]).any()
    np.testing.assert_array_equal(found[np.isfinite(found)], 0.5)


@pytest.mark.parametrize("name", ["near", "far"])
def test_beside_edges_the_share_is_that_of_the_blocker(traced, name):
    """Two nodes deep; further inside some share on the way stands for it."""
    light = LAMP if name == "near" else distant_lamp(LAMP, jnp.zeros(3))
    true = by_hand(ways_of(light))
    found = hidden(traced, light, True)
    blocked = np.isfinite(true)
    seen = ~blocked.reshape(3, 6, 6)
    near = np.zeros_like(seen)  # within two nodes along a row or a column of one that is seen
    for axis in (1, 2):
        for step in (-2, -1, 1, 2):
            moved = np.roll(seen, step, axis)
            if not (light.wraps and axis == 2):
                edge = [slice(None)] * 3
                edge[axis] = slice(0, step) if step > 0 else slice(step, None)
                moved[tuple(edge)] = False
            near |= moved
    beside = near.reshape(3, 36) & blocked
    assert beside.any()
    np.testing.assert_allclose(found[beside], true[beside], rtol=0.0, atol=2e-4)
    np.testing.assert_array_equal(np.isfinite(found), blocked)
    if light.near:
        rest = blocked & ~beside
        assert rest.any()
        np.testing.assert_array_equal(found[rest], 0.5)


def test_what_is_not_lit_is_not_asked_and_what_shapes_hide_sooner_stays(traced):
    lit = np.full((3, 36), True)
    lit[0, 14] = False
    share = np.full((3, 36), np.inf)
    share[0, 15], share[0, 20], share[2, 3] = 0.1, 0.9, 0.7
    found = hidden(traced, LAMP, False, lit, share.copy())
    assert found[0, 14] == np.inf
    assert found[0, 15] == 0.1
    assert found[0, 20] == 0.5
    assert found[2, 3] == 0.7
    assert found[2, 4] == np.inf


def test_shapes_behind_a_lamp_hide_nothing_from_its_edges(traced):
    """A node that only what lies behind the lamp would hide is a seen neighbour of the others."""
    share = np.full((3, 36), np.inf)
    share[1] = 1.5
    kept, found = hidden(traced, LAMP, True), hidden(traced, LAMP, True, share=share)
    met = np.isfinite(kept)
    np.testing.assert_array_equal(found[met], kept[met])
    share = np.full((3, 36), np.inf)
    share[1] = 0.9  # on the way: all hidden, so that there is no edge
    whole = hidden(traced, LAMP, True, share=share)
    np.testing.assert_array_equal(whole[1][met[1]], 0.5)


def test_distant_light_is_hidden_by_what_is_far_away():
    """However short the ways are that say where it is."""
    far = LEAF + np.array([-60.0, 0.0, 30.0])
    one = TracedModels([MeshModel(mesh(far, [[0, 1, 2]]), "far", {})], None, 0)
    x, up = np.array([(50.0, 0.0, 0.0), (50.0, 9.0, 0.0)]), Z[:2]
    way = 0.2 * (far.mean(0) - x[:1]) / 100.0 * np.array([[1.0], [-1.0]])
    way = np.stack([way, way])
    light = distant_lamp(Lamp((0, 0, 9), (0, 1, 0), (1, 0, 0), count=1), jnp.zeros(3))
    found = one.hidden(x, up, way, np.full((2, 2), True), np.full((2, 2), np.inf), light, False)
    np.testing.assert_array_equal(found, [[0.5, np.inf], [np.inf, np.inf]])


def test_the_face_on_which_a_point_lies_does_not_hide_the_light_before_it(traced):
    """Seen from behind it does: the point is a little before the side that is asked for."""
    up = np.array([-0.2, 0.0, 1.0]) / np.sqrt(1.04)
    x = np.stack([SQUARE[[0, 1, 2]].mean(0)] * 2)
    way = np.array([[(0.1, 0.1, 1.0), (0.3, -0.2, 0.5)]] * 2)
    share = np.full((2, 2), np.inf)
    sides = np.stack([up, -up])
    found = traced.hidden(x, sides, way, np.full((2, 2), True), share, LAMP, False)
    np.testing.assert_array_equal(found, [[np.inf, np.inf], [0.5, 0.5]])
