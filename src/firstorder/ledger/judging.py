"""Judging rows: what each route says, and whether the row is of the kind that it claims to be."""

from __future__ import annotations

import dataclasses
import math
import numbers
import time
import types
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import sympy as sp

from firstorder._labelled import DataFrame, data_frame
from firstorder.ledger.catalogue import Entry
from firstorder.ledger.rows import EXTRA, REASONS, ROUTES, Check, NotApplicable, Route, Row

# By how much, relative to the larger, what is printed must differ from the truth.
DIFFERENT = 1e-3


@dataclasses.dataclass(frozen=True)
class Verdict:
    """Verdict of one route: pass, fail, not applicable or not yet."""

    verdict: str
    error: float | None = None
    reason: str = ""


@dataclasses.dataclass(frozen=True)
class Result:
    """A row judged.

    Attributes:
        row, entry: what was judged.
        verdicts: by route; the optional route only where the row has it.
        kind: whether the row is of its kind; None if it has no counterexample to tell by.
        example: inputs, printed and true value of the counterexample.
        seconds: that it took.
    """

    row: Row
    entry: Entry
    verdicts: dict[str, Verdict]
    kind: Verdict | None
    example: dict[str, Any] | None
    seconds: float

    @property
    def status(self) -> str:
        """Verdict by which the row is counted: fail, not yet, stated or pass.

        One failed route fails the row, and so does a kind that is not so; a route that nobody has
        written leaves it at "not yet"; a definition with nothing to judge is "stated", which is not
        a pass.
        """
        said = {v.verdict for v in self.verdicts.values()}
        if "fail" in said or (self.kind and self.kind.verdict == "fail"):
            return "fail"
        if "not yet" in said:
            return "not yet"
        return "pass" if "pass" in said else "stated"

    def as_json(self) -> dict[str, Any]:
        """The object that `firstorder ledger --json` writes."""
        return {
            "equation": self.row.equation,
            "statement": self.entry.statement,
            "kind": self.row.kind,
            "status": self.status,
            "printed": self.entry.formula,
            "corrected": self.row.corrected,
            "counterexample": self.example,
            "kind_judged": self.kind and dataclasses.asdict(self.kind),
            **{k: dataclasses.asdict(v) for k, v in self.verdicts.items()},
            "implements": self.row.implements,
            "note": self.row.note,
        }


def judge(entry: Entry, row: Row) -> Result:
    """Run all routes of one row, and evaluate its counterexample.

    A route that raises has failed, and says why. What is printed must differ from the truth by a
    thousandth of the larger at the counterexample, and an identity has none; otherwise the row is
    not of its kind and fails.

    Example:
        >>> from firstorder.ledger import Check, Counterexample, Entry, Row, judge, na
        >>> same = Counterexample({"x": 2.0}, printed=lambda x: x + x, true=lambda x: x * x)
        >>> row = Row(
        ...     "T.2",
        ...     "misprint",
        ...     symbolic=na("measured"),
        ...     autodiff=na("no derivative"),
        ...     fourier=na("no spectrum"),
        ...     brute_force=Check(lambda: 0.0, 1e-9),
        ...     corrected="x^2",
        ...     counterexample=same,
        ... )
        >>> result = judge(Entry("T.2", "A square.", "2 x"), row)
        >>> result.status
        'fail'
        >>> print(result.kind.reason)
        The counterexample shows no difference: printed 4, true 4.
    """
    start = time.perf_counter()
    routes = (*ROUTES, EXTRA) if row.derived else ROUTES
    verdicts = {route: judge_route(route, getattr(row, route)) for route in routes}
    kind, example = _judge_kind(row)
    return Result(row, entry, verdicts, kind, example, time.perf_counter() - start)


