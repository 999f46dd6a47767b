"""Lines of sight that are laid along balls and rims first, and found after."""

import itertools

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, cylinder, disc, ellipsoid, primitive, sphere, triangle
from firstorder.space.discontinuities import _round_lines as lines
from firstorder.space.discontinuities._edges import edges_of
from firstorder.space.discontinuities._rounds import BALL, rounds_of

AT = Receiver.at((-1.0, 0.1, 0.0))
ORIGIN, ALONG, REACH = np.array([-1.0, 0.1, 0.0]), np.array([0.96, 0.28, 0.0]), 2.0
PLATE = triangle((-0.5, -0.6, 1.0), (0.6, -0.5, 1.1), (0.1, 0.7, 0.9))
FIRST, SECOND = (np.array([0.1, 0.5, 0.6]), 0.25), (np.array([0.05, 0.3, 1.7]), 0.5)


def parts(*shapes, at=AT):
    scene = Scene.of(*map(primitive, shapes))
    return edges_of(scene, at), rounds_of(scene)


def numbers_of(edges, rounds, *middles):
    """Of the bodies with these middles: a scene sorts its shapes by kind."""
    found = [np.argmin(np.linalg.norm(rounds.center - c, axis=-1)) for c in middles]
    return np.array(found), len(edges.ends)


def test_parabolas_are_those_through_their_values():
    p = np.array([2.0, -3.0, 5.0])
    values = np.polynomial.polynomial.polyval(lines.NODES, p)
    np.testing.assert_allclose(lines.PARABOLA @ values, p)


# --- a vertex and a ball -------------------------------------------------------------------------


def outside(t, vertex, center, radius):
    """The angle between a vertex and the middle of a ball, less that of its limb."""
    eye = ORIGIN + np.multiply.outer(t, ALONG)
    v, w = vertex - eye, center - eye
    far = np.linalg.norm(w, axis=-1)
    cosine = np.sum(v * w, -1) / np.linalg.norm(v, axis=-1) / far
    return np.arccos(cosine) - np.arcsin(radius / far)


def test_vertices_are_found_on_limbs_from_all_places_of_a_line():
    balls = [(np.array([0.05, 0.3, z]), r) for z, r in ((0.5, 0.3), (0.8, 0.5))]
    edges, rounds = parts(PLATE, *(sphere(*ball) for ball in balls))
    samples = np.linspace(0.0, REACH, 4001)
    true = []
    for v, ball in itertools.product(edges.vertices, balls):
        off = outside(samples, v, *ball)
        true += [*samples[1:][np.diff(np.sign(off)) != 0]]
    t, rows = lines.vertex_rounds_along(edges, rounds, AT, ALONG, REACH)
    assert len(t) > 1
    np.testing.assert_allclose(np.sort(t), np.sort(true), rtol=0.0, atol=6e-4)
    body = rows.edge - 3
    assert set(body.tolist()) == {0, 1}
    center, radius = rounds.center[body], np.sqrt(rounds.spread[body, 0, 0])
    for k in range(len(t)):
        assert abs(outside(t[k], edges.vertices[rows.vertex[k]], center[k], radius[k])) < 1e-9
    np.testing.assert_allclose(rows.place, ORIGIN + t[:, None] * ALONG)
    way = edges.vertices[rows.vertex] - rows.place
    np.testing.assert_allclose(rows.r_vertex, np.linalg.norm(way, axis=-1))
    w = np.linalg.norm(center - rows.place, axis=-1)
    np.testing.assert_allclose(rows.r_edge, np.sqrt(w**2 - radius**2), rtol=1e-9)
    # The edge in the place of the limb touches the ball, at right angles to the line of sight.
    touch = rows.place + rows.r_edge[:, None] * way / rows.r_vertex[:, None]
    np.testing.assert_allclose(rows.start, touch, rtol=0.0, atol=1e-9)
    for other in (way, center - touch):
        np.testing.assert_allclose(np.sum(rows.along * other, -1), 0.0, rtol=0.0, atol=1e-9)
    short, _ = lines.vertex_rounds_along(edges, rounds, AT, ALONG, 1.0)
    np.testing.assert_allclose(np.sort(short), np.sort(t[t < 1.0]))


