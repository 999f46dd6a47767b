"""Laws and events: a page for each, and for each path in the registry of squares.

A page has what the docstring says, what becomes of every portrait with the error that its square
was measured to have, which equations of the papers are cited and how the ledger judges them, and
where it is written, tested, derived and drawn.
"""

from __future__ import annotations

import ast
import functools
import inspect
import pathlib
import re

from docs.generate import api, equations, formulas, kept
from docs.generate import markdown as md
from docs.generate.docstrings import told
from figures import claims
from firstorder import laws, transport
from firstorder.checks import registry
from firstorder.checks.registry import all_cases
from firstorder.checks.squares import Case
from firstorder.laws import Law
from firstorder.transport import Chain, Event

FOLDERS = {"laws": "Laws", "events": "Events", "paths": "Paths"}
_SPOKEN = {
    "laws": "What mathematics does to light: R07's five operators, and what is made of them.",
    "events": "What happens to light locally: each picks a law and its parameters.",
    "paths": "Several events in a row. For each the errors of its portraits were measured.",
}

_SQUARES = (
    "A portrait's square: the step's own rule on the portrait, against the portrait of what the "
    "step makes of light, drawn by something that knows nothing of the step: brute force for "
    "values, autodiff for gradient and Hessian, transforms of samples for the others. "
    "Each has its verdict, its largest error over the largest magnitude, and the bound of it."
)


def pages() -> dict[str, str]:
    """A page for each law, event and path, and one that lists each kind."""
    found = {path_of(step): _step(step) for step in steps()}
    found |= {path_of_case(case): _path(case) for case in _chains()}
    return found | {f"{folder}/index.md": _index(folder, found) for folder in FOLDERS}


def _index(folder: str, found: dict[str, str]) -> str:
    """The page that lists the laws, the events or the paths, each with its first sentence."""
    here = {p: text for p, text in found.items() if p.startswith(f"{folder}/")}
    names = [path.partition("/")[2] for path in here]
    lines = []
    for name, text in zip(names, here.values(), strict=True):
        title, _, rest = text.removeprefix("# ").partition("\n\n")
        lines.append(f"- [{title}]({name}): {rest.partition(chr(10) * 2)[0]}")
    measured = _law_table() if folder == "laws" else ""
    listed = md.toctree([name.removesuffix(".md") for name in names], hidden=True)
    return md.page(FOLDERS[folder], _SPOKEN[folder], "\n".join(lines), measured, listed)


def _law_table() -> str:
    """The table of the five laws, with measured errors."""
    page = claims.LAWS.read_text(encoding="utf-8")
    return f"## The squares, measured\n\n{claims.section(page, 'laws')}"


def steps() -> tuple[type, ...]:
    """Classes of all laws and events: those that have squares, and those that are exported."""
    cases = [case.step for case in all_cases().values()]
    chained = [e for step in cases if isinstance(step, Chain) for e in step.events]
    walked = [type(s) for s in (*cases, *chained) if not isinstance(s, Chain)]
    exported = [
        thing
        for module, base in ((laws, Law), (transport, Event))
        for thing in (getattr(module, name) for name in module.__all__)
        if inspect.isclass(thing) and issubclass(thing, base) and not inspect.isabstract(thing)
    ]
    return tuple(dict.fromkeys([*exported, *walked]))


def path_of(step: type) -> str:
    """The page of a law or an event."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "-", step.__name__.strip("_"))
    return f"{'laws' if issubclass(step, Law) else 'events'}/{md.label(words)}.md"


def path_of_case(case: Case) -> str:
    """The page of a case: its step's, or its own if it is a path."""
    if isinstance(case.step, Chain):
        return f"paths/{md.label(case.name)}.md"
    return path_of(type(case.step))


def _chains() -> list[Case]:
    return [case for case in all_cases().values() if isinstance(case.step, Chain)]


def _step(step: type) -> str:
    """The page of one law or event."""
    cases = [case for case in all_cases().values() if type(case.step) is step]
    folder = path_of(step).partition("/")[0]
    return md.page(
        step.__name__,
        told(inspect.getdoc(step) or "", api.linked),
        f"In the API: {api.reference(step)}.",
        f"## What becomes of light\n\n{_SQUARES}" if cases else "",
        *_told_once(cases),
        _in_paths(step),
        _cited(step),
        _files(step, folder),
    )


