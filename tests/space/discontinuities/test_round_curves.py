"""Curves of the floor on which balls, walls and edges are seen in line, by circles and angles."""

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, cylinder, disc, primitive, sphere, triangle
from firstorder.space.discontinuities import _round_curves as curves
from firstorder.space.discontinuities._edges import edges_of
from firstorder.space.discontinuities._rounds import rounds_of

AT = Receiver.at((0.0, 0.0, 0.0))
REACH = 1.5
PLATE = triangle((-0.5, -0.6, 1.0), (0.6, -0.5, 1.1), (0.1, 0.7, 0.9))
LOW, HIGH = (np.array([0.1, 0.2, 0.6]), 0.25), (np.array([0.05, 0.3, 1.7]), 0.3)


def parts(*shapes, at=AT):
    """A scene of black shapes before a sky of one, its edges, and its bodies."""
    scene = Scene.of(*map(primitive, shapes), environment=1.0)
    return scene, edges_of(scene, at), rounds_of(scene), at, REACH


def shown(found):
    """Places on which something is seen, in the square, and the sizes of the jumps there."""
    at_all = found.jumps > 0.0
    places = found.places[at_all]
    np.testing.assert_allclose(places[:, 2], 0.0, rtol=0.0, atol=1e-12)
    assert np.max(np.abs(places)) <= REACH
    return places, found.jumps[at_all]


def limb(place, ball):
    """Way to the middle of a ball, the angle of its limb and the distance of that."""
    w = ball[0] - place
    far = np.linalg.norm(w, axis=-1)
    return w, np.arcsin(ball[1] / far), np.sqrt(far**2 - ball[1] ** 2)


def touching(g, k, cosine, fill=1.0):
    """The size of a root: K cos sqrt(2 / |k|) |g|^1.5 of a black pair before a white sky."""
    return fill * cosine * np.sqrt(2.0 / np.abs(k)) * g**1.5


def angle_between(a, b):
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, -1))


def rate(u, m, r):
    """Of images against each other, on the floor."""
    return np.linalg.norm(m[:, :2], axis=-1) * np.abs(1.0 / r[0] - 1.0 / r[1])


# --- outlines that touch -------------------------------------------------------------------------


def test_two_balls_touch_where_their_angles_add_up():
    (found,) = curves.body_curves(*parts(sphere(*LOW), sphere(*HIGH)), 60)
    places, sizes = shown(found)
    a, b = limb(places, LOW), limb(places, HIGH)
    middles = angle_between(a[0], b[0])
    outer = np.abs(middles - a[1] - b[1]) < 1e-8
    np.testing.assert_allclose(
        np.where(outer, a[1] + b[1], np.abs(a[1] - b[1])), middles, rtol=0.0, atol=1e-8
    )
    assert np.sum(outer) > 20
    # The limb of the low ball where it is touched: towards the other, or away from a larger one.
    unit = a[0] / np.linalg.norm(a[0], axis=-1, keepdims=True)
    towards = b[0] - np.sum(b[0] * unit, -1, keepdims=True) * unit
    towards = towards / np.linalg.norm(towards, axis=-1, keepdims=True)
    turn = (np.where(outer | (a[1] > b[1]), 1.0, -1.0) * a[1])[:, None]
    u = np.cos(turn) * unit + np.sin(turn) * towards
    out = -np.sin(turn) * unit + np.cos(turn) * towards
    curvature = a[2] / LOW[1], b[2] / HIGH[1]
    k = np.where(outer, curvature[0] + curvature[1], curvature[0] - curvature[1])
    true = touching(rate(u, out, (a[2], b[2])), k, u[:, 2])
    np.testing.assert_allclose(sizes, true, rtol=1e-3)


