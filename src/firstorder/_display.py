"""How things show themselves: in print, by their formulas in notebooks, by pictures where asked.

Jupyter and marimo ask an object for `_repr_html_` or `_repr_markdown_`, and a user for `plot`. What
the answer is, is found by `firstorder.symbolic`, which brings SymPy, and by `firstorder.plotting`,
which brings matplotlib; both lie above all that shows itself. They are therefore imported when
somebody asks, and nowhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import numpy as np

from firstorder._argument_checks import is_concrete

if TYPE_CHECKING:
    from firstorder.plotting._axes import Axes
    from firstorder.plotting._plot_paths import Figure
else:
    Axes = Figure = Any


FEW = 12  # numbers of an array that are printed; of more its shape
ROWS = 40  # of a table that are printed; of more the first and the last


def in_print(self: Any) -> str:
    """A pytree with the numbers of its small arrays; a named tuple takes it as its `__repr__`.

    Example:
        >>> from firstorder.transport import Travel
        >>> Travel(2.0)
        Travel(d=2)
    """
    return eqx.tree_pformat(jax.tree.map(_with_numbers, self))


class Module(eqx.Module):
    """Equinox's module, whose small arrays print their numbers: the base of every class of ours.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder._display import Module
        >>> class Place(Module):
        ...     x: float
        ...     n: jnp.ndarray
        >>> Place(0.5, jnp.asarray([0.6, 0.8]))
        Place(x=0.5, n=[0.6, 0.8])
    """

    __repr__ = in_print


def table(lines: Sequence[str]) -> str:
    """A table from its head and its rows; in the place of those in the middle how many they are.

    Example:
        >>> from firstorder._display import table
        >>> print(table(["x", "1", "2"]))
        x
        1
        2
    """
    head, *rows = lines
    if len(rows) > ROWS:
        rows[ROWS // 2 : -ROWS // 2] = [f"... {len(rows) - ROWS} more"]
    return "\n".join([head, *rows])


class _Text:
    """A leaf that prints as it is written."""

    def __init__(self, text: str):
        self.text = text

    def __repr__(self) -> str:
        return self.text


def _with_numbers(leaf: Any) -> Any:
    """A leaf as it is printed: the numbers of a small concrete array, anything else as it is."""
    if not isinstance(leaf, (np.ndarray, jax.Array)) or not 0 < leaf.size <= FEW:
        return leaf
    number = getattr(leaf.dtype, "kind", None) in (*"iufc",)  # keys of random numbers have no kind
    if not number or not is_concrete(leaf) or getattr(leaf, "is_deleted", bool)():
        return leaf
    return _Text(_written(np.asarray(leaf).tolist()))


def _written(number: Any) -> str:
    """A number to six digits, or a list of them."""
    if isinstance(number, list):
        return f"[{', '.join(map(_written, number))}]"
    return str(number) if isinstance(number, int) else f"{number + 0.0:.6g}"


def in_notebook(self: Any) -> str:
    """Markdown with formulas, for a notebook; a class takes it as its `_repr_markdown_`."""
    from firstorder.symbolic._display import markdown

    return markdown(self)


def in_notebook_with_picture(self: Any) -> str:
    """Markdown with formulas and a picture below them; a class takes it as `_repr_markdown_`."""
    from firstorder.plotting._notebooks import image

    return "\n\n".join(filter(None, [in_notebook(self), image(self)]))


def as_picture(self: Any) -> str:
    """Words and a picture, for a notebook; a class takes it as its `_repr_html_`."""
    from firstorder.plotting._notebooks import in_html

    return in_html(self)


def drawn(thing: Any, ax: Axes | None, **options: Any) -> Axes:
    """The thing on axes, new ones if there are none; what the method `plot` of a class returns."""
    from firstorder.plotting._plot_methods import plot

    return plot(thing, ax, **options)


def strip(path: Any, **options: Any) -> Figure:
    """A new figure of a path's portraits; what `plot` of a path returns."""
    from firstorder.plotting._plot_paths import plot_path

    return plot_path(path, **options)
