"""Path tracing with one reflection: how much certainty a second buys, here and elsewhere.

Irradiance at places of a floor, direct and reflected once. Every program is run with many seeds;
its efficiency is 1 over the variance of its answer times its seconds, and the ratio of two
efficiencies is how many times as long the one takes to the same standard error. Rays are counted
as paths need them: at each of two vertices one to a light and one onwards.
"""

from __future__ import annotations

import pathlib
import tempfile
from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from benchmarks.peers import measure, mitsuba_renderer, radiance
from firstorder.space import Receiver, Scene, library
from firstorder.space.bounces import path_irradiance

PLACES = np.array([(0.33, 0.5), (0.5, 0.34), (0.66, 0.9), (0.85, 0.62)])  # beside the boxes
SCENES = ("j12_box", "clutter")
RAYS = 4  # of a path
OURS, MITSUBA, RADIANCE = "firstorder", "Mitsuba, path", "Radiance, rtrace"
REPEATS = 16  # of each place in one run of rtrace, whose random numbers go on from row to row

# By a seed: answers at all places, a row each.
Call = Callable[[int], np.ndarray]


def run(quick: bool) -> dict[str, Any]:
    """Efficiency over ours, paths and rays a second, and how well the answers agree."""
    paths, seeds = (256, 2) if quick else (1 << 15, 8)
    scenes = {name: _scene(library.named_scene(name), paths, seeds) for name in SCENES}
    left = [measure.missing(p) for p in ("mitsuba", "pyradiance") if not measure.is_there(p)]
    return {"scenes": scenes, "paths": paths, "seeds": seeds, "left out": left}


def _scene(scene: Scene, paths: int, seeds: int) -> list[dict[str, Any]]:
    calls = _calls(scene, paths)
    for call in calls.values():
        call(0)
    answers: dict[str, list[np.ndarray]] = {name: [] for name in calls}
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for seed in range(1, seeds + 1):
        for name, call in calls.items():
            found, spent = measure.timed(lambda c=call, s=seed: c(s))
            answers[name].append(found)
            seconds[name].append(spent / len(found))
    # Radiance answers every round alike.
    apart = {name: np.unique(np.concatenate(found), axis=0) for name, found in answers.items()}
    rows = {n: _row(n, apart[n], seconds[n]) for n in calls}
    ours, mean = rows[OURS], np.mean(apart[OURS], 0)
    for name, row in rows.items():
        row["efficiency over ours"] = row["efficiency"] / ours["efficiency"]
        row["apart"] = float(np.sqrt(np.mean((np.mean(apart[name], 0) / mean - 1.0) ** 2)))
        row["rays a second"] = None if name == RADIANCE else RAYS * paths / row["seconds"]
    return list(rows.values())


def _row(name: str, answers: np.ndarray, seconds: list[float]) -> dict[str, Any]:
    """What one program reached: the error is that of one run, relative, RMS over the places."""
    error = float(np.sqrt(np.mean(np.var(answers, 0, ddof=1) / np.mean(answers, 0) ** 2)))
    spent = measure.spent(np.asarray(seconds) / len(PLACES))
    return {"program": name, "error": error, "seconds": spent.median, "low": spent.low,
            "high": spent.high, "answers": len(answers),
            "efficiency": 1.0 / (error**2 * spent.median)}  # fmt: skip


def _calls(scene: Scene, paths: int) -> dict[str, Call]:
    (floor,) = scene.named("floor")
    at = Receiver.at(
        np.append(PLACES, np.zeros((len(PLACES), 1)), 1), on=np.full(len(PLACES), floor)
    )

    def ours(seed: int) -> np.ndarray:
        found = path_irradiance(scene, at, key=jax.random.key(seed), paths=paths, bounces=1)
        return np.asarray(found.mean)[None]

    calls: dict[str, Call] = {OURS: ours}
    if measure.is_there("mitsuba"):
        calls[MITSUBA] = _mitsuba(scene, floor, paths)
    if measure.is_there("pyradiance"):
        calls[RADIANCE] = _radiance(scene, paths)
    return calls


def _mitsuba(scene: Scene, floor: int, paths: int) -> Call:
    """Its floor must reflect for its light to be seen: a black one is made white and seen once."""
    albedo = float(scene.material.albedo[floor, 0])
    loaded = mitsuba_renderer.loaded(scene if albedo else mitsuba_renderer.with_white(scene, floor))

    def E(seed: int) -> np.ndarray:
        return np.array([[
            mitsuba_renderer.irradiance(loaded, p, paths, seed * len(PLACES) + k, 3, albedo or 1.0)
            for k, p in enumerate(PLACES)
        ]])  # fmt: skip

    return E


def _radiance(scene: Scene, paths: int) -> Call:
    """A hemisphere of gathered rays without a cache, a sixteenth as many as the paths, repeated."""
    octree = radiance.compiled(scene, pathlib.Path(tempfile.mkdtemp(prefix="peers")))
    options = ("-ab", 1, "-ad", paths // REPEATS, "-as", 0, "-aa", 0)
    lights = ("-dj", 1, "-ds", 0.1, "-dt", 0, "-dc", 1)

    def E(seed: int) -> np.ndarray:
        rows = np.tile(PLACES, (REPEATS, 1))
        return radiance.irradiance(octree, rows, *options, *lights).reshape(REPEATS, -1)

    return E
