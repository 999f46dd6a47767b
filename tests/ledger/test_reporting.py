import functools
import json

import pytest

from firstorder.ledger import Judged, gather, report

ROWS = """
import sympy as sp
from firstorder.conventions import mirror_direction
from firstorder.ledger import ROUTES, Check, Counterexample, Row, na

x = sp.Symbol("x")
OUT = {"autodiff": na("no derivative"), "fourier": na("no spectrum")}
NAME = "firstorder.conventions.mirror_direction"


def mirrored():
    return abs(float(mirror_direction(0.3, 0.0)) + 0.3)


ROWS = [
    Row(
        "P.1",
        "identity",
        NAME,
        statement="A mirror turns the angle around.",
        symbolic=lambda: sp.sin(-x) + sp.sin(x),
        brute_force=Check(mirrored, 1e-12),
        **OUT,
    ),
    Row("P.2", "definition", statement="A name.", **dict.fromkeys(ROUTES, na("definition"))),
    Row("Q.1", "identity", NAME, statement="Nothing yet.", brute_force=Check(lambda: 0.0, 1.0)),
]
DERIVED = {"P.1": lambda: sp.cos(-x) - sp.cos(x)}
"""
WRONG = """
from firstorder.ledger import ROUTES, Counterexample, Row, na

same = Counterexample({"x": 2.0}, printed=lambda x: x + x, true=lambda x: x * x)
OUT = dict.fromkeys(ROUTES, na("definition"))
ROWS = [
    Row("W.1", "misprint", statement="A.", corrected="x^2", counterexample=same, **OUT),
    Row("W.2", "identity", statement="B.", **OUT | {"symbolic": lambda: 0}),
]
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "optics.py").write_text(ROWS)
    return tmp_path


def judged(folder, *equations, **options):
    return report(functools.partial(gather, folder), equations, **options)


def test_rows_are_printed_and_counted(folder, capsys):
    assert judged(folder) == 0
    one, two, three, *counts = capsys.readouterr().out.splitlines()
    assert one.split()[:3] == ["P.1", "pass", "identity"]
    assert one.endswith("A mirror turns the angle around.")
    assert "s:ok" in one
    assert "d:ok" in one
    assert two.split()[:2] == ["P.2", "stated"]
    assert "d:" not in two
    assert three.split()[1:3] == ["not", "yet"]
    assert "P: 1 pass, 1 stated" in counts
    assert "  derived by the library: 1 pass" in counts
    assert "Q: 1 not yet" in counts


def test_rows_are_chosen_and_written(folder, tmp_path, capsys):
    out = tmp_path / "rows.json"
    assert judged(folder, "P", json=out) == 0
    first, second = json.loads(out.read_text())
    assert first["equation"] == "P.1"
    assert first["derived"] == {"verdict": "pass", "error": None, "reason": ""}
    assert "derived" not in second
    assert len(capsys.readouterr().out.split("\n\n")[0].splitlines()) == 2
    with pytest.raises(ValueError, match=r"matches no row: P\.9"):
        judged(folder, "P.9")


def test_what_fails_is_said_in_sentences(tmp_path, capsys):
    (tmp_path / "wrong.py").write_text(WRONG)
    assert judged(tmp_path) == 1
    out = capsys.readouterr().out
    assert "W: 2 fail" in out
    assert (
        "W.1 fails by kind: The counterexample shows no difference: printed 4, true 4.\n"
        "W.2 fails by symbolic: TypeError: A proof must compute something"
    ) in out


def test_several_processes_judge_as_one_does(folder, capsys):
    judged(folder)
    one = capsys.readouterr().out
    assert judged(folder, jobs=2) == 0
    words = [line.partition(" s  ")[0][:60] for line in one.splitlines()]
    assert [line[:60] for line in capsys.readouterr().out.splitlines()] == [w[:60] for w in words]


def test_attacks_are_printed_and_written(folder, tmp_path, capsys):
    out = tmp_path / "attacks.json"
    assert judged(folder, attacked=True, json=out) == 1
    first, second, _, counts = capsys.readouterr().out.splitlines()
    assert first.split()[:2] == ["P.1", "notices"]
    assert second.startswith("Q.1                        does not call it")
    assert counts == "1 notices, 1 does not call it"
    assert json.loads(out.read_text())[0]["noticed"] == {
        "1.001": "brute_force",
        "0.999": "brute_force",
        "-1": "brute_force",
    }
    assert judged(folder, "P", attacked=True) == 0


def test_a_name_that_is_nothing_does_not_end_the_attack(tmp_path, capsys):
    text = ROWS.replace('"firstorder.conventions.mirror_direction"', '"firstorder.nothing"')
    (tmp_path / "optics.py").write_text(text)
    assert judged(tmp_path, attacked=True) == 1
    assert "cannot be attacked" in capsys.readouterr().out


def test_a_judged_row_says_which_routes_fail():
    fail = {"verdict": "fail", "error": 0.5, "reason": ""}
    row = {"kind": "identity", "statement": "A.", "fourier": fail, "kind_judged": None}
    assert Judged("T.1", "fail", row, 0.1).failures() == ["T.1 fails by fourier: 0.5"]
