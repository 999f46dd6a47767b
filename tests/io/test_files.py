import json
import os
import stat
import subprocess
import sys
import time

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import io
from firstorder.io._parts import ABANDONED


def test_a_file_that_fails_half_way_leaves_the_old_one_and_nothing_else(tmp_path):
    target = tmp_path / "deep" / "a.txt"
    io.write_text(target, "old")

    def fail_half_way():
        with io.atomic_write(target) as part:
            part.write_text("half of the new one")
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        fail_half_way()
    assert target.read_text() == "old"
    assert [f.name for f in target.parent.iterdir()] == ["a.txt"]


def test_the_lent_name_ends_like_the_final_one_and_others_may_read_the_file(tmp_path):
    with io.atomic_write(tmp_path / "a.png") as part:
        assert part.suffix == ".png"
        assert part.parent == tmp_path
    assert stat.S_IMODE((tmp_path / "a.png").stat().st_mode) & stat.S_IRUSR
    plain = tmp_path / "plain"
    plain.touch()
    assert (tmp_path / "a.png").stat().st_mode == plain.stat().st_mode


KILLED = """
import os, pathlib, signal, sys
from firstorder.io.files import atomic_write
with atomic_write(sys.argv[1]) as part:
    part.write_bytes(b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_writer_left_is_swept_by_the_next_one_of_the_same_file(tmp_path):
    target = tmp_path / "a.exr"
    subprocess.run([sys.executable, "-c", KILLED, str(target)], check=False)
    (part,) = tmp_path.iterdir()
    io.write_text(target, "young parts may be another program's")
    assert part.read_bytes() == b"half"
    when = time.time() - ABANDONED - 1.0
    os.utime(part, (when, when))
    io.write_text(tmp_path / "a.b.exr", "another file")
    io.write_text(tmp_path / "a.png", "another format")
    assert part.exists()
    io.write_text(target, "the same file")
    assert {f.name for f in tmp_path.iterdir()} == {"a.exr", "a.b.exr", "a.png"}


@pytest.mark.parametrize(
    "name",
    [
        ".a.settings.exr",  # somebody's hidden file
        ".a.k3_x9q0b.part.exr.txt",
        ".axb.k3_x9q0b.part.exr",  # of axb.exr
        ".a.b.k3_x9q0b.part.exr",  # of a.b.exr
        ".a.k3_x9q0b.part",  # of a
        ".a.k3_x9q0b.part.npz",
    ],
)
def test_what_is_not_a_part_of_the_file_is_left_however_old(tmp_path, name):
    other = tmp_path / name
    other.touch()
    os.utime(other, (0, 0))
    io.write_text(tmp_path / "a.exr", "light")
    assert other.exists()


def test_two_writers_of_one_file_at_once_leave_the_whole_file_of_the_last(tmp_path):
    with io.atomic_write(tmp_path / "a.txt") as one:
        with io.atomic_write(tmp_path / "a.txt") as other:
            one.write_text("one")
            other.write_text("other")
        assert (tmp_path / "a.txt").read_text() == "other"
    assert (tmp_path / "a.txt").read_text() == "one"
    assert len(list(tmp_path.iterdir())) == 1


def test_json_comes_back_and_has_null_where_it_has_no_word(tmp_path):
    io.write_json(tmp_path / "a.json", {"a": [1, 0.1, "Ω"], "b": (float("inf"), float("nan"))})
    assert json.loads((tmp_path / "a.json").read_text()) == {"a": [1, 0.1, "Ω"], "b": [None, None]}


def test_numbers_and_arrays_of_numpy_and_jax_are_numbers_and_lists_in_json(tmp_path):
    given = {"n": np.int64(3), "E": np.float32(0.5), "rows": np.array([[1.0, np.nan]])}
    io.write_json(tmp_path / "a.json", given | {"y": jnp.array([True])})
    assert json.loads((tmp_path / "a.json").read_text()) == {
        "n": 3, "E": 0.5, "rows": [[1.0, None]], "y": [True]
    }  # fmt: skip


def test_arrays_come_back_under_their_names(tmp_path):
    io.write_npz(tmp_path / "a.npz", {"x": np.arange(3), "words": np.array(["a", "b"])})
    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["x"].tolist() == [0, 1, 2]
        assert arrays["words"].tolist() == ["a", "b"]


@pytest.mark.parametrize("name", ["file", "allow_pickle", "a/b.npy", ""])
def test_arrays_may_have_any_name_and_files_any_ending(tmp_path, name):
    io.write_npz(tmp_path / "a.dat", {name: np.arange(3), "other": np.ones(2)})
    with np.load(tmp_path / "a.dat") as arrays:
        assert arrays[name].tolist() == [0, 1, 2]
    assert [f.name for f in tmp_path.iterdir()] == ["a.dat"]


def test_files_of_arrays_are_those_of_numpy_to_the_byte(tmp_path):
    arrays = {"x": np.arange(3), "y": np.array(1.5), "words": np.array(["a", "b"])}
    io.write_npz(tmp_path / "a.npz", arrays)
    np.savez_compressed(tmp_path / "b.npz", **arrays)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_writing_leaves_the_mask_of_the_process_alone(tmp_path, monkeypatch):
    """Who asks for it sets it: other threads would make files for everybody meanwhile."""
    monkeypatch.setattr(os, "umask", lambda mask: pytest.fail("the mask was set"))
    io.write_text(tmp_path / "a.txt", "light")
    assert (tmp_path / "a.txt").read_text() == "light"


def test_columns_come_back_to_the_last_digit(tmp_path):
    io.write_csv(tmp_path / "a.csv", {"x": [0.0, 1.0], "y": np.array([1 / 3, np.pi])})
    rows = [line.split(",") for line in (tmp_path / "a.csv").read_text().splitlines()]
    assert rows[0] == ["x", "y"]
    assert [float(r[1]) for r in rows[1:]] == [1 / 3, np.pi]


@pytest.mark.parametrize("columns", [{"x": [1.0], "y": [1.0, 2.0]}, {"x": [[1.0]]}, {}])
def test_columns_that_do_not_fit_are_refused_in_a_sentence(tmp_path, columns):
    with pytest.raises(ValueError, match="Argument `columns` must be vectors of one length"):
        io.write_csv(tmp_path / "a.csv", columns)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("names", [("E", "E.R"), ("E.R", "E")])
def test_no_column_takes_the_place_of_a_band(tmp_path, names):
    given = {"E": np.ones((2, 3)), "E.R": np.zeros(2)}
    with pytest.raises(ValueError, match=r"must give each column once, but two are called E\.R\."):
        io.write_csv(tmp_path / "a.csv", {name: given[name] for name in names})
