"""Events of a slice that turns: tangents of arcs, corners, the horizon, crossings."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import Scene, plane, primitive, receiver, sphere, triangle
from firstorder.space.azimuthal._critical_azimuths import (
    ROUNDINGS,
    events,
    folded,
    nodes_between,
    parts,
    tangents,
)
from firstorder.space.silhouettes._curves import SilhouetteArcs

BLUR = ROUNDINGS * float(jnp.finfo(float).eps)
BALL, RADIUS = np.array([1.0, 0.4, 1.5]), 0.6
FLAT = np.hypot(1.0, 0.4)


def test_slices_that_are_tangent_to_a_ball_pass_it_at_its_radius():
    found = jax.jit(
        lambda: parts(Scene.of(primitive(sphere(BALL, RADIUS))), receiver((0.0, 0.0, 0.0)))
    )
    (part,) = found()
    truth = np.arctan2(0.4, 1.0) + np.array([-1.0, 1.0]) * np.arcsin(RADIUS / FLAT)
    assert bool(part.split[0, 0])
    np.testing.assert_allclose(
        np.sort(part.tangent[0, 0]), np.sort(truth % np.pi), rtol=0.0, atol=1e-14
    )


def test_between_its_tangents_the_discriminant_is_a_product_of_sines():
    rng = np.random.default_rng(3)
    a, b, c = rng.normal(size=(3, 20, 3))
    arcs = SilhouetteArcs(*map(jnp.asarray, (c, a, b)), *jnp.zeros((2, 20)), jnp.zeros(20, int),
                  jnp.ones(20, bool))  # fmt: skip
    tangent, scale, split = (np.asarray(x) for x in jax.jit(tangents)(arcs))
    phi = 0.7
    v = np.array([-np.sin(phi), np.cos(phi), 0.0])
    truth = (a @ v) ** 2 + (b @ v) ** 2 - (c @ v) ** 2
    found = scale * np.sin(tangent[:, 1] - phi) * np.sin(phi - tangent[:, 0])
    assert 0 < np.sum(split) < 20
    np.testing.assert_allclose(found[split], truth[split], rtol=0.0, atol=1e-12)


def test_folding_takes_off_half_turns():
    phi, turns = folded(jnp.array([-0.1, 0.0, 3.0, 3.2]))
    np.testing.assert_allclose(phi, [np.pi - 0.1, 0.0, 3.0, 3.2 - np.pi], rtol=1e-15)
    np.testing.assert_array_equal(turns, [-1, 0, 0, 1])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_slanted_plane_has_an_event_where_it_meets_the_horizon(side):
    """Its normal (0.3, -0.5, 1), turned to the receiver, is that of a level line along (5, 3)."""
    normal = np.array([0.3, -0.5, 1.0])

    def found():
        slope = plane((0.0, 0.0, 2.0), side * normal)
        seen = parts(Scene.of(primitive(slope)), receiver((0.0, 0.0, 0.0)))
        return seen[0].normal, *events(seen, jnp.zeros(()).dtype)

    down, phi, there = jax.jit(found)()
    np.testing.assert_allclose(down, [-normal / np.linalg.norm(normal)], rtol=1e-14)
    assert np.sum(there) == 1
    np.testing.assert_allclose(folded(phi[there])[0], np.arctan2(3.0, 5.0), rtol=1e-14)


def test_horizons_of_planes_cut_outlines_and_each_other():
    """Of two planes, normals (1, 0, -1) and (0, -1, -1), and a triangle that the first one cuts."""
    corners = np.array([[0.5, 1.0, 1.0], [1.5, 1.0, 1.0], [0.5, 2.0, 1.0]])

    def found():
        scene = Scene.of(
            primitive(plane((-2.0, 0.0, 2.0), (1.0, 0.0, -1.0))),
            primitive(plane((0.0, 9.0, 2.0), (0.0, -1.0, -1.0))),
            primitive(triangle(*corners)),
        )
        return events(parts(scene, receiver((0.0, 0.0, 0.0))), jnp.zeros(()).dtype)

    phi, there = jax.jit(found)()
    there = np.asarray(there)
    # On x = z the triangle is cut at (1, 1, 1) and (1, 1.5, 1); on y = -z it is not.
    cuts = [[1.0, 1.0], [1.0, 1.5]]
    level = [[0.0, 1.0], [1.0, 0.0]]  # of each plane with the receiver's horizon
    both = [[1.0, -1.0]]  # (1, 0, -1) x (0, -1, -1) = (-1, 1, -1)
    ways = np.array([*corners[:, :2], *cuts, *level, *both])
    true = np.sort(np.arctan2(ways[:, 1], ways[:, 0]) % np.pi)
    np.testing.assert_allclose(np.sort(folded(phi[there])[0]), true, rtol=0.0, atol=1e-14)


def test_a_ball_above_the_horizon_has_two_events_and_its_nodes_cover_half_a_turn():
    def found():
        seen = parts(Scene.of(primitive(sphere(BALL, RADIUS))), receiver((0.0, 0.0, 0.0)))
        phi, there = events(seen, jnp.zeros(()).dtype)
        few = nodes_between(seen, 8, 1, phi.dtype, BLUR)
        return there, nodes_between(seen, 8, 16, phi.dtype, BLUR), few

    there, nodes, few = jax.jit(found)()
    assert np.sum(there) == 2
    np.testing.assert_allclose(np.sum(nodes.weight), np.pi, rtol=1e-14)
    assert np.all(np.isnan(few.weight))  # more events than panels: no answer


FLAT_ONES = np.array(
    [
        [(1.0, 0.4, 1.0), (-0.8, 0.9, 1.5), (0.1, -1.0, 0.9)],
        [(0.9, -0.6, 2.0), (0.6, 2.2, 1.6), (-2.4, -0.3, 1.8)],
    ]
)


def directions_of_crossings(one, two):
    """Where edges of two triangles are in line for an eye at 0, edge by edge, by NumPy."""
    found = []
    for a, b in zip(one, np.roll(one, 1, 0), strict=True):
        for c, d in zip(two, np.roll(two, 1, 0), strict=True):
            n, m = np.cross(a, b), np.cross(c, d)
            if (n @ c) * (n @ d) < 0.0 and (m @ a) * (m @ b) < 0.0:
                found.append(np.cross(n, m))
    return np.array(found)


def test_two_triangles_have_events_at_their_corners_and_crossings_and_no_others():
    def found():
        shapes = [primitive(triangle(*corners)) for corners in FLAT_ONES]
        seen = parts(Scene.of(*shapes), receiver((0.0, 0.0, 0.0)))
        return events(seen, jnp.zeros(()).dtype)

    phi, there = jax.jit(found)()
    crossings = directions_of_crossings(*FLAT_ONES)
    assert len(crossings) == 4
    x, y, _ = np.concatenate([*FLAT_ONES, crossings]).T
    np.testing.assert_allclose(
        np.sort(folded(phi[there])[0]), np.sort(np.arctan2(y, x) % np.pi), rtol=1e-12
    )


@jax.jit
def weights_by_panel(corners):
    seen = parts(Scene.of(primitive(triangle(*corners))), receiver((0.0, 0.0, 0.0)))
    nodes = nodes_between(seen, 8, 4, corners.dtype, BLUR)
    return nodes.weight.reshape(-1, 8), nodes.edge_weight.reshape(-1, 8)


@pytest.mark.parametrize(("lean", "counted"), [(1e-11, True), (1e-13, False)])
def test_edges_count_on_every_panel_but_one_of_a_rounding(lean, counted):
    """Between the ends of an edge that leans from the normal by as much."""
    corners = jnp.array([(1.0, 0.4, 1.0), (1.0, 0.4 + lean, 2.0), (0.5, -0.6, 1.5)])
    every, edges = weights_by_panel(corners)
    length = np.sum(every, -1)
    narrow = (length > 0.5 * lean) & (length < lean)
    assert np.sum(narrow) == 1
    np.testing.assert_array_equal(edges[~narrow], every[~narrow])
    np.testing.assert_array_equal(edges[narrow], counted * every[narrow])
