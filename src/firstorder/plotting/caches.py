"""Irradiance caches: the records of one surface, how far each reaches, and what limited it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from firstorder.methods.caching import Cache, taylor
from firstorder.plotting.style import COLOURS

_INK = {0: COLOURS[1], -1: COLOURS[2], 1: COLOURS[4]}
_MARKS = {0: "o", -1: "^", 1: "s"}


def draw_records(
    ax: Axes, cache: Cache, *, height: float = 0.0, step: float = 0.0, origin: float = 0.0
) -> None:
    """Draws the records of a cache as points with a bar from x - R to x + R.

    Circles are records whose radius nothing limited, triangles those that were raised to the
    smallest radius, squares those that were cut at the largest.

    Args:
        ax: where to draw.
        cache: the records.
        height: of the first record's bar, in the units of the axes.
        step: by which each next bar is lower, so that bars do not hide each other.
        origin: added to the arc lengths [m].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.methods.caching import Cache, Candidates, clamped
        >>> from firstorder.plotting import draw_records, panels
        >>> some = Candidates.along(jnp.cos, jnp.array([0.0, 1.0]))
        >>> figure, axes = panels()
        >>> draw_records(axes[0, 0], Cache.of(some, clamped(jnp.array([0.8, 9.0]), 0.1, 1.0)))
        >>> len(axes[0, 0].collections)
        3
    """
    x, R = np.asarray(cache.x) + origin, np.asarray(cache.radius)
    y = height - step * np.arange(len(x))
    clamp = np.asarray(cache.clamp)
    ax.hlines(y, x - R, x + R, color="0.6", linewidth=0.8)
    for code, ink in _INK.items():
        rows = clamp == code
        if rows.any():
            ax.scatter(x[rows], y[rows], s=12, color=ink, marker=_MARKS[code], zorder=3)


def draw_expansions(ax: Axes, cache: Cache, *, order: int | None = None, color: str = "") -> None:
    """Draws the Taylor expansion of each record over the reach of its radius.

    Args:
        ax: where to draw.
        cache: the records.
        order: of the expansions; that of the cache if not given.
        color: of the curves; the house style's third if not given.
    """
    order = cache.order if order is None else order
    for x, data, R in zip(cache.x, cache.derivatives, cache.radius, strict=True):
        dx = np.linspace(-1.0, 1.0, 61) * float(R)
        E = np.asarray(taylor(data, dx, order))
        ax.plot(float(x) + dx, E, "-", color=color or COLOURS[2], linewidth=1.1)
