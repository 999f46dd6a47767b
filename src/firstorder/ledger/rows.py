"""Rows of a ledger of equations: a statement, and the plain functions that judge it.

A symbolic proof returns what must vanish; a numeric route returns an error that is compared with
its bound. A row judges the *corrected* statement, and says beside it what a paper prints.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

KINDS = ("identity", "definition", "approximation", "misprint", "over-claim", "not ours")
NUMERIC = ("autodiff", "fourier", "brute_force")
ROUTES = ("symbolic", *NUMERIC)
# Nobody misses it where it is left out: a proof that starts from what the library itself derives.
EXTRA = "derived"

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
class Check:
    """A numeric route: a function that returns an error, and the largest error that passes.

    Example:
        >>> import math
        >>> from firstorder.ledger import Check
        >>> Check(lambda: abs(math.sin(1e-3) - 1e-3), bound=1e-9)
        Check(error=<function ...>, bound=1e-09)
    """

    error: Callable[[], Any]
    bound: float


@dataclasses.dataclass(frozen=True)
class NotApplicable:
    """A route left out for one of `REASONS`.

    Raises:
        ValueError: if the reason is none of them.
    """

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

    Example:
        >>> from firstorder.ledger import Counterexample
        >>> wrong = Counterexample({"x": 2.0}, printed=lambda x: x, true=lambda x: x * x)
        >>> wrong.printed(**wrong.inputs), wrong.true(**wrong.inputs)
        (2.0, 4.0)
    """

    inputs: Mapping[str, Any]
    printed: Callable[..., Any]
    true: Callable[..., Any]


Route: TypeAlias = Check | NotApplicable | Callable[[], Any] | None


@dataclasses.dataclass(frozen=True)
class Row:
    """One statement and its judges. A route left as None says "not yet" and never counts as passed.

    Attributes:
        equation: id, such as "R07.25": the paper before the first dot.
        kind: one of `KINDS`.
        implements: dotted name of what implements it, or "" if nothing does (yet).
        symbolic: function that returns one or more sympy expressions, all zero if it holds.
        autodiff, fourier, brute_force: `Check`, or `na(reason)`.
        derived: like `symbolic`, with a formula that `firstorder.symbolic.derive` found; a row may
            do without.
        corrected: the right formula, where the printed one is wrong.
        counterexample: where the printed one fails.
        note: what a reader should know; for an approximation its order and domain.
        statement: what it says, if no catalogue does.
        printed: the formula in the paper's symbols, if no catalogue has it.
        unnoticed: why the row does not notice that what it names is off by a tenth of a per cent
            (`attack`); "" if it does.

    Raises:
        ValueError: if the kind is none, a misprint has no correction or no counterexample, or a
            route is left out because of others that are not there.

    Example:
        >>> import sympy as sp
        >>> from firstorder.ledger import Entry, Row, judge, na
        >>> x = sp.Symbol("x")
        >>> row = Row(
        ...     "T.1",
        ...     "identity",
        ...     symbolic=lambda: sp.sin(x) ** 2 + sp.cos(x) ** 2 - 1,
        ...     autodiff=na("no derivative"),
        ...     fourier=na("no spectrum"),
        ...     brute_force=na("one route"),
        ... )
        >>> judge(Entry("T.1", "Pythagoras."), row).status
        'pass'
    """

    equation: str
    kind: str
    implements: str = ""
    symbolic: Route = None
    autodiff: Route = None
    fourier: Route = None
    brute_force: Route = None
    derived: Callable[[], Any] | None = None
    corrected: str = ""
    counterexample: Counterexample | None = None
    note: str = ""
    statement: str = ""
    printed: str = ""
    unnoticed: str = ""

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

    @property
    def paper(self) -> str:
        """Name of the paper: the part of the id before its first dot."""
        return self.equation.partition(".")[0]


def na(reason: str) -> NotApplicable:
    """A route that is left out for one of the listed reasons, `REASONS`.

    Raises:
        ValueError: if it is none of them.

    Example:
        >>> from firstorder.ledger import na
        >>> na("no spectrum")
        NotApplicable(reason='no spectrum')
    """
    return NotApplicable(reason)
