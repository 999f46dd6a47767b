"""Tiles that survive: the same image to the bit, whatever happened on the way."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

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
    mine, fresh = (tmp_path / f".pass0000_tile0000{k}.{k}.npz" for k in (0, 1))
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


def test_a_killed_program_is_resumed_to_the_bit(tmp_path):
    def start(folder, wait):
        command = [sys.executable, "-c", PROGRAM, str(folder), str(wait)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    first = start(tmp_path / "a", 0.05)
    while len(list((tmp_path / "a").glob("pass*"))) < 5:
        assert first.poll() is None
        time.sleep(0.01)
    os.kill(first.pid, signal.SIGKILL)
    first.communicate()
    kept = {f: f.stat().st_mtime_ns for f in (tmp_path / "a").glob("pass*")}
    assert 5 <= len(kept) < PASSES * 12
    resumed, whole = start(tmp_path / "a", 0.0), start(tmp_path / "b", 0.0)
    answers = [p.communicate()[0] for p in (resumed, whole)]
    assert answers[0] == answers[1] != ""
    for file, when in kept.items():
        assert file.stat().st_mtime_ns == when


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
    with pytest.raises(ValueError, match="`side` must be positive, but is 0"):
        render_tiles(noisy, 4, 4, tmp_path, side=0)
