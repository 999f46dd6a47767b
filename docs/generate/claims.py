"""Claims and pictures: what the papers say beside what was measured, and the gallery."""

from __future__ import annotations

import ast
import itertools
import re

from docs.generate import markdown as md
from docs.generate.docstrings import told
from docs.generate.equations import PAPERS
from figures import claims

FOLDER = "claims"
HEAD = ("claim", "paper", "measured", "holds")


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
    found[f"{FOLDER}/index.md"] = md.page("Claims", words, table, md.toctree(papers))
    found["gallery.md"] = _gallery()
    return found


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
    rows = [
        (
            md.escaped(record["claim"], cell=True),
            md.escaped(claims.quantity(record["paper"], record["unit"]), cell=True),
            md.escaped(claims.quantity(record["measured"], record["unit"]), cell=True),
            claims.HOLDS[record["holds"]],
        )
        for record in records
    ]
    sizes = "; ".join(dict.fromkeys(str(r["size"]) for r in records if r.get("size")))
    parts = [
        f"({md.label('figure', figure)})=\n## {figure}",
        told(said),
        md.table(HEAD, rows),
        f"Sizes: {md.escaped(sizes)}." if sizes else "",
        f"Drawn by {md.file_link(script, FOLDER)}: `python -m figures {figure}`.",
    ]
    return "\n\n".join(part for part in parts if part)


def _gallery() -> str:
    """The pictures that are kept, with the first words of the script that draws each."""
    parts = []
    for picture in sorted((md.ROOT / "gallery").glob("*.png")):
        script = claims.scripts()[picture.stem]
        said = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
        first = re.sub(r"\s+", " ", said.partition("\n\n")[0])
        link = f"[its claims](#{md.label('figure', picture.stem)})"
        judged = f", with {link}" if _has_claims(picture.stem) else ""
        parts += [
            f"## {picture.stem}",
            f"![{md.escaped(first)}](../../gallery/{picture.name})",
            f"{md.escaped(first)} Drawn by {md.file_link(script)}{judged}.",
        ]
    return md.page("Gallery", *parts)


def _has_claims(figure: str) -> bool:
    return any(record["figure"] == figure for record in claims.kept())
