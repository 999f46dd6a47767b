"""Vertices, edges and faces of shapes of which one knows them."""

import itertools

import numpy as np
import pytest

from firstorder.space import (
    Receiver,
    Scene,
    box,
    cylinder,
    plane,
    primitive,
    rectangle,
    sphere,
    triangle,
)
from firstorder.space.discontinuities._edges import dot, edges_of, fans, unit

AT = Receiver.at((0.0, 0.0, 0.0))
A, B, C = np.array([[0.0, 0.0, 1.0], [3.0, 0.0, 1.0], [0.0, 4.0, 1.0]])
CORNERS = np.array(list(itertools.product((1.0, 2.0), (3.0, 5.0), (7.0, 10.0))))


def edges(*shapes, at=AT):
    return edges_of(Scene.of(*map(primitive, shapes)), at)


def as_sets(found):
    """Edges by the coordinates of their ends."""
    return {frozenset(map(tuple, found.vertices[pair].round(9))) for pair in found.ends}


def pairs_of(points, pairs):
    return {frozenset((tuple(points[i]), tuple(points[j]))) for i, j in pairs}


def test_products_and_unit_vectors_are_those_of_geometry():
    assert dot(np.array([[1.0, 2.0, 3.0]]), np.array([4.0, -5.0, 6.0])).tolist() == [12.0]
    found = unit(np.array([[0.0, 3.0, 4.0], [0.0, 0.0, 0.0], [0.03, 0.04, 0.0]]))
    np.testing.assert_allclose(found, [[0.0, 0.6, 0.8], [0.0, 0.0, 0.0], [0.6, 0.8, 0.0]])


def test_a_triangle_has_three_vertices_and_three_edges():
    found = edges(triangle(A, B, C))
    np.testing.assert_allclose(found.vertices, [A, B, C])
    assert as_sets(found) == pairs_of([A, B, C], [(0, 1), (1, 2), (0, 2)])
    np.testing.assert_allclose(found.faces.corner, [A])
    np.testing.assert_allclose(found.faces.spans, [[B - A, C - A]])
    assert found.faces.triangular.tolist() == [True]
    np.testing.assert_array_equal(found.start + found.along, found.vertices[found.ends[:, 1]])


def test_a_rectangle_goes_round_its_four_corners():
    u, v = np.array([1.0, 0.0, 0.5]), np.array([0.0, 2.0, 0.0])
    found = edges(rectangle((5.0, 6.0, 7.0), u, v))
    corners = np.array([5.0, 6.0, 7.0]) + np.array([-u - v, u - v, u + v, v - u])
    assert as_sets(found) == pairs_of(corners, [(0, 1), (1, 2), (2, 3), (3, 0)])
    np.testing.assert_allclose(found.faces.corner, corners[:1])
    np.testing.assert_allclose(found.faces.spans, [[2.0 * u, 2.0 * v]])
    assert found.faces.triangular.tolist() == [False]


def test_a_box_has_twelve_edges_along_its_axes():
    found = edges(box((1.0, 3.0, 7.0), (2.0, 5.0, 10.0)))
    ends = itertools.combinations(range(8), 2)
    assert as_sets(found) == pairs_of(
        CORNERS, [(i, j) for i, j in ends if np.sum(CORNERS[i] != CORNERS[j]) == 1]
    )


def test_the_faces_of_a_box_are_its_six_sides():
    corner, spans, triangular = edges(box((1.0, 3.0, 7.0), (2.0, 5.0, 10.0))).faces
    x, y = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]).T
    points = corner[:, None] + np.einsum("ka,fai->fki", np.stack([x, y], -1), spans)
    found = {frozenset(map(tuple, face.round(9))) for face in points}
    true = {
        frozenset(map(tuple, CORNERS[CORNERS[:, i] == a])) for i in range(3) for a in CORNERS[:, i]
    }
    assert found == true
    assert not np.any(triangular)


@pytest.mark.parametrize(("apart", "vertices", "pairs"), [(0.5, 4, 5), (2.0, 6, 6)])
def test_shapes_share_what_is_nearer_than_rounding(apart, vertices, pairs):
    """Two triangles of a square of 4 m: distances below 4 m times 1.5e-8 are nothing."""
    a, b, c, d = 4.0 * np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    off = apart * 4.0 * np.sqrt(np.finfo(float).eps) * np.array([0.6, 0.0, 0.8])
    found = edges(triangle(a, b, c), triangle(a + off, c + off, d))
    assert (len(found.vertices), len(found.ends)) == (vertices, pairs)
    np.testing.assert_allclose(found.near, 4.0 * np.sqrt(np.finfo(float).eps), rtol=1e-7)


def test_single_precision_makes_more_points_one():
    at = Receiver.at(np.zeros(3, np.float32))
    assert at.position.dtype == np.float32
    np.testing.assert_allclose(edges(triangle(A, B, C), at=at).near, 4.0 * 2.0**-11.5, rtol=1e-6)


def test_many_shapes_have_the_edges_of_each():
    shapes = [
        triangle(A + np.array([0.0, 0.0, z]), B, C + np.array([z, 0.0, 0.0]))
        for z in (0.0, 1.0, 2.0, 3.0)
    ]
    assert as_sets(edges(*shapes)) == set.union(*(as_sets(edges(one)) for one in shapes))


def test_the_size_is_the_longest_extent_of_all_shapes():
    assert edges(triangle(A, B, C)).size == 4.0
    assert edges(triangle(A, B, C), sphere((0.0, 0.0, 9.0), 0.5)).size == 8.5
    assert edges(sphere((1.0, 0.0, 9.0), 0.5)).size == 1.0
    assert edges(cylinder((0.0, 0.0, 1.0), (0.0, 0.0, 8.0), 0.5)).size == 7.0