def results_to_pandas(results: Sequence[Result]) -> DataFrame:
    """Judged rows of a ledger as a table: what each says, and each route's verdict and error.

    Args:
        results: from `judge`.

    Raises:
        ModuleNotFoundError: without the extra `tables`.

    Example:
        >>> from firstorder.ledger import Entry, Row, judge, na, results_to_pandas
        >>> row = Row("T.1", "definition", symbolic=na("definition"), autodiff=na("definition"),
        ...           fourier=na("definition"), brute_force=na("definition"))
        >>> table = results_to_pandas([judge(Entry("T.1", "A name."), row)])
        >>> table.status[0], table.fourier[0]
        ('stated', 'not applicable')
    """
    routes = list(dict.fromkeys(route for result in results for route in result.verdicts))
    said = ("equation", "kind", "statement", "printed", "corrected", "implements", "note")
    found = [result.as_json() for result in results]
    columns: dict[str, list] = {name: [row[name] for row in found] for name in said}
    columns["status"] = [result.status for result in results]
    columns["seconds"] = [result.seconds for result in results]
    for route in routes:
        verdicts = [result.verdicts.get(route) for result in results]
        columns[route] = [v and v.verdict for v in verdicts]
        columns[f"{route}_error"] = [v and v.error for v in verdicts]
    return data_frame(columns, {"seconds": "s"})


def judge_route(route: str, check: Route) -> Verdict:
    """One route of a row; one that raises has failed, and the rows after it are still judged.

    Args:
        route: its name, one of `ROUTES`.
        check: how it is judged.

    Example:
        >>> from firstorder.ledger import Check, judge_route
        >>> judge_route("brute_force", Check(lambda: 1e-3, bound=1e-9)).verdict
        'fail'
    """
    try:
        return _verdict(route, check)
    except Exception as failure:
        return Verdict("fail", reason=_said(failure))


def _said(failure: Exception) -> str:
    """The kind of an exception and the first line of its words."""
    return f"{type(failure).__name__}: {(str(failure).splitlines() or [''])[0]}"


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
    if route not in ("symbolic", EXTRA):
        raise TypeError(f"Route `{route}` must be a Check, but is {type(check).__name__}.")
    if not _uses_a_name(check):
        raise TypeError("A proof must compute something, but this one uses no name at all.")
    return Verdict("pass" if all(vanishes(e) for e in _flat(check())) else "fail")


def _uses_a_name(function: Callable[..., Any]) -> bool:
    """Whether a function reads anything: a global, an attribute, an argument, a closure."""
    code = getattr(function, "__code__", None)
    return code is None or any(map(_reads, _codes(code)))


def _reads(code: types.CodeType) -> bool:
    arguments = code.co_argcount + code.co_kwonlyargcount
    return bool(code.co_names or code.co_freevars or arguments)


def _codes(code: types.CodeType) -> list[types.CodeType]:
    """The code of a function and of all that are defined in it."""
    inner = [c for c in code.co_consts if isinstance(c, types.CodeType)]
    return [code, *(each for c in inner for each in _codes(c))]


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
    """Whether sympy proves that an expression is zero.

    Raises:
        TypeError: for a truth value or a plain number, which no algebra has made.

    Example:
        >>> import sympy as sp
        >>> from firstorder.ledger import vanishes
        >>> x = sp.Symbol("x")
        >>> vanishes((x + 1) ** 2 - x**2 - 2 * x - 1), vanishes(sp.sin(x) - x)
        (True, False)
    """
    if isinstance(expression, bool):
        raise TypeError("A symbolic proof must return what vanishes, not a truth value.")
    if isinstance(expression, numbers.Number) and not isinstance(expression, sp.Basic):
        raise TypeError(
            f"A symbolic proof must return expressions, but returns the plain number {expression}."
        )
    return sp.simplify(expression) == 0


def _judge_kind(row: Row) -> tuple[Verdict | None, dict[str, Any] | None]:
    """Whether print and truth differ where the row says so, and both values."""
    c = row.counterexample
    if c is None:
        return None, None
    try:
        printed, true = float(c.printed(**c.inputs)), float(c.true(**c.inputs))
    except Exception as failure:
        return Verdict("fail", reason=f"The counterexample fails: {_said(failure)}"), None
    example = {"inputs": dict(c.inputs), "printed": printed, "true": true}
    if row.kind == "identity":
        return Verdict("fail", reason="An identity has no counterexample."), example
    largest = max(abs(printed), abs(true))
    apart = abs(printed - true) / largest if largest else 0.0
    if math.isinf(largest) and printed != true:
        apart = math.inf
    if not apart > DIFFERENT:  # NaN does not differ
        reason = f"The counterexample shows no difference: printed {printed:g}, true {true:g}."
        return Verdict("fail", apart, reason), example
    return Verdict("pass", apart), example
