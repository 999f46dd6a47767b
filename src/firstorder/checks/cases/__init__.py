"""Cases on which squares are drawn, with their deliberate faults: one file per law or event.

A folder each for the laws, the events that move light, the events that multiply it, scenes whose
light a law acts on, and light in space. A file lists `CASES` and `FAULTS`; a fault applies to
every case of its file. Brute-force callables share no code with the step they judge.
"""

import numpy as np

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.fields import Gaussian, Grid, gaussian

# Off-centre and correlated: a centred light hides phase errors, an upright one the sign of a shear.
CENTER, SIGMA, CORRELATION = (0.21, -0.13), (0.55, 0.4), 0.35
RAYS = np.array([[0.3, 0.1], [-0.4, 0.25], [0.7, -0.35]])
FREQUENCIES = (np.array([-0.45, -0.1, 0.0, 0.33]), np.array([-0.5, 0.05, 0.4]))
GRID = Grid.spanning((96, 97), (6.0, 5.5))  # even and odd, not square


def light(frame: Frame = FLATLAND) -> Gaussian:
    """The light of most cases."""
    return gaussian(CENTER, SIGMA, CORRELATION, 1.3, frame)


def bell(x, y):
    """Light of the cases in plain NumPy, for brute force; of numbers or of arrays."""
    (cx, cy), (sx, sy), r = CENTER, SIGMA, CORRELATION
    a, b = (x - cx) / sx, (y - cy) / sy
    return 1.3 * np.exp(-0.5 * (a * a - 2.0 * r * a * b + b * b) / (1.0 - r * r))


__all__ = [
    "FLATLAND",
    "FLATLAND_SLOPE",
    "FREQUENCIES",
    "GRID",
    "RAYS",
    "bell",
    "light",
]
