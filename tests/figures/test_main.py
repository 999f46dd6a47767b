import json
import os
import re
import sys

import numpy as np
import pytest

import figures
from figures import claims
from figures.__main__ import Options, main
from firstorder import session

GOOD = '''"""A straight line."""
from figures.style import Drawing
from figures.verdicts import OURS, Statement, at_least, met
from firstorder import plotting

DRAWN = []

def draw(quick):
    DRAWN.append(quick)
    figure, axes = plotting.panels()
    axes[0, 0].plot([0, 1], [0, 1])
    rule = at_least(0.5, "half")
    told = [
        Statement("rises", 1.0, 1.0, rule, "R07 §1", "m", error=0.1, scanned="2 lines"),
        Statement("falls", None, "no", met(False, "goes down"), OURS, reason="It rises."),
    ]
    curves = {"line": {"x": [0.0, 1.0], "y": [0.0, 1.0]}}
    return Drawing(figure, {"y": [0.0, 1.0]}, told, curves, "2 points", 7)
'''
BAD = '"""A failure."""\n\ndef draw(quick):\n    raise ValueError("Argument `d` is\\nbad.")\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    root = tmp_path / "figures"
    scripts = root / "fake"
    (scripts / "shared").mkdir(parents=True)
    (scripts / "good.py").write_text(GOOD)
    (scripts / "shared" / "parts.py").write_text("")
    monkeypatch.setattr(claims, "FOLDER", root)
    monkeypatch.setattr(claims, "KEPT", root / "claims.json")
    monkeypatch.setattr(figures, "__path__", [*figures.__path__, str(root)])
    for shared in ("style.py", "verdicts.py", "timing.py"):
        (root / shared).write_text("")
    yield scripts
    for name in [n for n in sys.modules if n.startswith("figures.fake")]:
        del sys.modules[name]


def drawn():
    return sys.modules["figures.fake.good"].DRAWN


