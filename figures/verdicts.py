"""What a figure says in words and numbers: statements, which have a verdict, and measurements.

A statement is judged by a rule that was written down before the run; the verdict is computed from
what was measured, never typed. A number that has a standard error decides nothing within two of it:

    holds       the rule is met
    refuted     it is not, and `reason` says by what mechanism and in which range
    undecided   what was measured lies within two standard errors of the threshold
    measured    not a statement: a plain number, listed apart and not counted

Example:
    >>> faster = Statement(
    ...     "Time of the full image over that of 17 %", paper=6.6, measured=2.2, error=0.1,
    ...     rule=at_least(6.6, "the paper's number"), source="R07 §9.1",
    ...     reason="Gradients cost half as much as values here.",
    ... )
    >>> faster.verdict, faster.rule.words
    ('refuted', "at least 6.6: the paper's number")
    >>> Statement("The same", 2.3, 2.2, at_least(2.3), "R07 §9.1", error=0.1).verdict
    'undecided'
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

Quantity = float | str | None
HOLDS, REFUTED, UNDECIDED, MEASURED = "holds", "refuted", "undecided", "measured"
VERDICTS = (HOLDS, REFUTED, UNDECIDED, MEASURED)
# Who is asked for a statement that no paper makes.
OURS = "ours"


@dataclass(frozen=True)
class Rule:
    """How a statement is read: words, and by how much a number meets them (negative: not)."""

    words: str
    margin: Callable[[float], float]


def at_least(threshold: float, why: str = "") -> Rule:
    """Met by `threshold` and what is larger."""
    return Rule(_because(f"at least {threshold:g}", why), lambda x: x - threshold)


def at_most(threshold: float, why: str = "") -> Rule:
    """Met by `threshold` and what is smaller."""
    return Rule(_because(f"at most {threshold:g}", why), lambda x: threshold - x)


def between(low: float, high: float, why: str = "") -> Rule:
    """Met from `low` to `high`, both included."""
    words = _because(f"from {low:g} to {high:g}", why)
    return Rule(words, lambda x: min(x - low, high - x))


def near(value: float, share: float, why: str = "") -> Rule:
    """Met within a share of `value`: `near(6.6, 0.1)` from 5.94 to 7.26."""
    off = share * abs(value)
    words = _because(f"within {100.0 * share:g} % of {value:g}", why)
    return Rule(words, lambda x: off - abs(x - value))


def met(condition: Any, words: str) -> Rule:
    """A condition that is not one number's: several at once, an order, words."""
    holds = bool(condition)
    return Rule(words, lambda _: math.inf if holds else -math.inf)


@dataclass(frozen=True)
class Statement:
    """What somebody says, beside what we measure.

    Attributes:
        claim: one line, the same at every size (numbers that depend on a run are `measured`).
        paper: the paper's value, or its words, or None where it gives none.
        measured: ours.
        rule: how it is read.
        source: where it stands, "R07 §9.1", "E11 Fig. 10", or `OURS` for what no paper says.
        unit: of `paper`, `measured` and `error`.
        error: standard error of `measured`, over seeds, lay-outs or interleaved repetitions.
        scanned: which parameters were varied and over what, in words.
        reason: why it does not hold and in which range, in one or two sentences; shown if refuted.
    """

    claim: str
    paper: Quantity
    measured: Quantity
    rule: Rule
    source: str
    unit: str = ""
    error: float | None = None
    scanned: str = ""
    reason: str = ""

    @property
    def verdict(self) -> str:
        """`holds`, `refuted`, or `undecided` within two standard errors of the threshold."""
        measured = _plain(self.measured)
        margin = self.rule.margin(measured if isinstance(measured, float) else math.nan)
        if math.isnan(margin):
            raise ValueError(
                f"The rule {self.rule.words!r} wants a number, but {self.claim!r} measured "
                f"{self.measured!r}."
            )
        if abs(margin) < 2.0 * (self.error or 0.0):
            return UNDECIDED
        return HOLDS if margin >= 0.0 else REFUTED

    def as_json(self) -> dict[str, Any]:
        """Plain values; numbers stay numbers."""
        return {
            "claim": self.claim,
            "source": self.source,
            "paper": _plain(self.paper),
            "measured": _plain(self.measured),
            "error": _plain(self.error),
            "unit": self.unit,
            "rule": self.rule.words,
            "scanned": self.scanned,
            "verdict": self.verdict,
            "reason": self.reason if self.verdict == REFUTED else "",
        }


@dataclass(frozen=True)
class Measurement:
    """A number beside which nobody says anything that could be true or false.

    Attributes:
        claim: one line that names what was measured, the same at every size.
        measured: the value, or words.
        unit: of it.
        error: its standard error.
        source: the place in a paper that it belongs to, if any.
    """

    claim: str
    measured: Quantity
    unit: str = ""
    error: float | None = None
    source: str = ""

    def as_json(self) -> dict[str, Any]:
        """Plain values, with the keys of a statement."""
        return {
            "claim": self.claim,
            "source": self.source,
            "paper": None,
            "measured": _plain(self.measured),
            "error": _plain(self.error),
            "unit": self.unit,
            "rule": "",
            "scanned": "",
            "verdict": MEASURED,
            "reason": "",
        }


def _because(words: str, why: str) -> str:
    return f"{words}: {why}" if why else words


def _plain(quantity: Any) -> Quantity:
    """A number that JSON can hold; NumPy's and JAX's scalars are neither `int` nor `float`."""
    if quantity is None or isinstance(quantity, str):
        return quantity
    value = np.asarray(quantity)
    if value.ndim:
        raise ValueError(f"A claim's value must be one number, but has shape {value.shape}.")
    if not np.isfinite(value):
        raise ValueError(f"A claim's value must be finite, but is {value}.")
    return float(value)
