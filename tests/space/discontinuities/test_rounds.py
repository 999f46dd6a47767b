"""Visual events of round bodies, by symmetries, against exact derivatives and closed light.

`derivations/space/discontinuities/rounds.py` has a brute force for a ball; here are ellipsoids,
discs, and bodies that touch each other's images.
"""

import numpy as np
import pytest

from derivations.space.discontinuities import rounds as brute
from firstorder.space import (
    Receiver,
    Scene,
    disc,
    ellipsoid,
    primitive,
    rectangle,
    sphere,
)
from firstorder.space.discontinuities import (
    _edges,
    _jumps,
    _round_curves,
    _round_lines,
    _rounds,
    _tangents,
    discontinuity_mesh,
)
from firstorder.space.discontinuities.events import visual_events_along
from tests.space.discontinuities.exact import (
    JUMP,
    REACH,
    ROOT,
    START,
    TOUCH,
    WAY,
    beside,
    crossings,
    found,
    left_over,
    told,
)

LAMPS = {
    "a disc": disc((0.05, -0.1, 2.0), (0.1, -0.05, -1.0), 0.4),
    "a ball": sphere((0.05, -0.1, 2.0), 0.4),
}
PLATE = (0.05, 0.1, 1.05), (0.22, 0.13, -0.05), (-0.1, 0.2, 0.07)


def blob(center, seed, size=0.17):
    axes = size * np.eye(3) + np.random.default_rng(seed).uniform(-0.1, 0.1, (3, 3))
    return ellipsoid(center, axes)


BLOBS = [blob((0.12, 0.05, 1.4), 1), blob((-0.1, -0.06, 0.7), 2)]


def scene_of(lamp, *shapes):
    return Scene.of(primitive(lamp, emission=1.0), *map(primitive, shapes))


SCENES = [(lamp, shapes) for lamp in LAMPS for shapes in (BLOBS, [BLOBS[1], rectangle(*PLATE)])]


@pytest.mark.parametrize(("lamp", "shapes"), SCENES)
def test_jumps_and_roots_are_those_of_exact_derivatives(lamp, shapes):
    scene = scene_of(LAMPS[lamp], *shapes)
    table = found(scene)
    touch = table.kind == TOUCH
    before, after = beside(scene, table, JUMP)
    assert np.sum(~touch) > 2
    np.testing.assert_allclose(table.jump_E2[~touch], (after - before)[~touch], rtol=1e-4)
    before, after = beside(scene, table, ROOT)
    assert np.sum(touch) > 2
    np.testing.assert_allclose(table.root_before[touch], before[touch], rtol=0.0, atol=2e-5)
    np.testing.assert_allclose(table.root_after[touch], after[touch], rtol=0.0, atol=2e-5)
    assert np.max(np.abs(table.root_before + table.root_after)) > 0.1


@pytest.mark.parametrize(("lamp", "shapes"), SCENES)
def test_no_event_is_missed(lamp, shapes):
    """Without jumps and roots what is left of E'' changes little from sample to sample."""
    scene = scene_of(LAMPS[lamp], *shapes)
    assert left_over(scene, found(scene)) < 0.1


@pytest.mark.parametrize("kind", [TOUCH, "vertex and edge", "three edges"])
def test_the_mesh_has_the_events_of_a_line_that_crosses_it(kind):
    scene = brute.scene()
    mesh = discontinuity_mesh(scene, Receiver.at((0.0, 0.0, 0.0)), points=1601, reach=2.0)
    table = found(scene)
    table = table.take(table.kind == kind)
    x, size = crossings(mesh, kind)
    np.testing.assert_allclose(x, table.x, rtol=0.0, atol=1e-4)
    # The mesh has points beside the line, between which jumps grow and shrink.
    np.testing.assert_allclose(size, told(table), rtol=0.01, atol=1e-4)


def test_umbra_and_penumbra_of_discs_are_circles():
    """Half as high as the lamp: radii 2 r - R and 2 r + R."""
    scene = scene_of(disc((0, 0, 2.0), (0, 0, -1.0), 0.5), disc((0, 0, 1.0), (0, 0, 1.0), 0.3))
    mesh = discontinuity_mesh(scene, Receiver.at((0.0, 0.0, 0.0)), points=33, reach=1.2)
    radii = sorted((np.linalg.norm(line, axis=1) for line in mesh.lines), key=np.mean)
    assert len(radii) == 2
    np.testing.assert_allclose(radii[0], 0.1, rtol=1e-9)
    np.testing.assert_allclose(radii[1], 1.1, rtol=1e-9)


