"""Errors of squares, computed once per process: most numeric routes of the ledger are squares."""

from __future__ import annotations

import functools

from firstorder.checks.registry import cases
from firstorder.checks.squares import square


@functools.cache
def square_error(case: str, portrait: str) -> float:
    """Normwise error of one square; a refusal is infinite, so it never passes for a proof."""
    error = square(cases()[case], portrait).error
    return float("inf") if error is None else error


@functools.cache
def refusal(case: str, portrait: str) -> float:
    """0 if the square is refused with a reason, infinity if it is not: for "no formula" rows."""
    found = square(cases()[case], portrait)
    return 0.0 if found.verdict == "refused" and found.reason else float("inf")
