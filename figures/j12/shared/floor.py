"""Panels of the box's floor from above: numbers at its cells, errors of caches, records."""

from __future__ import annotations

import string

import numpy as np
from matplotlib.axes import Axes

from figures.j12.shared.caching import Asked, Outcome
from figures.j12.shared.exact_box import image
from firstorder.plotting.style import COLOURS

UNDER_BLOCK = "0.92"


def show_map(ax: Axes, x: np.ndarray, values, title: str, words: str = "", **options) -> None:
    """Numbers at the middles of equal cells; `words` stand below."""
    ax.imshow(image(x, values), extent=(0, 1, 0, 1), **options)
    ax.set_facecolor(UNDER_BLOCK)
    plain(ax, title, words)


def show_error(ax: Axes, asked: Asked, outcome: Outcome, most: float, title: str, records=True):
    """The signed error of a cache, with its records as dots; the RMS over all orders below."""
    words = f"RMS {outcome.mean:.2e} W/m²"
    miss = outcome.values[0] - asked.truth
    show_map(ax, asked.x, miss, title, words, cmap="RdBu_r", vmin=-most, vmax=most)
    if records:
        show_records(ax, records_of(outcome), color=COLOURS[0], markersize=1.8)


def records_of(outcome: Outcome) -> np.ndarray:
    """Where the records of the first order of insertion lie (m, 2) [m]."""
    return np.asarray(outcome.cache(0).records.position)


def show_records(ax: Axes, x: np.ndarray, **options) -> None:
    """Places as dots."""
    ax.plot(*np.asarray(x).T, ".", markeredgewidth=0.0, **options)


def plain(ax: Axes, title: str, words: str = "") -> None:
    """Axes of the floor, without ticks."""
    ax.set(xticks=[], yticks=[], xlim=(0, 1), ylim=(0, 1), aspect="equal")
    ax.set_title(title, fontsize=8)
    ax.set_xlabel(words, fontsize=7.5)


def scale(axes, label: str = "error (W/m²)") -> None:
    """One colour scale beside a row of panels, all of whose images have that of the last."""
    bar = axes[-1].figure.colorbar(axes[-1].images[0], ax=list(axes), shrink=0.8, pad=0.01)
    bar.set_label(label, fontsize=7.5)
    bar.ax.ticklabel_format(axis="y", scilimits=(-2, 2))
    bar.ax.tick_params(labelsize=7)


def letter(axes) -> None:
    """Names panels a), b), ... in the order of reading."""
    for ax, name in zip(np.ravel(axes), string.ascii_lowercase, strict=False):
        ax.set_title(f"{name}) {ax.get_title()}", fontsize=8)
