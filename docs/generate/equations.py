"""The papers' equations: every row of the ledger, and the errata of each paper.

Rows are shown as they stand in `derivations`. Proofs and numeric routes are judged by `make check`,
which takes minutes: their verdicts are kept (`docs.generate.kept`). Only the counterexamples, which
take seconds, are evaluated here.
"""

from __future__ import annotations

import functools
import re
import textwrap
from typing import Any

import numpy as np

import derivations
from docs.generate import api, kept
from docs.generate import markdown as md
from firstorder.ledger import Check, Entry, Ledger, NotApplicable, Row
from firstorder.ledger.rows import EXTRA, REASONS, ROUTES, Route

PAPERS = {
    "R07": "Ramamoorthi, Mahajan, Belhumeur 2007, A first-order analysis of lighting, shading, and "
    "shadows",
    "J12": "Jarosz, Schönefeld, Kobbelt, Jensen 2012, Theory, analysis and applications of 2D "
    "global illumination",
    "E11": "Egan, Hecht, Durand, Ramamoorthi 2011, Frequency analysis and sheared filtering for "
    "shadow light fields of complex occluders",
    "D05": "Durand, Holzschuch, Soler, Chan, Sillion 2005, A frequency analysis of light transport",
    "C": "Our own corollaries, which tie the papers together",
}
WRONG = {"misprint": "Misprints", "over-claim": "Claims that go too far"}
_CITED = re.compile(r"\b(R07|J12|E11|D05)\b\s+(?:[^;.()]*?\b)?eqs?\. ([\d, and-]+)")
_ROUTES = {
    "symbolic": "symbolic proof",
    "autodiff": "automatic differentiation",
    "fourier": "transform of samples",
    "brute_force": "brute force",
    EXTRA: "derived from the library's own code",
}


def pages() -> dict[str, str]:
    """For each paper its rows and its errata, and a page that counts them."""
    found = {}
    for paper in PAPERS:
        found[f"equations/{md.label(paper)}.md"] = _paper(paper)
        if _wrong(paper):
            found[f"equations/{md.label(paper, 'errata')}.md"] = _errata(paper)
            found[f"equations/{_letter_name(paper)}"] = letter(paper)
    listed = [path.partition("/")[2].removesuffix(".md") for path in found if path.endswith(".md")]
    head = ("paper", "rows", *WRONG, "errata")
    counts = md.table(head, [_counts(paper) for paper in PAPERS])
    words = (
        "Every numbered equation of four papers, and the unnumbered statements that are used. A "
        "row judges the corrected statement; `make check` runs its proof and its numeric routes."
    )
    found["equations/index.md"] = md.page("Equations", words, counts, md.toctree(listed))
    return found


@functools.cache
def ledger() -> Ledger:
    """Every row, gathered once."""
    return derivations.table()


def anchor(equation: str) -> str:
    """The label of a row."""
    return md.label("eq", equation)


def cited(docstring: str) -> list[str]:
    """Ids of the numbered equations that a docstring cites: "R07 eqs. 12-13; D05 eq. 14".

    Example:
        >>> from docs.generate.equations import cited
        >>> cited("Reference: R07 eqs. 12-13, 20; D05 eq. 14 and Table 1.")
        ['R07.12', 'R07.13', 'R07.20', 'D05.14']
    """
    found = []
    for paper, numbers in _CITED.findall(" ".join(docstring.split())):
        for first, last in re.findall(r"(\d+)(?:-(\d+))?", numbers):
            found += [f"{paper}.{k}" for k in range(int(first), int(last or first) + 1)]
    return found


def line(equation: str) -> tuple[str, str, str, str, str]:
    """A row in a table: a link, what it says, its kind, its verdict, and the correction."""
    entry, row = ledger()[equation]
    link, said = f"[{equation}](#{anchor(equation)})", md.escaped(entry.statement, cell=True)
    return (link, said, row.kind, _judged(equation), _code(row.corrected, cell=True))


def _judged(equation: str) -> str:
    """How the row was judged: its verdict, and the error of each route that passed."""
    found = kept.ledger().get(equation)
    if found is None:
        return "not yet"
    errors = [
        _ROUTES[route] + ("" if error is None else f" {kept.size(error)}")
        for route, error in found["errors"].items()
    ]
    return ": ".join(filter(None, (found["status"], ", ".join(errors))))


def _rows(paper: str) -> list[tuple[Entry, Row]]:
    return [pair for pair in ledger().values() if pair[1].paper == paper]


def _wrong(paper: str) -> list[tuple[Entry, Row]]:
    return [pair for pair in _rows(paper) if pair[1].kind in WRONG]


def _counts(paper: str) -> tuple[str, ...]:
    rows = [row for _, row in _rows(paper)]
    kinds = [str(sum(row.kind == kind for row in rows)) for kind in WRONG]
    errata = f"[errata]({md.label(paper, 'errata')}.md)" if _wrong(paper) else ""
    words = f"[{paper}]({md.label(paper)}.md)"
    return (f"{words}: {PAPERS[paper]}", str(len(rows)), *kinds, errata)


def _paper(paper: str) -> str:
    """All rows of a paper, in its order."""
    errata = f"What should be corrected in print: [errata]({md.label(paper, 'errata')}.md)."
    rows = [_row(entry, row) for entry, row in _rows(paper)]
    return md.page(paper, f"{PAPERS[paper]}.", errata if _wrong(paper) else "", *rows)


