"""The discontinuity mesh, against the events on lines that cross it."""

import numpy as np
import pytest

from derivations.space.discontinuities import events as brute
from firstorder.space import Receiver, Scene, primitive, rectangle
from firstorder.space.discontinuities import _curves, discontinuity_mesh, mesh, visual_events_along

REACH = 1.2
MIDDLE = Receiver.at((0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def scene():
    return brute.scene_of(brute.skew(3))


@pytest.fixture(scope="module")
def lines(scene):
    return discontinuity_mesh(scene, MIDDLE, points=201, reach=REACH)


def crossings(found, start, way, reach):
    """Where a line of the plane crosses the pieces of a mesh: how far along, and the piece."""
    way = np.asarray(way)[:2] / np.linalg.norm(way)
    across, hits = np.array([-way[1], way[0]]), []
    for number, line in enumerate(found.lines):
        off = (line[:, :2] - start[:2]) @ across
        along = (line[:, :2] - start[:2]) @ way
        k = np.flatnonzero(off[1:] * off[:-1] < 0.0)
        x = along[k] + off[k] / (off[k] - off[k + 1]) * (along[k + 1] - along[k])
        hits += [(a, number) for a in x if 0.0 < a < reach]
    return sorted(hits)


def test_a_line_crosses_the_mesh_where_it_has_its_events(scene, lines):
    start, way, reach = (-1.1, -0.23, 0.0), (0.97, 0.24, 0.0), 2.2
    table = visual_events_along(scene, Receiver.at(start), along=way, reach=reach)
    hits = crossings(lines, np.array(start), way, reach)
    assert len(hits) == len(table) > 15
    np.testing.assert_allclose([a for a, _ in hits], table.x, rtol=0.0, atol=2e-4)
    assert sorted(lines.kind[[n for _, n in hits]]) == sorted(table.kind)


def test_a_line_across_a_piece_meets_its_jump(scene, lines):
    """Towards the normal of a piece E'' jumps by what the mesh says."""
    for kind in ("vertex and edge", "three edges"):
        rows = np.flatnonzero(lines.kind == kind)
        row = rows[np.argmax([len(lines.lines[r]) for r in rows])]
        k = len(lines.lines[row]) // 2
        place, tangent = lines.lines[row][k], np.diff(lines.lines[row][k - 1 : k + 2 : 2], axis=0)
        way = np.array([-tangent[0, 1], tangent[0, 0], 0.0]) / np.linalg.norm(tangent)
        start = Receiver.at(place - 1e-3 * way)
        table = visual_events_along(scene, start, along=way, reach=2e-3)
        nearest = np.argmin(np.abs(table.x - 1e-3))
        assert table.kind[nearest] == kind
        assert table.order[nearest] == lines.order[row] == 2
        np.testing.assert_allclose(abs(table.jump_E2[nearest]), lines.jumps[row][k], rtol=1e-3)


def test_a_bit_of_a_conic_in_a_small_square_is_drawn_with_most_of_its_points(scene, lines):
    row = max(np.flatnonzero(lines.kind == "three edges"), key=lambda n: len(lines.lines[n]))
    middle = lines.lines[row][len(lines.lines[row]) // 2]
    found = discontinuity_mesh(scene, Receiver.at(middle), points=30, reach=0.04)
    pieces = [found.lines[n] for n in np.flatnonzero(found.kind == "three edges")]
    assert max(map(len, pieces)) > 15


def test_edges_that_are_parallel_make_a_frame():
    lamp = primitive(rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)), emission=1.0)
    plate = primitive(rectangle((0.0, 0.0, 1.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0)))
    found = discontinuity_mesh(Scene.of(lamp, plate), MIDDLE, points=61, reach=REACH)
    assert len(found) == 8
    assert np.all(found.order == 1)
    half = np.sort([np.max(np.abs(line[:, :2]), axis=0) for line in found.lines], axis=1)
    inner = half[:, 0] < 0.5
    assert np.sum(inner) == 4
    np.testing.assert_allclose(half[inner, 0], 0.1, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(half[~inner, 1], 0.9, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(half, 0.9 - 0.8 * np.outer(inner, [1, 0]), rtol=0.0, atol=REACH / 30)


def test_pieces_end_where_nothing_is_seen():
    places = np.arange(15.0).reshape(1, 5, 3)
    sizes = np.array([[0.0, 1.0, 2.0, 0.0, 3.0]])
    found = mesh._mesh([_curves.Curves("three edges", places, sizes)])
    assert [line[:, 0].tolist() for line in found.lines] == [[3.0, 6.0]]
    assert found.jumps[0].tolist() == [1.0, 2.0]


def test_what_cannot_be_drawn_is_refused(scene):
    with pytest.raises(ValueError, match="`points` must be a positive integer, but is 0"):
        discontinuity_mesh(scene, MIDDLE, points=0, reach=1.0)
    with pytest.raises(ValueError, match="reach"):
        discontinuity_mesh(scene, MIDDLE, reach=-1.0)


def clipped(x, normal, corners):
    """The two places at which a plane meets the sides of a square, or none."""
    far = (corners - x) @ normal
    after, ends = np.roll(far, -1), np.roll(corners, -1, axis=0)
    met = (far > 0.0) != (after > 0.0)
    share = far[met] / (far[met] - after[met])
    return corners[met] + share[:, None] * (ends[met] - corners[met])


def test_points_stand_in_the_middles_of_equal_parts_of_where_planes_meet_a_square():
    """In any frame: planes at random, along the square's sides, and at two heights over it."""
    rng, reach, points = np.random.default_rng(0), 0.7, 5
    at = Receiver.at((0.3, -0.2, 0.5), (0.4, -0.7, 0.6))
    middle, axes = np.asarray(at.position, float), np.asarray(at.axes, float)
    normal = np.concatenate([rng.normal(size=(60, 3)), axes.T, -axes.T])
    point = middle + rng.normal(size=(66, 3)) * np.repeat([0.6, 0.2], [60, 6])[:, None]
    sides = reach * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    corners = middle + sides @ axes[:, :2].T
    places, which = _curves.within(at, point, normal, reach, points)
    ends = [clipped(*plane, corners) for plane in zip(point, normal, strict=True)]
    assert which.tolist() == [k for k, pair in enumerate(ends) if len(pair)]
    assert 20 < len(which) < 60
    share = (np.arange(1, 10, 2) / 10.0)[:, None]
    for found, k in zip(places, which, strict=True):
        a, b = ends[k]
        a, b = (a, b) if (b - a) @ (found[-1] - found[0]) > 0.0 else (b, a)
        np.testing.assert_allclose(found, a + share * (b - a), rtol=0.0, atol=1e-12)
