"""What pixels show: a ball of faces against the ball, and normals that lean away."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.bandwidth import pixel_rates as maps
from firstorder.checks.tolerance import fitted_order
from firstorder.imaging.camera import pinhole
from firstorder.imaging.facets import Facets, facets
from firstorder.imaging.hits import seen, seen_facets
from firstorder.models.primitives import bumpy_sphere
from firstorder.space import Scene, sphere, thing
from firstorder.space.silhouettes.meshes import EveryFace

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
    return EveryFace(piece).first_face(eye, ways, 0.0, np.inf, nobody)


@pytest.mark.smoke
def test_a_ball_of_faces_comes_to_be_the_ball():
    """All with the square of the edges; so does the criterion, by what each of its factors errs."""
    p, names = places(), ("distance", "normal", "cosine", "S")
    ball = Scene.of(thing(sphere((0.0, 0.0, 0.0), 0.8)))
    true = seen(ball, CAMERA, p, np.zeros(len(p), int))
    np.testing.assert_allclose(true.S, np.broadcast_to(-np.eye(2) / 0.8, (len(p), 2, 2)), atol=1e-9)
    errors = []
    for levels in (2, 3):
        piece = bumpy_sphere(0.8, lambda v: 0.0 * v[:, 0], levels)
        at = seen_facets(facets(piece), CAMERA, p, faces_at(piece, p))
        off = {k: np.asarray(getattr(at, k)) - np.asarray(getattr(true, k)) for k in names}
        errors.append([np.sqrt(np.mean(off[k] ** 2)) for k in names])
        factors = [np.max(abs(off[k]) / getattr(true, k)) for k in ("distance", "cosine")]
        factors.append(np.max(np.linalg.norm(off["S"], 2, axis=(1, 2))) * 0.8)
        glossy = maps.glossy_map(1.3, at), maps.glossy_map(1.3, true)
        np.testing.assert_allclose(*glossy, rtol=1.1 * sum(factors))
        assert sum(factors) < 0.1 * 4.0 ** (2 - levels)
    orders = [fitted_order([0.25, 0.125], e) for e in np.array(errors).T]
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


def test_a_normal_that_leans_away_gives_way_to_the_faces_own():
    piece = bumpy_sphere(0.8, levels=2)
    flat, p = facets(piece), np.zeros((1, 2))
    face = faces_at(piece, p)
    corners = np.asarray(flat.corners)[face[0]]
    up = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    for lean, expected in (
        ((0.0, 0.6, 0.8), up / np.linalg.norm(up)),  # the eye is at -y
        ((0.0, -0.6, 0.8), (0.0, -0.6, 0.8)),
    ):
        normals = jnp.broadcast_to(jnp.array(lean), flat.normals.shape)
        known = seen_facets(Facets(flat.corners, normals, flat.part), CAMERA, p, face)
        np.testing.assert_allclose(known.normal[0], expected, atol=1e-12)
        np.testing.assert_allclose(known.cosine, np.sum(known.normal * known.to_eye, 1))
        assert np.all(known.cosine > 0.0)


def test_nothing_is_a_plane_across_the_ray():
    at = seen_facets(facets(bumpy_sphere(0.8, levels=2)), CAMERA, places(3), np.full(3, -1))
    np.testing.assert_allclose(at.cosine, 1.0)
    np.testing.assert_allclose(at.distance, 1.0)
    assert np.all(at.S == 0.0)
