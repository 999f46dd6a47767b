"""Curves on a tilted plane of receivers: chords of a square, and places that see edges in line."""

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, plane, primitive, rectangle, triangle
from firstorder.space.discontinuities import _curves as curves
from firstorder.space.discontinuities._edges import edges_of
from firstorder.space.discontinuities._jumps import three_edges_bends, vertex_edge_bends
from firstorder.space.discontinuities._lines_of_sight import three_edges_at, vertex_edge_at
from firstorder.space.discontinuities._rounds import rounds_of

AT = Receiver.at((0.3, -0.2, 0.1), (0.1, -0.2, 1.0))
MIDDLE, FRAME = np.asarray(AT.position), np.asarray(AT.axes)
REACH = 0.8


def in_plane(places):
    """By the tangents and the normal of the receivers."""
    return (places - MIDDLE) @ FRAME


# --- chords --------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 4])
def test_points_are_spread_over_the_chord_of_a_plane(count):
    """Half a spacing beyond the first and the last are the sides of the square."""
    rng = np.random.default_rng(2)
    normal, point = rng.normal(size=(2, 40, 3))
    places, which = curves.within(AT, MIDDLE + 0.5 * point, normal, REACH, 1 + count)
    assert 5 < len(which) < 40
    assert places.shape == (len(which), 1 + count, 3)
    flat = in_plane(places)
    np.testing.assert_allclose(flat[..., 2], 0.0, rtol=0.0, atol=1e-12)
    off = np.einsum("nkc,nc->nk", places - (MIDDLE + 0.5 * point)[which, None], normal[which])
    np.testing.assert_allclose(off, 0.0, rtol=0.0, atol=1e-11)
    steps = np.diff(flat, axis=1)
    np.testing.assert_allclose(
        steps, np.broadcast_to(steps[:, :1], steps.shape), rtol=0.0, atol=1e-11
    )
    for end in (flat[:, 0] - 0.5 * steps[:, 0], flat[:, -1] + 0.5 * steps[:, 0]):
        np.testing.assert_allclose(np.max(np.abs(end), axis=1), REACH, rtol=1e-9)
    # Those that are left out pass the square: all of its corners are on one side.
    corners = MIDDLE + REACH * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) @ FRAME[:, :2].T
    sides = np.sign(np.einsum("ikc,ic->ik", corners - (MIDDLE + 0.5 * point)[:, None], normal))
    crossed = np.abs(np.sum(sides, axis=1)) < 4
    assert which.tolist() == np.flatnonzero(crossed).tolist()


def test_chords_along_the_sides_of_the_square_end_at_the_other_sides():
    normal = 7.0 * np.stack([FRAME[:, 0], -FRAME[:, 1], FRAME[:, 2], FRAME[:, 0]])
    point = MIDDLE + np.array([[0.3], [0.0], [0.0], [1.1]]) * normal / 7.0
    places, which = curves.within(AT, point, normal, REACH, 2)
    assert which.tolist() == [0, 1]
    flat = np.abs(in_plane(places))
    np.testing.assert_allclose(flat, [[[0.3, 0.4, 0]] * 2, [[0.4, 0, 0]] * 2], rtol=0.0, atol=1e-12)


def test_sizes_are_zero_where_nothing_is_seen():
    scene = Scene.of(primitive(rectangle((0, 0, 1), (0, 1, 0), (1, 0, 0)), emission=1.0))
    there = np.array([[True, False, True], [False, True, False]])
    found = curves.filled(scene, there, np.array([1.0, 1e-15, -0.3]), np.array([-2.0, 3.0, -4.0]))
    assert found.tolist() == [[2.0, 0.0, 0.0], [0.0, 4.0, 0.0]]


# --- places that see edges in line ---------------------------------------------------------------

CENTER = MIDDLE + FRAME @ [0.1, 0.05, 0.0]
U = np.array([0.3, -0.1, np.sqrt(0.9)])
ACROSS = np.linalg.qr(np.stack([U, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], -1))[0][:, 1:].T


def plate(r, angle):
    """A triangle an edge of which crosses a line of sight."""
    way = 0.2 * (np.cos(angle) * ACROSS[0] + np.sin(angle) * ACROSS[1]) + 0.05 * U
    inner = -np.sin(angle) * ACROSS[0] + np.cos(angle) * ACROSS[1]
    middle = CENTER + r * U
    return triangle(middle - way, middle + way, middle + 0.3 * inner)


PLATES = [plate(0.8, 0.2), plate(1.3, 1.3), plate(1.9, 2.6)]
SCENE = Scene.of(*map(primitive, PLATES), environment=1.0)
EDGES = edges_of(SCENE, AT)


def met(place, u, start, along):
    """Where a line of sight passes an edge: distance, share, and how far beside it."""
    (r, share), *_ = np.linalg.lstsq(np.stack([u, -along], -1), start - place)
    return r, share, np.linalg.norm(place + r * u - start - share * along)