def _path(case: Case) -> str:
    """The page of a path."""
    assert isinstance(case.step, Chain)
    events = [f"[{type(e).__name__}](../{path_of(type(e))})" for e in case.step.events]
    return md.page(
        _title(case),
        f"Events, in the order in which light meets them: {', then '.join(events)}.",
        f"## What becomes of light\n\n{_SQUARES}",
        _case(case),
    )


def _title(case: Case) -> str:
    return case.name[0].upper() + case.name[1:]


def _told_once(cases: list[Case]) -> list[str]:
    """What each case does to light, under the names of all cases of which it is true."""
    titles: dict[str, list[str]] = {}
    for case in cases:
        titles.setdefault(_case(case), []).append(_title(case))
    return [f"### {'; '.join(names)}\n\n{body}" for body, names in titles.items()]


def _case(case: Case) -> str:
    """What one case does to each portrait, and how well its square must close."""
    names = ", ".join(f"`{name}`" for name in case.field.frame.coordinates)
    light = f"{case.field.frame.sense.capitalize()} light $L$ over {names}."
    numbers = formulas.parameters(case)
    walked = f" Measured at {numbers}." if numbers else ""
    parts = [f"{light}{walked}"]
    for portrait, said in formulas.acts(case):
        parts.append(f"**{portrait.capitalize()}**, {_verdict(case, portrait)}.\n\n{said}")
    return "\n\n".join(parts)


def _verdict(case: Case, portrait: str) -> str:
    """Words for a square: its measured error, and the largest that passes."""
    said = kept.squares().get(case.name, {}).get(portrait)
    bound = f"at most {case.bound(portrait):.0e} passes"
    if said is None:
        return f"not measured yet, {bound}"
    return kept.words(said) if said["verdict"] == "refused" else f"{kept.words(said)}, {bound}"


def _in_paths(step: type) -> str:
    """The paths in which an event stands."""
    inside = [
        f"[{case.name}](../{path_of_case(case)})"
        for case in _chains()
        if isinstance(case.step, Chain) and step in map(type, case.step.events)
    ]
    return f"Part of the paths {', '.join(inside)}." if inside else ""


def _cited(step: type) -> str:
    """The equations that a docstring cites or that name the class, as the ledger has them."""
    ids = dict.fromkeys([*equations.cited(inspect.getdoc(step) or ""), *_implemented(step)])
    rows = [equations.line(equation) for equation in ids if equation in equations.ledger()]
    if not rows:
        return ""
    head = ("equation", "what it says", "kind", "verdict, errors by route", "corrected")
    return f"## Equations\n\n{md.table(head, rows)}"


def _implemented(step: type) -> list[str]:
    """Rows of the ledger that name the class or something in it."""
    named = re.compile(rf"\b{re.escape(step.__name__)}\b")
    return [k for k, (_, row) in equations.ledger().items() if named.search(row.implements)]


def _files(step: type, folder: str) -> str:
    """Where it is written, derived and tested."""
    source = pathlib.Path(inspect.getsourcefile(step) or "")
    rows = [("source", source)]
    if (library := md.ROOT / "src" / "firstorder") in source.parents:
        within = source.relative_to(library)
        test = within.with_name(f"test_{within.name.lstrip('_')}")
        rows += [
            ("derivation", md.ROOT / "derivations" / within),
            ("test", md.ROOT / "tests" / test),
        ]
    rows += [("cases and faults", file) for file in _registered(step)]
    found = [(what, md.file_link(file, folder)) for what, file in rows if file.exists()]
    found += [("figure", link) for link in _figures(step)]
    return f"## Where it is written\n\n{md.table(('what', 'file'), found)}"


def _figures(step: type) -> list[str]:
    """Links to the claims of figures whose scripts use a step."""
    used = [n for n, file in claims.scripts().items() if step.__name__ in _names(file)]
    judged = {record["figure"] for record in claims.kept()}
    return [f"[{name}](#{md.label('figure', name)})" for name in used if name in judged]


@functools.cache
def _names(script: pathlib.Path) -> frozenset[str]:
    """Names that a script imports from the library."""
    tree = ast.parse(script.read_text(encoding="utf-8"))
    froms = [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
    ours = [n for n in froms if (n.module or "").startswith("firstorder")]
    return frozenset(alias.name for node in ours for alias in node.names)


def _registered(step: type) -> list[pathlib.Path]:
    """Files of the registry whose cases walk a step."""
    return [
        pathlib.Path(file)
        for module in registry._modules()
        if any(type(case.step) is step for case in module.CASES) and (file := module.__file__)
    ]
