"""A ledger of equations for anybody's paper: rows, what judges them, and how sharp the judges are.

A folder of Python files lists its rows; `firstorder ledger FOLDER` gathers and judges them.
"""

from firstorder.ledger._out_of_true import put_out
from firstorder.ledger.attacks import FACTORS, REQUIRED, Attacked, attack, functions_of
from firstorder.ledger.catalogue import Entry, own_entry, read_catalogue
from firstorder.ledger.gathering import Ledger, gather
from firstorder.ledger.judging import (
    Result,
    Verdict,
    judge,
    judge_route,
    results_to_pandas,
    vanishes,
)
from firstorder.ledger.reporting import Judged, report
from firstorder.ledger.rows import (
    EXTRA,
    KINDS,
    NUMERIC,
    REASONS,
    ROUTES,
    Check,
    Counterexample,
    NotApplicable,
    Row,
    na,
)

__all__ = [
    "Row",
    "Check",
    "NotApplicable",
    "na",
    "Counterexample",
    "KINDS",
    "ROUTES",
    "NUMERIC",
    "EXTRA",
    "REASONS",
    "Entry",
    "read_catalogue",
    "own_entry",
    "Ledger",
    "gather",
    "judge",
    "judge_route",
    "vanishes",
    "results_to_pandas",
    "Verdict",
    "Result",
    "report",
    "Judged",
    "attack",
    "Attacked",
    "FACTORS",
    "REQUIRED",
    "functions_of",
    "put_out",
]
