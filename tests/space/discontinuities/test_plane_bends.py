"""The jump of E'' where E' jumps, against exact derivatives and clipped polygons."""

import numpy as np
import pytest

from derivations.flatland.discontinuities.events import brute_jump
from derivations.space.discontinuities import events as brute
from firstorder.space import Scene, box, cylinder, disc, primitive, rectangle, sphere
from firstorder.space.discontinuities import _plane_bends
from tests.space.discontinuities.exact import JUMP, PLANE, beside_places, found

X, Y, Z = np.eye(3)
SHEET = rectangle((0.05, 0.0, 2.0), 0.4 * Y, 0.5 * X)
UPRIGHT = disc((0.3, 0.05, 0.9), (1.0, 0.1, 0.3), 0.25)
BALL = sphere((0.05, -0.1, 2.0), 0.4)
CAPPED = cylinder((0.0, -0.2, 0.5), (0.3, -0.15, 0.55), 0.15)


def scene_of(lamp, *shapes):
    return Scene.of(primitive(lamp, emission=(1.0, 1.0)), *map(primitive, shapes))


SCENES = {
    "a plate under a sheet": scene_of(SHEET, rectangle((-0.1, 0.1, 1.25), 0.3 * X, 0.2 * Y)),
    "a ball over a box": scene_of(
        SHEET, box((-0.25, -0.2, 0.3), (0.28, 0.3, 0.8)), sphere((0.1, 0.05, 1.3), 0.2)
    ),
    "a disc edge-on": Scene.of(primitive(BALL, emission=1.0), primitive(UPRIGHT)),
    "a disc before an edge": scene_of(
        SHEET,
        disc((0.3, 0.05, 0.9), (1.0, 0.1, 0.0), 0.25),
        rectangle((0.25, 0.1, 1.25), 0.1 * X, 0.2 * Y + 0.1 * Z),
    ),
    "a lamp edge-on": scene_of(
        disc((0.3, 0.05, 1.4), (1.0, 0.1, 0.3), 0.25),
        box((0.0, -0.1, 0.3), (0.4, 0.3, 0.6)),
        sphere((0.2, 0.1, 0.9), 0.1),
    ),
    "a cap edge-on": scene_of(
        disc((0.3, 0.6, 1.4), (0.2, -1.0, -0.3), 0.45),
        CAPPED,
        rectangle((0.3, 0.2, 0.9), (0.1, 0.02, 0.1), (0.0, 0.1, 0.15)),
    ),
}


def kinks(scene, way):
    """Events at which E' jumps and nothing else happens, and how far away the others are."""
    table = found(scene, way=way)
    apart = np.abs(table.x[:, None] - table.x) + 9.0 * np.eye(len(table))
    room = np.min(apart, axis=1, initial=9.0)
    alone = (table.kind == PLANE) & (np.abs(table.jump_E1) > 1e-5) & (room > 1e-6)
    return table.take(alone), room[alone]


@pytest.mark.parametrize("name", SCENES)
def test_jumps_are_those_of_exact_derivatives(name):
    seen = 0
    for way in (np.array([1.0, 0.07, 0.0]), np.array([1.0, -0.25, 0.0])):
        table, room = kinks(SCENES[name], way)
        reach = np.minimum(2e-6, 0.01 * room)
        before, after = beside_places(SCENES[name], table.x, JUMP, reach, way=way)
        np.testing.assert_allclose(table.jump_E2, after - before, rtol=1e-6, atol=1e-7)
        seen += np.sum(np.abs(table.jump_E2) > 0.01)
    assert seen


def test_jumps_are_those_of_clipped_polygons():
    table = brute.predicted(None)
    table = table.take((table.kind == PLANE) & (np.abs(table.jump_E1) > 1e-5))
    jumps = [brute_jump(brute.on_line(None), x, 2, 5e-4) for x in table.x]
    np.testing.assert_allclose(table.jump_E2, jumps, rtol=0.0, atol=1e-5)
    assert np.max(np.abs(jumps)) > 0.1


def test_a_line_that_is_walked_back_meets_the_same_jump_of_the_second_derivative():
    """E'' does not change its sign with the direction, but after and before change places."""
    scene, way = SCENES["a disc before an edge"], np.array([1.0, 0.07, 0.0])
    table, _ = kinks(scene, way)
    end = np.array([-2.0, 0.03, 0.0]) + 4.0 * way / np.linalg.norm(way)
    back = found(scene, start=end, way=-way)
    back = back.take((back.kind == PLANE) & (np.abs(back.jump_E1) > 1e-5))
    np.testing.assert_allclose(back.jump_E2[::-1], -table.jump_E2, rtol=1e-6)


@pytest.mark.parametrize("part", ["_of_vertices", "_of_edges", "_of_bodies"])
def test_what_crosses_the_plane_and_is_left_out_is_seen(monkeypatch, part):
    names = {"_of_vertices": "a plate under a sheet", "_of_edges": "a disc before an edge"}
    scene = SCENES[names.get(part, "a ball over a box")]
    way = np.array([1.0, 0.07, 0.0])
    right, _ = kinks(scene, way)
    whole = getattr(_plane_bends, part)
    monkeypatch.setattr(_plane_bends, part, lambda *a: tuple(b[:0] for b in whole(*a)))
    spoilt, _ = kinks(scene, way)
    assert np.max(np.abs(spoilt.jump_E2 - right.jump_E2)) > 1e-3