def test_a_vertex_on_the_surface_of_a_ball_is_in_the_place_of_the_limb():
    """Seen from where the tangent meets the plane, both are as far away."""
    corner = FIRST[0] + FIRST[1] * np.array([0.6, 0.0, -0.8])
    edges, rounds = parts(
        triangle(corner, corner + np.array([1.0, 0.2, 0.3]), corner + np.array([0.5, 1.0, 0.1])),
        sphere(*FIRST),
    )
    place = np.array([[corner[0] + corner[2] * -0.8 / 0.6, 0.5, 0.0]])
    vertex = np.array([np.argmin(np.linalg.norm(edges.vertices - corner, axis=1))])
    rows, there = lines.vertex_rounds_at(edges, rounds, AT, place, vertex, np.array([0]))
    np.testing.assert_allclose(rows.r_vertex, rows.r_edge, rtol=1e-9)
    assert there.tolist() == [False]


@pytest.mark.parametrize(("height", "off"), [(0.0, False), (0.4, False), (2.5, True), (-2.5, True)])
def test_a_vertex_in_the_plane_of_a_disc_is_not_off_it(height, off):
    """Metres from the plane count, in units of what is one point, whatever the disc's axes."""
    near = 4.0 * np.sqrt(np.finfo(float).eps)
    normal = np.array([0.6, 0.0, 0.8])
    corner = np.array([1.0, 0.2, 0.3]) + height * near * normal
    shapes = triangle(
        corner, corner + np.array([0.0, 4.0, 0.0]), corner + np.array([-3.0, 0.0, 0.4])
    )
    flat = disc(np.array([1.0, 0.2, 0.3]) + 0.5 * np.array([0.8, 0.0, -0.6]), normal, 0.1)
    edges, rounds = parts(shapes, flat, sphere((0.0, 1.0, 1.0), 0.1))
    vertex, body = lines.vertices_off_discs(edges, rounds)
    pairs = set(zip(vertex.tolist(), body.tolist(), strict=True))
    (ball,) = np.flatnonzero(rounds.kind == BALL)
    at_corner = int(np.argmin(np.linalg.norm(edges.vertices - corner, axis=1)))
    assert ((at_corner, 1 - ball) in pairs) == off
    assert sum(body == ball) == 3


# --- three outlines ------------------------------------------------------------------------------

PLACE = ORIGIN + 0.9 * ALONG
U = np.array([0.48, -0.36, 0.8])
FRAME = np.array([[0.6, 0.8, 0.0], [0.64, -0.48, -0.6]])


def across(angle):
    return np.cos(angle) * FRAME[0] + np.sin(angle) * FRAME[1]


def ball_beside(r, angle, radius):
    """A ball that the line of sight touches at a distance."""
    return sphere(PLACE + r * U - radius * across(angle), radius)


def plate_through(r, angle):
    """A triangle an edge of which crosses the line of sight."""
    way, middle = across(angle) + 0.2 * U, PLACE + r * U
    return triangle(middle - 0.4 * way, middle + 0.6 * way, middle + 2.0 * across(angle + 1.3) - U)


def rim_through(r, angle):
    """A disc whose edge crosses the line of sight."""
    normal = U + 0.5 * across(angle)
    out = across(angle + np.pi / 2)
    return disc(PLACE + r * U - 0.3 * out, normal, 0.3)


def tube_beside(r, angle):
    """A cylinder whose wall the line of sight touches."""
    axis = across(angle + np.pi / 2) + 0.3 * U
    middle = PLACE + r * U - 0.2 * across(angle)
    return cylinder(middle - 0.5 * axis, middle + 0.8 * axis, 0.2)


TRIPLES = {
    "two edges and a ball": (
        plate_through(1.0, 0.3),
        plate_through(1.6, 1.5),
        ball_beside(2.2, 0.9, 0.3),
    ),
    "a ball and two edges": (
        ball_beside(0.8, 0.9, 0.2),
        plate_through(1.3, 2.5),
        plate_through(1.9, 1.5),
    ),
    "an edge and two balls": (
        ball_beside(0.8, 0.9, 0.2),
        plate_through(1.3, 2.1),
        ball_beside(1.9, 2.4, 0.3),
    ),
    "an edge, a rim and a ball": (
        rim_through(0.8, 0.9),
        plate_through(1.3, 2.1),
        ball_beside(1.9, 2.4, 0.3),
    ),
    "an edge, a wall and a ball": (
        ball_beside(0.8, 0.9, 0.2),
        tube_beside(1.3, 2.0),
        plate_through(1.9, 2.1),
    ),
}


