"""How E in a soft shadow changes, by everybody's way: error over time, for receiver and blocker.

An error is the RMS over places and both components, over the RMS of the true gradient. Each way is
given more and more samples, each time with the step that turns out best where it needs a step, as
if one knew it. Truth at the places is `reference`; of pixels it is ours, averaged over each.
Compilation is told apart: the first call of everything is not among the times.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from benchmarks.peers import contenders, measure, mitsuba_renderer, reference
from benchmarks.peers.soft_shadows import QUESTIONS, SHADOWS, SoftShadow

EXTENT = 0.8  # half the side of the floor that pictures show [m]
PIXEL = 0.04  # of images of derivatives [m]
# Samples a pixel and guiding of the projective integrator. The octree takes ten seconds to build:
# it is tried on the ball that moves alone. Its kernels come from a cache on disk where they were
# compiled before.
IMAGES, GUIDED = ((256, "none"), (4096, "none")), (4096, "octree")
ENOUGH = 1.0  # after so many seconds a budget has no more rounds
WARM = 2.0  # a call of so many seconds needs no first one before it
LEVEL = 0.01  # error at which times are compared, besides the best


class Size(NamedTuple):
    """How many places, rounds of timing and seeds; and how far budgets go, from 0 to 1."""

    places: int
    rounds: int
    share: float


FULL, QUICK = Size(8, 3, 1.0), Size(2, 1, 0.0)


def run(quick: bool) -> dict[str, Any]:
    """Rows of errors and seconds for each shadow and question, and what they say."""
    size = QUICK if quick else FULL
    names = ("box",) if quick else tuple(SHADOWS)
    shadows = {name: _shadow(SHADOWS[name], size) for name in names}
    return {"shadows": shadows, "left out": contenders.left_out(), "level": LEVEL,
            "places": size.places, "rounds": size.rounds}  # fmt: skip


def _shadow(shadow: SoftShadow, size: Size) -> dict[str, Any]:
    places = np.asarray(shadow.places[: size.places])
    found: dict[str, Any] = {"words": shadow.words, "questions": {}}
    for question in QUESTIONS:
        truth = reference.gradients(shadow, places, question)
        rows = _rows(shadow, places, question, truth.value, size)
        found["questions"][question] = {
            "ours": rows[0],
            "rows": over(rows),
            "reference error": truth.error / _rms(truth.value),
            "said": said(rows),
        }
    return found


def _rows(shadow, places, question: str, truth: np.ndarray, size: Size) -> list[dict[str, Any]]:
    """One row for each way and budget."""
    tried = [
        (way, budget, call)
        for way in contenders.ways(shadow, places, question)
        for budget, call in _within(way.budgets, size.share)
    ]
    first = _first_calls(tried)
    errors: list[list[float]] = [[] for _ in tried]
    seconds: list[list[float]] = [[] for _ in tried]
    for seed in range(size.rounds):
        for k, (_, _, call) in enumerate(tried):
            if sum(seconds[k]) * len(places) > ENOUGH:
                continue
            answers, spent = measure.timed(lambda c=call, s=seed: c(s))
            errors[k].append(min(_rms(a - truth) for a in answers) / _rms(truth))
            seconds[k].append(spent / len(places) / len(answers))
    rows = [
        _row(way.name, budget, way.unit, errors[k], seconds[k], first[k] / len(places))
        for k, (way, budget, _) in enumerate(tried)
    ]
    return rows + _images(shadow, question, size)


def _first_calls(tried) -> list[float]:
    """Seconds of first calls, 0 for those of a way of which a smaller one took longer than WARM."""
    found: list[float] = []
    slow: set[str] = set()
    for way, _, call in tried:
        seconds = 0.0 if way.name in slow else measure.timed(lambda c=call: c(0))[1]
        slow |= {way.name} if seconds > WARM else set()
        found.append(seconds)
    return found


def _within(budgets: dict[int, Any], share: float) -> list[tuple[int, Any]]:
    """The first budgets, one at least."""
    return list(budgets.items())[: max(1, round(share * len(budgets)))]


def _row(name, budget, unit, errors, seconds, first) -> dict[str, Any]:
    spent = measure.spent(seconds)
    return {
        "way": name,
        "budget": budget,
        "unit": unit,
        "error": float(np.mean(errors)),
        "seconds": spent.median,
        "low": spent.low,
        "high": spent.high,
        "first": first,
    }


def _rms(a: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.asarray(a, float) ** 2)))


# --- images of derivatives -----------------------------------------------------------------------


def window(shadow: SoftShadow) -> mitsuba_renderer.Window:
    """Pixels over the part of the floor in which the places lie."""
    low, high = np.min(shadow.places, 0), np.max(shadow.places, 0)
    columns, rows = np.maximum(np.ceil((high - low) / PIXEL).astype(int), 2)
    return mitsuba_renderer.Window(tuple(low.tolist()), int(columns), int(rows), PIXEL)


def _images(shadow: SoftShadow, question: str, size: Size) -> list[dict[str, Any]]:
    """Rows of the projective integrator, whose guiding all pixels share; one round each."""
    if not contenders.derives():
        return []
    seen = window(shadow)
    truth, scene = (
        contenders.pixels(shadow, seen, question),
        mitsuba_renderer.loaded(shadow.scene()),
    )
    bodies = [f"body{k}" for k in range(len(shadow.bodies))]
    moved, sign = (["lamp", *bodies], -1.0) if question == "receiver" else (bodies[:1], 1.0)
    rows = []
    guided = shadow is SHADOWS["ball"] and question == "blocker"
    for samples, guiding in (*IMAGES, *[GUIDED] * guided)[: None if size.share else 1]:

        def image(seed, n=samples, g=guiding):
            return sign * mitsuba_renderer.projective(scene, seen, moved, n, seed, g)

        first = measure.timed(lambda f=image: f(0))[1] if guiding == "none" else 0.0
        found, spent = measure.timed(lambda f=image: f(1))
        error = _rms(found - truth) / _rms(truth)
        rows.append(_row(f"{contenders.PROJECTIVE}, {guiding}", samples, "samples a pixel", [error],
                         [spent / len(truth)], first / len(truth)))  # fmt: skip
    return rows


def light(shadow: SoftShadow, side: int) -> np.ndarray:
    """E over the square of the floor that pictures show, row by row from the bottom."""
    s = np.linspace(-EXTENT, EXTENT, side)
    return contenders.light(shadow, np.stack(np.meshgrid(s, s), -1).reshape(-1, 2)).reshape(
        side, -1
    )


# --- what the rows say ---------------------------------------------------------------------------


def over(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The same rows with their times as shares of ours, which no machine is read from."""
    own = rows[0]["seconds"]
    times = ("seconds", "low", "high")
    return [{**row, **{key: row[key] / own for key in times}} for row in rows]


