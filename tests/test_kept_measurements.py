"""What the site shows of long measurements is complete, and of the ledger that is there now.

Squares are compared where they are walked: `tests/checks/test_squares.py`.
"""

import pytest

from derivations import table
from docs.generate import kept, notebook_pictures
from firstorder.checks.registry import all_cases
from firstorder.checks.squares import PORTRAITS
from firstorder.ledger import Check, judge
from firstorder.ledger.rows import EXTRA, ROUTES

AGAIN = "python -m docs.generate.kept"
# One row of each kind of route that takes less than a second.
JUDGED_AGAIN = ("R07.12", "D05.14", "R07.1", "E11.1", "J12.16")


def test_every_square_is_kept():
    assert {name: tuple(row) for name, row in kept.squares().items()} == {
        name: PORTRAITS for name in all_cases()
    }, AGAIN


def test_no_kept_square_is_larger_than_what_passes():
    for name, row in kept.squares().items():
        for portrait, found in row.items():
            refused = found["verdict"] == "refused"
            assert refused or found["error"] <= all_cases()[name].bound(portrait), (name, portrait)


def test_every_row_is_kept_with_the_routes_that_it_has():
    found = {name: set(row["errors"]) for name, row in kept.ledger().items()}
    judging = {
        name: {r for r in (*ROUTES, EXTRA) if callable(route(row, r)) or is_check(row, r)}
        for name, (_, row) in table().items()
    }
    assert found == judging, AGAIN


def route(row, name):
    return getattr(row, name)


def is_check(row, name):
    return isinstance(route(row, name), Check)


def test_every_kept_error_passes_and_no_row_fails():
    for name, (_, row) in table().items():
        found = kept.ledger()[name]
        assert found["status"] in ("pass", "stated"), name
        for r, error in found["errors"].items():
            assert not is_check(row, r) or error <= route(row, r).bound, (name, r)


@pytest.mark.parametrize("equation", JUDGED_AGAIN)
def test_a_row_that_is_judged_again_has_the_kept_verdict(equation):
    told = kept._judged(judge(*table()[equation]).as_json())
    assert told["status"] == kept.ledger()[equation]["status"], AGAIN
    assert set(told["errors"]) == set(kept.ledger()[equation]["errors"])


def test_every_notebook_has_a_kept_picture():
    for file in notebook_pictures.NOTEBOOKS.glob("*.py"):
        shown = notebook_pictures.of(file.stem)
        assert shown, f"{file.stem}: python -m docs.generate.notebook_pictures"
        assert all(picture.read_bytes()[:4] == b"\x89PNG" for picture in shown)
    names = {f.stem.rpartition("-")[0] for f in notebook_pictures.FOLDER.glob("*.png")}
    assert names == {f.stem for f in notebook_pictures.NOTEBOOKS.glob("*.py")}
