"""Tiles that survive: the same image to the bit, whatever happened on the way."""

import io
import json
import os
import signal
import subprocess
import sys
import time

import jax
import numpy as np
import pytest

from firstorder import session
from firstorder.rendering.tiles import _tiles, render_tiles

WIDTH, HEIGHT, SIDE, PASSES = 50, 34, 16, 3


def noisy(p, number):
    """Random numbers of the pass and the place."""
    rng = np.random.default_rng([number, *p[0].astype(int)])
    return {"value": np.sin(p[:, 0]) + rng.normal(size=len(p)), "half": 0.5 * p[:, 1]}


def made(folder, shade=noisy, **options):
    return render_tiles(shade, WIDTH, HEIGHT, folder, side=SIDE, passes=PASSES, **options)


def test_tiles_cover_every_pixel_once():
    seen = np.zeros((WIDTH, HEIGHT), int)
    for tile in _tiles(WIDTH, HEIGHT, SIDE):
        i, j = tile.places.astype(int).T
        seen[i, j] += 1
        assert len(i) == np.prod(tile.shape)
    np.testing.assert_array_equal(seen, 1)


def test_the_mean_over_passes(tmp_path):
    found = made(tmp_path)
    value = [noisy(t.places, k)["value"].reshape(t.shape) for k in range(PASSES)
             for t in _tiles(WIDTH, HEIGHT, SIDE) if t.left == t.low == 0]  # fmt: skip
    np.testing.assert_allclose(found["value"][:SIDE, :SIDE], np.mean(value, 0), rtol=1e-14)
    np.testing.assert_allclose(found["half"][3], 0.5 * (np.arange(HEIGHT) + 0.5), rtol=1e-14)


def test_what_a_killed_program_was_writing_is_swept_up(tmp_path):
    """Not what another one may still be writing, and not another's tiles."""
    made(tmp_path)
    mine, fresh = (tmp_path / f".pass0000_tile0000{k}.k3_x9q0{k}.part.npz" for k in (0, 1))
    for part in (mine, fresh):
        part.write_bytes(b"half")
    os.utime(mine, (0, 0))
    with pytest.raises(ValueError, match="tiles of this image"):
        made(tmp_path, key="other")
    assert mine.exists()
    made(tmp_path)
    assert not mine.exists()
    assert fresh.exists()
    assert len(list(tmp_path.glob("pass*.npz"))) == PASSES * len(list(_tiles(WIDTH, HEIGHT, SIDE)))


def test_an_interruption_costs_only_what_was_not_finished(tmp_path):
    """A shading function that fails in the middle of the second pass."""
    calls = []

    def failing(p, number):
        calls.append(number)
        if len(calls) == 17:
            raise KeyboardInterrupt
        return noisy(p, number)

    with pytest.raises(KeyboardInterrupt):
        made(tmp_path / "a", failing)
    again = []

    def counted(p, number):
        again.append(number)
        return noisy(p, number)

    resumed = made(tmp_path / "a", counted)
    whole = made(tmp_path / "b")
    assert len(again) == PASSES * 12 - 16
    for name, values in whole.items():
        np.testing.assert_array_equal(resumed[name], values)


PROGRAM = """
import sys, time
import numpy as np
from firstorder.rendering.tiles import render_tiles
def noisy(p, number):
    time.sleep(float(sys.argv[2]))
    rng = np.random.default_rng([number, *p[0].astype(int)])
    return {"value": np.sin(p[:, 0]) + rng.normal(size=len(p))}
found = render_tiles(noisy, 50, 34, sys.argv[1], side=16, passes=3)
print(found["value"].tobytes().hex())
"""