def test_a_vertex_touches_the_edges_on_which_it_lies():
    """A second triangle stands on the middle of an edge of the first."""
    middle = np.array([1.5, 0.0, 1.0])
    found = edges(triangle(A, B, C), triangle(middle, (1.5, -1.0, 2.0), (1.5, -2.0, 3.5)))
    on = {
        (tuple(found.vertices[v]), *map(tuple, sorted(found.vertices[found.ends[e]].tolist())))
        for v, e in zip(*np.nonzero(found.touch), strict=True)
    }
    apart = [(v, a, b) for v, a, b in on if v not in (a, b)]
    assert apart == [(tuple(middle), tuple(A), tuple(B))]
    assert len(on) == 2 * 6 + 1


def test_a_point_beside_the_end_of_an_edge_does_not_touch_it():
    line = rectangle((1.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.5))
    further = rectangle((3.5, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.5))
    found = edges(line, further)
    assert np.sum(found.touch) == 2 * 8


def test_edges_in_one_plane_are_coplanar():
    """Two of a triangle are, and so are parallel ones; of others none by chance."""
    found = edges(
        triangle(A, B, C),
        triangle(A + np.array([0, 0, 1]), B + np.array([0, 0, 1]), C + np.array([5, 1, 3])),
    )
    start, way = found.start, found.along
    volume = [
        [np.linalg.det([a, b, s - r]) for b, s in zip(way, start, strict=True)]
        for a, r in zip(way, start, strict=True)
    ]
    np.testing.assert_array_equal(found.coplanar, np.abs(volume) < 1e-9)
    assert 2 * 9 < np.sum(found.coplanar) < 36


def test_lines_pass_in_one_plane_if_they_are_nearer_than_rounding():
    """Whatever the lengths of the edges: what counts is the distance between their lines."""
    near = 4.0 * np.sqrt(np.finfo(float).eps)
    for off, one in [(0.5 * near, True), (2.0 * near, False)]:
        over = triangle((0.5, -2.0, 1.0 + off), (0.5, 2.0, 1.0 + off), (0.5, 1.5, 3.0))
        found = edges(triangle(A, (3.0, 0.0, 1.0), (1.0, 0.0, 4.5)), over)
        (i,) = np.flatnonzero(np.all(found.along[:, 1:] == 0.0, axis=1))
        (j,) = np.flatnonzero(np.all(found.along[:, ::2] == 0.0, axis=1))
        assert found.coplanar[i, j] == one


def test_both_parts_of_an_edge_leave_a_vertex_within_it():
    found = edges(triangle(A, B, C), triangle((1.0, 0.0, 1.0), (1.5, -1.0, 2.0), (1.5, -2.0, 3.0)))
    vertex, edge, way = fans(found)
    (within,) = np.flatnonzero(np.all(np.isclose(found.vertices, [1.0, 0.0, 1.0]), axis=1))
    ways = way[(vertex == within) & (np.abs(way[:, 2]) < 1e-12)]
    np.testing.assert_allclose(sorted(ways.tolist()), [[-1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    # Two from each of the other vertices, and four from this one.
    assert np.bincount(vertex).tolist() == [2, 2, 2, 4, 2, 2]
    ends = found.vertices[vertex] + way
    near = np.linalg.norm(ends[:, None] - found.vertices[found.ends[edge]], axis=-1)
    np.testing.assert_allclose(np.min(near, axis=1), 0.0, rtol=0.0, atol=1e-12)


def test_a_ball_has_no_edges():
    found = edges(sphere((0.0, 0.0, 9.0), 0.5))
    assert (found.vertices.shape, found.ends.shape) == ((0, 3), (0, 2))
    assert found.faces.corner.shape == (0, 3)


@pytest.mark.parametrize(("point", "normal"), [((1, 2, 0), (0, 0, 1)), ((0, 0, 0), (0, 0, -3))])
def test_receivers_may_lie_in_a_plane_without_end(point, normal):
    assert edges(plane(point, normal)).size == 1.0


@pytest.mark.parametrize(
    ("point", "normal"),
    [((1, 2, -0.1), (0, 0, 1)), ((1, 2, 1e-5), (0, 0, 1)), ((0, 0, 0), (0, 0.01, 1))],
)
def test_no_other_plane_may_be_without_end(point, normal):
    with pytest.raises(ValueError, match="must not hold a plane without end"):
        edges(plane(point, normal))


def test_far_from_the_origin_planes_are_one_by_their_size():
    high = Receiver.at((1e3, 2e3, 5.0))
    assert edges(plane((1e3, 2e3, 5.0 + 1e-4), (0.0, 0.0, 1.0)), at=high).size == 1.0
    level = Receiver.at((1e3, 2e3, 0.0))
    assert edges(plane((0.0, 0.0, 1e-4), (0.0, 0.0, 1.0)), at=level).size == 1.0


def test_a_shape_whose_corners_would_all_be_one_is_refused():
    small = rectangle((0.0, 0.0, 1.0), (1e-9, 0.0, 0.0), (0.0, 1e-9, 0.0))
    assert len(edges(small).ends) == 4
    with pytest.raises(ValueError, match=r"A shape is 2e-09 m long, .* within 1.5e-08 m count as"):
        edges(small, box((0.0, 0.0, 1.0), (1.0, 1.0, 2.0)))