def test_lines_on_which_an_edge_touches_a_ball_are_seen_in_a_plane_that_touches_it():
    found = curves.edge_tangent_lines(*parts(PLATE, sphere(*LOW)), 11)
    assert found.places.shape[1:] == (11, 3)
    places, sizes = shown(found)
    assert len(sizes) > 5
    corners = np.array([[-0.5, -0.6, 1.0], [0.6, -0.5, 1.1], [0.1, 0.7, 0.9]])
    true = np.full(len(places), np.nan)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        n = np.cross(start - places, end - places)
        n = n / np.linalg.norm(n, axis=-1, keepdims=True)
        w, _, r = limb(places, LOW)
        off = np.sum(w * n, -1)
        here = np.abs(np.abs(off) - LOW[1]) < 1e-9
        m = -np.sign(off)[:, None] * n
        way = w + LOW[1] * m
        u = way / np.linalg.norm(way, axis=-1, keepdims=True)
        along = end - start
        normal = np.cross(u, along)
        to_edge = np.sum(np.cross(start - places, along) * normal, -1) / np.sum(normal**2, -1)
        size = touching(rate(u, m, (r, to_edge)), r / LOW[1], u[:, 2])
        true = np.where(here, size, true)
    np.testing.assert_allclose(sizes, true, rtol=1e-3)


def test_an_upright_wall_is_seen_endwise_from_a_circle():
    tube = cylinder((0.2, 0.3, 1.0), (0.2, 0.3, 2.5), 0.4)
    found = curves.endwise_curves(*parts(tube, sphere((9.0, 9.0, 1.0), 0.1)), 7)
    assert found.places.shape == (1, 7, 3)
    x, y, _ = (found.places[0] - [0.2, 0.3, 0.0]).T
    np.testing.assert_allclose(np.hypot(x, y), 0.4)
    np.testing.assert_allclose(np.diff(np.unwrap(np.arctan2(y, x))), np.full(6, np.pi / 3))
    near, far = 1.0 / 0.4, 2.5 / 0.4
    fill = 0.5 * (near + far) / np.sqrt(near * far)
    true = touching(1.0 - 1.0 / 2.5, near - far, 1.0, fill)
    np.testing.assert_allclose(found.jumps, np.full((1, 7), true), rtol=1e-3)


def test_only_that_part_of_a_curve_counts_which_is_in_the_square():
    tube = cylinder((1.3, 0.3, 1.0), (1.3, 0.3, 2.5), 0.4)
    found = curves.endwise_curves(*parts(tube), 33)
    np.testing.assert_array_equal(found.jumps > 0.0, found.places[..., 0] <= REACH)
    assert 5 < np.sum(found.jumps > 0.0) < 30


# --- a vertex and an outline ---------------------------------------------------------------------


def test_vertices_are_on_limbs_from_conics():
    found = curves.vertex_cones(*parts(PLATE, sphere(*LOW)), 50)
    assert found.kind == "vertex and edge"
    assert found.places.shape == (3, 50, 3)
    corners = np.array([[-0.5, -0.6, 1.0], [0.6, -0.5, 1.1], [0.1, 0.7, 0.9]])
    order = [np.argmin([np.max(np.abs(_off(row, c))) for c in corners]) for row in found.places]
    assert sorted(order) == [0, 1, 2]
    for row, k in zip(found.places, order, strict=True):
        np.testing.assert_allclose(_off(row, corners[k]), 0.0, rtol=0.0, atol=1e-9)
    _, sizes = shown(found)
    assert len(sizes) > 50
    assert np.all(sizes < 20.0)


def _off(places, corner):
    """How far a vertex is seen off the limb of the low ball [rad]."""
    w, half, _ = limb(places, LOW)
    off = angle_between(corner - places, w) - half
    return off[np.max(np.abs(places), axis=1) <= REACH]


