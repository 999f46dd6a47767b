"""Silhouettes of meshes against closed forms of what the meshes approach, and against rays."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstorder.io import Embree
from firstorder.space.meshes.triangle_mesh import mesh
from firstorder.space.receiver import receiver
from firstorder.space.silhouettes import meshes
from firstorder.space.silhouettes.meshes import (
    _net_visibility_gradient,
    mesh_net_visibility,
    mesh_silhouette,
    visible_mesh_silhouettes,
)
from tests.precision import as_dtype
from tests.space import worlds
from tests.space.meshes.test_triangle_mesh import globe, icosphere

HERE = receiver((0.0, 0.0, 0.0))
BALLS = (((0.3, -0.2, 1.5), 0.5), ((-0.15, 0.35, 2.6), 0.9))


def balls(times, which):
    """Spheres as meshes, together one mesh; turned, so that nothing is in line."""
    v, f = icosphere(times)
    turn, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    parts = [v @ turn.T * r + np.array(c) for c, r in which]
    faces = [f + k * len(v) for k in range(len(which))]
    return mesh(np.concatenate(parts), np.concatenate(faces))


@eqx.filter_jit
def both(m, rim, at):
    return mesh_net_visibility(m, rim, at), _net_visibility_gradient(m, rim, at)


def measured(times, which, traced=Embree, at=HERE):
    m = balls(times, which)
    rim = visible_mesh_silhouettes(m, at.position, traced(m) if traced else None)
    value, slope = both(m, rim, at)
    return m, rim, float(value), np.asarray(slope)


# --- closed forms --------------------------------------------------------------------------------


def caps(x, which):
    """The solid angle that spheres free when seen from x: one, or two whose caps may overlap."""
    rel = [np.array(c) - x for c, _ in which]
    far = [np.linalg.norm(p) for p in rel]
    half = [np.arcsin(r / D) for (_, r), D in zip(which, far, strict=True)]
    total = sum(2.0 * np.pi * (1.0 - np.cos(h)) for h in half)
    if len(which) == 2:
        apart = np.arccos(np.dot(*rel) / np.prod(far))
        total -= lens(*half, apart)
    return 2.0 * np.pi - total


def lens(a, b, d):
    """What two caps of half-angles a, b share, their centres d apart: Gauss and Bonnet.

    The lens has two arcs, of geodesic curvature cot a and cot b, and two equal corners.
    """
    if d >= a + b:
        return 0.0
    ca, cb, cd = np.cos(a), np.cos(b), np.cos(d)
    alpha = np.arccos((cb - ca * cd) / (np.sin(a) * np.sin(d)))  # half of each arc, at the centre
    beta = np.arccos((ca - cb * cd) / (np.sin(b) * np.sin(d)))
    corner = np.arccos((cd - ca * cb) / (np.sin(a) * np.sin(b)))
    return 2.0 * (np.pi - corner - alpha * ca - beta * cb)


def slope_of(f, x, h=1e-3):
    """Differences of a closed form, of sixth order."""
    steps = h * np.eye(3)
    weights = ((1, 0.75), (2, -0.15), (3, 1.0 / 60.0))
    return np.array([sum(w * (f(x + k * s) - f(x - k * s)) for k, w in weights) / h for s in steps])


def test_the_closed_form_of_a_lens_is_right():
    rng = np.random.default_rng(0)
    w = rng.normal(size=(400_000, 3))
    w /= np.linalg.norm(w, axis=1)[:, None]
    a, b, d = 0.5, 0.7, 0.8
    inside = (w[:, 2] > np.cos(a)) & (w @ [np.sin(d), 0, np.cos(d)] > np.cos(b))
    share = lens(a, b, d) / (4.0 * np.pi)
    assert abs(inside.mean() - share) < 4.0 * np.sqrt(share / len(w))


@functools.cache
def errors(which):
    """Errors of value and gradient at 1280, 5120 and 20480 faces a sphere."""
    true = caps(np.zeros(3), which), slope_of(lambda x: caps(x, which), np.zeros(3))
    found = [measured(times, which) for times in ((3, 4, 5) if len(which) == 1 else (3, 4))]
    return np.array([(v - true[0], np.linalg.norm(g - true[1])) for _, _, v, g in found])


def test_a_sphere_of_20_thousand_triangles_converges_with_order_1_in_their_number():
    error = errors(BALLS[:1])
    order = np.log(np.abs(error[0] / error[-1])) / np.log(16.0)
    # The mesh lies inside the sphere by O(h^2), and h^2 goes as one over the number of faces. How
    # the faces lie to the rim changes from size to size: measured 0.996 and 0.986.
    np.testing.assert_allclose(order, 1.0, rtol=0.0, atol=0.03)
    assert 0.0 < error[-1, 0] < 2e-4
    assert error[-1, 1] < 3e-4


def test_two_spheres_one_behind_the_other_converge_likewise():
    error = errors(BALLS)
    assert caps(np.zeros(3), BALLS) - sum(caps(np.zeros(3), (b,)) for b in BALLS) > 0.1 - 2 * np.pi
    order = np.log(np.abs(error[0] / error[-1])) / np.log(4.0)
    np.testing.assert_allclose(order, 1.0, rtol=0.0, atol=0.03)  # measured 0.993 and 1.004
    assert 0.0 < error[-1, 0] < 3e-3


# --- the mesh as it is ---------------------------------------------------------------------------


def test_the_gradient_is_that_of_the_value_with_respect_to_receiver_and_mesh():
    m, rim, _, slope = measured(1, BALLS)
    assert np.any(np.asarray(rim.cut_first) >= 0)

    def value(x, shift):
        moved = m.at(m.vertices + shift)
        return mesh_net_visibility(moved, rim, eqx.tree_at(lambda a: a.position, HERE, x))

    here, there = jax.jit(jax.grad(value, (0, 1)))(jnp.zeros(3), jnp.zeros(3))
    np.testing.assert_allclose(here, slope, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(there, -slope, rtol=0.0, atol=1e-13)
    # ... and of the value itself: differences with the silhouettes found anew at each place
    x = np.array([1e-4, -2e-4, 1.5e-4])
    ends = [
        float(both(m, visible_mesh_silhouettes(m, s * x), receiver(jnp.asarray(s * x)))[0])
        for s in (-1.0, 1.0)
    ]
    # Between them the silhouette runs along other edges: an error of the mesh's third derivative.
    assert abs((ends[1] - ends[0]) - 2.0 * slope @ x) < 2e-3 * np.linalg.norm(2.0 * slope * x)


def test_net_visibility_is_what_rays_find():
    for height in (1.5, 0.2):  # free, and cut by the horizon
        which = (((0.6, -0.2, height), 0.5), ((0.9, 0.35, height + 0.7), 0.6))
        m, _, value, _ = measured(2, which)
        rng = np.random.default_rng(2)
        z, phi = (np.arange(300) + rng.uniform(size=(300, 300))) / 300, None
        phi = 2 * np.pi * (np.arange(300)[:, None] + rng.uniform(size=(300, 300))) / 300
        s = np.sqrt(1.0 - z * z)
        w = np.stack([s * np.cos(phi), s * np.sin(phi), z], -1).reshape(-1, 3)
        free = 2.0 * np.pi * np.mean(Embree(m).nearest(0.0 * w, w).face < 0)
        # strata that an edge crosses: some 4 * 300 of 90 000, each with a variance of 1/4 at most
        assert abs(free - value) < 4.0 * 2.0 * np.pi * np.sqrt(1200 / 4.0) / 90_000


def test_all_faces_in_double_and_embree_agree_on_what_is_seen():
    rng = np.random.default_rng(3)
    m = balls(3, BALLS)
    rough = m.at(m.vertices * (1.0 + 0.05 * rng.uniform(-1, 1, (len(m.vertices), 1))))
    one, other = (
        visible_mesh_silhouettes(rough, np.zeros(3)),
        visible_mesh_silhouettes(rough, np.zeros(3), Embree(rough)),
    )
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        np.testing.assert_array_equal(a, b)
    assert 0.1 < np.mean(np.asarray(one.visible)) < 0.9
    assert np.any((np.asarray(one.behind) >= 0) & one.visible)


@pytest.mark.smoke
def test_silhouettes_run_round_the_front_and_the_traced_ones_are_the_same():
    m = balls(1, BALLS[:1])
    found = mesh_silhouette(m, jnp.zeros(3))
    p, q = np.asarray(found.start)[found.live], np.asarray(found.end)[found.live]
    centre = np.array(BALLS[0][0])
    assert np.all(np.cross(p, q - p) @ centre > 0.0)  # (p - x) x dp points to the owner
    front = np.einsum("fd,fd->f", np.asarray(m.area_vectors), -np.asarray(m.corners)[:, 0]) > 0.0
    assert np.all(front[np.asarray(found.owner)[found.live]])
    rim = visible_mesh_silhouettes(m, np.zeros(3))
    assert len(rim.face) == len(p)
    assert np.all(rim.outer)
    again = rim.straight(m, jnp.zeros(3))
    np.testing.assert_array_equal(np.sort(again.start, 0), np.sort(p, 0))


def triangle(corners):
    """The solid angle of a triangle, by Eriksson's formula."""
    a, b, c = corners / np.linalg.norm(corners, axis=1)[:, None]
    return 2.0 * np.arctan(abs(np.linalg.det([a, b, c])) / (1 + a @ b + b @ c + c @ a))