def test_a_figure_is_written_with_its_arrays_curves_and_claims(folder, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(Options(quick=True, out=out, vector="svg")) == 0
    written = {f.name for f in out.iterdir()}
    files = {"png", "svg", "npz", "line.csv", "json"}
    assert written == {f"fake_good.{f}" for f in files} | {"claims.json"}
    with np.load(out / "fake_good.npz") as arrays:
        assert arrays["y"].tolist() == [0.0, 1.0]
    first, second = json.loads((out / "claims.json").read_text())
    assert first.pop("seconds") >= 0.0
    assert first == {
        "figure": "fake_good",
        "claim": "rises",
        "source": "R07 §1",
        "paper": 1.0,
        "measured": 1.0,
        "error": 0.1,
        "unit": "m",
        "rule": "at least 0.5: half",
        "scanned": "2 lines",
        "verdict": "holds",
        "reason": "",
        "size": "2 points",
        "seed": 7,
    }
    assert (second["paper"], second["measured"]) == (None, "no")
    assert (second["verdict"], second["reason"]) == ("refuted", "It rises.")
    shown = capsys.readouterr().out
    assert "judge 2 statements by what we measure: 1 hold and 1 are refuted" in shown
    assert "fake_good  refuted" in shown


def test_a_finished_figure_is_drawn_again_only_when_something_changed(folder, tmp_path, capsys):
    out = tmp_path / "out"
    for _ in range(2):
        assert main(Options(quick=True, out=out)) == 0
    assert drawn() == [True]
    main(Options(quick=True, out=out, force=True))
    assert drawn() == [True] * 2
    main(Options(out=out))
    assert drawn() == [True, True, False]
    main(Options(out=out, vector="pdf"))
    assert len(drawn()) == 4
    (out / "fake_good.npz").unlink()
    main(Options(out=out))
    assert len(drawn()) == 5
    (folder / "good.py").write_text(GOOD + "\n")
    main(Options(out=out))
    assert len(drawn()) == 6


def cut(out):
    (out / "fake_good.png").write_bytes((out / "fake_good.png").read_bytes()[:500])
    return r"fake_good.png has 500 bytes and not \d+"


def changed_in_one_byte(out):
    data = bytearray((out / "fake_good.npz").read_bytes())
    data[len(data) // 2] ^= 1
    (out / "fake_good.npz").write_bytes(data)
    return "fake_good.npz has another content"


def lost(out):
    (out / "fake_good.line.csv").unlink()
    return "fake_good.line.csv is missing"


@pytest.mark.parametrize("damage", [cut, changed_in_one_byte, lost])
def test_a_finished_figure_whose_files_are_not_as_written_is_drawn_again(
    folder, tmp_path, capsys, damage
):
    out = tmp_path / "out"
    main(Options(quick=True, out=out))
    right = {f.name: f.read_bytes() for f in out.iterdir() if f.suffix in (".png", ".csv")}
    words = damage(out)
    capsys.readouterr()
    main(Options(quick=True, out=out))
    assert re.search(f"^fake_good    drawn again: {words}.$", capsys.readouterr().out, re.M)
    assert drawn() == [True] * 2
    assert {name: (out / name).read_bytes() for name in right} == right
    main(Options(quick=True, out=out))
    assert "fake_good    finished before" in capsys.readouterr().out


BROKEN = ["", '{"key": "a", "fi', "[]", "null", '{"key": "a"}', "\udc80"]


@pytest.mark.parametrize("words", BROKEN)
def test_a_broken_record_is_named_and_the_figure_drawn_again(folder, tmp_path, capsys, words):
    out = tmp_path / "out"
    main(Options(quick=True, out=out))
    record = out / "fake_good.json"
    record.write_bytes(words.encode("utf-8", "surrogateescape"))
    (folder / "later.py").write_text(GOOD)
    capsys.readouterr()
    assert main(Options(("fake_later",), quick=True, out=out)) == 0
    told = f"{record} is damaged or another version's"
    assert (
        f"{told}: its claims are left out until fake_good is drawn again."
        in capsys.readouterr().out.splitlines()
    )
    assert main(Options(quick=True, out=out)) == 0
    assert f"fake_good    drawn again: {told}.\n" in capsys.readouterr().out
    assert drawn() == [True] * 2
    assert json.loads(record.read_text())["claims"][0]["verdict"] == "holds"


def test_a_figure_is_drawn_again_with_other_settings_that_change_bits(
    folder, tmp_path, capsys, monkeypatch
):
    out, flags = tmp_path / "out", os.environ.get("XLA_FLAGS", "")
    main(Options(quick=True, out=out))
    assert json.loads((out / "fake_good.json").read_text())["made_with"] == session.settings()
    monkeypatch.setenv("XLA_FLAGS", f"--xla_dump_to=/nowhere {flags}")
    main(Options(quick=True, out=out))
    assert drawn() == [True]
    monkeypatch.setenv("XLA_FLAGS", f"{flags} --xla_cpu_multi_thread_eigen=false")
    main(Options(quick=True, out=out))
    assert drawn() == [True] * 2
    assert "the compiler's settings differ (XLA_FLAGS " in capsys.readouterr().out


def test_a_failing_figure_is_one_sentence_and_a_log_and_the_others_go_on(folder, tmp_path, capsys):
    out = tmp_path / "out"
    (folder / "bad.py").write_text(BAD)
    assert main(Options(out=out)) == 1
    told = [t for t in capsys.readouterr().out.splitlines() if t.startswith("fake_bad could")]
    assert told[-1].startswith("fake_bad could not be drawn: ValueError: Argument `d` is bad. (see")
    assert "Traceback" in (out / "fake_bad.log").read_text()
    assert (out / "fake_good.png").exists()
    assert {r["figure"] for r in json.loads((out / "claims.json").read_text())} == {"fake_good"}


def test_an_interrupted_run_keeps_what_is_finished_and_goes_on_from_there(folder, tmp_path):
    out = tmp_path / "out"
    stop = GOOD.replace("    DRAWN.append(quick)", "    DRAWN.append(quick)\n    STOP()")
    (folder / "later.py").write_text("def STOP():\n    raise KeyboardInterrupt\n" + stop)
    assert main(Options(out=out)) == 130
    assert not (out / "fake_later.json").exists()
    (folder / "later.py").write_text(GOOD)
    del sys.modules["figures.fake.later"]
    assert main(Options(out=out)) == 0
    assert drawn() == [False]
    assert (out / "fake_later.png").exists()


def test_a_claim_that_is_no_finite_number_fails_its_figure(folder, tmp_path):
    (folder / "good.py").write_text(GOOD.replace("1.0, 1.0, ", '1.0, float("nan"), '))
    assert main(Options(out=tmp_path / "out")) == 1


def test_what_is_left_of_an_older_run_goes(folder, tmp_path):
    out = tmp_path / "out"
    main(Options(out=out, vector="svg"))
    (folder / "good.py").write_text(GOOD.replace('"line"', '"slope"'))
    del sys.modules["figures.fake.good"]
    main(Options(out=out))
    assert not (out / "fake_good.line.csv").exists()
    assert not (out / "fake_good.svg").exists()
    assert (out / "fake_good.slope.csv").exists()


def test_an_unknown_name_is_refused_in_a_sentence(folder, tmp_path, capsys):
    assert main(Options(("fake_none",), out=tmp_path)) == 2
    assert capsys.readouterr().err == "There is no figure called 'fake_none': see --list.\n"


def test_the_list_draws_nothing(folder, tmp_path, capsys):
    assert main(Options(list=True, out=tmp_path / "out")) == 0
    assert capsys.readouterr().out.split(maxsplit=1) == ["fake_good", "A straight line.\n"]
    assert not (tmp_path / "out").exists()
