"""Where E' jumps since a disc is seen edge-on, and how far strips reach beside round bodies."""

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, disc, primitive, rectangle, sphere
from firstorder.space.discontinuities import _strips, discontinuity_mesh
from tests.space.discontinuities.exact import (
    PLANE,
    ROOT,
    SLOPE,
    TOUCH,
    beside,
    crossings,
    found,
    left_over,
    told,
)

BALL = primitive(sphere((0.05, -0.1, 2.0), 0.4), emission=1.0)
UPRIGHT = primitive(disc((0.3, 0.05, 0.9), (1.0, 0.1, 0.3), 0.25))
SCENE = Scene.of(BALL, UPRIGHT)


def test_a_disc_that_is_seen_edge_on_makes_a_kink_and_nothing_else_is_missed():
    table = found(SCENE)
    touch = table.kind == TOUCH
    assert np.sum(touch) == 4
    assert np.sum(table.kind == PLANE) == 1
    before, after = beside(SCENE, table, SLOPE, order=1)
    np.testing.assert_allclose(table.jump_E1, after - before, rtol=0.0, atol=1e-7)
    before, after = beside(SCENE, table, ROOT)
    np.testing.assert_allclose(table.root_before[touch], before[touch], rtol=0.0, atol=2e-5)
    np.testing.assert_allclose(table.root_after[touch], after[touch], rtol=0.0, atol=2e-5)
    assert left_over(SCENE, table) < 0.1


def test_the_mesh_has_the_line_from_which_a_disc_is_seen_edge_on():
    mesh = discontinuity_mesh(SCENE, Receiver.at((0.0, 0.0, 0.0)), points=201, reach=1.1)
    table = found(SCENE)
    table = table.take(table.kind == PLANE)
    x, size = crossings(mesh, PLANE)
    np.testing.assert_allclose(x, table.x, rtol=1e-9)
    np.testing.assert_allclose(size, told(table), rtol=1e-3)


@pytest.mark.parametrize(("sides", "share"), [((1.0, 1.0), 1.0), ((1.0, 0.0), 0.5)])
def test_both_sides_of_a_disc_add_to_its_kink(sides, share):
    """`integral of cos(theta) (1/r_near - 1/r_far)` over the angle, for each side that shines."""
    lamp = Scene.of(primitive(disc((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.2), emission=sides))
    table = found(lamp, start=(-1.0, 0.0, 0.0), way=(1.0, 0.0, 0.0), reach=2.0)
    omega = np.linspace(-1.0, 1.0, 200001) * np.arcsin(0.2)
    half = np.sqrt(np.maximum(0.04 - np.sin(omega) ** 2, 0.0)) / 0.96
    both = 2.0 * np.trapezoid(2.0 * half * np.cos(omega), omega)
    np.testing.assert_allclose(table.jump_E1, [share * both], rtol=1e-6)


@pytest.mark.parametrize("ball", [(0.02, 0.1, 0.5), (0.01, -0.13, 0.5)])
def test_a_strip_ends_where_a_ball_crosses_its_plane(ball):
    lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.6, 0.0, 0.0))
    plate = rectangle((0.0, 0.0, 1.0), (0.2, 0.0, 0.0), (0.0, 0.3, 0.0))
    flat = primitive(lamp, emission=1.0), primitive(plate)
    scene = Scene.of(*flat, primitive(sphere(ball, 0.08)))
    way = (1.0, 0.0, 0.0)
    table, free = found(scene, way=way), found(Scene.of(*flat), way=way)
    table, free = (t.take(t.kind == PLANE) for t in (table, free))
    before, after = beside(scene, table, SLOPE, order=1, way=way)
    np.testing.assert_allclose(table.jump_E1, after - before, rtol=0.0, atol=1e-7)
    assert np.sum(np.abs(table.jump_E1 - free.jump_E1) > 0.02) == 2


def test_a_line_through_a_disc_tells_so():
    table = found(Scene.of(BALL, primitive(disc((0.0, 0.17, 0.1), (1.0, 0.3, 0.1), 0.3))))
    row = table.take(table.kind == "contact")
    off = (row.position - np.array([0.0, 0.17, 0.1])) @ np.array([1.0, 0.3, 0.1])
    np.testing.assert_allclose(off, [0.0], rtol=0.0, atol=1e-9)
    assert np.sum(table.kind == PLANE) == 0


def test_arcs_that_are_too_near_are_seen(monkeypatch):
    right = _strips.Arcs.inverse_distances
    monkeypatch.setattr(_strips.Arcs, "inverse_distances", lambda *a: 1.01 * right(*a))
    table = found(SCENE)
    before, after = beside(SCENE, table, SLOPE, order=1)
    assert np.max(np.abs(table.jump_E1 - after + before)) > 1e-3