def test_the_unit_of_length_is_of_no_matter_to_silhouettes_in_single_precision():
    """Of a solid a tenth of a picometre wide there were none."""
    solid, eye = balls(1, BALLS[:1]), jnp.array([0.1, 0.2, 0.3])
    live = mesh_silhouette(solid, eye).live
    assert np.sum(live) > 10
    for unit in (1e-16, 1e-13, 1e13):
        scaled = as_dtype(solid.at(unit * solid.vertices), "float32")
        found = mesh_silhouette(scaled, (unit * eye).astype(jnp.float32)).live
        np.testing.assert_array_equal(found, live)


def test_a_ball_has_no_silhouettes_at_its_pole():
    """Whose vertices are in one place; edges of faces without area once were some."""
    v, f = globe(6, 8)
    eye = np.array([0.5, 0.3, 4.0])
    ball = mesh(v, f)
    rim = visible_mesh_silhouettes(ball, eye)
    assert np.all(rim.outer)
    assert np.sum(mesh_silhouette(ball, eye).live) == len(rim.ends)
    lengths = np.linalg.norm(np.diff(v[rim.ends], axis=1), axis=-1)
    assert np.all(lengths > 0.1)


def test_a_lone_triangle_covers_as_much_from_behind():
    corners = np.array([[0.1, 0.2, 1.0], [1.0, 0.1, 1.4], [0.2, 1.1, 0.9]])
    for faces in ([[0, 1, 2]], [[0, 2, 1]]):
        m = mesh(corners, faces)
        value, _ = both(m, visible_mesh_silhouettes(m, np.zeros(3)), HERE)
        np.testing.assert_allclose(value, 2.0 * np.pi - triangle(corners), rtol=1e-13)


