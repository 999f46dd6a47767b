"""Lines of sight that are laid through edges first, and found after."""

import itertools

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, box, primitive, rectangle, triangle
from firstorder.space.discontinuities import _lines_of_sight as sight
from firstorder.space.discontinuities._edges import edges_of

AT = Receiver.at((-1.0, 0.1, 0.0))
ALONG, REACH = np.array([0.96, 0.28, 0.0]), 2.0
RNG = np.random.default_rng(4)


def edges(*shapes, at=AT):
    return edges_of(Scene.of(*map(primitive, shapes)), at)


def random_triangles(seed):
    rng = np.random.default_rng(seed)
    middles = np.array([[0.0, 0.4, 0.6 + 0.6 * k] for k in range(3)])
    return [triangle(*(m + rng.uniform(-0.8, 0.8, (3, 3)) * [1, 1, 0.3])) for m in middles]


TRIANGLES = random_triangles(7)


# --- lines and edges -----------------------------------------------------------------------------


def test_a_line_meets_an_edge_where_it_is_laid_through_it():
    eye, u, along = RNG.normal(size=(3, 5, 3))
    r, share = RNG.uniform(-1.0, 2.0, (2, 5))
    start = eye + r[:, None] * u - share[:, None] * along
    np.testing.assert_allclose(sight.meeting(eye, u, start, along), [r, share], rtol=1e-10)


