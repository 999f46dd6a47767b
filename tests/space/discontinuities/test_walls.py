"""Visual events of cylinders, against exact derivatives of irradiance, by closed forms, and by
symmetries.
"""

import functools

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
)
from firstorder.space.discontinuities import _rounds, _tangents, _walls, discontinuity_mesh
from tests.space.discontinuities.exact import (
    JUMP,
    PLANE,
    REACH,
    ROOT,
    SLOPE,
    START,
    TOUCH,
    WAY,
    beside,
    beside_places,
    crossings,
    derivatives,
    found,
    left_over,
    told,
    turns,
)

BALL = sphere((0.05, -0.1, 2.0), 0.4)
SHEET = rectangle((0.0, 0.05, 2.0), (0.1, 0.5, 0.03), (0.6, -0.05, 0.05))
PLATE = rectangle((0.05, 0.1, 1.25), (0.22, 0.13, -0.05), (-0.1, 0.2, 0.07))
ENDS = np.array([(-0.8, 0.05, 1.8), (0.7, 0.2, 2.1)])
TUBE = cylinder(*ENDS, 0.1)
LEANS = cylinder((0.1, 0.05, 0.7), (0.3, 0.2, 1.1), 0.15)
LIES = cylinder((-0.5, 0.15, 0.5), (0.0, -0.3, 0.4), 0.1)
STANDS = cylinder((0.1, 0.05, 0.7), (0.1, 0.05, 1.1), 0.15)
CRATE = box((-0.6, 0.1, 0.3), (-0.3, 0.3, 0.8))
NEON = cylinder((0.3, 1.5, 0.6), (0.3, 1.5, 1.4), 0.1)
COLUMN = cylinder((-0.3, 0.6, 0.0), (-0.3, 0.6, 0.8), 0.2)


def scene_of(lamp, *shapes):
    return Scene.of(primitive(lamp, emission=1.0), *map(primitive, shapes))


SCENES = {
    "a ball behind two": scene_of(BALL, LEANS, LIES),
    "one over a crate": scene_of(SHEET, STANDS, CRATE),
    "a tube behind one": scene_of(TUBE, LIES, PLATE),
}


@functools.cache
def events_of(name):
    return found(SCENES[name])


@functools.cache
def turns_of(name):
    """Where other things cross the outline of the tube at a place where its curvature jumps."""
    others = Scene.of(primitive(LIES), primitive(PLATE))
    return turns(*ENDS, 0.1, others) if name == "a tube behind one" else ()


@pytest.mark.parametrize("name", SCENES)
def test_jumps_and_roots_are_those_of_exact_derivatives(name):
    scene, table = SCENES[name], events_of(name)
    touch, flat = table.kind == TOUCH, table.kind == PLANE
    bent = ~touch & ~flat
    before, after = beside(scene, table, SLOPE, order=1)
    np.testing.assert_allclose(table.jump_E1, after - before, rtol=0.0, atol=1e-6)
    before, after = beside(scene, table, JUMP)
    np.testing.assert_allclose(table.jump_E2[bent], (after - before)[bent], rtol=1e-4)
    before, after = beside(scene, table, ROOT, others=turns_of(name))
    np.testing.assert_allclose(table.root_before[touch], before[touch], rtol=0.0, atol=2e-5)
    np.testing.assert_allclose(table.root_after[touch], after[touch], rtol=0.0, atol=2e-5)
    assert np.sum(touch) > 3
    assert np.any(flat)


@pytest.mark.parametrize("name", SCENES)
def test_no_event_is_missed(name):
    table = events_of(name)
    assert left_over(SCENES[name], table, step=1e-3, others=turns_of(name)) < 0.1


def test_what_crosses_the_end_of_a_line_of_a_wall_changes_E2_fast_but_makes_no_jump():
    """The cap of the tube is seen edge-on near by, and its outline all but has a corner."""
    scene, places = SCENES["a tube behind one"], np.array(turns_of("a tube behind one"))
    table = events_of("a tube behind one")
    apart = places[np.min(np.abs(places[:, None] - table.x), axis=1) > 1e-6]
    before, after = beside_places(scene, apart, JUMP, 1e-7)
    np.testing.assert_allclose(after, before, rtol=0.0, atol=1e-7)
    before, after = (derivatives(scene, apart + side * 5e-4)[1] for side in (-1.0, 1.0))
    assert np.max(np.abs(after - before)) > 5.0