@pytest.mark.parametrize("size", [1e-3, 1e-2])
def test_a_tiny_hole_overhead_is_all_that_is_free(size):
    """A funnel whose wide end lies below the horizon."""
    turn = 2.0 * np.pi / 3.0 * np.arange(3)
    ring = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], 1)
    hole = size * ring + [0.0, 0.0, 1.0]
    faces = [f for i, j in ((0, 1), (1, 2), (2, 0)) for f in ((i, j, 3 + j), (i, 3 + j, 3 + i))]
    m = mesh(np.concatenate([hole, 9.0 * ring - [0.0, 0.0, 1.0]]), faces)
    value, _ = both(m, visible_mesh_silhouettes(m, np.zeros(3)), HERE)
    np.testing.assert_allclose(value, triangle(hole), rtol=0.0, atol=1e-14)


def test_nothing_above_the_horizon_blocks_nothing():
    m = balls(0, (((0.3, 0.2, -2.0), 0.5),))
    value, slope = both(m, visible_mesh_silhouettes(m, np.zeros(3)), HERE)
    np.testing.assert_allclose(value, 2.0 * np.pi, rtol=1e-14)
    np.testing.assert_array_equal(slope, 0.0)


def test_a_traced_eye_is_one_sentence():
    m = balls(0, BALLS[:1])
    with pytest.raises(ValueError, match=r"must be concrete, but are traced\."):
        jax.jit(lambda x: visible_mesh_silhouettes(m, x).face)(jnp.zeros(3))


