"""Sampling rate and band limit of the lamp, one against the other, and the choice made by itself.

E11 Fig. 16 shows an inset of its Fig. 13 and no numbers. Ours: 0.25, 1, 4 and 16 shadow rays for
each pixel of 256 x 256, the lamp's band limit at 1 to 16 cycles for each of its diameters, on our
stand-in for that scene (a plant, a knot, a grid, a blob and a ball over ground with a relief); the
reference has 2,048 stratified rays. Errors are those of all ground in the image. The last column
is the limit that each pixel chooses by the error it expects, without the reference.

Below some 1 cycle for each diameter nothing changes any more: filters are never so wide that most
rays leave the lamp when they are slid.

Two claims fail, both at few rays. Measured over expected error is 0.476 at 1 ray and 1 cycle, and
0.50 or 0.51 beside that: both halves of one additive sequence err together, which is taken for a
bias, as on the fence of `automatic`. From 4 cycles or 4 rays upwards it is 0.59 to 1.04. A bias
that looks too large asks for a sharp filter: at 1 ray a quarter of the pixels choose more than 3.7
cycles, where 1 is best. So the limit of each pixel has 1.14 and 1.215 times the error of the best
fixed one at 0.25 and 1 ray, but 0.96 at 4 and 16. A single limit for all pixels, of least expected
error, is within 1.010 everywhere.
"""

from __future__ import annotations

import numpy as np

from figures.e11.shared import limits
from figures.e11.shared import space as scenes
from figures.style import Claim, Drawing
from firstorder import plotting

CYCLES = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
RATES = (0.25, 1.0, 4.0, 16.0)


