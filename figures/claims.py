"""The table of claims: what the papers say beside what we measure.

A record is one object of `claims.json`: `figure`, what `figures.verdicts` tells of a statement or a
measurement (`claim`, `source`, `paper`, `measured`, `error`, `unit`, `rule`, `scanned`, `verdict`,
`reason`), `seconds`, `size`, `seed`. Those of the last full run are kept in `figures/claims.json`,
without the seconds, which are in `figures/seconds.json` and decide what is drawn first; `make
readme` renews both, `CLAIMS.md`, the README and `docs/portraits.md` (`python -m figures.claims`).
"""

from __future__ import annotations

import json
import pathlib
import textwrap
from typing import Any

from PIL import Image

from figures.verdicts import HOLDS, MEASURED, REFUTED, UNDECIDED
from firstorder import io, session
from firstorder.checks import table as laws

Record = dict[str, Any]

FOLDER = pathlib.Path(__file__).parent
KEPT = FOLDER / "claims.json"
SECONDS = FOLDER / "seconds.json"
README = FOLDER.parent / "README.md"
PAGE = FOLDER.parent / "CLAIMS.md"
LAWS = FOLDER.parent / "docs" / "portraits.md"
OURS = "ours"
WIDE = 1200  # pixels of a picture that is kept
_BEGIN, _END = "<!-- begin: {} -->", "<!-- end: {} -->"
# Pictures that the README and the documentation show.
GALLERY = (
    "autodiff_fails", "path", "flatland_scenes", "r07_fig13", "e11_fig01", "d05_fig17_meshes",
)  # fmt: skip


def scripts() -> dict[str, pathlib.Path]:
    """The script of each figure: one a file, in a folder of its paper or in `ours`.

    A figure is called by its paper and its file (`r07_fig03`), one of ours by its file alone.
    """
    found = {}
    for file in FOLDER.glob("*/[!_]*.py"):
        paper = file.parent.name
        found[file.stem if paper == OURS else f"{paper}_{file.stem}"] = file
    return dict(sorted(found.items()))


def names() -> list[str]:
    """Names of all figures."""
    return list(scripts())


def module(name: str) -> str:
    """Dotted name of the module that draws a figure."""
    file = scripts()[name]
    return f"{FOLDER.name}.{file.parent.name}.{file.stem}"


def kept() -> list[Record]:
    """Claims of the last full run that was kept."""
    return json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else []


def longest_first(figures: list[str]) -> list[str]:
    """Figures by the time that they took in an earlier run, the longest and unknown ones first.

    Side by side, a long one that begins last keeps one process busy and the others idle.
    """
    known = json.loads(SECONDS.read_text(encoding="utf-8")) if SECONDS.exists() else {}
    return sorted(figures, key=lambda name: -known.get(name, float("inf")))


def quantity(value: float | str | None, unit: str, error: float | None = None) -> str:
    """A number in three digits with its unit and standard error, or words as they are.

    Example:
        >>> quantity(0.51234, "m", 0.0123), quantity("below 1", ""), quantity(None, "m")
        ('0.512 ± 0.012 m', 'below 1', '-')
    """
    if value is None or isinstance(value, str):
        return value or "-"
    spread = f" ± {error:.2g}" if error else ""
    return f"{value:.3g}{spread} {unit}".strip()


def statements(records: list[Record]) -> list[Record]:
    """What is judged: all but the plain measurements."""
    return [r for r in records if r["verdict"] != MEASURED]


def table(records: list[Record], width: int = 100) -> str:
    """The claims for a terminal: claim beside measured, and the verdict."""
    rows = [("figure", "verdict", "paper", "measured", "claim")]
    rows += [(r["figure"], r["verdict"], *quantities(r), r["claim"]) for r in records]
    widths = [min(20, max(len(row[i]) for row in rows)) for i in range(4)]
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


