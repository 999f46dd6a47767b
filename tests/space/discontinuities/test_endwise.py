"""Walls seen endwise: upright cylinders, whose walls made longer stand on the plane as circles."""

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, cylinder, primitive, sphere
from firstorder.space.discontinuities._edges import edges_of
from firstorder.space.discontinuities._endwise import endwise_along, endwise_at
from firstorder.space.discontinuities._rounds import WALL, rounds_of

AT = Receiver.at((0.0, 0.0, 0.0))
X = np.array([1.0, 0.0, 0.0])


def parts(*shapes):
    scene = Scene.of(*map(primitive, shapes))
    return edges_of(scene, AT), rounds_of(scene)


@pytest.mark.parametrize("ends", [(1.0, 3.0), (3.0, 1.0)])
def test_an_upright_wall_is_seen_endwise_from_the_circle_below_it(ends):
    """Both rims are circles of the curvatures r / R against each other there."""
    ball = sphere((9.0, 9.0, 9.0), 1.0)
    tube = cylinder((2.0, 0.3, ends[0]), (2.0, 0.3, ends[1]), 0.5)
    t, rows = endwise_along(*parts(ball, tube), AT, X, 4.0)
    np.testing.assert_allclose(np.sort(t), [1.6, 2.4], rtol=1e-12)
    np.testing.assert_allclose(rows.place, t[:, None] * X)
    np.testing.assert_allclose(rows.u, [[0.0, 0.0, 1.0]] * 2, atol=1e-12)
    np.testing.assert_allclose(rows.m, (rows.place - [2.0, 0.3, 0.0]) / 0.5, atol=1e-12)
    np.testing.assert_allclose(rows.r, [[1.0, 3.0]] * 2, rtol=1e-12)
    near, far = -1.0 / 0.5, -3.0 / 0.5
    np.testing.assert_allclose(rows.curvature, [near - far] * 2, rtol=1e-9)
    np.testing.assert_allclose(rows.bend, [(near + far) / 2.0] * 2, rtol=1e-9)
    # (k_1 + k_2) / (2 sqrt(k_1 k_2)) of a lens
    np.testing.assert_allclose(rows.fill, [2.0 / np.sqrt(3.0)] * 2, rtol=1e-9)
    assert len(endwise_along(*parts(ball, tube), AT, X, 2.0)[0]) == 1
    assert len(endwise_along(*parts(ball, tube), AT, -X, 4.0)[0]) == 0


def test_a_leaning_wall_is_seen_along_its_axis():
    """Its axis (3, 0, 4) / 5 meets the plane at x = 0.25, and the wall is 0.2 / 0.8 beside it."""
    base, axis = np.array([1.0, 0.0, 1.0]), np.array([0.6, 0.0, 0.8])
    tube, at = cylinder(base, base + 2.0 * axis, 0.2), Receiver.at((-1.0, 0.0, 0.0))
    t, rows = endwise_along(*parts(tube), at, X, 4.0)
    order = np.argsort(t)
    np.testing.assert_allclose(t[order], [1.0, 1.5], atol=1e-12)
    np.testing.assert_allclose(rows.u, [axis] * 2, atol=1e-12)
    out = np.array([0.8, 0.0, -0.6])
    np.testing.assert_allclose(rows.m[order], [-out, out], atol=1e-12)
    to_base = (base - rows.place) @ axis
    np.testing.assert_allclose(rows.r, np.stack([to_base, to_base + 2.0], -1), rtol=1e-12)


@pytest.mark.parametrize(
    ("low", "high", "there"),
    [(1.0, 3.0, True), (-3.0, -1.0, False), (-1.0, 1.0, False), (-0.1, 3.0, False)],
)
def test_eyes_below_the_ends_of_a_wall_see_it_endwise(low, high, there):
    edges, rounds = parts(cylinder((2.0, 0.0, low), (2.0, 0.0, high), 0.5))
    (wall,) = np.flatnonzero(rounds.kind == WALL)
    _, found = endwise_at(edges, rounds, AT, 1.5 * X[None], np.array([wall]))
    assert found.tolist() == [there]


def test_a_rim_in_the_floor_is_too_near():
    edges, rounds = parts(cylinder((2.0, 0.0, 1e-9), (2.0, 0.0, 2.0), 0.5))
    (wall,) = np.flatnonzero(rounds.kind == WALL)
    _, found = endwise_at(edges, rounds, AT, 1.5 * X[None], np.array([wall]))
    assert found.tolist() == [False]
