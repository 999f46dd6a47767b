"""J12 Fig. 19: a thousand records on the floor of the box by split spheres and by the Hessian.

Sizes are the library's; 30,000 rays from every cell, first-order extrapolation with the stratified
gradient. Radii are held between a cell and 1.5 m for every metric alike; nothing else is tuned. As
baselines that J12 argues against or leaves out: neighbour clamping (Krivanek et al. 2006) on all
candidates' harmonic means, and radius limits for the shortest ray, the best of 4 x 3 tried.

Without the right wall the split spheres change, the radiometric Hessian does not in any bit: what
is black adds zero to every sum.

The paper's factors are not found at this size. In the empty box the Hessian's error is lowest, by
a factor of 1.4 (2.8 with 110 records on a coarser floor); part of what is left is the rays' noise
(0.67e-5 W/m², Fig. 17). The limit at a cell, a third of the mean spacing of a thousand records, is
itself a tuned smallest radius for split spheres: it acts on the share of records that a claim
gives, and keeps them from wasting more in the corners. With the block the surface-area Hessian is
blind to the shadow's edge and spends its records where all is smooth. With both walls every split
sphere beats it: they crowd at the foot of the block, where the edge begins. The geometric Hessian
crowds there too, and does as well as they. The harmonic mean fails where most rays leave the box.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared.box import case, compare, floor_limits, metrics, show_error, size, tuned
from figures.j12.shared.caching import split
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.caching import neighbour_clamping
from firstorder.plotting.style import COLOURS

CASES = {
    "box": ("j12_box", "black"),
    "box, no right wall": ("j12_box", "none"),
    "box with a block": ("j12_occluder", "black"),
    "block, no right wall": ("j12_occluder", "none"),
}
SHOWN = ("minimum", "harmonic", "radiometric", "geometric")


def draw(quick: bool) -> Drawing:
    s = size(quick)
    figure, axes = plotting.panels(4, 5, 2.0, 2.2, width_ratios=[1, 1, 1, 1, 1.1])
    found, arrays = {}, {}
    for row, (words, (name, wall)) in enumerate(CASES.items()):
        c = case(name, s, wall)
        n = s.pixels
        held = neighbour_clamping(c.table.position, c.table.harmonic)
        here = compare(c, metrics(c) | {"neighbours": split(held, floor_limits(n))})
        if wall == "black":
            here["tuned limits"] = _tuned(c, quick)
        found[words] = here
        most = 4.0 * here["radiometric"].mean
        for k, method in enumerate(SHOWN):
            show_error(axes[row, k], c, here[method], most, method)
        axes[row, 0].set_ylabel(words, fontsize=8)
        _bars(axes[row, 4], here)
        arrays |= {f"{row}_{m.replace(' ', '_')}": o.errors for m, o in here.items()}
    return Drawing(figure, arrays, _claims(found), size=s.words(), seed=12)


def _tuned(c, quick: bool):
    """The best limits for the shortest ray, of a few."""
    lows = (1.0, 2.0) if quick else (1.0, 2.0, 3.0, 4.0)
    highs = (0.1, 0.3) if quick else (0.05, 0.1, 0.3)
    return tuned(c, c.table.minimum, [(a, b) for a in lows for b in highs]).outcome


def _bars(ax, here) -> None:
    """Errors over the radiometric Hessian's; what is longer than the panel is printed."""
    names, best = list(here), here["radiometric"].mean
    over = [here[name].mean / best for name in names]
    ax.barh(range(len(names)), over, color="0.6")
    for k, ratio in enumerate(over):
        ax.text(0.1, k, f"{ratio:.2f}", va="center", fontsize=6.5)
    ax.axvline(1.0, color=COLOURS[1], linestyle="-", linewidth=0.8)
    ax.set(xlim=(0.0, 5.0), yticks=range(len(names)))
    ax.set_yticklabels(names, fontsize=6.5)
    ax.invert_yaxis()
    ax.yaxis.tick_right()
    ax.tick_params(axis="x", labelsize=6.5)
    ax.set_xlabel("RMS over radiometric's", fontsize=7)


def _raised(outcome) -> float:
    return outcome.acted[0]


def _claims(found) -> list[Claim]:
    claims = []
    for words, here in found.items():
        best = here["radiometric"].mean
        for method in SHOWN[:2]:
            ratio = here[method].mean / best
            claims.append(
                Claim(
                    f"RMS error of the {method} split sphere over the radiometric Hessian, {words}",
                    "2 to 20",
                    ratio,
                    "",
                    ratio >= 2.0,
                )
            )
        claims.append(
            Claim(
                f"RMS error of the geometric Hessian over the radiometric one's, {words}",
                None,
                here["geometric"].mean / best,
            )
        )
        for method in ("neighbours", "tuned limits"):
            if method in here:
                claims.append(
                    Claim(
                        f"RMS error with {method} over the radiometric Hessian's, {words}",
                        "> 1",
                        here[method].mean / best,
                        "",
                        here[method].mean > best,
                    )
                )
        claims.append(
            Claim(
                "Share of records whose radius was raised to a cell: minimum, harmonic, "
                f"radiometric, geometric, {words}",
                None,
                ", ".join(f"{_raised(here[m]):.2f}" for m in SHOWN),
            )
        )
    for a, b in (("box", "box, no right wall"), ("box with a block", "block, no right wall")):
        for method in SHOWN[:3]:
            one, other = found[a][method].fit.records, found[b][method].fit.records
            apart = float(np.mean(np.any(one != other, axis=1)))
            same = method == "radiometric"
            claims.append(
                Claim(
                    f"Share of orders of insertion in which the {method} metric places other "
                    f"records without the right wall, {a}",
                    "0" if same else "1",
                    apart,
                    "",
                    apart == 0.0 if same else apart == 1.0,
                )
            )
    return claims
