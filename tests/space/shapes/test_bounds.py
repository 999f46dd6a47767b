"""Boxes around shapes of space, against points of the canonical shapes."""

import numpy as np
import pytest

from firstorder.space import Boxes, Cylinders, Discs, Ellipsoids, Planes, Rectangles, Triangles
from firstorder.space.shapes._bounds import bounds

TURN, RISE = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 513), np.linspace(0.0, np.pi, 257))
DISC = np.stack([np.cos(TURN[0]), np.sin(TURN[0]), 0.0 * TURN[0]], -1)
BALL = np.stack([np.sin(RISE) * np.cos(TURN), np.sin(RISE) * np.sin(TURN), np.cos(RISE)], -1)
CORNERS = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), -1).reshape(-1, 3)
UP = np.array([0.0, 0.0, 1.0])
CANONICAL = {
    Ellipsoids: BALL.reshape(-1, 3),
    Boxes: CORNERS,
    Cylinders: np.concatenate([DISC - UP, DISC + UP]),
    Discs: DISC,
    Rectangles: CORNERS * [1.0, 1.0, 0.0],
    Triangles: np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
}


@pytest.mark.parametrize("kind", CANONICAL)
def test_a_box_touches_its_shape_on_all_sides(kind):
    random = np.random.default_rng(1)
    group = kind(random.normal(size=(5, 3)), random.normal(size=(5, 3, 3)))
    moved = np.einsum("nij,kj->nki", np.asarray(group.axes), CANONICAL[kind])
    points = np.asarray(group.center)[:, None] + moved
    low, high = bounds(group)
    near = 2.0 * np.ptp(points, axis=1).max() * (np.pi / 512) ** 2  # round shapes are polygons here
    np.testing.assert_allclose(low, points.min(1), rtol=0.0, atol=near)
    np.testing.assert_allclose(high, points.max(1), rtol=0.0, atol=near)
    assert np.all(low <= points.min(1) + 1e-12)
    assert np.all(high >= points.max(1) - 1e-12)


def test_a_plane_ends_only_along_its_normal():
    flat = Planes((1.0, 2.0, 3.0), np.eye(3))
    low, high = bounds(flat)
    np.testing.assert_array_equal(low, [[-np.inf, -np.inf, 3.0]])
    np.testing.assert_array_equal(high, [[np.inf, np.inf, 3.0]])
