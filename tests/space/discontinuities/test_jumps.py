"""Jumps where black plates hide a sky of radiance one, against areas of clipped polygons."""

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, disc, primitive, sphere, triangle
from firstorder.space.discontinuities import _jumps as jumps
from firstorder.space.discontinuities._edges import edges_of
from firstorder.space.discontinuities._lines_of_sight import (
    ThreeEdges,
    VertexEdges,
    taken,
    three_edges_along,
    vertex_edges_along,
)
from firstorder.space.discontinuities._round_lines import vertex_rounds_at
from firstorder.space.discontinuities._rounds import rounds_of
from firstorder.space.discontinuities._tangents import body_tangents_at

PLACE, NORMAL = np.array([0.3, -0.2, 0.1]), np.array([0.1, -0.2, 1.0])
AT = Receiver.at(PLACE, NORMAL)
U = np.array([0.48, -0.36, 0.8])
FRAME = np.array([[0.6, 0.8, 0.0], [0.64, -0.48, -0.6]])  # at right angles to U
COSINE = U @ NORMAL / np.linalg.norm(NORMAL)
WAYS = np.asarray(AT.axes).T[:2]  # in the plane of the receivers
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def across(angle):
    return np.cos(angle) * FRAME[0] + np.sin(angle) * FRAME[1]


def clipped(polygon, side):
    """The part of a polygon on the plane at U where a linear function of space is positive."""
    values = (U + polygon @ FRAME) @ side
    parts = []
    for k, (p, f) in enumerate(zip(polygon, values, strict=True)):
        q, g = polygon[k - 1], values[k - 1]
        if f * g < 0.0:
            parts.append(q + (p - q) * g / (g - f))
        if f > 0.0:
            parts.append(p)
    return np.array(parts).reshape(-1, 2)


def area(sides):
    polygon = SQUARE
    for side in sides:
        polygon = clipped(polygon, side)
    x, y = polygon.T
    return 0.5 * np.sum(np.roll(x, 1) * y - x * np.roll(y, 1))


def jump_of_second_derivative(sides, way):
    """From an eye that moves; each side is a function of the eye's place. By parabolas."""
    t = 1e-3 * np.arange(6)
    second = [
        np.polyfit(s, [area([side(PLACE + x * way) for side in sides]) for x in s], 4)[2]
        for s in (t, -t)
    ]
    return 2.0 * (second[0] - second[1])


def beyond(start, along, inner, sign=1.0):
    """Positive on the side of an edge on which a point is."""

    def side(eye):
        n = np.cross(start - eye, along)
        return sign * n * np.sign(n @ (inner - eye))

    return side


def plate(r, angle, tilt, side):
    """An edge through the line of sight, and a triangle that reaches far to one side of it."""
    along = across(angle) + tilt * U
    inner = PLACE + r * U + 3.0 * side * across(angle + np.pi / 2)
    return PLACE + r * U - 0.5 * along, along, inner


PLATES = [(1.0, 0.2, 0.3), (1.5, 1.3, -0.4), (2.2, 2.6, 0.2)]
NEAR = [(1.0, 0.2, 0.1), (1.02, 1.3, -0.1), (1.04, 2.6, 0.1)]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 0, 2)])
@pytest.mark.parametrize("sides", [(1, -1, 1), (-1, -1, 1), (1, 1, 1), (-1, 1, -1)])
@pytest.mark.parametrize("plates", [PLATES, NEAR])
def test_three_edges_open_or_close_a_triangle(plates, sides, order):
    """Also where images hardly move against each other, before a sky of radiance two."""
    parts = [plate(*plates[i], sides[i]) for i in order]
    scene = Scene.of(*(primitive(triangle(s, s + a, p)) for s, a, p in parts), environment=2.0)
    start, along, _ = (np.array(a)[None] for a in zip(*parts, strict=True))
    r = np.array([[plates[i][0] for i in order]])
    rows = ThreeEdges(PLACE[None], start, along, U[None], r)
    found = jumps.three_edges_bends(scene, AT, edges_of(scene, AT), rows)
    open_sides = [beyond(*part, sign=-1.0) for part in parts]
    for way in WAYS:
        true = 2.0 * COSINE * jump_of_second_derivative(open_sides, way)
        np.testing.assert_allclose(found.along(way), [true], rtol=2e-3, atol=1e-9)
    np.testing.assert_allclose(found.rate @ np.asarray(AT.normal), 0.0, rtol=0.0, atol=1e-14)


CORNERS = [(1.0, 1.8), (1.8, 1.0), (1.0, 1.03)]  # distances of the corner and of the edge