def test_a_root_beside_the_end_of_a_line_of_a_wall_halves_beyond_a_hair():
    """A tip like a parabola is cut. Where a wall takes one side of it, only half of the root of its
    segment is left; the rest is a polynomial of the depth.
    """
    scene, places = SCENES["a tube behind one"], turns_of("a tube behind one")
    table = events_of("a tube behind one")
    near = np.min(np.abs(places[:, None] - table.x), axis=0) < 1e-6
    table = table.take(near & (table.kind == TOUCH))
    farther, _ = beside_places(scene, table.x, ROOT, 2e-6)
    np.testing.assert_allclose(farther, 0.5 * table.root_before, rtol=1e-6)
    assert len(table) == 1


def test_every_kind_of_event_has_been_seen():
    kinds = np.concatenate([events_of(name).kind for name in SCENES])
    assert set(kinds) == {TOUCH, PLANE, "vertex and edge", "three edges"}


@pytest.mark.parametrize("lamp", [NEON, box((0.2, 1.4, 0.6), (0.5, 1.6, 1.4))])
def test_upright_things_behind_a_column_make_kinks(lamp):
    """Walls and edges that are parallel line up along their whole lengths."""
    scene = scene_of(lamp, COLUMN)
    table = found(scene)
    before, after = beside(scene, table, SLOPE, order=1)
    np.testing.assert_allclose(table.jump_E1, after - before, rtol=0.0, atol=1e-6)
    assert np.sum(np.abs(table.jump_E1) > 0.02) > 3


def test_lines_that_touch_two_columns_are_those_of_two_circles():
    """Seen from above: inner and outer tangents, where they cross the line of receivers."""
    table = found(scene_of(NEON, COLUMN))
    (R, C), (r, c) = (0.1, np.array([0.3, 1.5])), (0.2, np.array([-0.3, 0.6]))
    way, expected = WAY[:2] / np.linalg.norm(WAY), []
    between = C - c
    for side in (1.0, -1.0):
        for turn in (1.0, -1.0):
            angle = np.arctan2(*between[::-1])
            angle += turn * np.arccos((r - side * R) / np.linalg.norm(between))
            n = np.array([np.cos(angle), np.sin(angle)])
            expected.append((n @ (c - START[:2]) + r) / (n @ way))
    np.testing.assert_allclose(table.x, sorted(expected), rtol=1e-9)


def test_a_cylinder_alone_has_no_events_beside_it():
    """Where its lines meet its rims its outline turns by no angle, and nothing jumps."""
    lamp = scene_of(cylinder((0.1, 0.9, 0.7), (0.3, 1.4, 0.8), 0.15))
    table = found(lamp)
    assert set(table.kind) <= {PLANE}  # of its caps
    assert left_over(lamp, table) < 1e-3


def test_a_cap_that_is_seen_edge_on_comes_and_goes_as_its_two_halves():
    """Of the cap, above on one side, E' jumps by `integral of cos(theta) (1/r_near - 1/r_far)`."""
    lamp = cylinder((0.0, 0.0, 1.0), (1.0, 0.0, 1.0), 0.2)
    table = found(scene_of(lamp), start=(-1.0, 0.0, 0.0), way=(1.0, 0.0, 0.0), reach=1.5)
    omega = np.linspace(-1.0, 1.0, 200001) * np.arcsin(0.2)  # of a circle of 0.2, one metre above
    half = np.sqrt(np.maximum(0.04 - np.sin(omega) ** 2, 0.0)) / 0.96
    expected = np.trapezoid(2.0 * half * np.cos(omega), omega)
    assert table.kind.tolist() == [PLANE]
    np.testing.assert_allclose(table.jump_E1, expected, rtol=1e-6)


def test_the_shadow_under_an_upright_cylinder_ends_on_a_circle():
    """Where it is seen endwise: of the hull of two discs, of angles `radius / height`."""
    scene = Scene.of(primitive(cylinder((0, 0, 1.0), (0, 0, 1.5), 0.01)), environment=1.0)
    mesh = discontinuity_mesh(scene, Receiver.at((0.0, 0.0, 0.0)), points=33, reach=0.5)
    assert len(mesh) == 1
    np.testing.assert_allclose(np.linalg.norm(mesh.lines[0], axis=1), 0.01, rtol=1e-9)
    near, far = 1.0 / 0.01, 1.5 / 0.01
    lens = np.sqrt(2.0 / (far - near)) * (1.0 / 1.0 - 1.0 / 1.5) ** 1.5
    expected = lens * 0.5 * (near + far) / np.sqrt(near * far)
    np.testing.assert_allclose(mesh.jumps[0], expected, rtol=1e-3)  # for angles of a hundredth


