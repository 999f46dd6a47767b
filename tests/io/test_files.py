import json
import stat

import numpy as np
import pytest

from firstorder import io


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


def test_json_comes_back_and_has_null_where_it_has_no_word(tmp_path):
    io.write_json(tmp_path / "a.json", {"a": [1, 0.1, "Ω"], "b": (float("inf"), float("nan"))})
    assert json.loads((tmp_path / "a.json").read_text()) == {"a": [1, 0.1, "Ω"], "b": [None, None]}


def test_arrays_come_back_under_their_names(tmp_path):
    io.write_npz(tmp_path / "a.npz", {"x": np.arange(3), "words": np.array(["a", "b"])})
    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["x"].tolist() == [0, 1, 2]
        assert arrays["words"].tolist() == ["a", "b"]


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
