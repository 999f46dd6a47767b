"""Curves on which two round outlines cross a third outline, against circles, exact derivatives, and
the events of lines, which are searched in another way.
"""

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, cylinder, disc, primitive, rectangle, sphere
from firstorder.space.discontinuities import (
    _edges,
    _rounds,
    _triple_curves,
    discontinuity_mesh,
    mesh,
)
from firstorder.space.discontinuities._followed import Square
from tests.space.discontinuities.exact import START, crossings, derivatives, found, told

MIDDLE, REACH = Receiver.at((0.0, 0.0, 0.0)), 1.5
SHEET = rectangle((0.0, 0.05, 2.0), (0.1, 0.5, 0.03), (0.6, -0.05, 0.05))
PAN = disc((0.05, -0.1, 2.0), (0.1, -0.05, -1.0), 0.4)
BALLS = sphere((0.15, 0.05, 1.3), 0.25), sphere((-0.1, -0.06, 0.7), 0.2)
TUBE = cylinder((0.1, 0.05, 0.7), (0.3, 0.2, 1.1), 0.15)
FLAT = disc((-0.05, 0.05, 1.4), (0.2, 0.1, 1.0), 0.25)


def scene_of(lamp, *shapes):
    return Scene.of(primitive(lamp, emission=1.0), *map(primitive, shapes))


SCENES = {
    "an edge and two balls": scene_of(SHEET, *BALLS),
    "three balls": scene_of(sphere((0.05, -0.1, 2.0), 0.4), *BALLS),
    "discs and a cylinder": scene_of(PAN, FLAT, TUBE),
}
STARTS = START + np.array([[0.0, 0.0, 0.0], [0.0, -0.2, 0.0]])


def curves(scene, points=401, reach=REACH):
    edges, rounds = _edges.edges_of(scene, MIDDLE), _rounds.rounds_of(scene)
    return _triple_curves.triple_curves(scene, edges, rounds, MIDDLE, reach, points)


@pytest.fixture(scope="module")
def meshes():
    return {
        name: discontinuity_mesh(scene, MIDDLE, points=1601, reach=REACH)
        for name, scene in SCENES.items()
    }


@pytest.mark.parametrize("name", SCENES)
def test_the_mesh_has_the_events_of_lines_that_cross_it(meshes, name):
    count = 0
    for start in STARTS:
        table = found(SCENES[name], start=start)
        inside = np.max(np.abs(table.position), axis=1) < REACH
        table = table.take((table.kind == "three edges") & inside)
        x, size = crossings(meshes[name], "three edges", start)
        np.testing.assert_allclose(x, table.x, rtol=0.0, atol=1e-4)
        np.testing.assert_allclose(size, told(table), rtol=0.03, atol=1e-3)
        count += len(x)
    assert count > 4


def jumps_of_E2(scene, cells=1501, halvings=12):
    """Where exact E'' jumps along the line, by halving cells in which it changes fast."""
    t = np.linspace(0.6, 3.4, cells)
    E2 = derivatives(scene, t)[1]
    change = np.abs(np.diff(E2))
    around = np.median([np.roll(change, k) for k in (-3, -2, 2, 3)], axis=0)
    cell = np.flatnonzero(change > 4.0 * around + 0.02)
    ends, values = np.stack([t[cell], t[cell + 1]]), np.stack([E2[cell], E2[cell + 1]])
    for _ in range(halvings):
        middle = np.mean(ends, axis=0)
        value = derivatives(scene, middle)[1]
        first = np.abs(value - values[0]) > np.abs(value - values[1])
        ends = np.where(first, [ends[0], middle], [middle, ends[1]])
        values = np.where(first, [values[0], value], [value, values[1]])
    return ends[0][np.abs(np.diff(values, axis=0)[0]) > 0.01]


def off_the_mesh(lines, places):
    """The places to which no line of a mesh is near."""
    x = np.concatenate([crossings(lines, kind)[0] for kind in np.unique(lines.kind)])
    return places[np.min(np.abs(places[:, None] - x), axis=1, initial=9.0) > 1e-3]


@pytest.mark.parametrize("name", ["an edge and two balls", "three balls"])
def test_exact_derivatives_jump_on_the_mesh_and_nowhere_else(meshes, name):
    places = jumps_of_E2(SCENES[name])
    assert len(places) > 2
    assert len(off_the_mesh(meshes[name], places)) == 0


def test_curves_that_are_left_out_are_seen(monkeypatch):
    scene = SCENES["three balls"]
    places = jumps_of_E2(scene)
    whole = mesh.triple_curves
    monkeypatch.setattr(mesh, "triple_curves", lambda *a: whole(*a)._replace(places=[], jumps=[]))
    without = discontinuity_mesh(scene, MIDDLE, points=401, reach=REACH)
    assert len(off_the_mesh(without, places)) > 0


MIDDLES, HEIGHTS, RADII = np.array([[0.1, 0.05], [-0.1, -0.05]]), np.array([0.8, 1.2]), (0.3, 0.25)
LEVEL = scene_of(
    rectangle((0.0, 0.1, 2.0), (0.0, 0.3, 0.0), (0.6, 0.0, 0.0)),
    *(disc((*c, h), (0.0, 0.0, 1.0), r) for c, h, r in zip(MIDDLES, HEIGHTS, RADII, strict=True)),
)


def test_level_discs_and_an_edge_cross_where_circles_do():
    """Seen in the plane of the lamp discs are circles: an edge crosses one of them on the other."""
    drawn = curves(LEVEL)
    x = drawn.places[drawn.jumps > 0.0][:, :2]
    assert len(x) > 400
    scale = 2.0 / HEIGHTS
    middle, radius = x[:, None] + (MIDDLES - x[:, None]) * scale[:, None], RADII * scale
    worst = []
    for axis, sides in ((1, (-0.2, 0.4)), (0, (-0.6, 0.6))):
        for at in sides:
            off = at - middle[:, 0, axis]
            half = np.sqrt(np.maximum(radius[0] ** 2 - off**2, 0.0))
            for side in (-1.0, 1.0):
                point = np.empty_like(x)
                point[:, axis] = at
                point[:, 1 - axis] = middle[:, 0, 1 - axis] + side * half
                worst.append(np.abs(np.linalg.norm(point - middle[:, 1], axis=1) - radius[1]))
    assert np.max(np.min(worst, axis=0)) < 1e-8


def test_curves_that_close_are_followed_once_around():
    """On an endless edge the images of two discs part on either side."""
    edges, rounds = _edges.edges_of(LEVEL, MIDDLE), _rounds.rounds_of(LEVEL)
    square, count = Square(edges, rounds, MIDDLE, 5.0), []
    for triple in _triple_curves.edges_with_two_bodies(edges, rounds):
        lines = _triple_curves._lines(square, [_triple_curves._seeds(square, triple)])
        ends = [(line.both[0], line.both[-1]) for line in lines]
        np.testing.assert_allclose(*np.swapaxes(ends, 0, 1), rtol=0.0, atol=1e-12)
        count.append(len(lines))
    assert count == [1, 1, 1, 1]


def test_a_scene_without_round_shapes_has_none():
    drawn = curves(Scene.of(primitive(SHEET, emission=1.0)), points=5)
    assert drawn.places.shape == (0, 5, 3)