def draw(quick: bool = False) -> Drawing:
    """A table of images: rates down, limits across."""
    side = scenes.QUICK_SIDE if quick else scenes.SIDE
    rates = RATES[:3] if quick else RATES
    scene = scenes.gathering(side, leaves=4000) if quick else scenes.gathering(side)
    ground = limits.ground(scene, quick)
    inset = limits.window(ground.picture(ground.true), side // 4)
    figure, axes = plotting.panels(len(rates) + 1, len(CYCLES) + 1, width=1.5, height=1.6)
    rms = np.empty((len(rates), len(CYCLES)))
    own, expected, picked = (np.empty(len(rates)) for _ in range(3))
    predicted = np.empty_like(rms)
    arrays = {"reference": ground.picture(ground.true)}
    last = None
    for i, rate in enumerate(rates):
        rungs = ground.answers(ground.traced(rate), CYCLES)
        chosen = ground.chosen(rungs)
        rms[i] = [ground.rms(v) for v in rungs.visible]
        predicted[i] = np.sqrt(np.mean(rungs.error**2, 1))
        own[i], expected[i] = ground.rms(chosen.visible), np.sqrt(np.mean(chosen.error**2))
        picked[i] = rms[i, rungs.best_of_all]
        for k, values in enumerate((*rungs.visible, chosen.visible)):
            error = rms[i, k] if k < len(CYCLES) else own[i]
            ax = axes[len(rates) - 1 - i, k]
            best = k == int(np.argmin(rms[i]))
            _inset(ax, ground.picture(values)[inset], f"{100 * error:.2f} %", best)
        axes[len(rates) - 1 - i, 0].set_ylabel(f"{rate:g} rays")
        arrays |= {f"visible {rate:g}": rungs.visible, f"chosen {rate:g}": chosen.visible}
        arrays |= {f"limit {rate:g}": chosen.limit * ground.diameter}
        last = chosen
    _below(axes[-1], ground, last, inset, figure)
    for k, c in enumerate(CYCLES):
        axes[0, k].set_title(f"{c:g} cycles\n" + axes[0, k].get_title())
    axes[0, -1].set_title("automatic\n" + axes[0, -1].get_title())
    arrays |= {"rates": np.array(rates), "cycles": CYCLES, "rms": rms, "automatic": own}
    arrays |= {"expected": predicted}
    claims = _claims(rates, rms, own, predicted, picked)
    size = f"{side} x {side} pixels, {ground.rays} rays of the reference"
    columns = {"rate": np.repeat(rates, len(CYCLES)), "cycles": np.tile(CYCLES, len(rates))}
    columns |= {"rms": rms.ravel(), "expected": predicted.ravel()}
    return Drawing(figure, arrays, claims, {"rms": columns}, size, limits.SEED)


def _inset(ax, values, title: str, best: bool = False) -> None:
    """A part of the image; a frame around the best limit of its row."""
    scenes.show(ax, values, title, cmap="gray", vmin=0.0, vmax=1.0)
    for spine in ax.spines.values():
        spine.set(visible=best, color=plotting.COLOURS[1] if best else "none", linewidth=2.5)


def _below(axes, ground, chosen, inset, figure) -> None:
    """The reference, and what the choice looks like at the highest rate."""
    scenes.show(
        axes[0], ground.picture(ground.true)[inset], "reference", cmap="gray", vmin=0, vmax=1
    )
    whole = ground.picture(ground.true)
    scenes.show(axes[1], whole, "the image", cmap="gray", vmin=0, vmax=1)
    i, j = inset
    x, y = [i.start, i.stop, i.stop, i.start, i.start], [j.start, j.start, j.stop, j.stop, j.start]
    axes[1].plot(x, y, color=plotting.COLOURS[1], lw=1.0)
    limit = np.log2(chosen.limit * ground.diameter)
    drawn = scenes.show(axes[2], ground.picture(limit), "limit chosen", vmin=0, vmax=4)
    figure.colorbar(drawn, ax=axes[2], label="log2 cycles", location="bottom")
    top = float(np.percentile(chosen.error, 99))
    expected = scenes.show(
        axes[3], ground.picture(chosen.error), "error expected", vmin=0, vmax=top
    )
    off = ground.picture(abs(chosen.visible - ground.true))
    drawn = scenes.show(axes[4], off, "error", vmin=0, vmax=top)
    for ax, shown in ((axes[3], expected), (axes[4], drawn)):
        figure.colorbar(shown, ax=ax, location="bottom")
    axes[5].set_visible(False)


def _claims(rates, rms, own, predicted, picked) -> list[Claim]:
    best = CYCLES[np.argmin(rms, 1)]
    ratio = rms / predicted
    worst = float(np.max(own / rms.min(1)))
    return [
        Claim(
            "Band limit of least error at the highest rate over that at the lowest",
            "the best lie on the diagonal",
            float(best[-1] / best[0]),
            "times",
            bool(best[-1] > best[0] and np.all(np.diff(best) >= 0.0)),
        ),
        Claim(
            "RMS error at the fewest rays, highest band limit over the lowest",
            "noisy",
            float(rms[0, -1] / rms[0, 0]),
            "times",
            bool(rms[0, -1] > rms[0, 0]),
        ),
        Claim(
            "RMS error at the lowest band limit, most rays over the best at as many rays",
            "overblurred",
            float(rms[-1, 0] / rms[-1].min()),
            "times",
            bool(rms[-1, 0] > rms[-1].min()),
        ),
        Claim(
            "RMS error of the automatic limit over the best fixed one found with the reference, "
            "worst rate",
            None,
            worst,
            "times",
            worst < 1.1,
        ),
        Claim(
            "The same, one automatic limit for all pixels",
            None,
            float(np.max(picked / rms.min(1))),
            "times",
            bool(np.max(picked / rms.min(1)) < 1.1),
        ),
        Claim(
            "Measured over expected RMS error, least over all rates and limits",
            None,
            float(ratio.min()),
            "times",
            bool(ratio.min() > 0.5),
        ),
        Claim(
            "Measured over expected RMS error, largest over all rates and limits",
            None,
            float(ratio.max()),
            "times",
            bool(ratio.max() < 2.0),
        ),
        Claim(
            "RMS error of the automatic limit, most rays over fewest",
            "falls",
            float(own[-1] / own[0]),
            "times",
            bool(np.all(np.diff(own) < 0.0)),
        ),
    ]
