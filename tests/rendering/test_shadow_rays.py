"""Shadow rays and camera rays through meshes, against every face asked in another way."""

import numpy as np
import pytest

from firstorder.imaging.camera import pinhole
from firstorder.io import Embree
from firstorder.models.plants import tree
from firstorder.models.primitives import (
    bar_lattice,
    bumpy_sphere,
    join_meshes,
    place_mesh,
    rotation_about,
)
from firstorder.rendering.shadow_rays import camera_hits, is_visible, mesh_blockers
from firstorder.shadowfield.rendering.lamp import lamp_frame
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays
from firstorder.space.meshes.triangle_mesh import mesh


def crossings(piece, a, b):
    """Shares of the way from a to b at all faces, NaN where one is missed: Moeller, Trumbore."""
    A, B, C = np.moveaxis(np.asarray(piece.vertices, float)[np.asarray(piece.faces)], 1, 0)
    e, f = B - A, C - A
    d = (b - a)[:, None]
    p = np.cross(d, f)
    det = np.sum(p * e, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = a[:, None] - A
        u = np.sum(p * s, -1) / det
        q = np.cross(s, e)
        v = np.sum(d * q, -1) / det
        t = np.sum(q * f, -1) / det
    inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0) & (t < 1.0)
    return np.where(inside, t, np.nan), np.minimum(np.minimum(u, v), 1.0 - u - v)


def rays(count, seed=0):
    rng = np.random.default_rng(seed)
    a = np.column_stack([rng.uniform(-2, 2, (count, 2)), np.full(count, -1.5)])
    b = np.column_stack([rng.uniform(-1, 1, (count, 2)), np.full(count, 2.5)])
    return a, b


@pytest.fixture(scope="module")
def things():
    ball = bumpy_sphere(0.6, levels=2)
    plate = place_mesh(bar_lattice((3, 3)), (0.2, 0.1, 1.0), rotation_about((1.0, 0.5, 0.2), 0.3))
    return ball, plate


@pytest.mark.smoke
def test_first_and_last_blockers_are_those_of_every_face(things):
    both, _ = join_meshes(things)
    a, b = rays(1500)
    t, edge = crossings(both, a, b)
    grazing = np.any((abs(edge) < 1e-4) & np.isfinite(edge), 1)  # by any face's edge or its plane
    with np.errstate(invalid="ignore"):
        hidden = np.any(np.isfinite(t), 1)
    first = 1.0 - np.max(np.where(np.isnan(t), -np.inf, t), 1)  # from the lamp
    last = 1.0 - np.min(np.where(np.isnan(t), np.inf, t), 1)
    assert 0.2 < hidden.mean() < 0.8
    assert np.sum(last - first > 0.1) > 100  # more than one thing in between
    for found in (
        mesh_blockers(Embree(both))(a, b),
        mesh_blockers([Embree(p) for p in things])(a, b),
    ):
        clear = ~grazing
        np.testing.assert_array_equal(np.isfinite(found[0]), hidden, err_msg="no ray grazes here")
        np.testing.assert_allclose(
            found[0][clear & hidden], first[clear & hidden], rtol=0.0, atol=1e-9
        )
        np.testing.assert_allclose(
            found[1][clear & hidden], last[clear & hidden], rtol=0.0, atol=1e-9
        )
        assert np.all(np.isposinf(found[0][~hidden]))
        assert np.all(np.isneginf(found[1][~hidden]))
    np.testing.assert_array_equal(is_visible(Embree(both), a, b), ~hidden)
    np.testing.assert_array_equal(is_visible([Embree(p) for p in things], a, b), ~hidden)


def test_only_grazing_rays_are_told_otherwise_in_single_precision():
    piece, _ = tree(800, seed=2, forks=(4, 3))
    a, b = rays(20000, 1)
    a, b = a + np.array([0, 0, 1.0]), b + np.array([0, 0, 3.0])
    tracer = Embree(piece)
    other = np.flatnonzero(is_visible(tracer, a, b) == tracer.occluded(a, b))
    assert len(other) <= 5
    if len(other):
        _, edge = crossings(piece, a[other], b[other])
        assert np.all(np.nanmin(abs(edge), 1) < 1e-3)


