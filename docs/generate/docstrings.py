r"""Docstrings as Markdown: paragraphs, lists of arguments, and examples.

Example:
    >>> from docs.generate.docstrings import told
    >>> print(told("Sum of two.\n\nArgs:\n    a: the first,\n        a number.\n    b: other."))
    Sum of two.
    <BLANKLINE>
    **Args**
    <BLANKLINE>
    - `a`: the first, a number.
    - `b`: other.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Mapping

from docs.generate.markdown import escaped, fence

LISTED = ("Args", "Attributes", "Raises", "Returns", "Yields")
HEADS = re.compile(rf"({'|'.join(LISTED)}|Example|Reference|Called):(?:\n| +|$)(.*)", re.S)
_ENTRY = re.compile(r"(\*{0,2}\w[\w.]*(?:, \*{0,2}\w[\w.]*)*): (.*)", re.S)


def told(
    docstring: str,
    linked: Callable[[str], str] = lambda text: text,
    types: Mapping[str, str] | None = None,
) -> str:
    """A docstring as Markdown.

    Args:
        docstring: clean, as `inspect.getdoc` gives it.
        linked: what becomes of words that are Markdown already: code in them may become links.
        types: of arguments, shown beside their names.
    """
    parts = []
    for block in _blocks(docstring):
        head = HEADS.fullmatch(block)
        if head is None:
            parts.append(_paragraph(block, linked))
        elif head[1] in LISTED:
            parts.append(f"**{head[1]}**\n\n{_entries(head[2], linked, types or {})}")
        elif head[1] == "Example":
            parts.append(f"**{head[1]}**\n\n{fence(textwrap.dedent(head[2]), 'pycon')}")
        else:
            parts.append(f"**{head[1]}:** {linked(escaped(_joined(head[2])))}")
    return "\n\n".join(parts)


def _blocks(docstring: str) -> list[str]:
    """Paragraphs; a section, with what is indented below its head, is one block."""
    blocks: list[list[str]] = [[]]
    for line in docstring.strip("\n").splitlines():
        inside = bool(blocks[-1]) and bool(HEADS.match(blocks[-1][0])) and line[:1] in ("", " ")
        if HEADS.match(line) or (not inside and not line.strip()):
            blocks.append([])
        if inside or line.strip():
            blocks[-1].append(line)
    return ["\n".join(lines).strip("\n") for lines in blocks if lines]


def _paragraph(block: str, linked: Callable[[str], str]) -> str:
    """Words, a list, or an indented block, which is code."""
    if all(line.startswith("    ") for line in block.splitlines()):
        return fence(textwrap.dedent(block))
    head, *rest = re.split(r"\n(?=    )", block, maxsplit=1)
    if rest and not head.lstrip().startswith(("-", "*")):  # an indented block below its sentence
        return f"{linked(escaped(head))}\n\n{fence(textwrap.dedent(rest[0]))}"
    return linked(escaped(block))


def _entries(text: str, linked: Callable[[str], str], types: Mapping[str, str]) -> str:
    """Arguments, attributes or errors as a list; words alone as they are."""
    items: list[str] = []
    for line in textwrap.dedent(text).splitlines():
        if line.startswith(" ") and items:
            items[-1] += f" {line.strip()}"
        elif line.strip():
            items.append(line.strip())
    if not all(_ENTRY.fullmatch(item) for item in items):
        return linked(escaped(_joined(text)))
    return "\n".join(_entry(item, linked, types) for item in items)


def _entry(item: str, linked: Callable[[str], str], types: Mapping[str, str]) -> str:
    found = _ENTRY.fullmatch(item)
    assert found is not None
    names, words = found[1].split(", "), linked(escaped(found[2]))
    shown = ", ".join(f"`{n}`" for n in names)
    of = types.get(names[0].lstrip("*"), "")
    return f"- {shown}{f' (`{of}`)' if of else ''}: {words}"


def _joined(text: str) -> str:
    return " ".join(text.split())
