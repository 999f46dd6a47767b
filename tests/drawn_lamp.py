"""A lamp that is drawn on the ceiling of a room, all of it turned, so that places are rounded."""

import numpy as np

from firstorder.imaging import Lamp, pinhole
from firstorder.space import rectangle

Q = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
Q *= np.sign(np.linalg.det(Q))
HEIGHT = 0.7
LAMP = Lamp(Q @ (0.1, 0.2, HEIGHT), Q @ (0.0, 0.3, 0.0), Q @ (0.2, 0.0, 0.0), 1.0, 8, True)
CAMERA = pinhole(Q @ (0.0, -2.0, 0.35), np.zeros(3), Q @ (0.0, 0.0, 1.0))
# Two places of the floor, in the image.
PLACES = np.array([[0.05, 0.02], [-0.11, 0.07]])


def board(z: float, half: float, up: bool = True):
    """A level square that looks up or down."""
    side = half if up else -half
    return rectangle(Q @ (0.0, 0.0, z), Q @ (half, 0.0, 0.0), Q @ (0.0, side, 0.0))


def corners(z: float, half: float) -> np.ndarray:
    """Those of such a square, one after the other."""
    square = [(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)]
    return np.array(square) @ Q.T
