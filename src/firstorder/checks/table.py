"""The table law x portrait (R07 Fig. 2), measured: each cell a square with its verdict and error.

What the code can do is printed by the code: `python -m firstorder.checks.table` writes the table
of the documentation (`docs/portraits.md`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from firstorder.checks.registry import all_cases
from firstorder.checks.squares import PORTRAITS, Square, square

# In the order of R07 Fig. 2.
LAWS = ("multiply", "integrate", "convolve", "move", "warp")

Table = dict[str, dict[str, Square]]


def measure(names: Iterable[str] = LAWS) -> Table:
    """Walks the squares of the named cases.

    Args:
        names: of cases in the registry; the five laws if left out.

    Returns:
        For each name and portrait the square: verdict, normwise error, reason of a refusal.

    Raises:
        ValueError: if no case has such a name.
    """
    known = all_cases()
    for name in names:
        if name not in known:
            raise ValueError(f"Argument `names` must name cases, but {name!r} is none.")
    return {name: {p: square(known[name], p) for p in PORTRAITS} for name in names}


def _words(s: Square) -> str:
    """A cell in words: the verdict, and the order of magnitude of its error.

    Example:
        >>> from firstorder.checks import Square
        >>> _words(Square("move", "value", "equal", 3.2e-16))
        'equal (1e-16)'
    """
    if s.error is None:
        return s.verdict
    if s.error == 0.0:
        return f"{s.verdict} (0)"
    return f"{s.verdict} (1e{math.floor(math.log10(s.error)):d})"


def _refusals(table: Table) -> dict[str, list[str]]:
    """Each reason of a refusal, with the cells that it speaks for."""
    found: dict[str, list[str]] = {}
    for name, row in table.items():
        for portrait, s in row.items():
            if s.verdict == "refused":
                found.setdefault(s.reason, []).append(f"{name} / {portrait}")
    return found


def as_text(table: Table) -> str:
    """The table for a terminal, the reasons of refusals below it.

    Example:
        >>> from firstorder.checks.squares import PORTRAITS, Square
        >>> row = {p: Square("move", p, "equal", 1e-16) for p in PORTRAITS}
        >>> print(as_text({"move": row}).splitlines()[1].split()[:3])
        ['move', 'equal', '(1e-16)']
    """
    lines = [["", *PORTRAITS]] + [[name, *map(_words, row.values())] for name, row in table.items()]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    body = ["  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)) for line in lines]
    why = [f"refused: {reason} ({', '.join(cells)})" for reason, cells in _refusals(table).items()]
    return "\n".join([line.rstrip() for line in body] + why)


def as_markdown(table: Table) -> str:
    """The table in Markdown; a refusal points to its reason below.

    Example:
        >>> from firstorder.checks.squares import PORTRAITS, Square
        >>> row = {p: Square("warp", p, "refused", None, "no formula") for p in PORTRAITS}
        >>> as_markdown({"warp": row}).splitlines()[2]
        '| warp | refused¹ | refused¹ | refused¹ | refused¹ | refused¹ | refused¹ |'
    """
    marks = {reason: _superscript(i + 1) for i, reason in enumerate(_refusals(table))}
    lines = ["| law | " + " | ".join(PORTRAITS) + " |", "|---" * (len(PORTRAITS) + 1) + "|"]
    for name, row in table.items():
        cells = [_words(s) + marks.get(s.reason if s.verdict == "refused" else "", "")
                 for s in row.values()]  # fmt: skip
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    if marks:
        lines += ["", *(f"{mark} {reason}  " for reason, mark in marks.items())]
    return "\n".join(lines)


def read_verdicts(rendered: str) -> dict[str, tuple[str, ...]]:
    r"""Names and verdicts read back from `as_markdown`: what must not be stale (errors may move).

    Example:
        >>> read_verdicts("| law | value |\n|---|---|\n| move | equal (1e-16) |")
        {'move': ('equal',)}
    """
    rows = [line.strip("| \n").split(" | ") for line in rendered.splitlines() if " | " in line]
    return {
        row[0]: tuple(re.match(r"[a-z]*", cell)[0] for cell in row[1:])  # type: ignore[index]
        for row in rows
        if row[0] != "law"
    }


def _superscript(n: int) -> str:
    return str(n).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))


if __name__ == "__main__":
    from firstorder import session

    session.start()
    print(as_markdown(measure()))