def test_a_program_killed_again_and_again_is_resumed_to_the_bit(tmp_path):
    """At random moments of every tile, its writing included."""
    wait = np.random.default_rng(0)

    def start(folder, wait):
        command = [sys.executable, "-c", PROGRAM, str(folder), str(wait)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    def tiles():
        return {f: f.stat().st_mtime_ns for f in (tmp_path / "a").glob("pass*")}

    for count in (4, 20):
        process = start(tmp_path / "a", 0.03)
        while len(tiles()) < count:
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(wait.uniform(0.0, 0.06))
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
    kept = tiles()
    assert 20 <= len(kept) < PASSES * 12
    resumed, whole = start(tmp_path / "a", 0.0), start(tmp_path / "b", 0.0)
    answers = [p.communicate()[0] for p in (resumed, whole)]
    assert answers[0] == answers[1] != ""
    for file, when in kept.items():
        assert file.stat().st_mtime_ns == when


def truncated(data):
    return data[: len(data) // 2]


def empty(data):
    return b""


def without_its_end(data):
    return data[:-30]


def with_a_number_that_is_nan(data):
    """Unpacked, a number made NaN and packed without compression, under the old checksum."""
    with np.load(io.BytesIO(data)) as kept:
        arrays = {name: kept[name] for name in kept.files}
    plain = io.BytesIO()
    np.savez(plain, **arrays)
    number = arrays["value"][0, 0].tobytes()
    changed = plain.getvalue().replace(number, np.array(np.nan).tobytes(), 1)
    assert changed != plain.getvalue()
    return changed


def of_another_shape(data):
    file = io.BytesIO()
    np.savez_compressed(file, value=np.zeros((SIDE, SIDE + 1)), half=np.zeros((SIDE, SIDE + 1)))
    return file.getvalue()


def of_words(data):
    file = io.BytesIO()
    np.savez_compressed(file, value=np.full((SIDE, SIDE), "a"), half=np.full((SIDE, SIDE), "b"))
    return file.getvalue()


def without_arrays(data):
    file = io.BytesIO()
    np.savez_compressed(file)
    return file.getvalue()


def no_npz(data):
    return b"hello"


@pytest.mark.parametrize(
    "damage",
    [truncated, empty, without_its_end, with_a_number_that_is_nan, of_another_shape, of_words,
     without_arrays, no_npz],
)  # fmt: skip
def test_a_damaged_tile_is_named_kept_aside_and_made_anew(tmp_path, damage):
    whole, tile = made(tmp_path), tmp_path / "pass0001_tile00004.npz"
    right, others = tile.read_bytes(), {f: f.stat().st_mtime_ns for f in tmp_path.iterdir()}
    tile.write_bytes(damage(right))
    broken = tile.read_bytes()
    told = r"^pass0001_tile00004.npz is damaged \(.*\): it is kept as .*npz.damaged and made anew.$"
    with pytest.warns(UserWarning, match=told) as warned:
        again = made(tmp_path)
    assert len(warned) == 1
    for name, values in whole.items():
        assert again[name].tobytes() == values.tobytes()
    aside = tile.with_name(f"{tile.name}.damaged")
    assert aside.read_bytes() == broken
    assert np.load(tile)["value"].tobytes() == np.load(io.BytesIO(right))["value"].tobytes()
    assert set(tmp_path.iterdir()) == {*others, aside}
    assert all(f.stat().st_mtime_ns == when for f, when in others.items() if f != tile)
    made(tmp_path)  # no warning: it is whole again


def test_numbers_that_are_not_finite_may_be_answers(tmp_path):
    """As the distance of the sky is."""
    for _ in range(2):
        found = made(tmp_path, lambda p, _: {"distance": np.where(p[:, 0] < 9.0, np.inf, np.nan)})
        assert np.isinf(found["distance"][0, 0])
        assert np.isnan(found["distance"][-1, 0])


BROKEN = ["", '{"width": 50, "hei', "[]", "null", '{"made_with": 3}', "\0"]


@pytest.mark.parametrize("words", [None, *BROKEN])
def test_tiles_without_a_readable_job_are_nobodys(tmp_path, words):
    folder = tmp_path / "a_tiles"
    made(folder)
    job = folder / "job.json"
    job.unlink() if words is None else job.write_text(words)
    before = set(folder.iterdir())
    with pytest.raises(ValueError, match="nothing tells whose") as told:
        made(folder)
    assert str(told.value) == (
        f"{job} is {'missing' if words is None else 'damaged'}, so nothing tells whose tiles these "
        "are: delete the folder a_tiles and render again, or choose another one."
    )
    assert set(folder.iterdir()) == before


@pytest.mark.parametrize("words", BROKEN)
def test_a_broken_job_without_tiles_is_set_aside_and_written_anew(tmp_path, words):
    (tmp_path / "job.json").write_text(words)
    with pytest.warns(UserWarning, match=r"^job.json is damaged .*kept as job.json.damaged"):
        found = made(tmp_path)
    assert (tmp_path / "job.json.damaged").read_text() == words
    np.testing.assert_array_equal(found["half"], made(tmp_path)["half"])


def test_what_lacks_is_not_made_with_other_settings_of_the_compiler(tmp_path, monkeypatch):
    whole = made(tmp_path)
    flags = os.environ.get("XLA_FLAGS", "")
    monkeypatch.setenv("XLA_FLAGS", f"{flags} --xla_cpu_multi_thread_eigen=false")
    np.testing.assert_array_equal(made(tmp_path)["value"], whole["value"])  # all are there
    lost = tmp_path / "pass0002_tile00011.npz"
    lost.unlink()
    with pytest.raises(ValueError, match=r"differ \(XLA_FLAGS .*, now .*eigen=false.*\): set"):
        made(tmp_path)
    monkeypatch.setenv("XLA_FLAGS", f"--xla_dump_to=/nowhere {flags}")  # writes, and changes no bit
    assert made(tmp_path)["value"].tobytes() == whole["value"].tobytes()
    assert lost.exists()


def test_a_job_of_before_says_nothing_of_settings_and_is_taken(tmp_path):
    whole, job = made(tmp_path), tmp_path / "job.json"
    words = json.loads(job.read_text())
    assert words.pop("made_with") == {**session.settings(), "device": jax.default_backend()}
    job.write_text(json.dumps(words))
    (tmp_path / "pass0002_tile00011.npz").unlink()
    np.testing.assert_array_equal(made(tmp_path)["value"], whole["value"])


def test_progress_can_be_looked_at(tmp_path):
    seen = []
    found = made(tmp_path, after_pass=lambda layers, k: seen.append((k, layers["half"][0, 0])))
    assert [k for k, _ in seen] == [0, 1, 2]
    assert seen[-1][1] == found["half"][0, 0]


@pytest.mark.parametrize(
    ("change", "what"), [(dict(key="b"), "key"), (dict(width=WIDTH + 1), "width")]
)
def test_a_folder_of_another_image_is_refused(tmp_path, change, what):
    made(tmp_path, key="a")
    given = dict(width=WIDTH, height=HEIGHT, side=SIDE, key="a") | change
    width, height = given.pop("width"), given.pop("height")
    with pytest.raises(ValueError, match=rf"holds those of another one \({what} differ\)"):
        render_tiles(noisy, width, height, tmp_path, **given)


def test_sizes_must_be_positive(tmp_path):
    with pytest.raises(ValueError, match="`side` must be a positive integer, but is 0"):
        render_tiles(noisy, 4, 4, tmp_path, side=0)


@pytest.mark.parametrize(
    ("shade", "error", "words"),
    [
        (lambda p, number: p[:, 0], TypeError, "`shade` must give arrays by layer's name"),
        (lambda p, number: {"value": 3.0}, ValueError, "a row for each of 6 places, but its layer"),
        (lambda p, number: {"value": p[:2, 0]}, ValueError, r"'value' has shape \(2,\)"),
    ],
)
def test_what_shading_gives_fits_the_tile(tmp_path, shade, error, words):
    with pytest.raises(error, match=words):
        render_tiles(shade, 3, 2, tmp_path, quiet=True)
