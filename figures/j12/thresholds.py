"""J12 §9: which error a threshold should tolerate, and what tuned limits are worth: four floors.

J12 tried several definitions of error and found that the total gives the best images. At equal
counts only the power of the Hessian tells records apart: R goes as |H|^(-1/4) for the total, -1/3
for the integrated square, -1/2 for averages; the relative one divides by E. Judged by RMS and by
structural similarity, on the boxes of J12 (one reflection), and under a wide lamp alone and with a
plate before it (`j12.shared.shadows`). `j12_caching_3d` has the same for two scenes of some
complexity.

Limits: the shortest ray, harmonic mean and radiometric Hessian with a smallest radius of 1 to 3
cells and a largest of 0.1 or 0.3 m, the best of these for each; all others have one cell and
1.5 m. The geometric Hessian is the metric by which definitions are told apart.

The total is best on the boxes, as J12 has it, by 1 to 40 %; in the light of the lamp no definition
differs by more than 1 %, and in its penumbra the integrated square and the relative error are 6 %
better. Limits gain a split sphere a factor of 3 where walls meet the floor, and nothing where no
surface is near; no limits mend what the radiometric Hessian does not know of a penumbra.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared.box import (
    Case,
    Size,
    case,
    compare,
    floor_limits,
    metrics,
    similar,
    tuned,
)
from figures.j12.shared.caching import Outcome, pointwise
from figures.j12.shared.shadows import shadow
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.caching import derivative_norm, radius_for
from firstorder.plotting.style import COLOURS

SCENES = {
    "j12_box": "box",
    "j12_occluder": "box with a block",
    "lamp": "lamp alone",
    "plate": "lamp and plate",
}
DEFINITIONS = ("total", "integrated squared", "average", "relative")
LENGTHS = ("minimum", "harmonic")


def draw(quick: bool) -> Drawing:
    s = Size(24, 16, 48, 60, 1) if quick else Size(64, 40, 120, 256, 3)
    figure, axes = plotting.panels(1, 4, 2.4, 2.6)
    claims, arrays, lowest, alike, gains = [], {}, {}, {}, {}
    for ax, (name, words) in zip(axes.ravel(), SCENES.items(), strict=True):
        c = case(name, s) if name.startswith("j12") else shadow(name, s).case
        value = np.maximum(c.table.E, 1e-9)
        H, within = c.table.geometric, floor_limits(s.pixels)
        found = compare(c, {d: pointwise(H, within, 1, d, value) for d in DEFINITIONS})
        plain = compare(c, metrics(c))
        limited = _limited(c, quick)
        _draw(ax, found, plain, limited, words)
        arrays |= {f"{name}_{m.replace(' ', '_')}": o.errors for m, o in (found | plain).items()}
        arrays |= {f"{name}_{m}_limited": o.errors for m, o in limited.items()}
        lowest[words] = min(found, key=lambda d: found[d].mean)
        alike[words] = max(found, key=lambda d, c=c, found=found: similar(c, found[d]))
        claims += _claims(words, found, plain, limited)
        gains[words] = max(plain[m].mean / limited[m].mean for m in LENGTHS)
    claims += _over_all(lowest, alike, gains)
    return Drawing(figure, arrays, claims, size=s.words(), seed=12)


def _limited(c: Case, quick: bool) -> dict[str, Outcome]:
    """Each metric with the best of some limits."""
    lows = (1.0, 2.0) if quick else (1.0, 2.0, 3.0)
    limits = [(low, high) for low in lows for high in (0.1, 0.3)]
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


def _claims(words: str, found, plain, limited) -> list[Claim]:
    total = found["total"]
    errors = ", ".join(f"{found[d].mean / total.mean:.2f}" for d in DEFINITIONS[1:])
    best = min(limited[m].mean for m in LENGTHS)
    return [
        Claim(
            f"RMS error of {', '.join(DEFINITIONS[1:])} error over that of the total, {words}",
            "> 1",
            errors,
            "",
            min(found[d].mean for d in DEFINITIONS[1:]) > total.mean,
        ),
        Claim(
            "RMS error of the best split sphere with tuned limits over that of the radiometric, of "
            f"the geometric Hessian, and of the radiometric with tuned limits, {words}",
            "> 1",
            f"{best / plain['radiometric'].mean:.2f}, {best / plain['geometric'].mean:.2f}, "
            f"{best / limited['radiometric'].mean:.2f}",
            "",
            best > plain["radiometric"].mean,
        ),
    ]


def _over_all(lowest, alike, gains) -> list[Claim]:
    return [
        Claim(
            f"Tolerated error with the least RMS error: {', '.join(lowest)}",
            "total",
            ", ".join(lowest.values()),
            "",
            set(lowest.values()) == {"total"},
        ),
        Claim(
            f"Tolerated error with the highest SSIM: {', '.join(alike)}",
            "total",
            ", ".join(alike.values()),
            "",
            set(alike.values()) == {"total"},
        ),
        Claim(
            f"What tuning its limits gains a split sphere at most, in RMS: {', '.join(gains)}",
            None,
            ", ".join(f"{g:.2f}" for g in gains.values()),
        ),
    ]
