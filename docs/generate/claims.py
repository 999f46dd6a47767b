"""Claims and pictures: what the papers say beside what was measured, and the gallery."""

from __future__ import annotations

import ast
import itertools
import pathlib
import re

from docs.generate import markdown as md
from docs.generate.docstrings import told
from docs.generate.equations import PAPERS
from figures import claims
from figures.verdicts import HOLDS, MEASURED, REFUTED, UNDECIDED

FOLDER = "claims"
HEAD = ("claim", "said in", "paper", "measured", "read as", "verdict")
JUDGED = (HOLDS, REFUTED, UNDECIDED)
_TOLD = {HOLDS: "hold", REFUTED: "are refuted", UNDECIDED: "lie within their error bar"}
# `_static/filter.js` gives it life; without scripts the table is whole.
_FIELD = """```{raw} html
<input type="search" class="filter" placeholder="words" aria-label="Words that a row must have">
```"""


def pages() -> dict[str, str]:
    """The claims of each paper by figure, a page that counts them, and the gallery."""
    papers = sorted({_paper(record) for record in claims.kept()})
    found = {f"{FOLDER}/{paper}.md": _claims(paper) for paper in papers}
    rows = [_counts(paper) for paper in papers]
    words = (
        "Every figure prints what its paper says beside what was measured. A rule that was written "
        "down before the run decides whether it **holds** or is **refuted**; what lies within two "
        "standard errors of the threshold is **undecided**; numbers beside which nobody says "
        "anything are **measured** and not counted. `make figures` measures all again."
    )
    table = md.table(("figures of", "statements", *JUDGED, MEASURED), rows)
    listed = md.toctree([*papers, "all"])
    found[f"{FOLDER}/index.md"] = md.page("Claims", words, table, listed)
    found[f"{FOLDER}/all.md"] = _all_claims()
    found["gallery.md"] = gallery()
    return found


def _all_claims() -> str:
    """Every claim in one table, with a field that hides rows without the words typed into it."""
    rows = [(_figure_link(record["figure"]), *_row(record)) for record in claims.kept()]
    words = (
        "Type words to see the rows that have them all: a figure, a quantity, `refuted`. The page "
        "of a figure's paper says why a statement is refuted."
    )
    return md.page("All claims", words, _FIELD, md.table(("figure", *HEAD), rows))


def _paper(record: claims.Record) -> str:
    """The folder of a figure: a paper, or `ours`."""
    return claims.scripts()[record["figure"]].parent.name


def _records(paper: str) -> list[claims.Record]:
    return [record for record in claims.kept() if _paper(record) == paper]


def _counts(paper: str) -> tuple[str, ...]:
    found = [record["verdict"] for record in _records(paper)]
    counts = (len(found) - found.count(MEASURED), *map(found.count, (*JUDGED, MEASURED)))
    return (f"[{_title(paper)}]({paper}.md)", *map(str, counts))


def _title(paper: str) -> str:
    return paper.upper() if paper.upper() in PAPERS else "Figures of our own"


def _claims(paper: str) -> str:
    """One paper's claims, a section for each figure."""
    parts = [f"{PAPERS[paper.upper()]}."] if paper.upper() in PAPERS else []
    parts += [_refuted(paper)]
    for figure, records in itertools.groupby(_records(paper), key=lambda r: r["figure"]):
        parts.append(_figure(figure, list(records)))
    return md.page(_title(paper), *parts)


def _refuted(paper: str) -> str:
    """What is refuted, by which number and why."""
    lines = [
        f"- {_figure_link(r['figure'])}, {md.escaped(r['source'])}: {md.escaped(r['claim'])}. "
        f"Measured: {md.escaped(claims.quantities(r)[1])}. {md.escaped(r['reason'])}".rstrip()
        for r in _records(paper)
        if r["verdict"] == REFUTED
    ]
    return "\n".join(["## Refuted, and why", "", *lines]) if lines else ""


def _figure(figure: str, records: list[claims.Record]) -> str:
    """One figure: its script's words, and its table."""
    script = claims.scripts()[figure]
    said = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    rows = [_row(record) for record in records]
    sizes = "; ".join(dict.fromkeys(str(r["size"]) for r in records if r.get("size")))
    parts = [
        f"({md.label('figure', figure)})=\n## {figure}",
        told(said),
        md.table(HEAD, rows),
        f"Sizes: {md.escaped(sizes)}." if sizes else "",
        f"Drawn by {md.file_link(script, FOLDER)}: `python -m figures {figure}`.",
    ]
    return "\n\n".join(part for part in parts if part)


def _figure_link(figure: str, words: str = "") -> str:
    """A link to the claims of a figure."""
    return f"[{words or figure}](#{md.label('figure', figure)})"


def _row(record: claims.Record) -> tuple[str, ...]:
    """A claim, where it stands, the paper's value and ours, how it was read, the verdict."""
    read = "; ".join(filter(None, (record["rule"], record["scanned"])))
    words = (record["claim"], record["source"], *claims.quantities(record), read, record["verdict"])
    return tuple(md.escaped(text, cell=True) for text in words)


def gallery() -> str:
    """Every figure: its picture where there is one, the first words of its script, its claims."""
    words = (
        "Every figure that a script draws. The first are kept with the library; other pictures are "
        "those of the last `make figures` or `make figures-quick` in the checkout from which this "
        "site was built, and missing where there was none."
    )
    kept = [name for name in claims.scripts() if _picture(name) in _kept_pictures()]
    others = [name for name in claims.scripts() if name not in kept]
    return md.page("Gallery", words, *map(_in_gallery, [*kept, *others]))


def _in_gallery(figure: str) -> str:
    """One figure."""
    script, picture = claims.scripts()[figure], _picture(figure)
    said = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    first = md.escaped(re.sub(r"\s+", " ", said.partition("\n\n")[0]))
    shown = (
        "" if picture is None else f"![{first}](../../{picture.relative_to(md.ROOT).as_posix()})"
    )
    drawn = f"Drawn by {md.file_link(script)}: `python -m figures {figure}`."
    parts = (f"## {figure}", shown, f"{first} {drawn} {_judged(figure)}".strip())
    return "\n\n".join(part for part in parts if part)


def _picture(figure: str) -> pathlib.Path | None:
    """The kept picture of a figure, or that of the last run here."""
    files = (md.ROOT / "gallery" / f"{figure}.png", md.ROOT / "figures" / "out" / f"{figure}.png")
    return next((file for file in files if file.is_file()), None)


def _kept_pictures() -> list[pathlib.Path]:
    return list((md.ROOT / "gallery").glob("*.png"))


def _judged(figure: str) -> str:
    """How many of its claims hold, with a link to them and to the reasons of the others."""
    found = [r["verdict"] for r in claims.statements(claims.kept()) if r["figure"] == figure]
    if not found:
        return ""
    link = _figure_link(figure, "its statements")
    told = [f"{found.count(v)} {words}" for v, words in _TOLD.items() if v in found]
    return f"Of {len(found)} of {link} {', '.join(told)}."
