"""A few kills of `make fuzz`, and that a lost, a rewritten and a wrong tile would be seen."""

import numpy as np
import pytest

from tests.fuzz import workers


@pytest.mark.slow
def test_three_kills_lose_nothing(tmp_path):
    for package in ("distributed", "OpenEXR"):
        pytest.importorskip(package)
    kills = 0
    # A scene whose programs are soon traced: each worker that begins must do so.
    for found in workers.renders(tmp_path, 0, 3, "examples/colour.toml", (1.0, 5.0)):
        assert (found.lost, found.twice, found.wrong) == (0, 0, [])
        kills += found.kills.total()
    assert kills == 3


class Idle:
    """A cluster that harms files instead of workers."""

    address, workers = "", (None,)

    def __init__(self, harm):
        self.kill_worker = self.kill_scheduler = lambda *_: harm()


class Done:
    returncode, pid = 0, 0

    def communicate(self, timeout=None):
        return b"", b""


@pytest.mark.parametrize(("harm", "lost", "twice", "wrong"), [
    (lambda tile, image: None, 0, 0, 0),
    (lambda tile, image: tile.unlink(), 1, 1, 0),
    (lambda tile, image: tile.write_bytes(b"again"), 0, 1, 0),
    (lambda tile, image: image.write_bytes(b"other"), 0, 0, 1),
])  # fmt: skip
def test_what_is_lost_twice_or_wrong_is_counted(tmp_path, monkeypatch, harm, lost, twice, wrong):
    out, tiles = tmp_path / "a.exr", tmp_path / "a_tiles"
    tiles.mkdir()
    for k in range(workers.TILES):
        (tiles / f"pass{k:04d}_tile00000.npz").write_bytes(b"tile")
    for file in (out, out.with_suffix(".png")):
        file.write_bytes(b"image")
    times = iter([None, lambda: harm(next(tiles.iterdir()), out)])

    def once():
        if (act := next(times, None)) is not None:
            act()

    monkeypatch.setattr(workers, "_client", lambda *_: Done())
    monkeypatch.setattr(workers, "_ended", lambda *_: False)
    rng = np.random.default_rng(2)  # workers and schedulers alone
    found = workers._disturbed(out, Idle(once), rng, 2, [b"image"] * 2)  # pyright: ignore
    assert (found.lost, found.twice, len(found.wrong)) == (lost, twice, wrong)
