"""What `.plot()` of scenes, fields, spectra and caches draws.

These classes lie below `plotting` and know nothing of it: they ask `firstorder._display`, which
imports this module when somebody asks. What `Path.plot` draws, a figure, is in `_plot_paths`.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes

from firstorder import flatland, space
from firstorder.caching import Cache
from firstorder.fields import Field, Spectrum
from firstorder.plotting._plot_caches import plot_cache
from firstorder.plotting._plot_light import plot_field, plot_spectrum
from firstorder.plotting._plot_scenes import plot_flatland, plot_space
from firstorder.plotting.style import house_style, panels


def plot(thing: Any, ax: Axes | None = None, **options: Any) -> Axes:
    """Draws a thing on axes, or on new ones in the house style, and returns them.

    Raises:
        ValueError: if it is no one thing of numbers over one or two coordinates.
    """
    if ax is not None:
        draw(ax, thing, **options)
        return ax
    with house_style():
        new = panels(1, 1, 4.2, 3.4)[1][0, 0]
        draw(new, thing, **options)
    return new


def draw(ax: Axes, thing: Any, **options: Any) -> None:
    """The thing on the axes, by its kind."""
    match thing:
        case flatland.Scene():
            plot_flatland(ax, thing, **options)
        case space.Scene():
            plot_space(ax, thing, **options)
        case Field():
            plot_field(ax, thing, **options)
        case Spectrum():
            plot_spectrum(ax, thing, **options)
        case Cache():
            plot_cache(ax, thing, **options)
        case _:
            raise TypeError(f"Nothing is known of how to draw a {type(thing).__name__}.")
