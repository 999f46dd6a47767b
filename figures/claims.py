"""The table of claims: what the papers say beside what we measure.

A record is one object of `claims.json`: `figure`, `claim`, `paper`, `measured`, `unit`, `holds`,
`seconds`, `size`, `seed`. Those of the last full run are kept in `figures/claims.json`.
"""

from __future__ import annotations

import json
import pathlib
import textwrap
from typing import Any

Record = dict[str, Any]

FOLDER = pathlib.Path(__file__).parent
KEPT = FOLDER / "claims.json"
_MACHINERY = {"style", "claims"}
HOLDS = {True: "yes", False: "NO", None: "-"}


def names() -> list[str]:
    """Names of all figures: the scripts beside this file."""
    found = (f.stem for f in FOLDER.glob("*.py"))
    return sorted(n for n in found if not n.startswith("_") and n not in _MACHINERY)


def kept() -> list[Record]:
    """Claims of the last full run that was kept."""
    return json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else []


def quantity(value: float | str | None, unit: str) -> str:
    """A value with its unit, three digits."""
    if value is None:
        return "-"
    words = value if isinstance(value, str) else f"{value:.3g}"
    return f"{words} {unit}".strip()


def table(records: list[Record], width: int = 100) -> str:
    """The claims for a terminal: claim beside measured, and whether it holds."""
    rows = [("figure", "holds", "paper", "measured", "claim")]
    rows += [
        (
            r["figure"],
            HOLDS[r["holds"]],
            quantity(r["paper"], r["unit"]),
            quantity(r["measured"], r["unit"]),
            r["claim"],
        )
        for r in records
    ]
    widths = [min(26, max(len(row[i]) for row in rows)) for i in range(4)]
    widths.append(max(30, width - sum(widths) - 2 * len(widths)))
    lines: list[str] = []
    for row in rows:
        cells = [textwrap.wrap(c, w) or [""] for c, w in zip(row, widths, strict=True)]
        for k in range(max(map(len, cells))):
            parts = (
                (c[k] if k < len(c) else "").ljust(w) for c, w in zip(cells, widths, strict=True)
            )
            lines.append("  ".join(parts).rstrip())
    lines.insert(1, "-" * width)
    return "\n".join(lines)
