"""J12 §9: which error a threshold should tolerate, and what tuned limits are worth: nine floors.

J12 tried several definitions of error and found that the total gives the best images. At equal
counts only the power of the Hessian tells records apart: R goes as |H|^(-1/4) for the total, -1/3
for the integrated square, -1/2 for averages; the relative one divides by E. Judged by RMS and by
structural similarity, on the boxes of J12 (one reflection; with the black wall and without), and
under a wide lamp alone and with four plates before it (`j12.shared.shadows`); four of the nine are
shown. Definitions are compared beside 24 random blocks too. `j12_caching_3d` has the same
for two scenes of some complexity.

Limits: the shortest ray, harmonic mean and radiometric Hessian with a smallest radius of 1 or 3
cells and a largest of 0.1 or 0.3 m, the best of these for each; all others have one cell and
1.5 m. The geometric Hessian is the metric by which definitions are told apart.

The total is best on the boxes, as J12 has it; in the light of the lamp definitions differ by little
and some others are better. Limits gain a split sphere a factor of 3 where walls meet the floor, and
nothing where no surface is near; no limits mend what the radiometric Hessian does not know of a
penumbra.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from figures.j12.shared.box import (
    Case,
    Size,
    case,
    compare,
    floor_limits,
    metrics,
    random_block,
    similar,
    tabulated,
    tuned,
)
from figures.j12.shared.caching import Outcome, pointwise
from figures.j12.shared.shadows import PLATES, shadow
from figures.spread import geometric, grouped
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least
from firstorder import plotting
from firstorder.caching import derivative_norm, radius_for
from firstorder.plotting.style import COLOURS

SCENES = {
    "j12_box": "box",
    "j12_occluder": "box with a block",
    "lamp": "lamp alone",
    "plate": "lamp and plate",
}
OPEN = {"open box": "j12_box", "open box with a block": "j12_occluder"}  # no right wall
BLOCKS = 24  # of any size, at any place, on whose floors definitions are compared too
GROUPS = {
    "box": ("j12_box", "open box"),
    "box with a block": ("j12_occluder", "open box with a block"),
    "plates": tuple(PLATES),
}
ORDERS = 16  # of insertion, in which definitions are compared: they differ by little
DEFINITIONS = ("total", "integrated squared", "average", "relative")
LENGTHS = ("minimum", "harmonic")


class Floor(NamedTuple):
    """Caches of one floor: by definition of the error, by metric, and by metrics with limits."""

    case: Case
    found: dict[str, Outcome]
    plain: dict[str, Outcome]
    limited: dict[str, Outcome]


def draw(quick: bool) -> Drawing:
    s = Size(24, 16, 48, 60, 2) if quick else Size(48, 40, 120, 144, 4)
    names = tuple(SCENES) if quick else tuple(dict.fromkeys((*SCENES, *OPEN, *PLATES)))
    floors = {name: _floor(name, s, quick) for name in names}
    boxes = [f.found for name, f in floors.items() if name not in ("lamp", *PLATES)]
    if not quick:
        more = (tabulated(random_block(seed), s) for seed in range(BLOCKS))
        boxes += [_definitions(c, quick) for c in more]
    figure, axes = plotting.panels(1, 4, 2.4, 2.6)
    arrays = {}
    for ax, (name, words) in zip(axes.ravel(), SCENES.items(), strict=True):
        f = floors[name]
        _draw(ax, f.found, f.plain, f.limited, words)
    for name, f in floors.items():
        every = f.found | f.plain | {f"{m}_limited": o for m, o in f.limited.items()}
        arrays |= {f"{name}_{m.replace(' ', '_')}": o.errors for m, o in every.items()}
    size = f"{s.words()}, {len(names)} floors"
    claims = [*(_lowest(d, boxes) for d in DEFINITIONS[1:]), *_claims(floors)]
    return Drawing(figure, arrays, claims, size=size, seed=12)


def _floor(name: str, s: Size, quick: bool) -> Floor:
    if name in OPEN:
        c = case(OPEN[name], s, "none")
    else:
        c = case(name, s) if name.startswith("j12") else shadow(name, s).case
    return Floor(c, _definitions(c, quick), compare(c, metrics(c)), _limited(c, quick))


def _definitions(c: Case, quick: bool) -> dict[str, Outcome]:
    """Caches of the geometric Hessian by definition of the error."""
    value, within = np.maximum(c.table.E, 1e-9), floor_limits(c.size.pixels)
    many = c if quick else replace(c, size=replace(c.size, orders=ORDERS))
    regions = {d: pointwise(c.table.geometric, within, 1, d, value) for d in DEFINITIONS}
    return compare(many, regions)


def _limited(c: Case, quick: bool) -> dict[str, Outcome]:
    """Each metric with the best of some limits."""
    limits = [(low, high) for low in ((1.0, 2.0) if quick else (1.0, 3.0)) for high in (0.1, 0.3)]
    lengths = {"minimum": c.table.minimum, "harmonic": c.table.harmonic}
    found = {m: tuned(c, length, limits).outcome for m, length in lengths.items()}
    k = derivative_norm(np.asarray(c.table.hessian), 2)
    # At equal counts a length whose multiple is the radius stands for the tolerance.
    radius = np.minimum(np.asarray(radius_for(k, 1.0, dims=2)), 1e6)
    return found | {"radiometric": tuned(c, radius, limits).outcome}


def _draw(ax, found, plain, limited, words: str) -> None:
    rows = {d: (o, "0.8") for d, o in found.items()}
    rows |= {m: (o, "0.6") for m, o in plain.items() if m != "geometric"}
    rows |= {f"{m}, limits": (o, COLOURS[1]) for m, o in limited.items()}
    own = found["total"].mean
    for y, (outcome, colour) in enumerate(rows.values()):
        ax.barh(y, outcome.mean / own, color=colour)
        ax.text(0.05, y, f"{outcome.mean / own:.2f}", va="center", fontsize=6.5)
    ax.axvline(1.0, color="0.7", linewidth=0.8)
    ax.set(yticks=range(len(rows)), xlim=(0.0, 3.5))
    ax.set_xlabel("RMS over that of the total", fontsize=7)
    ax.set_yticklabels(list(rows), fontsize=6.5)
    ax.invert_yaxis()
    ax.set_title(words, fontsize=8)


def _claims(floors: dict[str, Floor]) -> list[Statement | Measurement]:
    soft = [f for name, f in floors.items() if name in ("lamp", *PLATES)]
    groups = {w: [floors[n] for n in floors if n in group] for w, group in GROUPS.items()}
    return [
        _lowest_of_all(soft),
        *(_limits_lose(words, groups[words]) for words in ("box", "plates")),
        *(
            Measurement(
                f"RMS error of the best split sphere with tuned limits over the {m} Hessian's, "
                f"{words}",
                g.mean,
                error=g.error,
            )
            for words, m in (
                ("box with a block", "radiometric"),
                *((words, "geometric") for words in GROUPS),
            )
            for g in (grouped(_over_limited(m, groups[words])),)
        ),
        *_by_floor(floors),
    ]


def _lowest(definition: str, floors: list[dict[str, Outcome]]) -> Statement:
    """The total against another definition: over floors, each by the mean of its orders."""
    over = [found[definition].errors / found["total"].errors for found in floors]
    g = grouped(over)
    return Statement(
        f"Minimising total error gives the lowest RMS error: that of the {definition} error over "
        "the total's, boxes with reflected light, geometric mean",
        paper="lowest",
        measured=g.mean,
        rule=at_least(1.0, "'lowest'"),
        source="J12 §9",
        error=g.error,
        scanned=f"{len(floors)} floors, {len(over[0])} orders of insertion each",
        reason="At equal counts definitions are powers of the Hessian, and this one's is as good.",
    )


def _lowest_of_all(floors: list[Floor]) -> Statement:
    best = [min(f.found[d].mean for d in DEFINITIONS[1:]) / f.found["total"].mean for f in floors]
    g = geometric(best)
    return Statement(
        "Minimising total error gives the lowest RMS error: that of the best other definition over "
        "the total's, direct light of a lamp, with plates and without, geometric mean",
        paper="lowest",
        measured=g.mean,
        rule=at_least(1.0, "'lowest'"),
        source="J12 §9",
        error=g.error,
        scanned=f"{len(floors)} floors",
        reason="At equal counts definitions are powers of the Hessian. In penumbrae errors crowd "
        "where it is large, and a larger power than the total's, the integrated square's, follows "
        "it better; by 1 to 8 %.",
    )


def _over_limited(method: str, floors: list[Floor]) -> list[np.ndarray]:
    """Error of the best split sphere with tuned limits over a Hessian's: by floor and order."""
    return [
        min((f.limited[m] for m in LENGTHS), key=lambda o: o.mean).errors / f.plain[method].errors
        for f in floors
    ]