def test_skew_lines_are_nearest_at_right_angles_to_both():
    eye, u, start, along = RNG.normal(size=(4, 5, 3))
    r, share = sight.meeting(eye, u, start, along)
    gap = start + share[:, None] * along - eye - r[:, None] * u
    np.testing.assert_allclose(np.sum(gap * u, -1), 0.0, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(np.sum(gap * along, -1), 0.0, rtol=0.0, atol=1e-13)


def test_parallel_lines_do_not_meet():
    u = np.array([[1.0, 2.0, 3.0]])
    assert sight.meeting(np.zeros((1, 3)), u, np.ones((1, 3)), -2.0 * u) == (-1.0, -1.0)


def test_planes_are_met_where_a_line_crosses_them():
    n, point = RNG.normal(size=(2, 6, 3))
    t = sight.crossed(n, point, AT, ALONG)
    met = np.asarray(AT.position) + t[:, None] * ALONG
    np.testing.assert_allclose(np.sum((met - point) * n, -1), 0.0, rtol=0.0, atol=1e-13)
    along = 1e3 * np.array([[0.28, -0.96, 0.0], [0.28, -0.96, 1.0], [0.28, -0.96 + 1e-10, 1.0]])
    assert (sight.crossed(along, np.ones((3, 3)), AT, ALONG) == -1.0).tolist() == [
        True,
        True,
        False,
    ]


@pytest.mark.parametrize(
    ("r", "up", "there"),
    [
        ([1.0, 2.0], 0.5, True),
        ([2.0, 1.0], 0.5, True),
        ([3.0, 1.0, 2.0], 0.5, True),
        ([1.0, 1.0 + 1e-9], 0.5, False),
        ([1.0, 2.0, 1.0], 0.5, False),
        ([2.0, 1.0, 2.0], 0.5, False),
        ([1e-9, 2.0], 0.5, False),
        ([-1.0, 2.0], 0.5, False),
        ([1.0, 2.0], 0.0, False),
        ([1.0, 2.0], 0.9e-6, False),
        ([1.0, 2.0], 1.1e-6, True),
        ([1.0, 2.0], -0.5, False),
    ],
)
def test_what_is_in_line_is_above_the_plane_and_apart(r, up, there):
    u = np.array([[np.sqrt(1.0 - up**2), 0.0, up]])
    assert sight.apart_above(edges(*TRIANGLES), AT, u, np.array([r])).tolist() == [there]


def test_tables_are_put_together_and_taken_apart():
    rows = sight.ThreeEdges(*(RNG.normal(size=(4, *s)) for s in [(3,), (3, 3), (3, 3), (3,), (3,)]))
    both = sight.merged([sight.taken(rows, [2, 0]), sight.taken(rows, [1])])
    for a, b in zip(both, rows, strict=True):
        np.testing.assert_array_equal(a, b[[2, 0, 1]])


# --- a vertex and an edge ------------------------------------------------------------------------


def test_a_vertex_has_a_plane_with_each_edge_that_it_is_not_on():
    vertex, edge = sight.vertex_edge_pairs(edges(*TRIANGLES[:2]))
    assert len(vertex) == 2 * 3 + 2 * 9
    assert len(set(zip(vertex.tolist(), edge.tolist(), strict=True))) == len(vertex)


@pytest.mark.parametrize(("beside", "more"), [(0.0, 0), (0.5, 0), (2.0, 2)])
def test_a_vertex_on_the_line_of_an_edge_has_none_with_it(beside, more):
    """A corner beyond the end of an edge of 3 m, beside its line by so many times rounding."""
    off = beside * 5.0 * np.sqrt(np.finfo(float).eps)
    line = triangle((0.0, 0.0, 1.0), (3.0, 0.0, 1.0), (1.0, 1.0, 2.0))
    found = edges(line, triangle((5.0, off, 1.0), (4.0, -1.0, 3.0), (3.5, 1.0, 1.5)))
    vertex, edge = sight.vertex_edge_pairs(found)
    here = np.isclose(found.vertices[vertex, 0], 5.0)
    here &= np.isclose(np.abs(found.along[edge, 0]), 3.0)
    assert np.sum(here) == more // 2


def laid(vertex, start, along):
    """Where a line of receivers sees a vertex on an edge, by one linear system for each pair."""
    origin = np.asarray(AT.position)
    t, a, b = np.linalg.solve(np.stack([ALONG, start - vertex, along], -1), vertex - origin)
    # origin + t ALONG - vertex = -(a (start - vertex) + b along): the edge is met at share b / a.
    return t, b / a


def test_vertices_and_edges_are_found_in_line_from_all_places_of_a_line():
    found = edges(*TRIANGLES)
    true = []
    for v, e in itertools.product(range(9), range(9)):
        if v // 3 == e // 3 and found.touch[v, e]:
            continue
        t, share = laid(found.vertices[v], found.start[e], found.along[e])
        above = found.vertices[v] - np.asarray(AT.position) - t * ALONG
        if 0.0 < t < REACH and 0.0 < share < 1.0 and above[2] > 0.0:
            edge_place = found.start[e] + share * found.along[e]
            r = edge_place - np.asarray(AT.position) - t * ALONG
            if r[2] > 0.0:
                true.append((t, v, e, np.linalg.norm(above), np.linalg.norm(r)))
    t, rows = sight.vertex_edges_along(found, AT, ALONG, REACH)
    order = np.argsort(t)
    np.testing.assert_allclose(
        np.stack([t, rows.vertex, rows.edge, rows.r_vertex, rows.r_edge], -1)[order],
        sorted(true),
        rtol=1e-9,
    )
    assert len(t) > 5
    np.testing.assert_allclose(rows.place, np.asarray(AT.position) + t[:, None] * ALONG)
    np.testing.assert_array_equal(rows.start, found.start[rows.edge])
    np.testing.assert_array_equal(rows.along, found.along[rows.edge])


def test_a_corner_of_a_box_has_edges_in_the_planes_of_its_faces_only():
    """Of a box all edges are parallel to one of each vertex; of far triangles none is."""
    box_and_more = edges(box((0.0, 0.0, 1.0), (1.0, 1.0, 2.0)), TRIANGLES[0])
    count = len(box_and_more.ends)
    vertex, edge = (a.ravel() for a in np.indices((len(box_and_more.vertices), count + 1)))
    rows = sight.VertexEdges(edge, vertex, edge, *[edge] * 4)
    held = sight.in_planes_of_others(box_and_more, rows).reshape(-1, count + 1)
    corner = np.all(np.isin(box_and_more.vertices, [0.0, 1.0, 2.0]), axis=1)
    of_box = np.all(np.isin(box_and_more.start, [0.0, 1.0, 2.0]), axis=1)
    assert np.all(held[np.ix_(corner, np.append(of_box, False))])
    assert np.all(held[np.ix_(~corner, np.append(~of_box, False))])
    assert not np.any(held[np.ix_(corner, np.append(~of_box, True))])
    assert not np.any(held[np.ix_(~corner, np.append(of_box, True))])


# --- three edges ---------------------------------------------------------------------------------


@pytest.mark.parametrize("most", [4, 1000])
def test_triples_are_those_no_two_of_which_lie_in_a_plane(most):
    found = edges(*TRIANGLES)
    chunks = list(sight.edge_triples(found, most))
    assert all(len(chunk) == most for chunk in chunks[:-1])
    of = np.argmax(np.sum(found.touch.reshape(3, 3, 9), axis=1) == 2, axis=0)
    true = [t for t in itertools.combinations(range(9), 3) if len(set(of[list(t)])) == 3]
    assert np.concatenate(chunks).tolist() == [list(t) for t in true]


def determinant(found, triple, t):
    """Of unit normals of planes through places and three edges."""
    place = np.asarray(AT.position) + t[:, None] * ALONG
    n = np.stack([np.cross(found.start[i] - place, found.along[i]) for i in triple], -1)
    return np.linalg.det(n)


@pytest.mark.parametrize("seed", [5, 22, 26])
def test_three_edges_are_found_in_line_from_all_places_of_a_line(seed):
    found = edges(*random_triangles(seed))
    samples = np.linspace(0.0, REACH, 4001)
    true = []
    for triple in np.concatenate(list(sight.edge_triples(found))):
        values = determinant(found, triple, samples)
        for k in np.flatnonzero(np.diff(np.sign(values))):
            t = samples[k] - values[k] * (samples[k + 1] - samples[k]) / (values[k + 1] - values[k])
            place = np.asarray(AT.position) + t * ALONG
            # The line through the eye that meets the first two edges.
            u = np.cross(*(np.cross(found.start[e] - place, found.along[e]) for e in triple[:2]))
            u = u * np.sign(u[2]) / np.linalg.norm(u)
            pairs = [
                np.linalg.lstsq(np.stack([u, -found.along[e]], -1), found.start[e] - place)[0]
                for e in triple
            ]
            far, shares = np.transpose(pairs)
            if min(far) > 0.0 and min(shares) > 0.0 and max(shares) < 1.0:
                true.append((t, *far))
    t, rows = sight.three_edges_along(found, AT, ALONG, REACH)
    assert len(true) > 1
    order = np.argsort(t)
    np.testing.assert_allclose(
        np.column_stack([t, rows.r])[order], sorted(true), rtol=1e-5, atol=1e-6
    )
    later = Receiver.at(np.asarray(AT.position) + 0.9 * np.min(t) * ALONG)
    again, _ = sight.three_edges_along(found, later, ALONG, REACH - 0.9 * np.min(t))
    np.testing.assert_allclose(np.sort(again), np.sort(t) - 0.9 * np.min(t), rtol=0.0, atol=1e-9)
    on = rows.place[:, None] + rows.r[..., None] * rows.u[:, None]
    beside = np.cross(on - rows.start, rows.along)
    np.testing.assert_allclose(beside, 0.0, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(np.linalg.norm(rows.u, axis=-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(rows.place, np.asarray(AT.position) + t[:, None] * ALONG)


def test_a_line_without_edges_above_it_sees_nothing():
    t, rows = sight.three_edges_along(edges(TRIANGLES[0]), AT, ALONG, REACH)
    assert t.shape == (0,)
    assert rows.start.shape == (0, 3, 3)


def test_a_line_through_three_edges_is_found_whichever_two_are_nearly_in_a_plane_with_the_eye():
    """Two of them run beside each other as seen from there, at an angle of 1e-7."""
    u, place = np.array([[0.0, 0.6, 0.8]]), np.array([[0.1, 0.2, 0.0]])
    for turn in range(3):
        ways = np.array([[1.0, 0.0, 0.0], [1.0, 1e-7, 0.0], [0.3, 1.0, 0.0]])
        ways = np.roll(ways, turn, axis=0)
        start = place + np.array([[1.0], [2.0], [3.0]]) * u - 0.5 * ways
        shapes = [
            triangle(s, s + w, s + w / 2 + [0.1, 0.3, 5.0])
            for s, w in zip(start, ways, strict=True)
        ]
        found = edges(*shapes)
        starts = [
            np.argmin(
                np.linalg.norm(found.start - s, axis=1) + np.linalg.norm(found.along - w, axis=1)
            )
            for s, w in zip(start, ways, strict=True)
        ]
        rows, there = sight.three_edges_at(found, AT, place, np.array([starts]))
        assert there.tolist() == [True]
        np.testing.assert_allclose(rows.u, u, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(rows.r, [[1.0, 2.0, 3.0]], rtol=0.0, atol=1e-12)


def test_lines_through_three_edges_meet_the_receivers_plane():
    found = edges(*TRIANGLES)
    triples = np.concatenate(list(sight.edge_triples(found)))
    share = RNG.uniform(0.0, 1.0, (len(triples), 2))
    places = sight.transversals(found, AT, triples, share)
    np.testing.assert_allclose(places[..., 2], 0.0, rtol=0.0, atol=1e-9)
    first = found.start[triples[:, :1]] + share[..., None] * found.along[triples[:, :1]]
    u = first - places
    for k in (1, 2):
        n = np.cross(u, found.along[triples[:, k]][:, None])
        n = n / np.linalg.norm(n, axis=-1, keepdims=True)
        away = np.sum((found.start[triples[:, k]][:, None] - first) * n, axis=-1)
        np.testing.assert_allclose(away, 0.0, rtol=0.0, atol=1e-9)


# --- roots, and faces that are run into ----------------------------------------------------------


@pytest.mark.parametrize(
    ("coefficients", "roots"),
    [
        ((2.0, -1.0, 0.12), [0.2, 0.3]),
        ((-3.0, 0.0, 12.0), [-2.0, 2.0]),
        ((1.0, 3.0, 2.0), [-2.0, -1.0]),
        ((0.0, 2.0, -1.0), [0.5]),
        ((0.0, 0.5, -0.125), [0.25]),
        ((0.0, -0.5, 0.125), [0.25]),
        ((1.0, 0.0, 1.0), []),
        ((1.0, -1.0, 0.25), []),
        ((0.0, 0.0, 1.0), []),
        ((1.0, -1.0, 0.0), [0.0, 1.0]),
    ],
)
def test_roots_of_parabolas_are_real_and_simple(coefficients, roots):
    values = np.polyval(coefficients, np.array([0.0, 0.5, 1.0]))
    found, row = sight.quadratic_roots(np.stack([np.array([1.0, 1.0, 1.0]), values], -1))
    np.testing.assert_allclose(np.sort(found), roots, rtol=0.0, atol=1e-12)
    assert row.tolist() == [1] * len(roots)


@pytest.mark.parametrize("z", [0.4, 0.4 + 3e-8, -0.4 - 3e-8])
def test_a_line_runs_into_faces_and_out_of_them(z):
    """A box from x = 1 to 2; a wall at 3, an edge of which lies in the plane; a triangle at 3.5.

    Points are one within 3.7e-8 m.
    """
    at, along = Receiver.at((0.0, 0.0, 0.0)), np.array([1.0, 0.0, 0.0])
    shapes = [
        box((1.0, -0.5, -0.5), (2.0, 0.5, 0.5)),
        rectangle((3.0, 0.1, z), (0.0, 0.5, 0.0), (0.0, 0.0, 0.4)),
        triangle((3.5, -0.3, -0.3), (3.5, 1.0, -0.3), (3.5, -0.3, 1.0)),
    ]
    found = edges(*shapes, at=at)
    np.testing.assert_allclose(sight.contacts(found, at, along, 4.0), [1.0, 2.0, 3.0, 3.5])
    np.testing.assert_allclose(sight.contacts(found, at, along, 2.5), [1.0, 2.0])
    np.testing.assert_allclose(sight.contacts(found, at, -along, 4.0), [])


@pytest.mark.parametrize(
    ("y", "z", "count"),
    [(0.1, 0.2, 1), (-0.1, 0.2, 0), (0.1, -0.2, 0), (0.9, 0.2, 1), (1.1, 0.2, 0), (0.7, 0.7, 0)],
)
def test_a_triangle_is_met_within_its_three_sides(y, z, count):
    """That with y, z > 0 and y / 1.2 + z < 1, seen along x."""
    at, along = Receiver.at((0.0, y, z)), np.array([1.0, 0.0, 0.0])
    face = triangle((2.0, 0.0, 0.0), (2.3, 1.2, 0.0), (2.0, 0.0, 1.0))
    found = sight.contacts(edges(face, at=at), at, along, 4.0)
    np.testing.assert_allclose(found, [2.0 + 0.25 * y] * count, rtol=1e-12)


@pytest.mark.parametrize(("y", "count"), [(-1.01, 0), (-0.99, 1), (0.99, 1), (1.01, 0)])
@pytest.mark.parametrize(("z", "inside"), [(-0.51, 0), (-0.49, 1), (0.49, 1), (0.51, 0)])
def test_a_rectangle_is_met_within_its_four_sides(y, z, count, inside):
    at = Receiver.at((0.0, y, z))
    face = rectangle((2.0, 0.0, 0.0), (0.3, 1.0, 0.0), (0.0, 0.0, 0.5))
    found = sight.contacts(edges(face, at=at), at, np.array([1.0, 0.0, 0.0]), 4.0)
    np.testing.assert_allclose(found, [2.0 + 0.3 * y] * count * inside, rtol=1e-12)
