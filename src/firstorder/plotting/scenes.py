"""Simple scenes of flatland: surfaces, blockers and rays, with equal axes."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from firstorder.conventions import direction
from firstorder.typing import as_float

_INK = "0.15"


def map_axes(ax: Axes, title: str = "") -> Axes:
    """Turns axes into a map: equal units, no frame.

    Args:
        ax: that becomes a map.
        title: written above.

    Example:
        >>> from firstorder.plotting import map_axes, panels
        >>> figure, axes = panels()
        >>> map_axes(axes[0, 0]).get_aspect()
        1.0
    """
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.set_title(title, loc="left")
    return ax


def draw_surface(ax: Axes, points, *, depth: float = 0.06) -> None:
    """Draws a receiver through `points` (n, 2), from left to right, hatched below.

    Args:
        ax: where to draw.
        points: shape (n, 2) [m].
        depth: of the hatching [m].

    Raises:
        ValueError: if there are not two different points.

    Example:
        >>> from firstorder.plotting import draw_surface, panels
        >>> figure, axes = panels()
        >>> draw_surface(axes[0, 0], [(0.0, 0.0), (0.5, 0.1), (1.0, 0.0)])
        >>> len(axes[0, 0].lines)
        1
    """
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or not len(points):
        raise ValueError(f"Argument `points` must have shape (n, 2), but has {points.shape}.")
    same = np.all(points[1:] == points[:-1], axis=1)  # a place given twice has no direction
    points = points[np.concatenate([[True], ~same])]
    if len(points) < 2:
        raise ValueError("Argument `points` must hold two different places, but does not.")
    across = np.gradient(points, axis=0)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    turns = length == 0.0  # straight back: the way that it came
    across = np.where(turns, points - np.roll(points, 1, 0), across)
    down = np.stack([across[:, 1], -across[:, 0]], -1)
    below = points + depth * down / np.linalg.norm(down, axis=1, keepdims=True)
    band = np.concatenate([points, below[::-1]])
    ax.fill(*band.T, facecolor="0.92", edgecolor="0.6", hatch="////", linewidth=0)
    ax.plot(*points.T, color=_INK, linestyle="-", linewidth=1.6)


def draw_rays(ax: Axes, origins, angles, lengths, *, color="#c2410c", arrows: bool = False) -> None:
    """Draws rays from `origins` (n, 2) at `angles` counter-clockwise from +y.

    Args:
        ax: where to draw.
        origins: where the rays begin, one or one for each, in metres.
        angles: as in `conventions.direction`, one or one for each, in radians.
        lengths: how far they are drawn, in metres.
        color: of the lines.
        arrows: a head at the far end, the way the angle points.

    Example:
        >>> from firstorder.plotting import draw_rays, panels
        >>> figure, axes = panels()
        >>> draw_rays(axes[0, 0], (0.0, 0.0), [-0.5, 0.0, 0.5], 1.0)
        >>> len(axes[0, 0].lines)
        3
    """
    along = np.asarray(direction(jnp.atleast_1d(as_float(angles))))
    origins, along = np.broadcast_arrays(np.asarray(origins, dtype=float), along)
    ends = origins + along * np.reshape(lengths, (-1, 1))
    for a, b in zip(origins, ends, strict=True):
        if arrows:
            head = {"arrowstyle": "-|>", "color": color, "linewidth": 0.9}
            ax.annotate("", xy=tuple(b), xytext=tuple(a), arrowprops=head)
        ax.plot(*np.stack([a, b]).T, color=color, linestyle="-", linewidth=0.0 if arrows else 0.9)
