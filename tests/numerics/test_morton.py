"""Morton's curve: points that follow each other on it lie together."""

import numpy as np

from firstorder.numerics._morton import morton


def test_bits_of_the_cells_in_turns():
    corners = [(0, 0, 0), (1024, 1024, 1024)]  # so that a cell is 1
    cells = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (2, 3, 0), (1023, 1023, 1023)]
    numbers = morton(np.array([*corners, *cells], float))
    assert numbers.tolist() == [0, 2**30 - 1, 1, 2, 4, 2 + 8 + 16, 2**30 - 1]


def test_neighbours_on_the_curve_are_near():
    points = np.random.default_rng(0).uniform(size=(4096, 3))
    along = points[np.argsort(morton(points))]
    steps = np.linalg.norm(np.diff(along, axis=0), axis=1)
    assert np.median(steps) < 0.1  # 0.66 in any order; 1 / 16 is the mean spacing


def test_points_in_one_plane_or_place():
    flat = np.array([[0.0, 0, 5], [1, 0, 5], [0, 1, 5]])
    assert len(set(morton(flat).tolist())) == 3
    assert morton(np.zeros((2, 3))).tolist() == [0, 0]
