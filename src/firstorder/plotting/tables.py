"""Tables as figures."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

_GROUND = {
    "equal": "#dceee3",
    "approximate": "#fbedc8",
    "refused": "#ececec",
    "unequal": "#f3b6a8",
    "": "white",
}


def draw_table(
    ax: Axes,
    columns: Sequence[str],
    rows: Sequence[str],
    cells: Sequence[Sequence[str]],
    verdicts: Sequence[Sequence[str]] | None = None,
    *,
    wrap: int = 24,
    title: str = "",
) -> None:
    """Draws a table with a head and a stub, each cell tinted by its verdict.

    The verdict must also be among the cell's words: a tint alone is lost in grey.

    Args:
        ax: where to draw; it is filled.
        columns: names of the columns.
        rows: names of the rows.
        cells: words, row by row.
        verdicts: "equal", "approximate", "refused", "unequal" or "" for each cell.
        wrap: longest line of a cell, in letters.
        title: written above.

    Example:
        >>> from firstorder.plotting import draw_table, panels
        >>> figure, axes = panels()
        >>> draw_table(axes[0, 0], ["spectrum"], ["travel"], [["equal"]], [["equal"]])
        >>> sorted(text.get_text() for text in axes[0, 0].texts)
        ['equal', 'spectrum', 'travel']
    """
    ax.set_axis_off()
    ax.set_title(title, loc="left", fontweight="bold")
    wide = len(columns)
    heights = [1.0 + max(_lines(c, wrap) for c in row) for row in cells]
    head = 1.0 + max(_lines(c, wrap) for c in columns)
    full = head + sum(heights)
    stub = 0.12
    column = (1.0 - stub) / wide

    def cell(left, top, width, height, words, ground, weight="normal"):
        box = Rectangle((left, top - height), width, height, facecolor=ground, clip_on=False)
        box.set(edgecolor="0.7", linewidth=0.6)
        ax.add_patch(box)
        ax.text(
            left + 0.5 * width,
            top - 0.5 * height,
            "\n".join(_wrapped(words, wrap)),
            ha="center",
            va="center",
            fontsize=7.5,
            fontweight=weight,
        )

    ax.set(xlim=(0.0, 1.0), ylim=(0.0, full))
    top = full
    for j, name in enumerate(columns):
        cell(stub + j * column, top, column, head, name, "0.85", "bold")
    top -= head
    for i, (name, height) in enumerate(zip(rows, heights, strict=True)):
        cell(0.0, top, stub, height, name, "0.93", "bold")
        for j, words in enumerate(cells[i]):
            ground = _GROUND[verdicts[i][j]] if verdicts else "white"
            cell(stub + j * column, top, column, height, words, ground)
        top -= height


def _wrapped(words: str, wrap: int) -> list[str]:
    return [part for line in words.split("\n") for part in textwrap.wrap(line, wrap) or [""]]


def _lines(words: str, wrap: int) -> int:
    return len(_wrapped(words, wrap))