@pytest.mark.parametrize("scene", [SCENES["a ball behind two"], scene_of(SHEET, STANDS)])
def test_the_mesh_has_the_events_of_a_line_that_crosses_it(scene):
    mesh = discontinuity_mesh(scene, Receiver.at((0.0, 0.0, 0.0)), points=401, reach=1.1)
    whole = found(scene)
    assert len(set(whole.kind)) == 2
    for kind in set(whole.kind):
        table, hits = whole.take(whole.kind == kind), crossings(mesh, kind)
        table = table.take(np.abs(table.x - 2.0) < 1.05)
        hits = hits[:, np.abs(hits[0] - 2.0) < 1.05]
        np.testing.assert_allclose(hits[0], table.x, rtol=0.0, atol=1e-3)
        np.testing.assert_allclose(hits[1], told(table), rtol=0.03, atol=1e-3)


def test_a_line_that_runs_into_a_cylinder_tells_so():
    table = found(scene_of(BALL, cylinder((-0.5, 0.0, -0.1), (0.5, 0.0, 0.1), 0.3)))
    inside = table.position[table.kind == "contact"]
    axis = np.array([1.0, 0.0, 0.2]) / np.hypot(1.0, 0.2)
    along = inside @ axis  # through both caps
    np.testing.assert_allclose(np.abs(along), 0.5 * np.hypot(1.0, 0.2))
    table = found(scene_of(BALL, cylinder((0.0, 0.2, -0.4), (0.0, 0.1, 0.6), 0.3)))
    inside = table.position[table.kind == "contact"] - np.array([0.0, 0.2, -0.4])
    axis = np.array([0.0, -0.1, 1.0]) / np.hypot(0.1, 1.0)
    np.testing.assert_allclose(np.linalg.norm(np.cross(inside, axis), axis=1), [0.3, 0.3])


def test_a_cylinder_that_stands_on_the_floor_has_events_like_any_other():
    ground = plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    column = cylinder((-0.1, 0.4, 0.0), (-0.1, 0.4, 0.9), 0.2)
    start = Receiver.at(START, on=2)
    whole = _events(scene_of(SHEET, column, ground), start)
    free = _events(scene_of(SHEET, column), Receiver.at(START))
    np.testing.assert_allclose(whole.x, free.x, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(whole.root_after, free.root_after, rtol=0.0, atol=1e-9)
    assert len(whole) > 3


def _events(scene, at):
    from firstorder.space.discontinuities import visual_events_along

    return visual_events_along(scene, at, along=WAY, reach=REACH)


def test_a_line_that_is_walked_back_has_its_events_in_reverse():
    scene = SCENES["one over a crate"]
    there, end = events_of("one over a crate"), START + REACH * WAY / np.linalg.norm(WAY)
    back = found(scene, start=end, way=-WAY)
    np.testing.assert_allclose(REACH - back.x[::-1], there.x, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(back.jump_E1[::-1], there.jump_E1, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(back.root_after[::-1], there.root_before, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(-back.jump_E2[::-1], there.jump_E2, rtol=1e-4, atol=1e-9)


def test_events_do_not_depend_on_the_size_of_the_scene():
    def grown(k):
        lamp = sphere((0.0, 0.1 * k, 2.0 * k), 0.4 * k)
        tube = cylinder(k * np.array((0.1, 0.05, 0.7)), k * np.array((0.3, 0.2, 1.1)), 0.15 * k)
        crate = box(k * np.array((-0.6, 0.1, 0.3)), k * np.array((-0.3, 0.3, 0.8)))
        return found(scene_of(lamp, tube, crate), start=k * START, reach=k * REACH)

    one, other = grown(1.0), grown(1e3)
    np.testing.assert_allclose(other.x, 1e3 * one.x, rtol=1e-7)
    np.testing.assert_allclose(10.0**4.5 * other.root_after, one.root_after, rtol=0.0, atol=1e-6)


# --- faults --------------------------------------------------------------------------------------


def error(name):
    scene = SCENES[name]
    table = found(scene)
    table = table.take(table.kind == TOUCH)
    return np.max(np.abs(table.root_after - beside(scene, table, ROOT)[1]))


def test_a_hull_taken_for_a_lens_is_seen(monkeypatch):
    right = _tangents.endwise_at

    def spoilt(*args):
        rows, there = right(*args)
        return rows._replace(fill=np.ones(len(rows.fill))), there

    assert error("one over a crate") < 2e-5
    monkeypatch.setattr(_tangents, "endwise_at", spoilt)
    assert error("one over a crate") > 1e-3


def test_rims_that_are_outlines_all_round_are_seen(monkeypatch):
    whole = len(events_of("a ball behind two"))
    monkeypatch.setattr(_rounds, "_part_of_outline", lambda *_: np.array(True))
    assert len(found(SCENES["a ball behind two"], hidden=True)) > whole


def test_walls_that_are_too_wide_are_seen(monkeypatch):
    right = _walls.across
    monkeypatch.setattr(_walls, "across", lambda wall: 1.01 * right(wall))
    with pytest.raises(AssertionError):
        test_lines_that_touch_two_columns_are_those_of_two_circles()
