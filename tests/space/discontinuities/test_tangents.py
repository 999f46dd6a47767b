"""Lines of sight along which balls touch edges and each other, by angles and distances."""

import itertools

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, cylinder, disc, ellipsoid, primitive, sphere, triangle
from firstorder.space.discontinuities import _tangents as tangents
from firstorder.space.discontinuities._edges import edges_of
from firstorder.space.discontinuities._rounds import BALL, WALL, rounds_of

AT = Receiver.at((-1.0, 0.1, 0.0))
ORIGIN, ALONG, REACH = np.array([-1.0, 0.1, 0.0]), np.array([0.96, 0.28, 0.0]), 2.0
PLATE = triangle((-0.5, -0.6, 1.0), (0.6, -0.5, 1.1), (0.1, 0.7, 0.9))
FIRST, SECOND = ((0.1, 0.5, 0.6), 0.25), ((0.05, 0.3, 1.7), 0.3)
C, R = zip(FIRST, SECOND, strict=True)
CENTERS, RADII = np.array(C), np.array(R)


def parts(*shapes):
    scene = Scene.of(*map(primitive, shapes))
    return edges_of(scene, AT), rounds_of(scene)


def away(point, lines, ways):
    """Distances of points from lines."""
    return np.linalg.norm(np.cross(point - lines, ways), axis=-1) / np.linalg.norm(ways, axis=-1)


# --- edges and bodies ----------------------------------------------------------------------------


