"""Labels of axes from the names of coordinates, and scales of colour beside them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from matplotlib.axes import Axes

from firstorder._argument_checks import is_concrete
from firstorder.plotting.style import label


def label_axes(ax: Axes, names: tuple[str, str], spectrum: bool = False) -> None:
    """Puts the names of the two coordinates on the axes."""
    across, up = (f"Omega_{n}" if spectrum else n for n in names)
    ax.set_xlabel(label(across))
    ax.set_ylabel(label(up))


def check_one_of_numbers(name: str, thing: Any, kind: str, batch: Callable[[Any], Any]) -> None:
    """Refuses to draw what is not one thing of numbers.

    Args:
        name: of the argument.
        thing: to be drawn.
        kind: of thing, in a word.
        batch: says how many of them a thing of numbers holds; nothing for one alone.

    Raises:
        ValueError: if it is traced, or a batch.
    """
    if not is_concrete(thing):
        raise ValueError(
            f"Argument `{name}` must hold numbers to be drawn, but is traced or made of symbols: "
            "draw it outside of jit, grad and vmap."
        )
    if several := batch(thing):
        raise ValueError(
            f"Argument `{name}` must be one {kind} to be drawn, but is a batch of {several}: "
            f"draw jax.tree.map(lambda leaf: leaf[0], {name}), or another of them."
        )


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
