"""Pictures of irradiance caches: records on a line or a surface, their regions, their limits."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.image import AxesImage

from firstorder.caching import Cache, taylor
from firstorder.plotting.style import COLOURS, MAGNITUDE

_INK = {0: COLOURS[1], -1: COLOURS[2], 1: COLOURS[4]}
_MARKS = {0: "o", -1: "^", 1: "s"}


def _check_dims(cache: Cache, dims: int) -> None:
    """Refuse records of a surface where those of a line are drawn, and the other way round."""
    if cache.records.dims != dims:
        words = "along a line" if dims == 1 else "on a plane"
        raise ValueError(f"Argument `cache` must have its records {words}, but has not.")


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

    Raises:
        ValueError: if the records are not along a line.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Cache, Candidates, circular_regions
        >>> from firstorder.plotting import draw_records, panels
        >>> some = Candidates.from_function(jnp.cos, jnp.array([0.0, 1.0]))
        >>> reach = circular_regions(jnp.array([0.8, 9.0]), 0.1, 1.0)
        >>> figure, axes = panels()
        >>> draw_records(axes[0, 0], Cache.of(some, reach))
        >>> len(axes[0, 0].collections)
        3
    """
    _check_dims(cache, 1)
    x, R = np.asarray(cache.records.position)[:, 0] + origin, np.asarray(cache.region.radius)
    y = height - step * np.arange(len(x))
    clamp = np.broadcast_to(np.asarray(cache.region.clamp), x.shape)
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

    Raises:
        ValueError: for another order than 0, 1 or 2, a Hessian that is missing, or records that are
            not along a line.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Cache, Candidates, circular_regions
        >>> from firstorder.plotting import draw_expansions, panels
        >>> some = Candidates.from_function(jnp.cos, jnp.array([0.0, 1.0]))
        >>> cache = Cache.of(some, circular_regions(jnp.array([0.8, 9.0]), 0.1, 1.0))
        >>> figure, axes = panels()
        >>> draw_expansions(axes[0, 0], cache)
        >>> len(axes[0, 0].lines)
        2
    """
    _check_dims(cache, 1)
    order = cache.order if order is None else order
    for i, R in enumerate(np.asarray(cache.region.radius)):
        one = cache.records.at(i)
        dx = np.linspace(-1.0, 1.0, 61) * R
        E = np.asarray(taylor(one.value, one.gradient, one.hessian, dx[:, None], order))
        ax.plot(float(one.position[0]) + dx, E, "-", color=color or COLOURS[2], linewidth=1.1)


def _draw_ellipses(
    ax: Axes,
    cache: Cache,
    *,
    scale: float = 0.5,
    color: str = "white",
    linewidth: float = 0.4,
    dots: float = 1.0,
) -> EllipseCollection:
    """Draws the records of a surface as ellipses, and as points if these have a size.

    Args:
        ax: where to draw; its coordinates are those of the plane [m].
        cache: the records.
        scale: of the ellipses: 1 for their reach; J12 draws halves, which overlap less.
        color: of lines and points.
        linewidth: of the ellipses [pt].
        dots: area of the points [pt^2]; none if zero.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Cache, Candidates, circular_regions
        >>> from firstorder.plotting import panels
        >>> from firstorder.plotting.caches import _draw_ellipses
        >>> some = Candidates.of(jnp.zeros((1, 2)), jnp.ones(1), jnp.zeros((1, 2)))
        >>> reach = circular_regions(jnp.array([0.5]), 0.1, 1.0, dims=2)
        >>> figure, axes = panels()
        >>> drawn = _draw_ellipses(axes[0, 0], Cache.of(some, reach))
        >>> len(drawn.get_offsets())
        1
    """
    lengths, angle = cache.region.axes()
    x = np.asarray(cache.records.position)
    sizes = 2.0 * scale * lengths
    drawn = EllipseCollection(
        sizes[:, 0], sizes[:, 1], np.degrees(angle), units="xy", offsets=x,
        offset_transform=ax.transData, facecolors="none", edgecolors=color, linewidths=linewidth,
    )  # fmt: skip
    ax.add_collection(drawn)
    if dots > 0.0:
        ax.scatter(x[:, 0], x[:, 1], s=dots, color=color, linewidths=0.0, zorder=3)
    return drawn


def show_cache(
    ax: Axes,
    cache: Cache,
    error: np.ndarray,
    extent: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0),
    *,
    top: float | None = None,
    scale: float = 0.5,
    cmap: str = MAGNITUDE,
) -> AxesImage:
    """Draws the error of every pixel, and the ellipses of the records over it.

    Args:
        ax: where to draw.
        cache: the records.
        error: modulus of the error (rows, columns), the first row at the bottom.
        extent: left, right, bottom and top of the image [m].
        top: error that gets the brightest colour; the largest if not given.
        scale: of the ellipses, 1 for their reach.
        cmap: of the errors.

    Returns:
        The image, for a colour bar.

    Raises:
        ValueError: if the records are not on a plane.

    Example:
        >>> import jax.numpy as jnp
        >>> import numpy as np
        >>> from firstorder.caching import Cache, Candidates, circular_regions
        >>> from firstorder.plotting import panels, show_cache
        >>> some = Candidates.of(jnp.zeros((1, 2)), jnp.ones(1), jnp.zeros((1, 2)))
        >>> cache = Cache.of(some, circular_regions(jnp.array([0.5]), 0.1, 1.0, dims=2))
        >>> figure, axes = panels()
        >>> show_cache(axes[0, 0], cache, np.eye(4), top=2.0).get_clim()
        (0.0, 2.0)
    """
    _check_dims(cache, 2)
    image = ax.imshow(
        np.asarray(error), extent=extent, origin="lower", vmin=0.0, vmax=top, cmap=cmap
    )
    _draw_ellipses(ax, cache, scale=scale)
    ax.set_xlim(extent[:2])
    ax.set_ylim(extent[2:])
    return image
