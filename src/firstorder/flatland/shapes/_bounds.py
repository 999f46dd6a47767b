"""Boxes around shapes of flatland, by NumPy: for words and pictures, not for tracing."""

from __future__ import annotations

import numpy as np

from firstorder.conventions import direction
from firstorder.flatland.shapes.kinds import Arcs, Circles, Curves, Ellipses, Segments, Shape

SAMPLES = 257  # along arcs and curves, whose highest points lie between two of them


def bounds(group: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates of each shape of a kind, shape (n, 2) each [m].

    Exact for segments, circles and ellipses; of the points of a fine polygon for the others.

    Example:
        >>> from firstorder.flatland import Circles
        >>> from firstorder.flatland.shapes._bounds import bounds
        >>> low, high = bounds(Circles((1.0, 2.0), 0.5))
        >>> low.tolist(), high.tolist()
        ([[0.5, 1.5]], [[1.5, 2.5]])
    """
    match group:
        case Segments():
            points = np.stack([group.start, group.end], 1)
        case Circles():
            return _about(group.center, np.asarray(group.radius)[:, None])
        case Ellipses():
            c, s = np.cos(group.tilt), np.sin(group.tilt)
            turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], 1)
            return _about(group.center, np.linalg.norm(turn * group.semi[:, None, :], axis=-1))
        case Arcs():
            start, sweep = np.asarray(group.start), np.asarray(group.sweep)
            angle = start[:, None] + sweep[:, None] * np.linspace(0.0, 1.0, SAMPLES)
            around = group.radius[:, None, None] * direction(angle)
            points = np.asarray(group.center)[:, None] + around
        case _:
            assert isinstance(group, Curves)
            k = np.arange(group.cosines.shape[1])
            angle = 2.0 * np.pi * np.linspace(0.0, 1.0, SAMPLES)[:, None] * k
            points = np.cos(angle) @ np.asarray(group.cosines)
            points = points + np.sin(angle) @ np.asarray(group.sines)
    points = np.asarray(points)
    return points.min(1), points.max(1)


def _about(center, half) -> tuple[np.ndarray, np.ndarray]:
    center, half = np.asarray(center), np.asarray(half)
    return center - half, center + half
