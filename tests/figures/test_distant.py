"""Figures that workers draw: the same files, and what goes wrong in sentences."""

import json
import pathlib

import pytest

from figures import claims, distant, records
from figures.__main__ import Options, key, main
from firstorder.jobs import _dask
from tests.jobs.cluster import Cluster

NAMES = ("d05_fig04", "d05_fig05")


@pytest.fixture(autouse=True)
def no_kept_claims(tmp_path, monkeypatch):
    monkeypatch.setattr(claims, "KEPT", tmp_path / "none.json")


def claims_of(files, name):
    told = json.loads(files[f"{name}.json"])["claims"]
    return [{k: v for k, v in claim.items() if k != "seconds"} for claim in told]


def test_workers_draw_the_same_files_and_one_that_is_killed_costs_nothing(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    here, there = tmp_path / "here", tmp_path / "there"
    assert main(Options(NAMES, quick=True, out=here)) == 0
    with Cluster(2, tmp_path) as cluster:
        plain = distant.drawn

        def killing(*given):
            for found in plain(*given):
                cluster.kill_worker()
                yield found

        monkeypatch.setattr(distant, "drawn", killing)
        assert main(Options(NAMES, quick=True, out=there, scheduler=cluster.address)) == 0
    ours, theirs = ({f.name: f.read_bytes() for f in folder.iterdir()} for folder in (here, there))
    assert set(ours) == set(theirs)
    assert [f for f in ours if f.endswith((".png", ".npz")) and ours[f] != theirs[f]] == []
    for name in NAMES:
        asked = {f"{name}.png"}
        assert records.why_drawn(name, there, key(name, True), asked) == ""
        assert claims_of(theirs, name) == claims_of(ours, name) != []


def test_other_code_there_is_refused(tmp_path):
    pen = distant._Pen(Options(quick=True, out=tmp_path, scheduler="tcp://a:1"))
    with pytest.raises(ValueError, match="but one has other code for d05_fig05, or other versions"):
        pen(("d05_fig05", "another key"))


def test_a_figure_that_fails_there_comes_with_its_log(tmp_path, monkeypatch):
    import figures.__main__ as program

    def failing(name, options):
        (options.out / f"{name}.log").write_text("Traceback")
        return (
            name,
            1.0,
            f"{name} could not be drawn: OSError: full (see {options.out / name}.log).",
        )

    monkeypatch.setattr(program, "draw", failing)
    out = tmp_path / "out"
    found = distant._Pen(Options(quick=True, out=out))(("d05_fig05", key("d05_fig05", True)))
    distant.write(found, out)
    assert (
        found.failure
        == f"d05_fig05 could not be drawn: OSError: full (see {out / 'd05_fig05'}.log)."
    )
    assert [f.name for f in out.iterdir()] == ["d05_fig05.log"]


def test_a_record_is_written_last(tmp_path, monkeypatch):
    written, plain = [], distant.io.atomic_write
    monkeypatch.setattr(
        distant.io, "atomic_write", lambda p: written.append(pathlib.Path(p).name) or plain(p)
    )
    distant.write(
        distant.Drawn("a", 1.0, None, {"a.json": b"", "a.npz": b"", "a.png": b""}), tmp_path
    )
    assert written == ["a.npz", "a.png", "a.json"]


def test_no_scheduler_is_a_sentence_and_exit_code_1(tmp_path, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(_dask, "FIRST", 0.5)
    asked = Options(("d05_fig05",), quick=True, out=tmp_path, scheduler="tcp://127.0.0.1:1")
    assert main(asked) == 1
    told = capsys.readouterr().out.splitlines()[-1]
    assert told.startswith("Argument `scheduler` must be the address of a scheduler of dask.dis")
