"""What pixels show: a ball of faces against the ball, and normals that lean away."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.bandwidth import pixel_rates as maps
from firstorder.checks.tolerance import fitted_order
from firstorder.imaging.camera import pinhole
from firstorder.imaging.facets import Facets, mesh_facets
from firstorder.imaging.hits import GBuffer, facet_gbuffer, gbuffer, primary_hits
from firstorder.imaging.images import render
from firstorder.io import SpaceFile
from firstorder.models.primitives import bumpy_sphere
from firstorder.space import Scene, box, plane, primitive, sphere
from firstorder.space.silhouettes.face_tracers import BruteForceTracer

CAMERA = pinhole((0.0, -3.0, 0.4), (0.0, 0.0, 0.0), gamma=2.0)


def places(count=60, seed=0):
    """Image coordinates within 0.8 of the rim of a ball of 0.8 m."""
    rng = np.random.default_rng(seed)
    t, r = 2.0 * np.pi * rng.random(count), 0.45 * np.sqrt(rng.random(count))
    return np.stack([r * np.cos(t), r * np.sin(t)], -1)


def faces_at(piece, p):
    """Faces that are seen, each of them asked."""
    eye, gamma = np.asarray(CAMERA.eye), np.full(len(p), -float(CAMERA.gamma))
    ways = np.column_stack([p, gamma]) @ np.asarray(CAMERA.axes).T
    nobody = np.full((len(p), 1), -1)
    return BruteForceTracer(piece).first_face(eye, ways, 0.0, np.inf, nobody)


@pytest.mark.smoke
def test_a_ball_of_faces_comes_to_be_the_ball():
    """All with the square of the edges; so does the criterion, by what each of its factors errs."""
    p, names = places(), ("distance", "normal", "cosine", "S")
    ball = Scene.of(primitive(sphere((0.0, 0.0, 0.0), 0.8)))
    true = gbuffer(ball, CAMERA, p, np.zeros(len(p), int))
    np.testing.assert_allclose(
        true.S, np.broadcast_to(-np.eye(2) / 0.8, (len(p), 2, 2)), rtol=0.0, atol=1e-9
    )
    errors = []
    for levels in (2, 3):
        piece = bumpy_sphere(0.8, lambda v: 0.0 * v[:, 0], levels)
        at = facet_gbuffer(mesh_facets(piece), CAMERA, p, faces_at(piece, p))
        off = {k: np.asarray(getattr(at, k)) - np.asarray(getattr(true, k)) for k in names}
        errors.append([np.sqrt(np.mean(off[k] ** 2)) for k in names])
        factors = [np.max(abs(off[k]) / getattr(true, k)) for k in ("distance", "cosine")]
        factors.append(np.max(np.linalg.norm(off["S"], 2, axis=(1, 2))) * 0.8)
        glossy = maps.glossy_bandwidth_map(1.3, at), maps.glossy_bandwidth_map(1.3, true)
        np.testing.assert_allclose(*glossy, rtol=1.1 * sum(factors))
        assert sum(factors) < 0.1 * 4.0 ** (2 - levels)
    orders = [fitted_order([0.25, 0.125], e) for e in np.array(errors).T]
    np.testing.assert_allclose(orders, 2.0, rtol=0.0, atol=0.1)


def test_a_normal_that_leans_away_gives_way_to_the_faces_own():
    piece = bumpy_sphere(0.8, levels=2)
    flat, p = mesh_facets(piece), np.zeros((1, 2))
    face = faces_at(piece, p)
    corners = np.asarray(flat.corners)[face[0]]
    up = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    for lean, expected in (
        ((0.0, 0.6, 0.8), up / np.linalg.norm(up)),  # the eye is at -y
        ((0.0, -0.6, 0.8), (0.0, -0.6, 0.8)),
    ):
        normals = jnp.broadcast_to(jnp.array(lean), flat.normals.shape)
        known = facet_gbuffer(Facets(flat.corners, normals, flat.part), CAMERA, p, face)
        np.testing.assert_allclose(known.normal[0], expected, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(known.cosine, np.sum(known.normal * known.to_eye, 1))
        assert np.all(known.cosine > 0.0)


def test_nothing_is_a_plane_across_the_ray():
    at = facet_gbuffer(mesh_facets(bumpy_sphere(0.8, levels=2)), CAMERA, places(3), np.full(3, -1))
    np.testing.assert_allclose(at.cosine, 1.0)
    np.testing.assert_allclose(at.distance, 1.0)
    assert np.all(at.S == 0.0)


FLOOR = plane((0.0, 0.0, -0.5), (0.0, 0.0, 1.0))
BALL = sphere((0.0, 0.0, 0.0), 0.5)
CUBE = box((0.6, -0.2, -0.5), (0.9, 0.2, 0.1))


def met_by_hand(p):
    """Distance to the ball and to the floor along rays, from their equations; infinite for none."""
    ways = np.column_stack([p, np.full(len(p), -2.0)]) @ np.asarray(CAMERA.axes).T
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    eye = np.asarray(CAMERA.eye)
    b = ways @ eye
    root = b**2 - (eye @ eye - 0.25)
    ball = np.where(root > 0.0, -b - np.sqrt(np.maximum(root, 0.0)), np.inf)
    floor = np.where(ways[:, 2] < 0.0, (-0.5 - eye[2]) / ways[:, 2], np.inf)
    return ways, ball, floor


def test_first_hits_of_an_image_are_those_of_the_equations():
    scene = Scene.of(primitive(FLOOR, name="floor"), primitive(BALL, name="ball"))
    hits = primary_hits(scene, CAMERA, (24, 16))
    assert hits.position.shape == (24, 16, 3)
    assert hits.label.shape == (24, 16)
    assert isinstance(hits, GBuffer)
    p = hits.p.reshape(-1, 2)
    assert np.ptp(p, 0) == pytest.approx([2.0 * 23 / 24, 2.0 * 15 / 24])
    ways, ball, floor = met_by_hand(p)
    numbers = np.array([*scene.named("ball"), *scene.named("floor"), -1])
    t = np.stack([ball, floor, np.full(len(p), 1e9)])
    first = np.argmin(t, 0)
    assert set(first) == {0, 1, 2}
    np.testing.assert_array_equal(hits.index.ravel(), numbers[first])
    met, eye = first < 2, np.asarray(CAMERA.eye)
    position = eye + np.min(t, 0)[:, None] * ways
    np.testing.assert_allclose(hits.distance.ravel()[met], np.min(t, 0)[met], rtol=1e-9)
    np.testing.assert_allclose(
        hits.position.reshape(-1, 3)[met], position[met], rtol=0.0, atol=1e-9
    )
    normal = np.where(first[:, None] == 0, position / 0.5, [0.0, 0.0, 1.0])
    np.testing.assert_allclose(hits.normal.reshape(-1, 3)[met], normal[met], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(hits.to_eye.reshape(-1, 3), -ways, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(hits.distance.ravel()[~met], 1.0)
    other = primary_hits(scene, CAMERA, (24, 16), half_width=0.9)
    assert np.any(other.index != hits.index)  # the comparison can fail


def test_places_are_seen_as_pixels_are_and_faces_are_told_apart():
    scene = Scene.of(primitive(FLOOR), primitive(BALL), primitive(CUBE, name="cube"))
    image = primary_hits(scene, CAMERA, 40)
    places = image.p.reshape(-1, 2)[::7]  # as many that the last block is not whole
    some = primary_hits(scene, CAMERA, p=places)
    for a, b in zip(jax.tree.leaves(some), jax.tree.leaves(image), strict=True):
        np.testing.assert_array_equal(a, b.reshape(1600, *b.shape[2:])[::7])
    table = some.to_xarray()
    np.testing.assert_array_equal(np.stack([table.px, table.py], -1), places)
    (cube,) = scene.named("cube")
    seen = image.index == cube
    faces = {int(k): image.normal[seen & (image.label == k)] for k in np.unique(image.label[seen])}
    assert len(faces) >= 2
    for normals in faces.values():
        np.testing.assert_allclose(
            normals, np.broadcast_to(normals[0], normals.shape), rtol=0.0, atol=1e-12
        )


def test_no_places_and_no_size():
    scene = Scene.of(primitive(BALL))
    assert primary_hits(scene, CAMERA, p=np.zeros((0, 2))).position.shape == (0, 3)
    for given in ({}, {"size": 4, "p": np.zeros((1, 2))}):
        with pytest.raises(ValueError, match="`size` or `p`"):
            primary_hits(scene, CAMERA, **given)
    with pytest.raises(ValueError, match="columns"):
        primary_hits(scene, CAMERA, 0)


def test_a_size_may_be_any_integer_and_is_refused_in_one_sentence():
    scene = Scene.of(primitive(sphere((0.0, 0.0, 0.0), 0.8)))
    assert primary_hits(scene, CAMERA, np.int64(2)).index.shape == (2, 2)
    for size in ((2, 2, 3), ()):
        with pytest.raises(ValueError, match=r"^Argument `size` must be one integer or two"):
            primary_hits(scene, CAMERA, size)


@pytest.mark.parametrize("p", [np.zeros((3, 3)), np.zeros(3)])
def test_places_of_three_coordinates_are_refused(p):
    scene = Scene.of(primitive(sphere((0.0, 0.0, 0.0), 0.8)))
    says = r"^Argument `p` must have two coordinates|parameter p="  # a check of shapes is first
    with pytest.raises((ValueError, TypeError), match=says):
        primary_hits(scene, CAMERA, p=p)


@pytest.mark.parametrize(
    "see", [lambda s: primary_hits(s, CAMERA, 2), lambda s: render(s, CAMERA, 2, 2)]
)
def test_the_contents_of_a_file_are_no_scene(see):
    space = SpaceFile((primitive(sphere((0.0, 0.0, 0.0), 0.8)),))
    with pytest.raises(TypeError, match=r"^Argument `scene` must be a Scene|parameter scene="):
        see(space)