def test_faces_on_which_ends_lie_do_not_hide():
    piece = bumpy_sphere(1.0, lambda n: np.zeros(len(n)), levels=3)
    middle = np.asarray(piece.corners, float).mean(1)
    lamp = np.broadcast_to([0.0, 0.0, 6.0], middle.shape)
    n = np.cross(*(np.asarray(piece.corners, float)[:, k] - middle for k in (0, 1)))
    n /= np.linalg.norm(n, axis=1)[:, None]
    cosine = np.sum(n * (lamp - middle), 1) / np.linalg.norm(lamp - middle, axis=1)
    got = is_visible(Embree(piece), middle, lamp)
    assert np.all(got[cosine > 0.05])  # a ball is convex
    assert not np.any(got[cosine < -0.05])
    first, _ = mesh_blockers(Embree(piece))(middle, lamp)
    assert np.all(np.isinf(first[cosine > 0.05]))


def test_a_table_of_rays_knows_depths_below_the_lamp(things):
    lamp = lamp_frame((0, 0, 2.5), (0, 0.5, 0), (0.5, 0, 0))
    plate = place_mesh(bar_lattice((0, 0), thickness=0.1), (0, 0, 1.0))
    points = np.array([[0.0, 0.0, -1.5], [5.0, 0.0, -1.5]])
    table, owner = trace_shadow_rays(lamp, points, 8, mesh_blockers(Embree(plate)))
    under = owner == 0
    np.testing.assert_allclose(table.near[under], 2.5 - 1.05, rtol=1e-5)
    np.testing.assert_allclose(table.far[under], 2.5 - 0.95, rtol=1e-5)
    assert np.all(table.free[~under])


def test_a_camera_sees_the_nearest_face_and_its_part(things):
    both, part = join_meshes(things)
    camera = pinhole((0.5, -4.0, 1.5), (0.0, 0.0, 0.3), gamma=2.0)
    p = np.random.default_rng(3).uniform(-1, 1, (500, 2))
    found = camera_hits(Embree(both), camera, p, part)
    eye, axes = np.asarray(camera.eye, float), np.asarray(camera.axes, float)
    ends = eye + 10.0 * (np.column_stack([p, np.full(len(p), -2.0)]) @ axes.T)
    t, _ = crossings(both, np.broadcast_to(eye, ends.shape), ends)
    some = np.any(np.isfinite(t), 1)
    np.testing.assert_array_equal(found.face >= 0, some)
    assert 50 < some.sum() < 450
    nearest = np.nanargmin(t[some], 1)
    np.testing.assert_array_equal(part[nearest], found.part[some])
    expected = eye + np.nanmin(t[some], 1)[:, None] * (ends[some] - eye)
    np.testing.assert_allclose(found.position[some], expected, rtol=0.0, atol=1e-9)
    distance = np.linalg.norm(expected - eye, axis=1)
    np.testing.assert_allclose(found.distance[some], distance, rtol=1e-9)
    corners = np.asarray(both.corners, float)[found.face[some]]
    at = np.einsum("rk,rki->ri", found.weights[some], corners)
    np.testing.assert_allclose(at, expected, rtol=0.0, atol=1e-6)
    # unit, across the face, towards the eye
    np.testing.assert_allclose(np.linalg.norm(found.normal[some], axis=1), 1.0, rtol=1e-12)
    edge = corners[:, 1] - corners[:, 0]
    np.testing.assert_allclose(np.sum(found.normal[some] * edge, 1), 0.0, rtol=0.0, atol=1e-9)
    assert np.all(np.sum(found.normal[some] * (eye - expected), 1) >= 0.0)
    assert np.all(np.isnan(found.position[~some]))
    assert np.all(found.part[~some] == -1)
    assert np.all(camera_hits(Embree(both), camera, p).part[some] == 0)


def test_what_cannot_be_asked_is_refused():
    tracer = Embree(mesh([[0, 0, 2], [1, 0, 2], [0, 1, 2]], [[0, 1, 2]]))
    with pytest.raises(ValueError, match="Argument `tracers` must hold a tracer"):
        mesh_blockers([])
    with pytest.raises(ValueError, match="must be finite and apart"):
        is_visible(tracer, np.zeros((1, 3)), np.zeros((1, 3)))
    with pytest.raises(ValueError, match=r"`parts` must have shape \(1,\)"):
        camera_hits(
            tracer, pinhole((0, 0, 3), (0, 0, 0), (0, 1, 0)), np.zeros((1, 2)), np.zeros(2, int)
        )
