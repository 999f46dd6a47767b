"""The example `examples/motion`: ten rows of a user's own, and each of their judges can fail."""

import pathlib
import runpy
import shutil

import pytest
import sympy

from firstorder.errors import Refused
from firstorder.ledger import gather, judge, judge_route
from firstorder.symbolic import derive

FOLDER = pathlib.Path(__file__).parents[2] / "examples" / "motion"


@pytest.fixture(scope="module")
def ledger():
    return gather(FOLDER)


def test_the_rows_pass(ledger):
    found = {name: judge(*pair) for name, pair in ledger.items()}
    assert {name: r.status for name, r in found.items()} == dict.fromkeys(found, "pass")
    assert len(found) == 10
    claims = {name for name, r in found.items() if r.row.kind == "over-claim"}
    assert claims == {"motion.moire", "motion.blur"}
    assert all(any(v.error is not None for v in r.verdicts.values()) for r in found.values())


WRONG = {
    # What is changed in a copy of the file, and the judges that must notice.
    "a speed of the other sign": (
        ("{x: x + way}", "{x: x - way}"),
        [
            *((row, "symbolic") for row in ("line", "jet", "covariance", "wedge")),
            *((row, "symbolic") for row in ("sheared_filter", "moire", "photograph", "lamp")),
            *((row, "symbolic") for row in ("rising",)),
            *((row, "fourier") for row in ("line", "covariance", "photograph")),
            ("jet", "autodiff"),
        ],
    ),
    "gratings the other way": (
        ("k * (CELLS[0] - s * CELLS[1])", "k * (CELLS[0] + s * CELLS[1])"),
        [(row, "fourier") for row in ("wedge", "sheared_filter", "moire")],
    ),
    "a filter too wide": (
        ("<= 6)", "<= 6.2)"),
        [("sheared_filter", "brute_force")],
    ),
    "a blur of another shutter": (
        ("s**2 * T**2 / 12", "s**2 * T**2 / 6"),
        [("blur", "symbolic")],
    ),
    "a variance of another shutter": (
        ("1.3**2 / 12", "1.3**2 / 11"),
        [("blur", "brute_force")],
    ),
    "a lamp on the other side": (("* 0.1 * f", "* -0.1 * f"), [("lamp", "fourier")]),
    "an edge the other way": (
        ("x > 0.3 * t", "x > -0.3 * t"),
        [("rising", "brute_force")],
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_row_fails(name, tmp_path):
    (right, wrong), judges = WRONG[name]
    folder = shutil.copytree(FOLDER, tmp_path / "motion")
    file = folder / "light_in_motion.py"
    text = file.read_text()
    assert text.count(right) == 1
    file.write_text(text.replace(right, wrong))
    rows = {row.equation: row for _, row in gather(folder).values()}
    for row, route in judges:
        verdict = judge_route(route, getattr(rows[f"motion.{row}"], route))
        assert (row, route, verdict.verdict, verdict.reason) == (row, route, "fail", "")


def test_where_a_speed_changes_there_is_no_spectrum():
    """What the rows `jet` and `rising` say beside their formulas."""
    names = runpy.run_path(str(FOLDER / "light_in_motion.py"))
    L, moved, t, a = names["L"], names["moved"], names["t"], sympy.Symbol("a", positive=True)
    assert isinstance(derive(L >> moved(a * t**2)).portrait("spectrum"), Refused)
    assert not isinstance(derive(L >> moved(a * t)).portrait("spectrum"), Refused)