def said(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Of each peer its best error and its time over ours, there and at the level of error."""
    ours = rows[0]
    found = {}
    for name in dict.fromkeys(row["way"] for row in rows if row is not ours):
        own = [row for row in rows if row["way"] == name]
        best = min(own, key=lambda row: row["error"])
        at = time_at(own, LEVEL)
        found[name] = {
            "error": best["error"],
            "times ours": best["seconds"] / ours["seconds"],
            "times ours at the level": None if at is None else at / ours["seconds"],
        }
    return found


def time_at(rows: list[dict[str, Any]], level: float) -> float | None:
    """Seconds at which a way has an error, between budgets on logarithmic axes; None if never.

    Example:
        >>> from benchmarks.peers.gradients import time_at
        >>> rows = [{"seconds": 1.0, "error": 0.1}, {"seconds": 100.0, "error": 0.001}]
        >>> round(time_at(rows, 0.01), 6)
        10.0
    """
    rows = sorted(rows, key=lambda row: row["seconds"])
    for before, after in zip([None, *rows], rows, strict=False):
        if after["error"] > level:
            continue
        if before is None:
            return after["seconds"]
        x = np.log([before["error"], after["error"]])
        y = np.log([before["seconds"], after["seconds"]])
        return float(np.exp(np.interp(-np.log(level), -x, y)))
    return None
