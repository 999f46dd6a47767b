"""A Sphinx extension: formulas as MathML, which browsers draw by themselves, without a network."""

from __future__ import annotations

import html
import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.errors import ExtensionError


def mathml(latex: str, display: str = "inline") -> str:
    """A formula as MathML, with its LaTeX as what is said in its place.

    Raises:
        ExtensionError: if it cannot be read.
    """
    # A bar on one side of a fraction is drawn by a bracket that is not there on the other.
    latex = re.sub(r"\\substack", "", latex)
    try:
        drawn = convert(latex, display=display)
    except Exception as failure:
        raise ExtensionError(f"A formula cannot be drawn: {latex}") from failure
    return drawn.replace("<math ", f'<math alttext="{html.escape(latex)}" ', 1)


def _inline(writer: Any, node: nodes.Element) -> None:
    writer.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.Element) -> None:
    writer.body.append(f'<div class="math">{mathml(node.astext(), "block")}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, Any]:
    """Register the renderer; `html_math_renderer = "mathml"` chooses it."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