def test_two_planes_through_each_edge_touch_a_ball():
    planes = tangents.edge_tangents(*parts(PLATE, sphere(*FIRST), sphere(*SECOND)))
    assert np.bincount(planes.body).tolist() == [6, 6]
    np.testing.assert_allclose(np.linalg.norm(planes.normal, axis=-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(np.sum(planes.normal * planes.along, -1), 0.0, rtol=0.0, atol=1e-14)
    far = np.abs(np.sum((CENTERS[planes.body] - planes.start) * planes.normal, -1))
    np.testing.assert_allclose(far, RADII[planes.body], rtol=1e-12)
    lines = {tuple(row.round(6)) for row in np.hstack([planes.start, planes.along])}
    assert len(lines) == 3


def test_no_plane_through_a_line_that_meets_a_ball_touches_it():
    planes = tangents.edge_tangents(*parts(PLATE, sphere((0.0, -0.5, 1.05), 0.2)))
    assert len(planes.body) == 4


def test_lines_of_a_wall_are_edges_in_planes_that_touch_another_body_but_not_its_own_rims():
    tube = cylinder((0.4, -0.3, 0.5), (0.7, -0.2, 1.3), 0.1)
    edges, rounds = parts(tube, sphere(*FIRST))
    planes = tangents.edge_tangents(edges, rounds)
    axis = np.array([0.3, 0.1, 0.8])
    assert rounds.kind[planes.body].tolist() == [BALL] * 4
    np.testing.assert_allclose(planes.along, np.tile(axis, (4, 1)), rtol=0.0, atol=1e-12)
    foot = planes.start - [0.4, -0.3, 0.5]
    np.testing.assert_allclose(foot, 0.1 * planes.normal, rtol=0.0, atol=1e-12)
    far = np.abs(np.sum((FIRST[0] - planes.start) * planes.normal, -1))
    np.testing.assert_allclose(far, FIRST[1], rtol=1e-10)
    assert tangents.edge_tangents(*parts(tube)).body.size == 0


def test_a_place_sees_an_edge_touch_a_ball_where_its_line_of_sight_does():
    edges, rounds = parts(PLATE, sphere(*FIRST), sphere(*SECOND))
    t, rows = tangents.edge_tangents_along(edges, rounds, AT, ALONG, REACH)
    assert len(t) > 2
    place = ORIGIN + t[:, None] * ALONG
    np.testing.assert_allclose(rows.place, place, rtol=0.0, atol=1e-12)
    edge = place + rows.r[:, :1] * rows.u
    beside = np.min([away(edge, s, a) for s, a in zip(edges.start, edges.along, strict=True)], 0)
    np.testing.assert_allclose(beside, 0.0, rtol=0.0, atol=1e-12)
    touch = place + rows.r[:, 1:] * rows.u
    far = np.linalg.norm(touch[:, None] - CENTERS, axis=-1) - RADII
    body = np.argmin(np.abs(far), axis=1)
    np.testing.assert_allclose(np.min(np.abs(far), axis=1), 0.0, rtol=0.0, atol=1e-12)
    # The normal looks out of the ball, whose image is a circle of the tangent R / r.
    np.testing.assert_allclose(
        touch - CENTERS[body], RADII[body, None] * rows.m, rtol=0.0, atol=1e-12
    )
    np.testing.assert_allclose(rows.curvature, rows.r[:, 1] / RADII[body], rtol=1e-12)
    np.testing.assert_allclose(rows.bend, -0.5 * rows.curvature, rtol=1e-12)
    assert np.all(rows.fill == 1.0)


def angle_to_limb(t, start, along, center, radius):
    """By how much an edge is seen outside a ball, at the least, and where along it."""
    place = ORIGIN + t * ALONG
    s = np.linspace(0.0, 1.0, 2001)
    to_edge, w = start + s[:, None] * along - place, center - place
    cosine = to_edge @ w / np.linalg.norm(to_edge, axis=1) / np.linalg.norm(w)
    k = np.argmax(cosine)
    return np.arccos(cosine[k]) - np.arcsin(radius / np.linalg.norm(w)), 0 < k < 2000


def test_all_places_of_a_line_that_see_an_edge_touch_a_ball_are_found():
    edges, rounds = parts(PLATE, sphere(*FIRST), sphere(*SECOND))
    t = np.linspace(0.0, REACH, 401)
    true = []
    for ball, (start, along) in itertools.product(
        (FIRST, SECOND), zip(edges.start, edges.along, strict=True)
    ):
        found = [angle_to_limb(x, start, along, *ball) for x in t]
        off, within = (np.array(a) for a in zip(*found, strict=True))
        turns = np.flatnonzero((np.diff(np.sign(off)) != 0) & within[1:])
        true += [*(t[turns] + t[turns + 1]) / 2]
    # Limbs touch edges from within as well: an edge across the ball's middle is no such place.
    found, _ = tangents.edge_tangents_along(edges, rounds, AT, ALONG, REACH)
    np.testing.assert_allclose(np.sort(found), np.sort(true), rtol=0.0, atol=3e-3)
    shorter, _ = tangents.edge_tangents_along(edges, rounds, AT, ALONG, 1.0)
    np.testing.assert_allclose(np.sort(shorter), np.sort(found[found < 1.0]))


# --- two bodies ----------------------------------------------------------------------------------


def gap(t, side):
    """Between the images of two balls: their middles, less both radii or the difference."""
    w = CENTERS - (ORIGIN + t[:, None, None] * ALONG)
    length = np.linalg.norm(w, axis=-1)
    middles = np.arccos(np.sum(w[:, 0] * w[:, 1], -1) / np.prod(length, axis=-1))
    first, second = np.arcsin(RADII / length).T
    return middles - (np.abs(first - second) if side > 0 else first + second)


def test_two_balls_touch_where_their_angles_add_up():
    edges, rounds = parts(sphere(*FIRST), sphere(*SECOND))
    t, rows = tangents.body_tangents_along(edges, rounds, AT, ALONG, REACH)
    samples = np.linspace(0.0, REACH, 4001)
    true = [
        (samples[k], side)
        for side in (-1.0, 1.0)
        for k in np.flatnonzero(np.diff(np.sign(gap(samples, side))))
    ]
    assert len(true) == 4
    order = np.argsort(t)
    np.testing.assert_allclose(t[order], sorted(x for x, _ in true), rtol=0.0, atol=1e-3)
    sides = np.array([side for _, side in sorted(true)])
    k = rows.r[order] / RADII
    np.testing.assert_allclose(np.sum(rows.m[order] * rows.u[order], -1), 0.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(rows.curvature[order], sides * k[:, 1] - k[:, 0], rtol=1e-6)
    np.testing.assert_allclose(rows.bend[order], -0.5 * (sides * k[:, 1] + k[:, 0]), rtol=1e-6)
    touch = rows.place[:, None] + rows.r[..., None] * rows.u[:, None]
    np.testing.assert_allclose(np.linalg.norm(touch - CENTERS, axis=-1), np.tile(RADII, (4, 1)))
    np.testing.assert_allclose(rows.place, ORIGIN + t[:, None] * ALONG, rtol=0.0, atol=1e-9)
    assert np.all(rows.fill == 1.0)
    shorter, _ = tangents.body_tangents_along(edges, rounds, AT, ALONG, 1.0)
    np.testing.assert_allclose(np.sort(shorter), np.sort(t[t < 1.0]))


def test_places_off_a_common_plane_see_nothing_touch():
    edges, rounds = parts(sphere(*FIRST), sphere(*SECOND))
    ((numbers, planes),) = tangents.common_planes(rounds)
    angle, side = np.linspace(0.0, 6.0, 7), np.ones(7)
    places, normal = planes.places(AT, angle, side)
    bodies = np.broadcast_to(numbers, (7, 2))
    _, there = tangents.body_tangents_at(edges, rounds, AT, places, bodies, normal)
    assert np.all(there)
    aside = places + 0.01 * np.cross(normal, [0.0, 0.0, 1.0])
    _, there = tangents.body_tangents_at(edges, rounds, AT, aside, bodies, normal)
    assert not np.any(there)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_planes_that_touch_two_balls_pass_the_middles_at_their_radii(side):
    _, rounds = parts(sphere(*FIRST), sphere(*SECOND))
    ((numbers, planes),) = tangents.common_planes(rounds)
    assert numbers == (0, 1)
    angle = np.linspace(0.0, 2.0 * np.pi, 9)
    places, n = planes.places(AT, angle, np.full(9, side))
    np.testing.assert_allclose(np.linalg.norm(n, axis=-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(n @ (CENTERS[1] - CENTERS[0]), RADII[0] - side * RADII[1], rtol=1e-9)
    np.testing.assert_allclose(n, planes.normals(angle, np.full(9, side)))
    touch = CENTERS[0] + RADII[0] * n, CENTERS[1] + side * RADII[1] * n
    np.testing.assert_allclose(
        away(places, touch[0], touch[1] - touch[0]), 0.0, rtol=0.0, atol=1e-9
    )
    np.testing.assert_allclose(places[:, 2], 0.0, rtol=0.0, atol=1e-12)
    assert np.linalg.matrix_rank(n - n[0], tol=1e-3) == 2  # all around the axis


def test_a_line_along_the_plane_of_the_receivers_meets_it_nowhere():
    _, rounds = parts(sphere((0.0, 0.0, 1.0), 0.5), sphere((3.0, 0.0, 1.0), 0.5))
    ((_, planes),) = tangents.common_planes(rounds)
    places, _ = planes.places(AT, np.linspace(0.0, 6.0, 5), np.ones(5))
    far = ~np.isfinite(places[:, 0]) | (np.abs(places[:, 0]) > 1e9)
    assert np.all(far)


PAIRS = {
    "balls apart": ([sphere((0, 0, 1), 0.4), sphere((1.0, 0, 1), 0.5)], 1),
    "balls that meet": ([sphere((0, 0, 1), 0.4), sphere((0.8, 0, 1), 0.5)], 0),
    "a disc beside a ball": ([sphere((0, 0, 1), 0.4), disc((0.41, 0, 1), (1, 0, 0), 0.9)], 1),
    "a disc through a ball": ([sphere((0, 0, 1), 0.4), disc((0.39, 0, 1), (1, 0, 0), 0.9)], 0),
    "long bodies side by side": (
        [
            ellipsoid((0, 0, 1), np.diag([0.1, 2.0, 0.1])),
            ellipsoid((0.3, 1, 1), np.diag([0.1, 2, 0.1])),
        ],
        1,
    ),
    "two rims of one cylinder": ([cylinder((0, 0, 1), (0, 0, 2), 0.3)], 0),
    "a ball and both rims": ([cylinder((0, 0, 1), (0, 0, 2), 0.3), sphere((1, 0, 1), 0.2)], 2),
}


@pytest.mark.parametrize("name", PAIRS)
def test_planes_touch_two_bodies_that_do_not_meet(name):
    shapes, count = PAIRS[name]
    found = list(tangents.common_planes(parts(*shapes)[1]))
    assert len(found) == count
    for (i, j), planes in found:
        assert i < j
        axis = planes.axis
        np.testing.assert_allclose(np.linalg.norm(axis), 1.0)
        reach = [np.sqrt(axis @ body.spread @ axis) for body in (planes.first, planes.second)]
        assert axis @ (planes.second.center - planes.first.center) > sum(reach)


def test_a_table_without_rows_has_none():
    t, rows = tangents.no_tangents()
    assert t.shape == (0,)
    assert [a.shape for a in rows] == [(0, 3)] * 3 + [(0, 2)] + [(0,)] * 3


# --- walls that are seen endwise -----------------------------------------------------------------

BELOW, X = Receiver.at((0.0, 0.0, 0.0)), np.array([1.0, 0.0, 0.0])


def bodies(*shapes):
    scene = Scene.of(*map(primitive, shapes))
    return edges_of(scene, BELOW), rounds_of(scene)


@pytest.mark.parametrize("ends", [(1.0, 3.0), (3.0, 1.0)])
def test_an_upright_wall_is_seen_endwise_from_the_circle_below_it(ends):
    """Both rims are circles of the curvatures r / R against each other there."""
    ball = sphere((9.0, 9.0, 9.0), 1.0)
    tube = cylinder((2.0, 0.3, ends[0]), (2.0, 0.3, ends[1]), 0.5)
    t, rows = tangents.endwise_along(*bodies(ball, tube), BELOW, X, 4.0)
    np.testing.assert_allclose(np.sort(t), [1.6, 2.4], rtol=1e-12)
    np.testing.assert_allclose(rows.place, t[:, None] * X)
    np.testing.assert_allclose(rows.u, [[0.0, 0.0, 1.0]] * 2, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(rows.m, (rows.place - [2.0, 0.3, 0.0]) / 0.5, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(rows.r, [[1.0, 3.0]] * 2, rtol=1e-12)
    near, far = -1.0 / 0.5, -3.0 / 0.5
    np.testing.assert_allclose(rows.curvature, [near - far] * 2, rtol=1e-9)
    np.testing.assert_allclose(rows.bend, [(near + far) / 2.0] * 2, rtol=1e-9)
    # (k_1 + k_2) / (2 sqrt(k_1 k_2)) of a lens
    np.testing.assert_allclose(rows.fill, [2.0 / np.sqrt(3.0)] * 2, rtol=1e-9)
    assert len(tangents.endwise_along(*bodies(ball, tube), BELOW, X, 2.0)[0]) == 1
    assert len(tangents.endwise_along(*bodies(ball, tube), BELOW, -X, 4.0)[0]) == 0


def test_a_leaning_wall_is_seen_along_its_axis():
    """Its axis (3, 0, 4) / 5 meets the plane at x = 0.25, and the wall is 0.2 / 0.8 beside it."""
    base, axis = np.array([1.0, 0.0, 1.0]), np.array([0.6, 0.0, 0.8])
    tube, at = cylinder(base, base + 2.0 * axis, 0.2), Receiver.at((-1.0, 0.0, 0.0))
    t, rows = tangents.endwise_along(*bodies(tube), at, X, 4.0)
    order = np.argsort(t)
    np.testing.assert_allclose(t[order], [1.0, 1.5], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(rows.u, [axis] * 2, rtol=0.0, atol=1e-12)
    out = np.array([0.8, 0.0, -0.6])
    np.testing.assert_allclose(rows.m[order], [-out, out], rtol=0.0, atol=1e-12)
    to_base = (base - rows.place) @ axis
    np.testing.assert_allclose(rows.r, np.stack([to_base, to_base + 2.0], -1), rtol=1e-12)


@pytest.mark.parametrize(
    ("low", "high", "there"),
    [(1.0, 3.0, True), (-3.0, -1.0, False), (-1.0, 1.0, False), (-0.1, 3.0, False)],
)
def test_eyes_below_the_ends_of_a_wall_see_it_endwise(low, high, there):
    edges, rounds = bodies(cylinder((2.0, 0.0, low), (2.0, 0.0, high), 0.5))
    (wall,) = np.flatnonzero(rounds.kind == WALL)
    _, found = tangents.endwise_at(edges, rounds, BELOW, 1.5 * X[None], np.array([wall]))
    assert found.tolist() == [there]


def test_a_rim_in_the_floor_is_too_near():
    edges, rounds = bodies(cylinder((2.0, 0.0, 1e-9), (2.0, 0.0, 2.0), 0.5))
    (wall,) = np.flatnonzero(rounds.kind == WALL)
    _, found = tangents.endwise_at(edges, rounds, BELOW, 1.5 * X[None], np.array([wall]))
    assert found.tolist() == [False]
