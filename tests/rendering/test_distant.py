"""Images whose tiles workers make: the same to the bit, and a scheduler is all they share."""

import os
import pathlib

import numpy as np
import pytest

from firstorder.cli import main
from firstorder.io.exr import read_layers
from firstorder.rendering import tiles
from firstorder.rendering.tiles import render_tiles
from tests.jobs.cluster import Cluster

WIDTH, HEIGHT, SIDE, PASSES = 50, 34, 16, 3
EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"

pytestmark = pytest.mark.filterwarnings("ignore:The scheduler at .* has no workers yet")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    pytest.importorskip("distributed")
    with Cluster(2, tmp_path_factory.mktemp("cluster")) as running:
        yield running


def noisy(p, number):
    """Random numbers of the pass and the place, and which process has drawn them."""
    rng = np.random.default_rng([number, *p[0].astype(int)])
    return {"value": rng.normal(size=len(p)), "process": np.full(len(p), float(os.getpid()))}


def made(folder, **options):
    return render_tiles(noisy, WIDTH, HEIGHT, folder, side=SIDE, passes=PASSES, **options)


def files(folder):
    return {f.name: f.stat().st_mtime_ns for f in folder.glob("pass*")}


def test_tiles_come_from_workers_and_what_is_there_is_not_made_again(cluster, tmp_path):
    whole, before = made(tmp_path / "a"), None
    (tmp_path / "b").mkdir()
    for file in sorted((tmp_path / "a").glob("*"))[:7]:  # the job, and tiles
        (tmp_path / "b" / file.name).write_bytes(file.read_bytes())
    before = files(tmp_path / "b")
    found = made(tmp_path / "b", scheduler=cluster.address)
    assert found["value"].tobytes() == whole["value"].tobytes()
    after = files(tmp_path / "b")
    assert len(before) == 6
    assert {name: after[name] for name in before} == before
    processes = set(np.unique(np.concatenate([
        np.load(tmp_path / "b" / name)["process"].ravel() for name in set(after) - set(before)
    ])))  # fmt: skip
    assert processes <= {float(w.pid) for w in cluster.workers}
    assert sorted(f.name for f in (tmp_path / "b").iterdir()) == ["job.json", *sorted(after)]


def test_passes_can_be_looked_at_in_turn(cluster, tmp_path):
    seen = []
    found = made(tmp_path, scheduler=cluster.address, after_pass=lambda a, k: seen.append((k, a)))
    assert [k for k, _ in seen] == list(range(PASSES))
    np.testing.assert_array_equal(seen[-1][1]["value"], found["value"])


def test_a_tile_that_is_damaged_meanwhile_is_made_here(cluster, tmp_path, monkeypatch):
    whole, plain = made(tmp_path / "a"), tiles.tiles_by_workers

    def damaging(*given):
        for k, file in enumerate(plain(*given)):
            if k == 3:
                file.write_bytes(file.read_bytes()[:50])
            yield file

    monkeypatch.setattr(tiles, "tiles_by_workers", damaging)
    with pytest.warns(UserWarning, match=r"npz is damaged \(it is no whole NPZ file\)"):
        found = made(tmp_path / "b", scheduler=cluster.address)
    assert found["value"].tobytes() == whole["value"].tobytes()


def test_what_was_made_with_other_settings_is_refused_before_any_work(tmp_path, monkeypatch):
    made(tmp_path)
    (tmp_path / "pass0002_tile00011.npz").unlink()
    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")
    with pytest.raises(ValueError, match=r"some are missing .* and the others differ"):
        made(tmp_path, scheduler="tcp://127.0.0.1:1")


@pytest.mark.slow
def test_a_scene_is_rendered_by_workers_that_are_killed_to_the_same_bytes(tmp_path, monkeypatch):
    """With a mesh in a file that no worker can read, as the world travels."""
    pytest.importorskip("distributed")
    pytest.importorskip("OpenEXR")
    pytest.importorskip("embreex")
    (tmp_path / "here").mkdir()
    for name in ("pebble.toml", "pebble.obj"):
        (tmp_path / "here" / name).write_bytes((EXAMPLES / name).read_bytes())
    size = ["--width", "80", "--height", "72", "--nodes", "2", "--sky-rows", "2", "--passes", "2"]
    command = ["render", str(tmp_path / "here" / "pebble.toml"), *size, "--out"]
    assert main([*command, str(tmp_path / "here.exr")]) == 0
    with Cluster(2, tmp_path) as cluster:
        plain, came = tiles.tiles_by_workers, []

        def killing(*given):
            for file in plain(*given):
                came.append(file)
                if len(came) == 2:
                    cluster.kill_worker()
                if len(came) == 4:
                    cluster.kill_scheduler()
                yield file

        monkeypatch.setattr(tiles, "tiles_by_workers", killing)
        given = [str(tmp_path / "there.exr"), "--scheduler", cluster.address]
        assert main([*command, *given]) == 0
    assert len(came) == len(set(came)) == 8
    there, here = ((tmp_path / f"{name}.exr").read_bytes() for name in ("there", "here"))
    assert there == here
    assert np.ptp(read_layers(tmp_path / "there.exr")["value"]) > 0.0


def test_a_scheduler_that_is_not_there_is_one_sentence_and_exit_code_2(
    tmp_path, capsys, monkeypatch
):
    pytest.importorskip("distributed")
    from firstorder.jobs import _dask

    monkeypatch.setattr(_dask, "FIRST", 0.5)
    given = ["--width", "8", "--height", "8", "--out", str(tmp_path / "a.exr")]
    scheduler = ["--scheduler", "tcp://127.0.0.1:1"]
    assert main(["render", str(EXAMPLES / "coats.toml"), *given, *scheduler]) == 2
    told = capsys.readouterr().err
    assert told.startswith("Argument `scheduler` must be the address of a scheduler of dask.")
    assert told.count("\n") == 1