def test_a_square_cuts_four_arcs_out_of_the_edge_of_a_penumbra():
    """A circle of radius 1.1 in a square of half 0.8, whose corners are 1.13 away."""
    lamp, plate = disc((0, 0, 2.0), (0, 0, -1.0), 0.5), disc((0, 0, 1.0), (0, 0, 1.0), 0.3)
    scene, at = scene_of(lamp, plate), Receiver.at((0.0, 0.0, 0.0))
    bodies, edges = _rounds.rounds_of(scene), _edges.edges_of(scene, at)
    (curves,) = _round_curves.body_curves(scene, edges, bodies, at, 0.8, 401)
    shown = curves.places[curves.jumps > 0.0]
    radius, most = np.linalg.norm(shown, axis=1), np.max(np.abs(shown), axis=1)
    arcs = radius > 0.5
    np.testing.assert_allclose(radius, np.where(arcs, 1.1, 0.1), rtol=1e-9)
    assert np.max(most[arcs]) <= 0.8
    # The share of the circle between the angles at which it crosses the sides.
    share = (np.pi / 4 - np.arccos(0.8 / 1.1)) / (np.pi / 4)
    np.testing.assert_allclose(np.sum(arcs) / 401, share, rtol=0.0, atol=8 / 401)


def test_what_two_balls_share_is_the_area_of_a_lens():
    """From far below, discs of the angles of the balls: E'' where they begin to overlap."""
    R, r, H, h = 0.002, 0.003, 2.0, 1.0
    scene = scene_of(sphere((0.0, 0.0, H), R), sphere((0.0, 0.0, h), r))
    table = found(scene, start=(-0.02, 0.0, 0.0), way=(1.0, 0.0, 0.0), reach=0.04)
    k = H / R + h / r  # of circles of the angles R/H and r/h, one beside the other
    speed = 1.0 / h - 1.0 / H
    outer = -np.sqrt(2.0 / k) * speed**1.5
    assert table.kind.tolist() == [TOUCH] * 4
    # Up to squares of angles of a hundredth.
    np.testing.assert_allclose(table.root_after[0], outer, rtol=5e-4)
    np.testing.assert_allclose(table.root_before[3], outer, rtol=5e-4)
    np.testing.assert_allclose(table.x[0] - 0.02, -(R / H + r / h) / speed, rtol=5e-4)