def corner_of(r, angles):
    corner = PLACE + r * U
    return corner, [corner + 2.0 * across(a) + 0.3 * U for a in angles]


@pytest.mark.parametrize(("near", "far"), CORNERS)
@pytest.mark.parametrize("angles", [(0.5, 1.4), (0.9, 2.5), (-0.6, 1.2), (3.5, 4.4)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_corner_and_an_edge_hide_a_triangle_twice(near, far, angles, side):
    corner, ends = corner_of(near, angles)
    start, along, inner = plate(far, 0.2, 0.3, side)
    shapes = triangle(corner, *ends), triangle(start, start + along, inner)
    scene = Scene.of(*map(primitive, shapes), environment=1.0)
    edges = edges_of(scene, AT)
    (vertex,) = np.flatnonzero(np.all(np.isclose(edges.vertices, corner), axis=1))
    (edge,) = np.flatnonzero(
        np.any(edges.ends == nearest(edges, start), axis=1)
        & np.any(edges.ends == nearest(edges, start + along), axis=1)
    )
    rows = VertexEdges(
        PLACE[None],
        np.array([vertex]),
        np.array([edge]),
        edges.start[[edge]],
        edges.along[[edge]],
        np.array([near]),
        np.array([far]),
    )
    found = jumps.vertex_edge_bends(scene, AT, edges, rows)
    hidden = [
        beyond(start, along, inner),
        beyond(corner, ends[0] - corner, ends[1]),
        beyond(corner, ends[1] - corner, ends[0]),
    ]
    for way in WAYS:
        true = COSINE * jump_of_second_derivative(hidden, way)
        np.testing.assert_allclose(found.along(way), [true], rtol=1e-4)


def nearest(edges, point):
    return int(np.argmin(np.linalg.norm(edges.vertices - point, axis=1)))


@pytest.mark.parametrize(("near", "far"), CORNERS)
@pytest.mark.parametrize("angle", [0.4, 2.0, 4.5])
def test_a_corner_and_a_ball_hide_a_triangle_twice(near, far, angle):
    """The ball as its tangent: what lies between the two is smaller by one order."""
    m = across(angle)
    corner, ends = corner_of(near, (angle + 2.0, angle + 3.4))
    touch = PLACE + far * U
    shapes = triangle(corner, *ends), sphere(touch - 0.4 * m, 0.4)
    scene = Scene.of(*map(primitive, shapes), environment=1.0)
    edges, rounds = edges_of(scene, AT), rounds_of(scene)
    vertex = np.array([nearest(edges, corner)])
    rows, there = vertex_rounds_at(edges, rounds, AT, PLACE[None], vertex, np.array([0]))
    assert there.tolist() == [True]
    found = jumps.vertex_edge_bends(scene, AT, edges, rows)
    hidden = [
        beyond(touch, np.cross(U, m), touch - m),
        beyond(corner, ends[0] - corner, ends[1]),
        beyond(corner, ends[1] - corner, ends[0]),
    ]
    for way in WAYS:
        true = COSINE * jump_of_second_derivative(hidden, way)
        np.testing.assert_allclose(found.along(way), [true], rtol=2e-3)


def test_a_corner_with_a_side_along_the_edge_has_no_jump_of_its_own():
    """A strip opens there: E' jumps, and nobody knows the jump of E''."""
    start, along, inner = plate(1.8, 0.2, 0.0, 1.0)
    corner = PLACE + U
    beside = corner + along, corner - 2.0 * across(0.2 + np.pi / 2)
    shapes = triangle(corner, *beside), triangle(start, start + along, inner)
    scene = Scene.of(*map(primitive, shapes), environment=1.0)
    edges = edges_of(scene, AT)
    (edge,) = np.flatnonzero(
        np.all(np.isclose(edges.start, start), axis=1)
        & np.all(np.isclose(edges.along, along), axis=1)
    )
    rows = VertexEdges(
        PLACE[None],
        np.array([nearest(edges, corner)]),
        np.array([edge]),
        start[None],
        along[None],
        np.array([1.0]),
        np.array([1.8]),
    )
    assert jumps.vertex_edge_bends(scene, AT, edges, rows).strength.tolist() == [0.0]


# --- outlines that touch -------------------------------------------------------------------------

HEIGHTS = np.array([1.2, 2.5])


# Radii, and whether they touch from within: the last two nearly along a stretch.
TOUCHING = [
    (np.array([0.4, 0.6]), False),
    (np.array([0.4, 1.4]), True),
    (np.array([0.3, 0.4]), True),
    (np.array([0.48, 1.08]), True),
]


def touching_discs(radii, inner, aside, shine):
    """Two discs across the normal whose images touch, the second from within or from outside.

    They touch above the place, or so far beside it. The farther one shines.
    """
    n, (m, tau) = np.asarray(AT.axes)[:, 2], np.array([[0.6, 0.8], [-0.8, 0.6]]) @ WAYS
    sides = np.array([-1.0, -1.0 if inner else 1.0])
    way = n + aside * (0.3 * m + tau)
    centers = PLACE + HEIGHTS[:, None] * way + (sides * radii)[:, None] * m
    shapes = [disc(c, -n, r) for c, r in zip(centers, radii, strict=True)]
    near, far = shapes
    scene = Scene.of(primitive(near), primitive(far, emission=shine), environment=1.0)
    edges, normal = edges_of(scene, AT), np.cross(way, tau)[None]
    normal = normal / np.linalg.norm(normal)
    bodies = np.array([[0, 1]])
    rows, there = body_tangents_at(edges, rounds_of(scene), AT, PLACE[None], bodies, normal)
    assert there.tolist() == [True]
    return scene, edges, centers, rows, 1.0 / np.linalg.norm(way)


def overlap(x, way, centers, radii):
    """Of the images of two discs on the plane a metre above the eye, which are circles."""
    a, b = radii / HEIGHTS
    images = WAYS @ (centers - PLACE - x * way).T / HEIGHTS
    distance = np.hypot(*(images[:, 1] - images[:, 0]))
    if not abs(a - b) < distance < a + b:
        return np.pi * min(a, b) ** 2 if distance < a + b else 0.0
    split = (distance**2 + a**2 - b**2) / (2.0 * distance)
    half = np.sqrt(a**2 - split**2)
    sectors = a**2 * np.arctan2(half, split) + b**2 * np.arctan2(half, distance - split)
    return sectors - distance * half


@pytest.mark.parametrize(("aside", "shine"), [(0.0, 0.0), (0.6, 0.0), (0.6, 3.0)])
@pytest.mark.parametrize(("radii", "inner"), TOUCHING)
def test_two_discs_that_touch_hide_a_lens_twice(radii, inner, aside, shine):
    """An area that grows by c x^1.5 has the second derivative 0.75 c / sqrt(x).

    A metre above the eye an area counts by the fourth power of the cosine, and by what the farther
    disc does not send that the sky would.
    """
    scene, edges, centers, rows, cosine = touching_discs(radii, inner, aside, shine)
    found = jumps.tangent_roots(scene, AT, edges, rows)
    a, b = radii / HEIGHTS
    whole = np.pi * min(a, b) ** 2 if inner else 0.0
    for way in WAYS:
        grown = [overlap(x, way, centers, radii) - whole for x in (-1e-5, 1e-5)]
        true = (1.0 - shine) * cosine**4 * 0.75 * np.array(grown)[:, None] / 1e-5**1.5
        np.testing.assert_allclose(found.along(way), true, rtol=2e-3)
        assert np.sum(true != 0.0) == 1


def test_what_opens_beside_a_lens_counts_by_its_area():
    scene, edges, _, rows, _ = touching_discs(*TOUCHING[0], 0.0, 0.0)
    one = jumps.tangent_roots(scene, AT, edges, rows)
    more = jumps.tangent_roots(scene, AT, edges, rows._replace(fill=np.array([1.7])))
    np.testing.assert_allclose(more.strength, 1.7 * one.strength)


@pytest.mark.parametrize("kind", ["vertex and edge", "three edges"])
def test_jumps_of_many_lines_of_sight_are_those_of_each(kind):
    parts = [plate(*where, 1.0) for where in PLATES]
    scene = Scene.of(*(primitive(triangle(s, s + a, p)) for s, a, p in parts), environment=1.0)
    edges, start = edges_of(scene, AT), Receiver.at(PLACE - 0.5 * WAYS[0], NORMAL)
    if kind == "three edges":
        _, rows = three_edges_along(edges, start, WAYS[0], 1.0)
        bends = jumps.three_edges_bends
    else:
        _, rows = vertex_edges_along(edges, start, WAYS[0], 1.0)
        bends = jumps.vertex_edge_bends
    assert len(rows.place) > 1
    each = [bends(scene, AT, edges, taken(rows, [k])) for k in range(len(rows.place))]
    found = bends(scene, AT, edges, rows)
    np.testing.assert_allclose(found.rate, np.concatenate([one.rate for one in each]), rtol=1e-9)
    strength = np.concatenate([one.strength for one in each])
    np.testing.assert_allclose(found.strength, strength, rtol=1e-9)