def _limits_lose(words: str, floors: list[Floor]) -> Statement:
    over = _over_limited("radiometric", floors)
    g = grouped(over)
    return Statement(
        "The radiometric Hessian does without tuned limits: RMS error of the best split sphere "
        f"with them over its own, {words}, geometric mean",
        paper="higher quality without these measures",
        measured=g.mean,
        rule=at_least(1.0, "'higher quality': a smaller error"),
        source="J12 §8.2",
        error=g.error,
        scanned=f"{len(floors)} floors, {len(over[0])} orders of insertion each",
        reason="It leaves out the edges of shadows, which are nearly all there is in a penumbra, "
        "and no radius holds its records back there; with reflected light and no block it wins.",
    )


def _by_floor(floors: dict[str, Floor]) -> list[Measurement]:
    words = ", ".join(floors)

    def told(what: str, numbers) -> Measurement:
        return Measurement(f"{what}: {words}", ", ".join(numbers))

    return [
        told(
            "RMS error of the best split sphere with tuned limits over the radiometric Hessian's",
            (
                f"{min(f.limited[m].mean for m in LENGTHS) / f.plain['radiometric'].mean:.2f}"
                for f in floors.values()
            ),
        ),
        told(
            "The same over the geometric Hessian's",
            (
                f"{min(f.limited[m].mean for m in LENGTHS) / f.plain['geometric'].mean:.2f}"
                for f in floors.values()
            ),
        ),
        told(
            "What tuning its limits gains a split sphere at most, in RMS",
            (
                f"{max(f.plain[m].mean / f.limited[m].mean for m in LENGTHS):.2f}"
                for f in floors.values()
            ),
        ),
        told(
            "Tolerated error with the highest structural similarity",
            (max(f.found, key=lambda d, f=f: similar(f.case, f.found[d])) for f in floors.values()),
        ),
    ]