def test_a_vertex_in_the_plane_of_a_disc_has_no_cone_with_it():
    flat = disc((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 0.2)
    level = triangle((-0.5, -0.6, 1.0), (0.6, -0.5, 1.0), (0.1, 0.7, 0.9))
    found = curves.vertex_cones(*parts(level, flat), 9)
    assert len(found.places) == 1


def test_planes_through_a_vertex_touch_an_upright_wall_along_tangents_of_its_circle():
    tube = cylinder((0.2, 0.1, 0.5), (0.2, 0.1, 0.8), 0.15)
    found = curves.vertex_walls(*parts(PLATE, tube), 21)
    assert found.places.shape == (6, 21, 3)
    middle, corners = np.array([0.2, 0.1]), np.array([[-0.5, -0.6], [0.6, -0.5], [0.1, 0.7]])
    through = []
    for row in found.places[..., :2]:
        way = (row[-1] - row[0]) / np.linalg.norm(row[-1] - row[0])
        beside = np.abs(way[0] * (middle - row[0])[1] - way[1] * (middle - row[0])[0])
        np.testing.assert_allclose(beside, 0.15, rtol=1e-9)
        off = [abs(way[0] * d[1] - way[1] * d[0]) for d in corners - row[0]]
        through.append(int(np.argmin(off)))
        assert min(off) < 1e-9
    assert sorted(through) == [0, 0, 1, 1, 2, 2]
    places, sizes = shown(found)
    assert len(sizes) > 3
    # What is seen has the corner behind the wall, at a height between those of the rims there.
    w = places[:, :2] - middle
    to_touch = np.sqrt(np.sum(w * w, -1) - 0.15**2)
    heights = [
        to_touch * h / np.linalg.norm(places[:, :2] - c, axis=1)
        for c, h in zip(corners, (1.0, 1.1, 0.9), strict=True)
    ]
    assert np.all(np.any((np.array(heights) > 0.5) & (np.array(heights) < 0.8), axis=0))


# --- two edges and an outline --------------------------------------------------------------------

PLATES = (
    triangle((-0.4, 0.0, 0.7), (0.5, 0.1, 0.7), (0.0, -0.9, 0.8)),
    triangle((0.05, -0.5, 1.3), (0.0, 0.6, 1.2), (-0.9, 0.1, 1.3)),
)


@pytest.mark.parametrize("at", [AT, Receiver.at((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))])
def test_two_edges_cross_a_limb_in_places_that_see_all_three_in_line(at):
    ball = (np.array([0.1, 0.15, 1.9]), 0.3)
    shapes = (*PLATES, sphere(*ball))
    if at is not AT:  # all of it below
        shapes = [_mirrored(s) for s in shapes]
        ball = (ball[0] * [1.0, 1.0, -1.0], ball[1])
    scene, edges, rounds, _, _ = parts(*shapes, at=at)
    found = curves.round_conics(scene, edges, rounds, at, REACH, 12)
    assert found.kind == "three edges"
    places, sizes = shown(found)
    assert len(sizes) > 10
    assert found.places.shape[1:] == (12, 3)
    start, along = edges.start, edges.along
    skew = [(i, j) for i, j in zip(*np.nonzero(np.triu(~edges.coplanar, 1)), strict=True)]
    best = np.full(len(places), np.inf)
    for i, j in skew:
        n = [np.cross(start[e] - places, along[e]) for e in (i, j)]
        u = np.cross(*n)
        u = u * np.sign(u @ np.asarray(at.normal))[:, None]
        w, half, _ = limb(places, ball)
        best = np.minimum(best, np.abs(angle_between(u, w) - half))
    np.testing.assert_allclose(best, 0.0, rtol=0.0, atol=1e-9)
    # Shown places follow each other: a row has one or two pieces.
    pieces = np.sum(np.diff((found.jumps > 0.0).astype(int), axis=1) == 1, axis=1)
    assert np.max(pieces) <= 2


def _mirrored(shape):
    """The shape on the other side of the floor."""
    flip = np.array([1.0, 1.0, -1.0])
    axes = np.asarray(shape.axes) * flip[:, None]
    if type(shape).__name__ == "Triangles":
        axes = axes[..., [1, 0, 2]]
    return type(shape)(np.asarray(shape.center) * flip, axes)
