"""A Sphinx extension: the list of pages beside each page, made of titles from the start.

The theme shows titles only, but Sphinx copies the headings and names of every page for each page
and throws them away afterwards: two fifths of the time of a build.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from docutils import nodes
from sphinx import addnodes


def titles(toc: nodes.Element) -> nodes.Element:
    """The contents of a page without what lies below its title, but for the pages listed there."""
    short = toc.deepcopy()
    for top in short.children:
        if isinstance(top, nodes.Element) and len(top) > 1:
            listed = list(top.findall(addnodes.toctree))
            if listed:
                top[1][:] = listed
            else:
                top.pop(1)
    return short


def _shortened(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Make the function by which the theme asks for the list work on titles."""
    whole = context.get("toctree")
    if whole is not None:
        context["toctree"] = _on_titles(app, whole)


def _on_titles(app: Any, whole: Callable[..., Any]) -> Callable[..., Any]:
    def asked(**options: Any) -> Any:
        env = app.env
        if not options.get("titles_only"):
            return whole(**options)
        if not hasattr(app, "titles_of_pages"):
            app.titles_of_pages = {name: titles(toc) for name, toc in env.tocs.items()}
        kept, env.tocs = env.tocs, app.titles_of_pages
        try:
            return whole(**options)
        finally:
            env.tocs = kept

    return asked


def setup(app: Any) -> dict[str, Any]:
    """Stand before the theme, which asks at the usual priority."""
    app.connect("html-page-context", _shortened, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
