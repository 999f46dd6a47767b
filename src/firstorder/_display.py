"""How things show themselves: by their formulas in notebooks, by their pictures where asked.

Jupyter and marimo ask an object for `_repr_html_` or `_repr_markdown_`, and a user for `plot`. What
the answer is, is found by `firstorder.symbolic`, which brings SymPy, and by `firstorder.plotting`,
which brings matplotlib; both lie above all that shows itself. They are therefore imported when
somebody asks, and nowhere else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from firstorder.plotting._axes import Axes
else:
    Axes = Any


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
    from firstorder.plotting._at_hand import plot

    return plot(thing, ax, **options)
