"""Workers, schedulers and clients killed at random moments of a render: no tile lost, none twice.

Real processes on loopback: a client renders an image by two workers. Of ten kills eight hit a
worker, one the scheduler and one the client, which then begins again. An image that is finished
makes room for the next, until enough has been killed. Each has to be that of a program that nobody
disturbs, byte by byte; a tile, once there, has to stay untouched.
"""

from __future__ import annotations

import os
import pathlib
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from tests.fuzz.kills import COMMAND, ROOT
from tests.jobs.cluster import Cluster

SCENE = "examples/coats.toml"
SIZE = ("--width", "128", "--height", "128", "--passes", "8", "--nodes", "4", "--sky-rows", "4")
TILES = 4 * 8  # of 64 by 64 pixels, in each pass
Pause = tuple[float, float]
PAUSE: Pause = 3.0, 15.0  # seconds from kill to kill; a worker needs five to ten to begin
LIMIT = 600.0  # seconds for an image


class Render(NamedTuple):
    """An image that was made while things were killed.

    Attributes:
        kills: what was killed, and how often.
        lost: tiles that are not there.
        twice: tiles that were written again.
        wrong: other differences to the undisturbed image, in words.
    """

    kills: Counter[str]
    lost: int
    twice: int
    wrong: list[str]


def renders(
    folder: pathlib.Path, seed: int, kills: int, scene: str = SCENE, pause: Pause = PAUSE
) -> Iterator[Render]:
    """Images of a scene, until so much was killed, with pauses between."""
    whole = _finished(_client(scene, folder / "whole.exr"), folder / "whole.exr")
    rng, count = np.random.default_rng(seed), 0
    with Cluster(2, folder) as cluster:
        while count < kills:
            out = folder / f"image{count}.exr"
            found = _disturbed(out, cluster, rng, kills - count, whole, scene, pause)
            count += found.kills.total()
            yield found


def _disturbed(
    out: pathlib.Path,
    cluster: Cluster,
    rng: np.random.Generator,
    most: int,
    whole: list[bytes],
    scene: str = SCENE,
    pause: Pause = PAUSE,
) -> Render:
    """One image, and what was killed meanwhile."""
    tiles = out.with_name(f"{out.stem}_tiles")
    kills, seen, changed = Counter[str](), dict[str, int](), set[str]()
    client, begin = _client(scene, out, cluster.address), time.monotonic()
    while kills.total() < most and time.monotonic() - begin < LIMIT:
        if _ended(client, rng.uniform(*pause)):
            break
        match what := rng.choice(["worker", "scheduler", "client"], p=[0.8, 0.1, 0.1]):
            case "worker":
                cluster.kill_worker(int(rng.integers(len(cluster.workers))))
            case "scheduler":
                cluster.kill_scheduler()
            case _:
                os.kill(client.pid, signal.SIGKILL)
                client.communicate()
                client = _client(scene, out, cluster.address)
        kills[str(what)] += 1
        now = {f.name: f.stat().st_mtime_ns for f in tiles.glob("pass*.npz")}
        changed |= {name for name in seen if now.get(name) != seen[name]}
        seen |= now
    files = _finished(client, out)
    now = {f.name: f.stat().st_mtime_ns for f in tiles.glob("pass*.npz")}
    changed |= {name for name in seen if now.get(name) != seen[name]}
    wrong = [] if files == whole else [f"{out.name} is another image"]
    wrong += [f"{f.name} is damaged" for f in tiles.glob("*.damaged*")]
    return Render(kills, TILES - len(now), len(changed), wrong)


def _client(scene: str, out: pathlib.Path, scheduler: str | None = None) -> subprocess.Popen[bytes]:
    given = ["--scheduler", scheduler] if scheduler else []
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}
    return subprocess.Popen(
        [*COMMAND, "render", scene, *SIZE, "--out", str(out), *given],
        cwd=ROOT, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip


def _ended(process: subprocess.Popen[bytes], seconds: float) -> bool:
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def _finished(client: subprocess.Popen[bytes], out: pathlib.Path) -> list[bytes]:
    """The files of an image, once its client has ended well."""
    _, words = client.communicate(timeout=LIMIT)
    if client.returncode:
        raise RuntimeError(words.decode(errors="replace"))
    return [file.read_bytes() for file in (out, out.with_suffix(".png"))]
