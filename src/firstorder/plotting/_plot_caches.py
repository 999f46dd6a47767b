"""Caches on axes: interpolated irradiance where records reach, and the records themselves."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from firstorder.caching import Cache
from firstorder.caching.regions import CLAMPS
from firstorder.plotting._axes import check_one_of_numbers, colour_bar, label_axes
from firstorder.plotting._plot_light import show_no_value
from firstorder.plotting.caches import _INK, _MARKS, _draw_ellipses
from firstorder.plotting.light import show_light_field
from firstorder.plotting.style import COLOURS

POINTS = 600  # along a line
PIXELS = 160  # along the longer side of a plane
WORDS = {"": "record", "raised": "radius raised", "cut": "radius cut"}


def check_cache(cache: Cache) -> None:
    """Refuse what is not one cache of numbers.

    Raises:
        ValueError: if it is traced, or a batch of caches.
    """
    check_one_of_numbers("cache", cache, "cache", lambda c: c.records.position.shape[:-2])


def plot_cache(ax: Axes, cache: Cache, size: int = 0) -> None:
    """Along a line a curve and the records on it, on a plane an image and their ellipses."""
    check_cache(cache)
    if cache.records.dims == 1:
        _plot_line(ax, cache, size or POINTS)
    else:
        _plot_plane(ax, cache, size or PIXELS)


def pieces(cache: Cache, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Places along a line and irradiance there: NaN where no record reaches, and at every jump.

    Where a record's reach ends the weights of the others step, so a curve has a piece between any
    two such ends.
    """
    x, R = np.asarray(cache.records.position)[:, 0], np.asarray(cache.region.radius)
    ends = np.unique(np.concatenate([x - R, x + R]))
    each = max(3, size // (len(ends) - 1))
    # Just inside of the ends, which themselves are outside.
    inside = np.linspace(0.0, 1.0, each) * (1.0 - 2e-6) + 1e-6
    places = ends[:-1, None] + np.diff(ends)[:, None] * inside
    found = cache(places.reshape(-1, 1))
    covered = np.asarray(found.covered).reshape(places.shape)
    E = np.where(covered, np.asarray(found.value).reshape(places.shape), np.nan)
    gap = np.full((len(places), 1), np.nan)
    return np.hstack([places, ends[1:, None]]).ravel(), np.hstack([E, gap]).ravel()


def _plot_line(ax: Axes, cache: Cache, size: int) -> None:
    x, E = pieces(cache, size)
    ax.plot(x, E, "-", color=COLOURS[1], linewidth=1.2)
    places, value = np.asarray(cache.records.position)[:, 0], np.asarray(cache.records.value)
    clamp = np.broadcast_to(np.asarray(cache.region.clamp), value.shape)
    for code, ink in _INK.items():
        rows = clamp == code
        if rows.any():
            ax.scatter(
                places[rows], value[rows], s=14, color=ink if code else COLOURS[0],
                marker=_MARKS[code], zorder=3, label=WORDS[CLAMPS[code]],
            )  # fmt: skip
    if np.any(clamp):
        ax.legend(loc="best", fontsize=7, frameon=False)
    ax.set(xlabel="arc length $x$ (m)", ylabel="irradiance $E$ (W/m)", xlim=(x.min(), x.max()))


def _plot_plane(ax: Axes, cache: Cache, size: int) -> None:
    places, lengths = np.asarray(cache.records.position), cache.region.axes()[0]
    low, high = (places - lengths[:, :1]).min(0), (places + lengths[:, :1]).max(0)
    step = float((high - low).max()) / size
    axes = [np.arange(a + 0.5 * step, b, step) for a, b in zip(low, high, strict=True)]
    found = cache(np.stack(np.meshgrid(*axes, indexing="ij"), -1))
    E = np.where(np.asarray(found.covered), np.asarray(found.value), np.nan)
    image = show_light_field(ax, E, *axes, names=("x", "y"), equal=True, scale=False)
    show_no_value(ax, E)
    _draw_ellipses(ax, cache, scale=1.0, linewidth=0.3, dots=2.0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    label_axes(ax, ("x", "y"))
    colour_bar(ax, image, "irradiance $E$ (W/m$^2$)")
