"""Shapes made from points: polylines, boxes and smooth closed curves."""

from __future__ import annotations

from typing import Any

import numpy as np

from firstorder._argument_checks import check_count, check_shape, is_concrete, nan_unless
from firstorder.flatland.shapes.kinds import Curves, Segments
from firstorder.numerics._host import hosted
from firstorder.typing import as_float


def polyline(points: Any, closed: bool = False) -> Segments:
    """Segments from point to point, in order; `closed` adds the one back to the first.

    Clockwise travel gives a closed polyline outward normals.

    Raises:
        ValueError: if there are fewer than two points.

    Example:
        >>> from firstorder.flatland import polyline
        >>> polyline([(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]).count
        2
    """
    p = as_float(points)
    if p.ndim != 2 or p.shape[0] < 2 or p.shape[1] != 2:
        raise ValueError(f"Argument `points` must have shape (n > 1, 2), but has {p.shape}.")
    xp, p = hosted(p)
    if closed:
        p = xp.concatenate([p, p[:1]])
    return Segments(p[:-1], p[1:])


def box(low: Any, high: Any, inward: bool = False) -> Segments:
    """Four segments around a rectangle: left, top, right, bottom; a room if normals are `inward`.

    An inward box is travelled counter-clockwise: bottom, right, top, left.

    Args:
        low: the lower left corner, shape (2,) [m].
        high: the upper right one, shape (2,) [m].
        inward: whether normals point inward.

    Raises:
        ValueError: if `high` is not above `low` in both coordinates; NaN where they are traced.

    Example:
        >>> from firstorder.flatland import box
        >>> box((0.0, 0.0), (2.0, 1.0)).count
        4
    """
    xp, low, high = hosted(as_float(low), as_float(high))
    check_shape("low", low, (2,))
    check_shape("high", high, (2,))
    if is_concrete((low, high)) and not np.all(np.asarray(high) > np.asarray(low)):
        raise ValueError("Argument `high` must be above `low` in both coordinates, but is not.")
    high = nan_unless(high > low, high)
    (x0, y0), (x1, y1) = low, high
    corners = [(x0, y0), (x0, y1), (x1, y1), (x1, y0)]
    if inward:
        corners = [corners[0], corners[3], corners[2], corners[1]]
    return polyline(xp.stack([xp.stack(c) for c in corners]), closed=True)


def closed_curve(points: Any, harmonics: int = 16, samples: int = 64) -> Curves:
    """The smooth closed curve through points at equal steps of the parameter, clockwise.

    Args:
        points: shape (m, 2), not repeating the first at the end, m > 2 harmonics; may be traced
            [m].
        harmonics: highest frequency kept.
        samples: pieces in which roots are bracketed.

    Raises:
        ValueError: if there are too few points, or a count is no positive integer.

    Example:
        >>> import numpy as np
        >>> from firstorder.flatland import closed_curve
        >>> a = 2 * np.pi * np.arange(64) / 64
        >>> bean = closed_curve(np.stack([np.cos(a), np.sin(a) + 0.3 * np.cos(2 * a)], -1), 4)
        >>> bean.count
        1
    """
    check_count("harmonics", harmonics)
    p = as_float(points)
    if p.ndim != 2 or p.shape[1] != 2 or p.shape[0] <= 2 * harmonics:
        raise ValueError(
            f"Argument `points` must have shape (m > {2 * harmonics}, 2), but has {p.shape}."
        )
    xp, p = hosted(p)
    x, y = (p - p[0]).T  # far from the origin products of coordinates lose the area
    leftwards = xp.sum(x * xp.roll(y, -1) - y * xp.roll(x, -1)) > 0.0
    F = xp.fft.rfft(xp.where(leftwards, p[::-1], p), axis=0)[: harmonics + 1] / p.shape[0]
    scale = np.where(np.arange(harmonics + 1) == 0, 1.0, 2.0)[:, None]
    return Curves(scale * F.real, -scale * F.imag, samples)
