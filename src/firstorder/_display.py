"""How laws, events, paths and portraits show themselves in notebooks: by their formulas.

Jupyter and marimo ask an object for `_repr_markdown_`. What the answer says is found by
`firstorder.symbolic`, which lies above all that shows itself and brings SymPy. It is therefore
imported when a notebook asks, and nowhere else. Python's own `repr` is left as it is.
"""

from __future__ import annotations

from typing import Any


def in_notebook(self: Any) -> str:
    """Markdown with formulas, for a notebook; a class takes it as its `_repr_markdown_`."""
    from firstorder.symbolic._display import markdown

    return markdown(self)