def test_a_body_may_be_drawn_with_other_axes():
    """A ball is an ellipsoid with axes in any direction."""
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    lamp, plate = LAMPS["a disc"], rectangle(*PLATE)
    one = found(scene_of(lamp, plate, sphere((0.1, 0.0, 0.6), 0.2)))
    other = found(scene_of(lamp, plate, ellipsoid((0.1, 0.0, 0.6), 0.2 * turn)))
    assert one.kind.tolist() == other.kind.tolist()
    np.testing.assert_allclose(one.x, other.x, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(one.root_after, other.root_after, rtol=0.0, atol=1e-7)


def test_a_line_that_is_walked_back_has_its_events_in_reverse():
    scene = scene_of(LAMPS["a ball"], *BLOBS)
    there, end = found(scene), START + REACH * WAY / np.linalg.norm(WAY)
    back = found(scene, start=end, way=-WAY)
    np.testing.assert_allclose(REACH - back.x[::-1], there.x, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(back.root_after[::-1], there.root_before, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(-back.jump_E2[::-1], there.jump_E2, rtol=1e-4, atol=1e-9)


def test_a_shorter_line_has_those_events_of_a_longer_one_that_are_on_it():
    scene = scene_of(LAMPS["a ball"], BLOBS[1], rectangle(*PLATE))
    whole = found(scene, hidden=True)
    part = found(scene, reach=1.9, hidden=True)  # others are a little farther on
    np.testing.assert_allclose(part.x, whole.x[whole.x < 1.9], rtol=0.0, atol=1e-9)
    assert len(part) > 5


def conics(k):
    """A circle and a hyperbola by s and t / k: squares add to 0.25, and the product is 0.12."""
    circle, hyperbola = np.zeros((2, 3, 3))
    circle[[0, 0, 2], [0, 2, 0]] = -0.25, 1.0, 1.0 / k**2
    hyperbola[[0, 1], [0, 1]] = -0.12, 1.0 / k
    return circle, hyperbola


def test_a_circle_and_a_hyperbola_meet_in_two_points_of_a_square():
    t, s = _round_lines._common_roots(*conics(1.0))
    order = np.argsort(t)
    np.testing.assert_allclose(t[order], [0.3, 0.4], rtol=1e-9)
    np.testing.assert_allclose(s[order], [0.4, 0.3], rtol=1e-9)
    t, _ = _round_lines._common_roots(*conics(5.0))  # at 1.5 and 2
    assert len(t) == 0


def test_two_functions_of_a_radius_and_an_angle_are_zero_at_two_points():
    def both(t, angle):
        x, y = t * np.cos(angle), t * np.sin(angle)
        return np.stack([(x - 0.3) * (y + 0.6), (y - 0.4) * (x + 0.2) + 3.0 * (x - 0.3)])

    t, angle = _round_lines._common_zeros(both)
    points = np.stack([t * np.cos(angle), t * np.sin(angle)], -1)
    np.testing.assert_allclose(
        points[np.argsort(t)], [[0.3, 0.4], [0.55, -0.6]], rtol=0.0, atol=1e-9
    )


def test_roots_and_jumps_shrink_as_space_grows():
    def grown(k):
        lamp, ball = sphere((0.0, 0.1 * k, 2.0 * k), 0.4 * k), sphere((0.0, 0.0, k), 0.2 * k)
        plate = rectangle(*(k * np.array(a) for a in PLATE))
        return found(scene_of(lamp, ball, plate), start=k * START, reach=k * REACH)

    one, other = grown(1.0), grown(1e3)
    np.testing.assert_allclose(other.x, 1e3 * one.x, rtol=1e-7)
    np.testing.assert_allclose(10.0**4.5 * other.root_after, one.root_after, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(1e6 * other.jump_E2, one.jump_E2, rtol=0.0, atol=1e-5)


def test_a_line_that_runs_into_a_ball_tells_so():
    table = found(scene_of(LAMPS["a disc"], sphere((0.0, 0.17, 0.0), 0.5)))
    row = table.take(table.kind == "contact")
    assert row.order.tolist() == [0, 0]
    at = row.position - np.array([0.0, 0.17, 0.0])
    np.testing.assert_allclose(np.linalg.norm(at, axis=1), 0.5)


def test_a_ball_on_the_floor_has_events_like_any_other():
    lamp, balls = LAMPS["a ball"], (sphere((0.1, 0.0, 0.2), 0.2), sphere((-0.3, 0.1, 0.9), 0.25))
    floor = rectangle((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0))
    start = Receiver.at((-2.0, 0.2, 0.0), on=3)
    table = visual_events_along(scene_of(lamp, *balls, floor), start, along=WAY, reach=4.0)
    free = found(scene_of(lamp, *balls), start=(-2.0, 0.2, 0.0), reach=4.0)
    np.testing.assert_allclose(table.x, free.x, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(table.root_after, free.root_after, rtol=0.0, atol=1e-9)
    assert len(table) > 3


def test_what_parts_two_balls_does_not_depend_on_where_the_origin_is():
    """Along it their middles are farther apart than both radii together."""
    middles = np.array([[0.0, 0.1, -2.0], [0.2, 0.0, 2.0]])
    for shift in ([0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [-0.1, 0.0, 1.0], [3.0, -1.0, 2.0]):
        balls = _rounds.rounds_of(scene_of(*(sphere(c + shift, 1.2) for c in middles)))
        ((numbers, planes),) = _tangents.common_planes(balls)
        assert numbers == (0, 1)
        assert planes.axis @ (middles[1] - middles[0]) > 2.4


def test_bodies_that_nothing_parts_have_no_plane_between_them():
    one, other = sphere((0.0, 0.0, 1.0), 0.2), sphere((0.1, 0.0, 1.0), 0.2)
    assert len(found(scene_of(one, other))) == 0


# --- faults --------------------------------------------------------------------------------------


@pytest.fixture
def searched_again():
    brute.predicted.cache_clear()
    yield
    brute.predicted.cache_clear()


def test_a_curvature_that_is_wrong_is_seen(monkeypatch, searched_again):
    right = _rounds.outline_at

    def spoilt(*args):
        outline = right(*args)
        return outline._replace(curvature=1.01 * outline.curvature)

    monkeypatch.setattr("firstorder.space.discontinuities._tangents.outline_at", spoilt)
    assert brute.root_error(brute.by_values) > 1e-3


def test_limbs_that_move_too_fast_are_seen(monkeypatch, searched_again):
    monkeypatch.setattr(_jumps, "tangential", lambda at, m: 1.01 * np.asarray(m))
    assert brute.root_error(brute.by_values) > 1e-3
    assert brute.jump_error(brute.by_values) > 1e-3
