"""Labels of axes from the names of coordinates, and scales of colour beside them."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes

from firstorder.plotting.style import label


def label_axes(ax: Axes, names: tuple[str, str], spectrum: bool = False) -> None:
    """Puts the names of the two coordinates on the axes."""
    across, up = (f"Omega_{n}" if spectrum else n for n in names)
    ax.set_xlabel(label(across))
    ax.set_ylabel(label(up))


def colour_bar(ax: Axes, colours: Any, words: str, height: float = 1.0) -> None:
    """A scale of colours to the right of the axes, whose place in the figure stays theirs.

    Args:
        ax: the axes.
        colours: an image or a collection in them.
        words: what the scale is of.
        height: as a share of the axes'.
    """
    beside = ax.inset_axes((1.03, 0.0, 0.045, height))
    ax.figure.colorbar(colours, cax=beside, label=words)