FAULTS = {
    "forget what is hidden": lambda rim: eqx.tree_at(
        lambda r: (r.visible, r.behind),
        rim,
        (np.ones_like(rim.visible), np.full_like(rim.behind, -1)),
    ),
    "count what has the mesh behind it": lambda rim: eqx.tree_at(
        lambda r: r.behind, rim, np.full_like(rim.behind, -1)
    ),
    "turn the edges about": lambda rim: eqx.tree_at(lambda r: r.ends, rim, rim.ends[:, ::-1]),
}


def test_the_pieces_close_and_a_fault_in_the_cuts_is_noticed():
    """A closed edge bounds the same solid angle round any axis above which it lies."""
    m, rim, _, _ = measured(3, BALLS)
    uncut = eqx.tree_at(
        lambda r: (r.cut_first, r.cut_last),
        rim,
        (np.full_like(rim.cut_first, -1), np.full_like(rim.cut_last, -1)),
    )
    tilted = receiver((0.0, 0.0, 0.0), (0.2, -0.1, 1.0))
    gaps = [abs(float(both(m, r, HERE)[0] - both(m, r, tilted)[0])) for r in (rim, uncut)]
    assert gaps[0] < 1e-12 < 1e-6 < gaps[1]


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_rim_is_noticed(fault):
    m, rim, _, _ = measured(3, BALLS)
    wrong, wrong_slope = both(m, FAULTS[fault](rim), HERE)
    true = caps(np.zeros(3), BALLS), slope_of(lambda x: caps(x, BALLS), np.zeros(3))
    bound = np.abs(errors(BALLS)[0])
    assert np.isfinite(wrong)
    assert abs(wrong - true[0]) > 3.0 * bound[0]
    assert np.linalg.norm(wrong_slope - true[1]) > 3.0 * bound[1]


def test_fault_of_a_wrong_power_is_noticed(monkeypatch):
    m, rim, _, _ = measured(3, BALLS[:1])
    right = meshes.segment_translation_rate
    monkeypatch.setattr(
        meshes, "segment_translation_rate", lambda a, b: right(a, b) * jnp.linalg.norm(a)
    )
    wrong = _net_visibility_gradient(m, rim, HERE)
    true = slope_of(lambda x: caps(x, BALLS[:1]), np.zeros(3))
    assert np.linalg.norm(wrong - true) > 3.0 * np.abs(errors(BALLS[:1])[0, 1])


# --- properties ----------------------------------------------------------------------------------

CORNERS = np.array([(0.1, 0.0, 0.8), (0.9, 0.2, 1.1), (0.2, 0.8, 1.3), (0.4, 0.3, 1.9)])
FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
SECOND = CORNERS * (-0.7, 0.6, 1.4) + (0.2, 0.1, 0.2)