def markdown(records: list[Record]) -> str:
    """The claims for `CLAIMS.md`: what is refuted and why, every statement, every measurement."""
    refuted = [
        f"- **{r['source']}** (`{r['figure']}`): {r['claim']}. Paper: {quantities(r)[0]}; "
        f"measured: {quantities(r)[1]}. {r['reason']}".rstrip()
        for r in records
        if r["verdict"] == REFUTED
    ]
    said = [
        [
            r["figure"],
            r["source"],
            r["claim"],
            *quantities(r),
            "; ".join(filter(None, (r["rule"], r["scanned"]))),
            r["verdict"],
        ]
        for r in statements(records)
    ]
    numbers = [
        [r["figure"], r["claim"], quantities(r)[1]] for r in records if r["verdict"] == MEASURED
    ]
    head = ["figure", "says", "claim", "paper", "measured", "read as", "verdict"]
    parts = (
        ("What is refuted, and why", "\n".join(refuted)),
        ("Statements", markdown_table(head, said)),
        ("Measurements", markdown_table(["figure", "what", "measured"], numbers)),
    )
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts)


def summary(records: list[Record]) -> str:
    """How many claims hold, in one sentence."""
    found = [r["verdict"] for r in records]
    hold, refuted, undecided, plain = map(found.count, (HOLDS, REFUTED, UNDECIDED, MEASURED))
    told = [f"{hold} hold", f"{refuted} are refuted"]
    told += [f"{undecided} lie within their error bar"] if undecided else []
    return (
        f"The figures judge {len(found) - plain} statements by what we measure: "
        f"{_listed(told)}. {plain} further numbers are measured and state nothing."
    )


def _listed(words: list[str]) -> str:
    """Words as an English list."""
    return ", ".join(words[:-1]) + f" and {words[-1]}"


def quantities(record: Record) -> tuple[str, str]:
    """The paper's value and ours, in words."""
    paper = quantity(record["paper"], record["unit"])
    return paper, quantity(record["measured"], record["unit"], record["error"])


def markdown_table(head: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(c.replace("|", r"\|") for c in row) + " |" for row in lines)


def section(page: str, name: str) -> str:
    """What stands between the two markers of a generated section."""
    return page.partition(_BEGIN.format(name))[2].partition(_END.format(name))[0].strip()


def with_section(page: str, name: str, text: str) -> str:
    """A page with a generated section replaced."""
    begin, end = _BEGIN.format(name), _END.format(name)
    before, found, rest = page.partition(begin)
    if not found or end not in rest:
        raise ValueError(f"The page lacks the markers {begin} and {end}.")
    return f"{before}{begin}\n{text}\n{end}{rest.partition(end)[2]}"


def differences(records: list[Record], others: list[Record]) -> list[str]:
    """Which claims two runs do not share, or judge differently; in sentences."""
    one, other = ({(r["figure"], r["claim"]): r["verdict"] for r in rs} for rs in (records, others))
    known = {figure for figure, _ in other}
    figures = {figure for figure, _ in one}
    told = [f"{f} is new." for f in sorted(figures - known)]
    told += [f"{f}: {c!r} is new." for f, c in one if f in known and (f, c) not in other]
    told += [f"{f}: {c!r} is gone." for f, c in other if f in figures and (f, c) not in one]
    return told + [
        f"{f}: {c!r} was {other[f, c]} and is {one[f, c]}."
        for f, c in one
        if (f, c) in other and other[f, c] != one[f, c]
    ]


def _small(picture: pathlib.Path) -> Image.Image:
    """A picture as wide as a page shows it, so that the repository stays small."""
    with Image.open(picture) as image:
        small = image.convert("RGB")
    small.thumbnail((WIDE, small.height))
    return small


def keep() -> None:
    """Keep the claims of the last full run; renew the pages and pictures that show them."""
    records = json.loads((FOLDER / "out" / "claims.json").read_text(encoding="utf-8"))
    missing = set(names()) - {r["figure"] for r in records}
    if missing:
        raise SystemExit(f"The last run lacks {', '.join(sorted(missing))}: run `make figures`.")
    for name in GALLERY:
        with io.atomic_write(README.parent / "gallery" / f"{name}.png") as part:
            _small(FOLDER / "out" / f"{name}.png").save(part, format="png", optimize=True)
    io.write_json(KEPT, [{k: v for k, v in r.items() if k != "seconds"} for r in records])
    io.write_json(SECONDS, {r["figure"]: round(r["seconds"], 1) for r in records})
    for page, name, text in (
        (PAGE, "claims", markdown(kept())),
        (README, "claims", summary(kept())),
        (LAWS, "laws", laws.as_markdown(laws.measure())),
    ):
        io.write_text(page, with_section(page.read_text(encoding="utf-8"), name, text))


if __name__ == "__main__":
    session.start()
    keep()