def found_along(search, shapes, distances, atol):
    """Places and lines of sight of a search, of which one is that of `U`, at those distances."""
    edges, rounds = parts(*shapes)
    t, rows = search(edges, rounds, AT, ALONG, REACH)
    np.testing.assert_allclose(rows.place, ORIGIN + t[:, None] * ALONG, rtol=0.0, atol=1e-12)
    (k,) = np.flatnonzero(np.abs(t - 0.9) < 1e-8)
    np.testing.assert_allclose(rows.u[k], U, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(sorted(rows.r[k]), distances, rtol=0.0, atol=1e-7)
    short, _ = search(edges, rounds, AT, ALONG, 0.95)
    np.testing.assert_allclose(np.sort(short), np.sort(t[t < 0.95]), rtol=0.0, atol=atol)
    return t, rows


@pytest.mark.parametrize("name", TRIPLES)
def test_a_line_that_passes_an_edge_and_two_outlines_is_found(name):
    true = {"two": [1.0, 1.6, 2.2], "a b": [0.8, 1.3, 1.9], "an ": [0.8, 1.3, 1.9]}[name[:3]]
    _, rows = found_along(lines.round_triples_along, TRIPLES[name], true, 1e-9)
    touch = rows.place[:, None] + rows.r[..., None] * rows.u[:, None]
    beside = (
        np.cross(touch - rows.start, rows.along) / np.linalg.norm(rows.along, axis=-1)[..., None]
    )
    np.testing.assert_allclose(beside, 0.0, rtol=0.0, atol=1e-7)


ROUNDS = {
    "three balls": (
        ball_beside(0.8, 0.9, 0.2),
        ball_beside(1.3, 2.1, 0.3),
        ball_beside(1.9, 3.4, 0.25),
    ),
    "a rim and two balls": (
        rim_through(0.8, 0.9),
        ball_beside(1.3, 2.1, 0.3),
        ball_beside(1.9, 3.4, 0.25),
    ),
    "a wall, a rim and a ball": (
        ball_beside(0.8, 0.9, 0.2),
        tube_beside(1.3, 2.0),
        rim_through(1.9, 3.4),
    ),
}


@pytest.mark.parametrize("name", ROUNDS)
def test_a_line_that_passes_three_round_outlines_is_found(name):
    shapes = (*ROUNDS[name], PLATE)
    t, rows = found_along(lines.three_rounds_along, shapes, [0.8, 1.3, 1.9], 1e-7)
    assert len(np.unique(np.column_stack([t, rows.u]).round(6), axis=0)) == len(t)


def test_edges_that_cross_in_one_plane_with_the_eye_are_another_event():
    """The edge and the ball's limb run beside each other as seen there."""
    shapes = (
        plate_through(1.0, 0.9 + np.pi / 2),
        ball_beside(1.6, 0.9, 0.3),
        ball_beside(2.2, 2.4, 0.3),
    )
    edges, rounds = parts(*shapes)
    u = U[None]
    edge = [int(np.argmin(np.linalg.norm(np.cross(PLACE + U - edges.start, edges.along), axis=1)))]
    bodies, count = numbers_of(edges, rounds, *(np.asarray(s.center)[0] for s in shapes[1:]))
    numbers = np.array([[*edge, *(count + bodies)]])
    rows, there = lines.triples_at(edges, rounds, AT, PLACE[None], u, numbers)
    assert there.tolist() == [False]
    np.testing.assert_allclose(rows.r, [[1.0, 1.6, 2.2]], rtol=1e-9)


@pytest.mark.parametrize(("angle", "on"), [(0.0, True), (3e-7, True), (3e-6, False)])
def test_a_direction_is_on_an_outline_within_a_millionth(angle, on):
    ball = ball_beside(1.5, 0.9, 0.3)
    edges, rounds = parts(plate_through(1.0, 0.3), ball)
    u = U + angle * across(0.9)
    number = np.array([0, 1, 2, 3])
    start, along, r, there = lines.seen(
        edges, rounds, np.tile(PLACE, (4, 1)), np.tile(u, (4, 1)), number
    )
    hit = np.linalg.norm(np.cross(PLACE + U - edges.start, edges.along), axis=1) < 1e-9
    # An edge is on any line of sight that passes between its ends, in a plane or not.
    assert there[3] == on
    np.testing.assert_allclose(r[3], 1.5, rtol=1e-5)
    np.testing.assert_allclose(start[:3], edges.start)
    np.testing.assert_allclose(along[:3], edges.along)
    np.testing.assert_allclose(r[:3][hit], 1.0, rtol=1e-5)


@pytest.mark.parametrize(("share", "on"), [(-0.1, False), (0.1, True), (0.9, True), (1.1, False)])
def test_a_direction_is_on_an_edge_between_its_ends(share, on):
    edges, rounds = parts(PLATE, sphere(*FIRST))
    way = edges.start + share * edges.along - PLACE
    _, _, r, there = lines.seen(edges, rounds, np.tile(PLACE, (3, 1)), way, np.arange(3))
    np.testing.assert_allclose(r, 1.0)
    assert there.tolist() == [on] * 3


# --- which of them -------------------------------------------------------------------------------


def test_triples_are_all_pairs_of_edges_in_no_plane_with_each_body():
    edges, rounds = parts(PLATE, plate_through(1.9, 1.5), sphere(*FIRST), sphere(*SECOND))
    found = lines.edge_triples_with_bodies(edges, rounds).tolist()
    pairs = [(i, j) for i, j in itertools.combinations(range(6), 2) if not edges.coplanar[i, j]]
    assert len(pairs) == 9
    assert sorted(found) == sorted([*pair, 6 + k] for pair in pairs for k in (0, 1))


TUBE = cylinder((0.0, 0.0, 1.0), (0.0, 0.0, 2.0), 0.3)


def test_two_bodies_of_one_cylinder_are_no_pair():
    edges, rounds = parts(PLATE, TUBE, sphere(*FIRST), sphere(*SECOND))
    found = lines.edges_with_two_bodies(edges, rounds)
    of = rounds.shape.tolist()
    pairs = [(3 + i, 3 + j) for i, j in itertools.combinations(range(5), 2) if of[i] != of[j]]
    assert len(pairs) == 7
    assert sorted(map(tuple, found.tolist())) == [(e, *p) for e in range(3) for p in pairs]


def test_three_bodies_are_of_three_shapes_and_balls_come_last():
    flat = disc((0.0, 0.0, 3.0), (0.0, 0.0, 1.0), 0.3)
    edges, rounds = parts(PLATE, TUBE, sphere(*FIRST), flat)
    found = lines.three_bodies(edges, rounds) - 3
    assert len(found) == 3
    assert np.all(rounds.kind[found[:, 2]] == BALL)
    assert all(len(set(rounds.shape[row].tolist())) == 3 for row in found)
    assert lines.three_bodies(*parts(PLATE, TUBE)).shape == (0, 3)


# --- roots and zeros -----------------------------------------------------------------------------


def polynomial(rng, t, s):
    """Of second degree in both, and zero at one place."""
    a = rng.uniform(-1.0, 1.0, (3, 3))
    a[0, 0] -= t ** np.arange(3) @ a @ s ** np.arange(3)
    return a


@pytest.mark.parametrize("seed", range(6))
def test_common_roots_are_zeros_of_both_between_0_and_1(seed):
    rng = np.random.default_rng(seed)
    t, s = rng.uniform(0.1, 0.9, 2)
    f, g = polynomial(rng, t, s), polynomial(rng, t, s)
    found = np.stack(lines._common_roots(f, g), -1)
    assert np.min(np.linalg.norm(found - [t, s], axis=1)) < 1e-8
    powers = found[..., None] ** np.arange(3)
    for a in (f, g):
        values = np.einsum("ni,ij,nj->n", powers[:, 0], a, powers[:, 1])
        np.testing.assert_allclose(values, 0.0, rtol=0.0, atol=1e-7)
    assert np.all((found > 0.0) & (found < 1.0))


def test_common_zeros_are_each_found_once():
    """Lines of equal t and angle that cross at (0.3, 2), (0.3, 5), (0.71, 2) and (0.71, 5)."""

    def both(t, angle):
        return np.stack([(t - 0.3) * (t - 0.71) + 0.0 * angle, np.cos(angle - 3.5) - np.cos(1.5)])

    t, angle = lines._common_zeros(both)
    true = [[0.3, 2.0], [0.3, 5.0], [0.71, 2.0], [0.71, 5.0]]
    np.testing.assert_allclose(sorted(np.stack([t, angle], -1).tolist()), true, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("ways", [(0.3, 0.3), (-0.4, 0.9)])
def test_angles_count_from_an_axis_across_what_is_between(ways):
    """For a ball, at right angles to the ways to its middle from both ends."""
    _, rounds = parts(PLATE, ellipsoid((0.0, 0.0, 1.0), 0.5 * np.eye(3)))
    ends = np.array([[ways[0], 0.2, 0.0], [ways[1], 0.2, 0.0]])
    axis = lines._axis(rounds.take(0), ends)
    assert np.linalg.norm(axis) > 1e-3
    np.testing.assert_allclose((rounds.center[0] - ends) @ axis, 0.0, rtol=0.0, atol=1e-12)
