"""Light of four coordinates for the squares in space: off-centre, every pair correlated."""

from __future__ import annotations

import numpy as np

from firstorder.conventions import SPACE_SLOPE
from firstorder.fields import Gaussian, Grid

CENTER = np.array([0.21, -0.13, 0.08, -0.17])
# Covariance in primal space: A A^T of a matrix with no zero and no symmetry.
FACTOR = np.array(
    [
        [0.55, 0.10, -0.12, 0.08],
        [-0.15, 0.50, 0.09, -0.11],
        [0.12, -0.14, 0.45, 0.10],
        [0.07, 0.13, -0.16, 0.48],
    ]
)
SPREAD = FACTOR @ FACTOR.T
RAYS = np.array([[0.3, 0.1, -0.2, 0.15], [-0.4, 0.25, 0.3, -0.1]])
FREQUENCIES = (np.array([-0.2, 0.35]), np.array([0.15]), np.array([-0.3, 0.1]), np.array([0.25]))
WIDTHS = 6.5  # half of the box in standard deviations: what lies outside is below 1e-9


def light() -> Gaussian:
    """The light of the cases in space."""
    return Gaussian(CENTER, np.linalg.inv(SPREAD), 1.3, SPACE_SLOPE)


def bell(u, center=CENTER, spread=SPREAD, amplitude=1.3) -> float:
    """Light of the cases in space in plain NumPy, for brute force."""
    h = np.asarray(u) - center
    return amplitude * float(np.exp(-0.5 * h @ np.linalg.solve(spread, h)))


def box(size: int, center, spread) -> Grid:
    """`size` samples along every axis, over 6.5 standard deviations about a centre."""
    deviations = np.sqrt(np.diag(spread))
    sides = tuple(WIDTHS * float(s) for s in deviations)
    return Grid.spanning((size,) * len(sides), sides, tuple(map(float, center)))
