"""Programs killed at random moments: run again they write the same bytes, and leave nothing hidden.

A part that a killed writer leaves is its next writer's to remove once nothing was written to it for
ten minutes; here it is made so old before the second run.
"""

from __future__ import annotations

import os
import pathlib
import signal
import subprocess
import sys
import time
from typing import NamedTuple

import numpy as np

ROOT = pathlib.Path(__file__).parents[2]
COMMAND = (sys.executable, "-c", "from firstorder.cli import main; raise SystemExit(main())")
SIZE = ("--width", "24", "--height", "24", "--passes", "4", "--nodes", "4")
SKY = ("--sky-rows", "4")

# What is run, with {out} for its folder, and the endings of the files that are to be the same.
PROGRAMS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "render": (
        (*COMMAND, "render", "examples/coats.toml", "--out", "{out}/a.exr", *SIZE, *SKY),
        (".exr", ".png"),
    ),
    "mesh": (
        (*COMMAND, "render", "examples/pebble.toml", "--out", "{out}/a.exr", *SIZE, *SKY),
        (".exr", ".png"),
    ),
    "figure": (
        (sys.executable, "-m", "figures", "path", "--quick", "--out", "{out}"),
        (".png", ".npz", ".csv"),
    ),
    "curves": (
        (*COMMAND, "scene", "scene_b", "--out", "{out}/a.png", "--toml", "{out}/a.toml"),
        (".png", ".csv", ".toml"),
    ),
}


class Whole(NamedTuple):
    """What a program writes that nobody disturbs.

    Attributes:
        files: their bytes by name.
        seconds: that it took, on the wall.
    """

    files: dict[str, bytes]
    seconds: float


def uninterrupted(name: str, folder: pathlib.Path) -> Whole:
    """Runs a program to its end."""
    start = time.monotonic()
    _finished(_started(name, folder))
    return Whole(_written(name, folder), time.monotonic() - start)


def wrong_after_a_kill(
    name: str, folder: pathlib.Path, whole: Whole, seed: int, number: int
) -> tuple[float, list[str]]:
    """Kills a program, runs it again, and tells what is not as if nobody had.

    Args:
        name: of the program.
        folder: for what it writes.
        whole: what it writes when nobody disturbs it.
        seed: of the moment.
        number: of the kill.

    Returns:
        The moment, in seconds after the start, and what is wrong, in words.
    """
    moment = _moment(whole, seed, number)
    first = _started(name, folder)
    time.sleep(moment)
    os.kill(first.pid, signal.SIGKILL)
    first.communicate()
    for part in _hidden(folder):
        os.utime(part, (0, 0))
    _finished(_started(name, folder))
    files = _written(name, folder)
    wrong = [f"{f} differs" for f in sorted(whole.files) if files.get(f) != whole.files[f]]
    wrong += [f"{f} is new" for f in sorted(set(files) - set(whole.files))]
    return moment, wrong + [f"{part.name} is left" for part in _hidden(folder)]


def _moment(whole: Whole, seed: int, number: int) -> float:
    """When to kill, after the start [s]; nothing is written in the first fifth."""
    return np.random.default_rng([seed, number]).uniform(0.2, 1.0) * whole.seconds


def _started(name: str, folder: pathlib.Path) -> subprocess.Popen[bytes]:
    folder.mkdir(parents=True, exist_ok=True)
    command = [word.replace("{out}", str(folder)) for word in PROGRAMS[name][0]]
    paths = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    environment = os.environ | {"PYTHONPATH": paths, "MPLBACKEND": "Agg"}
    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=quiet, stderr=subprocess.PIPE
    )


def _finished(process: subprocess.Popen[bytes]) -> None:
    _, words = process.communicate()
    if process.returncode:
        raise RuntimeError(words.decode(errors="replace"))


def _written(name: str, folder: pathlib.Path) -> dict[str, bytes]:
    """Files that count, by their path in the folder."""
    endings = PROGRAMS[name][1]
    found = (f for f in folder.rglob("*") if f.suffix in endings and not f.name.startswith("."))
    return {str(f.relative_to(folder)): f.read_bytes() for f in found if f.is_file()}


def _hidden(folder: pathlib.Path) -> list[pathlib.Path]:
    return [f for f in folder.rglob(".*") if f.is_file()]