def refined(vertices, faces):
    """Each triangle in four, by the middles of its sides."""
    sides = np.stack([faces, np.roll(faces, -1, 1)], -1)
    pairs, which = np.unique(np.sort(sides, -1).reshape(-1, 2), axis=0, return_inverse=True)
    m = len(vertices) + which.reshape(-1, 3)
    a, b, c = faces.T
    p, q, r = m.T
    new = [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
    return np.concatenate([vertices, vertices[pairs].mean(1)]), np.concatenate(
        [np.stack(t, 1) for t in new]
    )


def freed(place, turn=(0.0, 0.0, 0.0), shift=(0.0, 0.0, 0.0), scale=1.0, fine=False):
    """Net visibility below two tetrahedra and its gradient in the receiver's axes, moved."""
    v = np.concatenate([CORNERS, SECOND])
    f = np.concatenate([FACES, FACES[:, ::-1] + len(CORNERS)])  # the second one is a mirror image
    v, f = refined(v, f) if fine else (v, f)
    change = worlds.Change(turn=turn, shift=shift, scale=scale).arrays
    at = worlds.below(change, *map(jnp.asarray, place))
    m = mesh(np.asarray(scale * v @ worlds.rotation(change.turn).T + change.shift), f)
    rim = visible_mesh_silhouettes(m, at.position)
    return [np.asarray(a) for a in both(m, rim, at)]


SPOT = st.tuples(worlds.PLACE, worlds.PLACE)


@settings(max_examples=10)
@given(SPOT, worlds.TURN, worlds.SHIFT, worlds.SIZE)
def test_meshes_hide_the_same_wherever_they_are(place, turn, shift, scale):
    (value, slope), (rest, steep) = freed(place, turn, shift, scale), freed(place)
    assert rest < 2.0 * np.pi - 0.05
    np.testing.assert_allclose(value, rest, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(
        scale * slope, steep, rtol=0.0, atol=1e-9 * (1.0 + np.abs(steep).max())
    )


@settings(max_examples=10)
@given(SPOT)
def test_meshes_of_smaller_triangles_hide_the_same(place):
    for fine, coarse in zip(freed(place, fine=True), freed(place), strict=True):
        np.testing.assert_allclose(fine, coarse, rtol=0.0, atol=1e-9 * (1.0 + np.abs(coarse).max()))


# --- a mesh that stands on itself ----------------------------------------------------------------


def stood(gap, turn=(0.0, 0.0, 0.0), scale=1.0, traced=None, eye=(0.0, 0.05, 1.0)):
    """What a tilted table leaves free, and a box that stands on it; where nothing is seen from."""
    c, u, w = np.array([(2.0, 0.1, 0.3), (0.8, 0.1, 0.0), (-0.1, 0.9, 0.0)])
    table = [c - u - w, c + u - w, c + u + w, c - u + w]
    low, high = np.array([(1.8, -0.2, 0.3 + gap), (2.1, 0.25, 0.7 + gap)])
    box = [np.where(bits, high, low) for bits in np.ndindex(2, 2, 2)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for q in quads for t in (q[:3], (q[0], *q[2:]))])
    faces = np.concatenate([[(0, 1, 2), (0, 2, 3)], faces + 4])
    rotated = worlds.rotation(turn)
    m = mesh(scale * np.array(table + box) @ rotated.T, faces)
    at = receiver(scale * rotated @ np.array(eye), rotated @ np.array((1.0, 0.0, 0.05)))
    rim = visible_mesh_silhouettes(m, at.position, traced(m) if traced else None)
    return float(mesh_net_visibility(m, rim, at))


@pytest.mark.parametrize("traced", [None, Embree])
@pytest.mark.parametrize("eye", [(0.0, 0.05, 1.0), (0.0, 0.05, 0.1)])
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, -1.1, 0.7)])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_a_box_on_a_table_hides_what_one_a_hair_above_it_does(traced, eye, turn, scale):
    stands, floats = (stood(gap, turn, scale, traced, eye) for gap in (0.0, 1e-6))
    np.testing.assert_allclose(stands, floats, rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("faces", [FACES[:1], FACES])  # a flat sheet, and a closed body
def test_triangles_without_common_vertices_hide_what_one_mesh_does(faces):
    v, f = refined(*refined(CORNERS, faces))
    whole, soup = mesh(v, f), mesh(v[f].reshape(-1, 3), np.arange(f.size).reshape(-1, 3))
    at = receiver((0.3, 0.2, 0.0))
    values = [
        float(mesh_net_visibility(m, visible_mesh_silhouettes(m, at.position, traced(m)), at))
        for m in (whole, soup)
        for traced in (lambda _: None, Embree)
    ]
    np.testing.assert_allclose(values, values[0], rtol=0.0, atol=1e-12)