def test_lines_of_a_vertex_and_an_edge_have_jumps_where_both_are_in_line():
    found = curves.vertex_lines(SCENE, EDGES, AT, REACH, 9)
    assert found.kind == "vertex and edge"
    vertex, edge = curves.vertex_edge_pairs(EDGES)
    normal = np.cross(EDGES.start[edge] - EDGES.vertices[vertex], EDGES.along[edge])
    places, which = curves.within(AT, EDGES.vertices[vertex], normal, REACH, 9)
    np.testing.assert_allclose(found.places, places)
    vertex, edge, flat = *(np.repeat(a[which], 9) for a in (vertex, edge)), places.reshape(-1, 3)
    corner, start, along = EDGES.vertices[vertex], EDGES.start[edge], EDGES.along[edge]
    passes = [met(p, c - p, s, a) for p, c, s, a in zip(flat, corner, start, along, strict=True)]
    r, share, beside = np.transpose(passes)
    np.testing.assert_allclose(beside, 0.0, rtol=0.0, atol=1e-10)
    shown = found.jumps.ravel() > 0.0
    assert np.sum(shown) > 20
    assert np.all((share > 0.0) & (share < 1.0) & (r > 0.0) | ~shown)
    rows, _ = vertex_edge_at(EDGES, AT, flat[shown], vertex[shown], edge[shown])
    bends = vertex_edge_bends(SCENE, AT, EDGES, rows)
    way = bends.rate / np.linalg.norm(bends.rate, axis=-1, keepdims=True)
    np.testing.assert_allclose(found.jumps.ravel()[shown], np.abs(bends.along(way)), rtol=1e-9)


def lines_through(triple, share):
    """Places that see three edges in line at shares of the first, and which really do."""
    start, along = EDGES.start[triple], EDGES.along[triple]
    point = start[0] + share[:, None] * along[0]
    n = [np.cross(start[i] - point, along[i]) for i in (1, 2)]
    u = np.cross(*n)
    u = u / np.linalg.norm(u, axis=-1, keepdims=True) * np.sign(u @ FRAME[:, 2])[:, None]
    place = point - ((point - MIDDLE) @ FRAME[:, 2] / (u @ FRAME[:, 2]))[:, None] * u
    passes = np.array(
        [
            [met(p, w, s, a) for s, a in zip(start, along, strict=True)]
            for p, w in zip(place, u, strict=True)
        ]
    )
    seen = np.all((passes[..., 1] > 0.0) & (passes[..., 1] < 1.0) & (passes[..., 0] > 0.0), axis=1)
    return place, seen


@pytest.mark.parametrize("reach", [REACH, 0.2])
def test_conics_are_seen_through_three_edges_and_drawn_as_far_as_they_are(reach):
    """Half a coarse cell beyond what is seen at the middles of coarse cells, at both ends."""
    (found,) = curves.conics(SCENE, EDGES, AT, reach, 24)
    assert found.kind == "three edges"
    coarse, row = (np.arange(curves.COARSE) + 0.5) / curves.COARSE, 0
    for triple in np.concatenate(list(curves.edge_triples(EDGES))):
        place, seen = lines_through(triple, coarse)
        seen &= np.max(np.abs(in_plane(place)), axis=1) <= reach
        if not np.any(seen):
            continue
        first, last = np.flatnonzero(seen)[[0, -1]]
        low, high = first / curves.COARSE, (last + 1) / curves.COARSE
        low, high = max(low - 0.5 / curves.COARSE, 0), min(high + 0.5 / curves.COARSE, 1)
        share = low + (high - low) * (np.arange(24) + 0.5) / 24
        place, seen = lines_through(triple, share)
        np.testing.assert_allclose(found.places[row], place, rtol=0.0, atol=1e-9)
        seen &= np.max(np.abs(in_plane(place)), axis=1) <= reach
        np.testing.assert_array_equal(found.jumps[row] > 0.0, seen)
        table, _ = three_edges_at(EDGES, AT, place[seen], np.tile(triple, (np.sum(seen), 1)))
        bends = three_edges_bends(SCENE, AT, EDGES, table)
        way = bends.rate / np.linalg.norm(bends.rate, axis=-1, keepdims=True)
        np.testing.assert_allclose(found.jumps[row][seen], np.abs(bends.along(way)), rtol=1e-6)
        row += 1
    assert row == len(found.places) > 0


@pytest.mark.parametrize("sides", [(1.0, 0.0), (0.5, 2.0)])
@pytest.mark.parametrize("tilt", [0.0, 0.6])
def test_a_lamp_has_a_kink_in_its_plane(sides, tilt):
    """E = |d . m| |x| times the integral of cos(theta) L / r^3 over the lamp, on either side."""
    at, up = Receiver.at((0.0, 0.0, 0.0)), np.array([tilt, 0.0, np.sqrt(1.0 - tilt**2)])
    middle = np.array([0.2, 0.1, 0.0]) + 1.5 * up
    lamp = primitive(rectangle(middle, (0.0, 0.4, 0.0), 0.5 * up), emission=sides)
    scene = Scene.of(lamp, primitive(plane((0, 0, 0), (0, 0, 1))))
    edges, rounds = edges_of(scene, at), rounds_of(scene)
    found = curves.plane_lines(scene, edges, rounds, at, 1.0, 3)
    assert found.kind == "two edges in a plane"
    assert found.places.shape == (1, 3, 3)
    np.testing.assert_allclose(found.places[0, :, 0], 0.2, rtol=1e-12)
    x, w = np.polynomial.legendre.leggauss(20)
    y, high = 0.1 + 0.4 * x[:, None], 1.5 + 0.5 * x
    for place, size in zip(found.places[0], found.jumps[0], strict=True):
        r = np.hypot(y - place[1], high)
        true = sum(sides) * up[2] * 0.2 * (w @ (high * up[2] / r**4) @ w)
        np.testing.assert_allclose(size, true, rtol=1e-5)
