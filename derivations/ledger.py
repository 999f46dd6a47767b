"""The ledger: one row for every equation, with what was proved and what was measured.

A derivation module lists `ROWS`. Each row names its checks as plain functions: a symbolic proof
returns what must vanish; a numeric route returns an error that is compared with its bound. The
catalogue supplies what the paper prints; rows judge the *corrected* statement.
"""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import sympy as sp

import derivations
from derivations.catalogue import Entry, load

KINDS = ("identity", "definition", "approximation", "misprint", "over-claim", "not ours")
ROUTES = ("symbolic", "autodiff", "fourier", "brute_force")

# The few reasons for which a route may be left out. They are counted per paper.
REASONS = {
    "definition": "a definition has nothing to prove",
    "no derivative": "the statement contains no derivative",
    "no spectrum": "the statement has no simple spectrum",
    "spectral": "the statement is about a spectrum, of which autodiff knows nothing",
    "refusal": "the statement says that no formula exists; the refusal is tested",
    "measured": "an approximation is measured, not proved",
    "two routes": "symbolic and two other routes already judge it",
    "one route": "one numeric route is all that the statement admits",
    "scale": "an order-of-magnitude claim is judged by measurement alone",
}


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What one route says: pass, fail, not applicable or not yet."""

    verdict: str
    error: float | None = None
    reason: str = ""


@dataclasses.dataclass(frozen=True)
class Check:
    """A numeric route: a function that returns an error, and the largest error that passes."""

    error: Callable[[], float]
    bound: float


@dataclasses.dataclass(frozen=True)
class NotApplicable:
    """A route left out for one of `REASONS`."""

    reason: str

    def __post_init__(self):
        if self.reason not in REASONS:
            raise ValueError(
                f"Argument `reason` must be one of {list(REASONS)}, but is {self.reason!r}."
            )


@dataclasses.dataclass(frozen=True)
class Counterexample:
    """Inputs at which the printed statement and the truth differ, as functions of the inputs.

    `true` must come from a brute-force route (quadrature, tracing, sampling), not from the
    corrected formula.
    """

    inputs: dict[str, float]
    printed: Callable[..., float]
    true: Callable[..., float]


Route = Check | NotApplicable | Callable[[], Any] | None


@dataclasses.dataclass(frozen=True)
class Row:
    """One statement and its judges. A route left as None says "not yet" and never counts as passed.

    Attributes:
        equation: id in the catalogue.
        kind: one of `KINDS`.
        implements: dotted name of what implements it, or "" if nothing does (yet).
        symbolic: function that returns one or more sympy expressions, all zero if it holds.
        autodiff, fourier, brute_force: `Check`, or `na(reason)`.
        corrected: the right formula, where the printed one is wrong.
        counterexample: where the printed one fails.
        note: what a reader should know; for an approximation its order and domain.
    """

    equation: str
    kind: str
    implements: str = ""
    symbolic: Route = None
    autodiff: Route = None
    fourier: Route = None
    brute_force: Route = None
    corrected: str = ""
    counterexample: Counterexample | None = None
    note: str = ""

    def __post_init__(self):
        if self.kind not in KINDS:
            raise ValueError(f"Argument `kind` must be one of {KINDS}, but is {self.kind!r}.")
        if self.kind in ("misprint", "over-claim") and not (self.corrected and self.counterexample):
            raise ValueError(
                f"Row {self.equation} needs a corrected statement and a counterexample."
            )
        routes = [getattr(self, route) for route in ROUTES]
        left_out = {route.reason for route in routes if isinstance(route, NotApplicable)}
        if "two routes" in left_out and sum(isinstance(r, Check) for r in routes) < 2:
            raise ValueError(
                f"Row {self.equation} says that two other routes judge it; they do not."
            )


def na(reason: str) -> NotApplicable:
    """A route that is left out for one of the listed reasons."""
    return NotApplicable(reason)


@dataclasses.dataclass(frozen=True)
class Result:
    """A row judged."""

    row: Row
    entry: Entry
    verdicts: dict[str, Verdict]
    seconds: float

    @property
    def status(self) -> str:
        """What the row may be counted as: fail, not yet, stated or pass.

        One failed route fails the row; one that nobody has written leaves it at "not yet"; a
        definition with nothing to judge is "stated", which is not a pass.
        """
        said = {v.verdict for v in self.verdicts.values()}
        if "fail" in said:
            return "fail"
        if "not yet" in said:
            return "not yet"
        return "pass" if "pass" in said else "stated"

    def as_json(self) -> dict[str, Any]:
        """The object that `python -m derivations --json` writes."""
        c = self.row.counterexample
        example = c and {
            "inputs": c.inputs,
            "printed": float(c.printed(**c.inputs)),
            "true": float(c.true(**c.inputs)),
        }
        return {
            "equation": self.row.equation,
            "statement": self.entry.statement,
            "kind": self.row.kind,
            "printed": self.entry.formula,
            "corrected": self.row.corrected,
            "counterexample": example,
            **{k: dataclasses.asdict(v) for k, v in self.verdicts.items()},
            "implements": self.row.implements,
            "note": self.row.note,
        }


def rows() -> Iterator[Row]:
    """All rows of all derivation modules, in no particular order."""
    for info in pkgutil.walk_packages(derivations.__path__, "derivations."):
        if info.name.endswith("__main__") or ".catalogue" in info.name or info.name == __name__:
            continue
        yield from getattr(importlib.import_module(info.name), "ROWS", ())


def table() -> dict[str, tuple[Entry, Row]]:
    """Every equation of the catalogue with its row, or an empty row that says "not yet"."""
    catalogue = load()
    found: dict[str, Row] = {}
    for row in rows():
        if row.equation in found:
            raise ValueError(f"Row {row.equation} is listed twice.")
        if row.equation not in catalogue:
            raise ValueError(f"Row {row.equation} is not in the catalogue.")
        found[row.equation] = row
    return {k: (e, found.get(k, Row(k, e.kind))) for k, e in catalogue.items()}


def judge(entry: Entry, row: Row) -> Result:
    """Run all routes of one row."""
    start = time.perf_counter()
    verdicts = {route: _guarded(route, getattr(row, route)) for route in ROUTES}
    return Result(row, entry, verdicts, time.perf_counter() - start)


def _guarded(route: str, check: Route) -> Verdict:
    """A route that raises has failed, and says why; the rows after it are still judged."""
    try:
        return _verdict(route, check)
    except Exception as failure:
        first = (str(failure).splitlines() or [""])[0]
        return Verdict("fail", reason=f"{type(failure).__name__}: {first}")


def _verdict(route: str, check: Route) -> Verdict:
    if check is None:
        return Verdict("not yet")
    if isinstance(check, NotApplicable):
        return Verdict("not applicable", reason=REASONS[check.reason])
    if isinstance(check, Check):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            error = float(check.error())
        return Verdict("pass" if error <= check.bound else "fail", error)  # NaN fails
    if route != "symbolic":
        raise TypeError(f"Route `{route}` must be a Check, but is {type(check).__name__}.")
    return Verdict("pass" if all(vanishes(e) for e in _flat(check())) else "fail")


def _flat(result) -> list:
    """One expression, a matrix or a sequence of them, as a list that is not empty."""
    if isinstance(result, sp.MatrixBase):
        return list(result)
    if isinstance(result, (list, tuple)):
        flat = [e for item in result for e in _flat(item)]
        if not flat:
            raise ValueError("A proof that returns nothing proves nothing.")
        return flat
    return [result]


def vanishes(expression) -> bool:
    """Whether sympy proves that an expression is zero."""
    if isinstance(expression, bool):
        raise TypeError("A symbolic proof must return what vanishes, not a truth value.")
    return sp.simplify(expression) == 0
