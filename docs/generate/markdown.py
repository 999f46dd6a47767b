r"""Pieces of Markdown, as MyST reads it.

Example:
    >>> from docs.generate.markdown import escaped, label
    >>> label("R07", "fig2.warp")
    'r07-fig2-warp'
    >>> escaped("|theta| < 1, `a < b`")
    '|theta| \\< 1, `a < b`'
    >>> escaped("*incoming* light, a * b")
    '*incoming* light, a \\* b'
"""

from __future__ import annotations

import os
import pathlib
import re
from collections.abc import Iterable, Sequence

ROOT = pathlib.Path(__file__).parents[2]
GENERATED = "docs/_generated"


def label(*parts: str) -> str:
    """A label of small letters, digits and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", "-".join(parts).lower()).strip("-")


def escaped(text: str, cell: bool = False) -> str:
    """Plain words: what Markdown would read as more is escaped, but for `code` and *emphasis*.

    Args:
        text: words, with code between single backticks.
        cell: whether it stands in a table, which a bar would end.
    """
    parts = re.split(r"(`[^`]*`|(?<![\w*])\*\w[^*`]*\w\*(?![\w*]))", text)
    plain = (re.sub(r"([<$\[\]*_^~{}\\])", r"\\\1", p) for p in parts[::2])
    parts[::2] = list(plain)
    joined = "".join(parts)
    return re.sub(r"\s+", " ", joined.replace("|", r"\|")) if cell else joined


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; cells are Markdown already."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def fence(text: str, language: str = "text") -> str:
    """A block of code."""
    return f"```{language}\n{text.strip()}\n```"


def mathematics(latex: str) -> str:
    """A formula on a line of its own."""
    return fence(latex, "{math}")


def toctree(pages: Iterable[str], hidden: bool = False) -> str:
    """The list of pages below this one, shown here or only in the margin."""
    return "\n".join(["```{toctree}", ":hidden:" if hidden else ":maxdepth: 1", "", *pages, "```"])


def page(title: str, *parts: str) -> str:
    """A title and paragraphs; empty ones are left out."""
    return "\n\n".join([f"# {title}", *(part for part in parts if part)]) + "\n"


def file_link(file: pathlib.Path, folder: str = "") -> str:
    """A link to a copy of a file of the repository, from a page in a folder of generated ones."""
    shown = file.relative_to(ROOT).as_posix()
    there = os.path.relpath(file, ROOT / GENERATED / folder)
    return f"{{download}}`{shown} <{pathlib.PurePath(there).as_posix()}>`"


def quoted(code: str) -> str:
    """Code inside a line, whatever backticks it has."""
    return f"`` {code} ``" if "`" in code else f"`{code}`"
