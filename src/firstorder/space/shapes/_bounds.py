"""Boxes around shapes of space, by NumPy: for words and pictures, not for tracing."""

from __future__ import annotations

import numpy as np

from firstorder.space.shapes.kinds import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Rectangles,
    Shape,
    Triangles,
)


def bounds(group: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates of each shape of a kind, shape (n, 3) each [m]; all exact.

    Planes have no end, but along an axis on which they stand upright.

    Example:
        >>> from firstorder.space import sphere
        >>> from firstorder.space.shapes._bounds import bounds
        >>> low, high = bounds(sphere((1.0, 2.0, 3.0), 0.5))
        >>> low.tolist(), high.tolist()
        ([[0.5, 1.5, 2.5]], [[1.5, 2.5, 3.5]])
    """
    center, axes = np.asarray(group.center), np.asarray(group.axes)
    round_part, straight = np.linalg.norm(axes[..., :2], axis=-1), np.abs(axes)
    match group:
        case Ellipsoids():
            half = np.linalg.norm(axes, axis=-1)
        case Boxes():
            half = straight.sum(-1)
        case Cylinders():
            half = round_part + straight[..., 2]
        case Discs():
            half = round_part
        case Rectangles():
            half = straight[..., :2].sum(-1)
        case Triangles():
            corners = center + np.stack([0.0 * center, axes[..., 0], axes[..., 1]])
            return corners.min(0), corners.max(0)
        case _:
            half = np.where(straight[..., :2].sum(-1) > 0.0, np.inf, 0.0)
    return center - half, center + half
