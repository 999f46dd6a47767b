"""Measurements that the site shows and that take too long for a build: squares, and the ledger.

`python -m docs.generate.kept` measures them again, in some five minutes (`make readme`). That they
are still so is judged where each is walked anyway: `tests/checks/test_squares.py` and
`tests/test_kept_measurements.py`.
"""

from __future__ import annotations

import functools
import json
import pathlib
import tempfile
from typing import Any

import derivations
from firstorder import io, session
from firstorder.checks.registry import all_cases
from firstorder.checks.squares import PORTRAITS, Square, square
from firstorder.ledger import report
from firstorder.ledger.rows import EXTRA, ROUTES

FOLDER = pathlib.Path(__file__).parents[1] / "kept"
SQUARES = FOLDER / "squares.json"
LEDGER = FOLDER / "ledger.json"
# Below it an error is rounding, and differs from machine to machine.
ROUNDING = 1e-8

Measured = dict[str, dict[str, Any]]


@functools.cache
def squares() -> Measured:
    """For each case and portrait the verdict of its square, and the error."""
    return json.loads(SQUARES.read_text(encoding="utf-8"))


@functools.cache
def ledger() -> Measured:
    """For each row of the ledger its status, and the error of each route that judged it."""
    return json.loads(LEDGER.read_text(encoding="utf-8"))


def is_current(found: Square) -> bool:
    """Whether a square is as it was kept: its verdict, and its error beyond rounding to 5 %."""
    kept = squares().get(found.name, {}).get(found.portrait)
    if kept is None or kept["verdict"] != found.verdict:
        return False
    errors = kept["error"], found.error
    if errors[0] is None or errors[1] is None:
        return errors[0] == errors[1]
    return max(errors) < ROUNDING or abs(errors[0] - errors[1]) < 0.05 * max(errors)


def words(kept: dict[str, Any]) -> str:
    """A square in words.

    Example:
        >>> from docs.generate.kept import words
        >>> words({"verdict": "equal", "error": 3.2e-16})
        'equal, measured error 3e-16'
        >>> words({"verdict": "refused", "error": None})
        'refused'
    """
    error = kept["error"]
    return kept["verdict"] + ("" if error is None else f", measured error {size(error)}")


def size(error: float) -> str:
    """An error in one digit.

    Example:
        >>> from docs.generate.kept import size
        >>> size(0.0), size(3.2e-16)
        ('0', '3e-16')
    """
    return f"{error:.0e}" if error else "0"


def _measured_squares() -> Measured:
    return {
        name: {p: _told(square(case, p)) for p in PORTRAITS} for name, case in all_cases().items()
    }


def _told(found: Square) -> dict[str, Any]:
    return {"verdict": found.verdict, "error": _rounded(found.error)}


def _measured_ledger() -> Measured:
    """Every row judged."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "rows.json")
        if report(derivations.table, json=file, jobs=2):
            raise SystemExit("The ledger has rows that fail: nothing is kept.")
        rows = json.loads(file.read_text(encoding="utf-8"))
    return {row["equation"]: _judged(row) for row in rows}


def _judged(row: dict[str, Any]) -> dict[str, Any]:
    """Record of a row that is kept: its status, and of each route that passed the error."""
    routes = {name: row[name] for name in (*ROUTES, EXTRA) if name in row}
    passed = {k: _rounded(v["error"]) for k, v in routes.items() if v["verdict"] == "pass"}
    return {"status": row["status"], "errors": passed}


def _rounded(error: float | None) -> float | None:
    """Two digits: what a reader can use."""
    return None if error is None else float(f"{error:.1e}")


def keep() -> None:
    """Measure everything, and keep it."""
    FOLDER.mkdir(exist_ok=True)
    io.write_json(SQUARES, _measured_squares())
    io.write_json(LEDGER, _measured_ledger())


if __name__ == "__main__":
    session.start()
    keep()