def _row(entry: Entry, row: Row) -> str:
    """One row: what it says, what is printed, what is right, and who judges it."""
    where = f", section {entry.section}" if entry.section else ""
    parts = [
        f"({anchor(row.equation)})=\n## {row.equation}",
        f"*{row.kind}*{where}. {api.linked(md.escaped(' '.join(entry.statement.split())))}",
        f"Printed:\n\n{md.fence(entry.formula)}" if entry.formula else "",
        _correction(row),
        f"Note: {api.linked(md.escaped(' '.join(row.note.split())))}" if row.note else "",
        f"Implemented by {api.implementation(row.implements)}." if row.implements else "",
        _judges(row),
    ]
    return "\n\n".join(part for part in parts if part)


def _errata(paper: str) -> str:
    """What one would send to the authors."""
    words = (
        f"{PAPERS[paper]}. Each correction has a counterexample: inputs at which what is printed "
        "and the truth differ, the truth found by quadrature, tracing or sampling and not from the "
        "corrected formula."
    )
    parts = [words, f"The same as plain text: {{download}}`{_letter_name(paper)}`."]
    for kind, title in WRONG.items():
        rows = _of_kind(paper, kind)
        parts += [f"## {title}"] if rows else []
        parts += [_erratum(entry, row) for entry, row in rows]
    return md.page(f"Errata of {paper}", *parts)


def _of_kind(paper: str, kind: str) -> list[tuple[Entry, Row]]:
    return [(entry, row) for entry, row in _wrong(paper) if row.kind == kind]


def _letter_name(paper: str) -> str:
    return f"{md.label(paper, 'errata')}.txt"


def letter(paper: str) -> str:
    """The errata of a paper as plain text: number, print, correction, counterexample."""
    parts = [f"Errata of {PAPERS[paper]}"]
    for kind, title in WRONG.items():
        rows = _of_kind(paper, kind)
        parts += [f"{title}\n{'=' * len(title)}"] if rows else []
        parts += [_in_letter(entry, row) for entry, row in rows]
    return "\n\n".join(parts) + "\n"


def _in_letter(entry: Entry, row: Row) -> str:
    """One erratum as plain text."""
    where = f" (section {entry.section})" if entry.section else ""
    lines = [
        f"{row.equation}{where}",
        _indented("", entry.statement),
        _indented("Printed: ", entry.formula),
        _indented("Correct: ", row.corrected),
    ]
    if example := _example(row.equation):
        lines.append(_indented("", "At {}: printed {}, true {}.".format(*example)))
    return "\n".join(line for line in lines if line)


def _indented(head: str, text: str) -> str:
    """A paragraph of a letter; nothing for no text."""
    words = " ".join(text.split())
    made = textwrap.fill(f"{head}{words}", 78, initial_indent="  ", subsequent_indent="    ")
    return made if words else ""


def _erratum(entry: Entry, row: Row) -> str:
    where = f" (section {entry.section})" if entry.section else ""
    parts = [
        f"### [{row.equation}](#{anchor(row.equation)}){where}",
        md.escaped(" ".join(entry.statement.split())),
        f"Printed:\n\n{md.fence(entry.formula)}" if entry.formula else "",
        _correction(row),
    ]
    return "\n\n".join(part for part in parts if part)


def _correction(row: Row) -> str:
    """The right formula, and where the printed one fails."""
    parts = [f"Corrected:\n\n{md.fence(row.corrected)}"] if row.corrected else []
    if example := _example(row.equation):
        inputs, printed, true = example
        parts.append(
            f"Counterexample: at `{inputs}` the printed statement gives "
            f"**{printed}**, and the truth is **{true}**."
        )
    return "\n\n".join(parts)


@functools.cache
def _example(equation: str) -> tuple[str, str, str] | None:
    """The inputs of a counterexample, what the printed statement gives there, and the truth."""
    example = ledger()[equation][1].counterexample
    if example is None:
        return None
    printed, true = example.printed(**example.inputs), example.true(**example.inputs)
    inputs = ", ".join(f"{name} = {_number(value)}" for name, value in example.inputs.items())
    return inputs, _number(printed), _number(true)


def _number(value: Any) -> str:
    """Six digits; of several numbers each."""
    array = np.asarray(value)
    if array.ndim:
        return "(" + ", ".join(map(_number, array)) + ")"
    return (
        str(value)
        if isinstance(value, str)
        else f"{complex(value) if np.iscomplexobj(array) else float(value):.6g}"
    )


def _judges(row: Row) -> str:
    """The verdict, by which routes and with which errors, and why not by the others."""
    by, without = [], []
    found = kept.ledger().get(row.equation, {"status": "not yet", "errors": {}})
    for name in (*ROUTES, EXTRA):
        route = getattr(row, name)
        if isinstance(route, NotApplicable):
            without.append(f"{_ROUTES[name]} ({REASONS[route.reason]})")
        elif route is not None:
            by.append(f"{_ROUTES[name]}{_errors(route, found['errors'].get(name))}")
    judged = f"Verdict: **{found['status']}**, by {', '.join(by)}." if by else "Not judged yet."
    if not by and found["status"] == "stated":
        judged = "Verdict: **stated**, a definition with nothing to judge."
    return f"{judged} Left out: {'; '.join(without)}." if without else judged


def _errors(route: Route, error: float | None) -> str:
    """The measured error of a numeric route, and the largest that passes."""
    if not isinstance(route, Check):
        return ""
    measured = "" if error is None else f" (error {kept.size(error)}, passes to {route.bound:.2g})"
    return measured or f" (passes to {route.bound:.2g})"


def _code(text: str, cell: bool = False) -> str:
    """A formula in a cell."""
    plain = " ".join(text.split())
    return md.quoted(plain.replace("|", r"\|") if cell else plain) if plain else ""
