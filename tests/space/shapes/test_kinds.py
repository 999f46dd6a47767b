"""Every kind of shape against its definition: points on it, rays to it, normals of it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import Boxes, Cylinders, Discs, Ellipsoids, Planes, Rectangles, Triangles
from firstorder.space.shapes import kinds

rng = np.random.default_rng(5)
CENTER = np.array([0.3, -0.2, 0.4])
AXES = np.array([[0.9, 0.2, 0.1], [-0.1, 0.7, 0.2], [0.2, -0.3, 0.8]])
FLATS = (Discs, Rectangles, Triangles, Planes)
ORIGINS = rng.uniform(-3.0, 3.0, (400, 3))
TARGETS = CENTER + rng.uniform(-0.8, 0.8, (400, 3))


def implicit(kind, q):
    """Zero on the canonical shape, negative inside; for flat ones how far out of the outline."""
    x, y, z = np.moveaxis(q, -1, 0)
    return {
        Ellipsoids: np.sqrt(x * x + y * y + z * z) - 1.0,
        Boxes: np.maximum(np.maximum(abs(x), abs(y)), abs(z)) - 1.0,
        Cylinders: np.maximum(np.hypot(x, y), abs(z)) - 1.0,
        Discs: np.hypot(x, y) - 1.0,
        Rectangles: np.maximum(abs(x), abs(y)) - 1.0,
        Triangles: np.maximum(np.maximum(-x, -y), x + y - 1.0),
        Planes: 0.0 * x - 1.0,
    }[kind]


@pytest.fixture(scope="module", params=kinds.KINDS)
def traced(request):
    """A kind, and what 400 rays find on one of it."""
    row = jax.tree.map(lambda a: a[0], request.param(CENTER, AXES))
    along = TARGETS - ORIGINS
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    o, d = jnp.asarray(ORIGINS), jnp.asarray(along)
    t = jax.vmap(lambda o, d: row.distance(o, d, False))(o, d)
    normal = jax.vmap(lambda o, d, t: row.normal(o + t * d))(o, d, jnp.where(t < 1e9, t, 0.0))
    return request.param, row, along, np.asarray(t), np.asarray(normal)


def test_hits_lie_on_the_shape_and_nothing_is_met_before(traced):
    kind, _, along, t, _ = traced
    hit = np.isfinite(t)
    assert hit.sum() > 30
    if kind is not Planes:
        assert hit.sum() < 400
    q = np.linalg.solve(AXES, (ORIGINS + np.where(hit, t, 0.0)[:, None] * along - CENTER).T).T
    if kind in FLATS:
        assert np.all(implicit(kind, q[hit]) <= 1e-12)
        np.testing.assert_allclose(q[hit, 2], 0.0, rtol=0.0, atol=1e-12)
    else:
        np.testing.assert_allclose(implicit(kind, q[hit]), 0.0, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("kind", kinds.KINDS)
def test_inside_is_where_the_definition_says(kind):
    q = np.random.default_rng(6).uniform(-1.2, 1.2, (2000, 3))
    inside = np.asarray(jax.vmap(kind.canonical_inside)(jnp.asarray(q)))
    if kind in FLATS:
        assert not np.any(inside)
    else:
        np.testing.assert_array_equal(inside, implicit(kind, q) < 0.0)


@pytest.mark.parametrize("kind", FLATS)
def test_the_side_of_a_flat_shape_on_which_a_point_lies_is_that_of_its_normal(kind):
    """Along the normal of what its first two axes span; for two that stand differently."""
    axes, place = np.stack([AXES, np.diag([1.0, 1.0, 1.0])]), np.array([0.7, 1.1, -0.3])
    shapes = kind(np.stack([CENTER, CENTER]), axes)
    normal = np.cross(axes[..., 0], axes[..., 1])
    for p in (place, -place):
        signs = np.sign(np.sum((p - CENTER) * normal, -1))
        np.testing.assert_array_equal(np.sign(shapes.height(p)), signs)


@pytest.mark.parametrize("kind", FLATS)
def test_a_flat_shape_that_is_turned_over_keeps_its_points_and_faces_the_other_way(kind):
    shapes = kind(np.stack([CENTER, CENTER]), np.stack([AXES, AXES]))
    over = shapes.turned(jnp.array([True, False])).axes
    np.testing.assert_array_equal(over[0], AXES[:, [1, 0, 2]] * [1.0, 1.0, -1.0])
    np.testing.assert_array_equal(over[1], AXES)


@pytest.mark.parametrize("kind", kinds.KINDS)
def test_the_middle_of_a_shape_lies_in_it_and_of_a_plane_below_the_eye(kind):
    eye, row = jnp.asarray(ORIGINS[0]), jax.tree.map(lambda a: a[0], kind(CENTER, AXES))
    middle = np.asarray(row.middle(eye))
    q = np.linalg.solve(AXES, middle - CENTER)
    assert implicit(kind, q) < -0.1
    if kind in FLATS:
        assert abs(q[2]) < 1e-12
    if kind is Planes:
        np.testing.assert_allclose(AXES[:, :2].T @ (eye - middle), 0.0, rtol=0.0, atol=1e-12)


def test_misses_are_misses(traced):
    kind, _, along, t, _ = traced
    s = np.linspace(0.0, 8.0, 4001)[1:-1]
    for i in np.flatnonzero(~np.isfinite(t))[:40]:
        q = np.linalg.solve(AXES, (ORIGINS[i] + s[:, None] * along[i] - CENTER).T).T
        if kind in FLATS:
            crossed = np.flatnonzero(np.sign(q[1:, 2]) != np.sign(q[:-1, 2]))
            assert np.all(implicit(kind, q[crossed]) > -1e-2)
        else:
            assert np.all(implicit(kind, q) > -1e-5)


def test_normals_are_across_the_surface_and_outwards(traced):
    kind, _, along, t, normal = traced
    if kind in FLATS:
        across = np.cross(AXES[:, 0], AXES[:, 1])
        across = np.broadcast_to(across / np.linalg.norm(across), normal.shape)
        np.testing.assert_allclose(normal, across, rtol=0.0, atol=1e-12)
        return
    hit = np.isfinite(t)
    point = ORIGINS[hit] + t[hit, None] * along[hit]
    h = 1e-6
    rise = np.stack(
        [
            implicit(kind, np.linalg.solve(AXES, (point + h * e - CENTER).T).T)
            - implicit(kind, np.linalg.solve(AXES, (point - h * e - CENTER).T).T)
            for e in np.eye(3)
        ],
        -1,
    )
    rise = rise / np.linalg.norm(rise, axis=1, keepdims=True)
    # Beside an edge differences mix two faces.
    q = np.linalg.solve(AXES, (point - CENTER).T).T
    third = np.sort(np.abs(q), 1)[:, 1]
    smooth = third < 0.999 if kind is Boxes else np.abs(np.hypot(q[:, 0], q[:, 1]) - abs(q[:, 2]))
    smooth = smooth if kind is Boxes else (smooth > 1e-3) | (kind is Ellipsoids)
    np.testing.assert_allclose(normal[hit][smooth], rise[smooth], rtol=0.0, atol=1e-6)


def test_a_ray_does_not_meet_the_shape_that_it_starts_on(traced):
    _, row, along, _, _ = traced
    assert np.isinf(row.distance(jnp.asarray(ORIGINS[0]), jnp.asarray(along[0]), True))


def test_distances_have_derivatives(traced):
    _, row, along, t, _ = traced
    o, d = jnp.asarray(ORIGINS), jnp.asarray(along)
    slope = jax.vmap(jax.grad(lambda o, d: row.distance(o, d, False)))(o, d)
    assert np.all(np.isfinite(np.asarray(slope)[np.isfinite(t)]))
    moved = jax.vmap(lambda o, d: row.distance(o + 1e-6 * d, d, False))(o, d)
    hit = np.isfinite(t) & (t > 1e-3) & np.isfinite(np.asarray(moved))
    along_ray = np.sum(np.asarray(slope) * along, 1)
    np.testing.assert_allclose(along_ray[hit], -1.0, rtol=0.0, atol=1e-9)


def test_normals_have_derivatives_in_the_middle_of_a_cylinders_caps():
    """The cap is flat, and the distance from the axis has no derivative there."""
    row = jax.tree.map(lambda a: a[0], Cylinders(np.zeros(3), np.diag([0.5, 0.5, 2.0])))
    for end in (-2.0, 2.0):
        for beside in (0.0, 0.1):
            place = jnp.array([beside, 0.0, end])
            np.testing.assert_array_equal(jax.jacfwd(row.normal)(place), np.zeros((3, 3)))
            bend = jax.jacrev(jax.jacfwd(row.normal))(place)
            np.testing.assert_array_equal(bend, np.zeros((3, 3, 3)))


def test_bad_shapes_are_refused_in_one_sentence():
    with pytest.raises(
        ValueError, match=r"^Argument `axes` must be invertible, but its rank .*\.$"
    ):
        Boxes([0.0, 0.0, 0.0], np.diag([1.0, 1.0, 0.0]))
    with pytest.raises(ValueError, match=r"^Argument `axes` must hold 2 shapes, but holds 1\.$"):
        Boxes(np.zeros((2, 3)), np.eye(3))
    with pytest.raises(ValueError, match=r"^Argument `center` must be finite, but is nan\.$"):
        Boxes([0.0, np.nan, 0.0], np.eye(3))
