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

FOLDER = "claims"
HEAD = ("claim", "paper", "measured", "holds")
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
        "Every figure prints the paper's claim beside the measured number; those that do not hold "
        "stay, with the reason in the figure's script. `make figures` measures them again."
    )
    table = md.table(("figures of", "claims", "hold", "do not", "measured only"), rows)
    listed = md.toctree([*papers, "all"])
    found[f"{FOLDER}/index.md"] = md.page("Claims", words, table, listed)
    found[f"{FOLDER}/all.md"] = _all_claims()
    found["gallery.md"] = gallery()
    return found


def _all_claims() -> str:
    """Every claim in one table, with a field that hides rows without the words typed into it."""
    rows = [(_figure_link(record["figure"]), *_row(record)) for record in claims.kept()]
    words = (
        "Type words to see the rows that have them all: a figure, a quantity, `NO`. A claim that "
        "does not hold links to its figure, whose script's words say why."
    )
    return md.page("All claims", words, _FIELD, md.table(("figure", *HEAD), rows))


def _paper(record: claims.Record) -> str:
    """The folder of a figure: a paper, or `ours`."""
    return claims.scripts()[record["figure"]].parent.name


def _records(paper: str) -> list[claims.Record]:
    return [record for record in claims.kept() if _paper(record) == paper]


def _counts(paper: str) -> tuple[str, ...]:
    held = [record["holds"] for record in _records(paper)]
    counts = (len(held), held.count(True), held.count(False), held.count(None))
    return (f"[{_title(paper)}]({paper}.md)", *map(str, counts))


def _title(paper: str) -> str:
    return paper.upper() if paper.upper() in PAPERS else "Figures of our own"


def _claims(paper: str) -> str:
    """One paper's claims, a section for each figure."""
    parts = [f"{PAPERS[paper.upper()]}."] if paper.upper() in PAPERS else []
    for figure, records in itertools.groupby(_records(paper), key=lambda r: r["figure"]):
        parts.append(_figure(figure, list(records)))
    return md.page(_title(paper), *parts)


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
    """A claim, what the paper has, what was measured, and whether it holds."""
    quantities = (claims.quantity(record[k], record["unit"]) for k in ("paper", "measured"))
    words = (md.escaped(text, cell=True) for text in (record["claim"], *quantities))
    return (*words, claims.HOLDS[record["holds"]])


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
    held = [record["holds"] for record in claims.kept() if record["figure"] == figure]
    if not held:
        return ""
    link = _figure_link(figure, "its claims")
    hold, against, open_ = (held.count(verdict) for verdict in (True, False, None))
    told = [f"{hold} of {len(held)} hold"]
    told += [f"{against} not, for the reasons given there"] if against else []
    told += [f"{open_} without a verdict"] if open_ else []
    return f"Of {link} {', '.join(told)}."
