"""The tracer of all faces: a single ray, of which few faces are tested, against many at once."""

import numpy as np
import pytest

from firstorder.space.meshes.triangle_mesh import mesh
from firstorder.space.silhouettes.face_tracers import BruteForceTracer, _touched_face
from tests.space.meshes.test_triangle_mesh import icosphere


def _first_faces_one_by_one():
    """First faces of rays to vertices of a shuffled ball: one after the other, and all at once."""
    rng = np.random.default_rng(0)
    vertices, faces = icosphere(4)
    tracer = BruteForceTracer(mesh(vertices, rng.permutation(faces)))
    eye = np.array([0.3, -0.2, 3.0])
    rays = vertices[rng.integers(0, len(vertices), 300)] * rng.choice([1.0, 1.3], (300, 1)) - eye
    skip = np.full((300, 2), -1)
    everywhere = tracer.first_face(eye, rays, 0.0, np.inf, skip)
    skip[::2, 1] = everywhere[::2]
    together = tracer.first_face(eye, rays, 0.0, np.inf, skip)
    each = (slice(k, k + 1) for k in range(len(rays)))
    alone = [tracer.first_face(eye, rays[k], 0.0, np.inf, skip[k])[0] for k in each]
    return np.array(alone), together


def test_a_single_ray_finds_what_many_find():
    alone, together = _first_faces_one_by_one()
    np.testing.assert_array_equal(alone, together)
    assert 0.2 < np.mean(together >= 0) < 1.0


@pytest.mark.parametrize("order", [[0, 1, 2], [0, 2, 1]], ids=["front", "back"])
def test_a_face_that_holds_a_point_is_touched_beside_it_on_its_own_side(order):
    """Rays to the middle of an edge, a little aside of it: into the face, out of it, and along."""
    face = np.array([[[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0]]])[:, order]
    ways, aside = np.tile([1.0, 0.0, 1.0], (3, 1)), np.array([[0, 1, 0], [0, -1, 0], [2, 1, 0]])
    skip = np.full((3, 2), -1)
    found = _touched_face(face, np.zeros(3), ways, 1e-3 * aside, np.full(3, 1e-9), skip)
    np.testing.assert_array_equal(found, [0, -1, 0])
    skip[0, 0] = 0
    found = _touched_face(face, np.zeros(3), ways, 1e-3 * aside, np.full(3, 1e-9), skip)
    np.testing.assert_array_equal(found, [-1, -1, 0])


def test_fault_spheres_too_small_for_their_faces_is_noticed(monkeypatch):
    right = BruteForceTracer._runs.func

    def smaller(tracer):
        order, middle, radius = right(tracer)
        return order, middle, 0.7 * radius

    monkeypatch.setattr(BruteForceTracer, "_runs", property(smaller))
    alone, together = _first_faces_one_by_one()
    assert np.any(alone != together)
