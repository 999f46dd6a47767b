"""Sampling rate and band limit of the lamp, one against the other, and the choice made by itself.

E11 Fig. 16 shows an inset of its Fig. 13 and no numbers. Ours: 0.25, 1, 4 and 16 shadow rays for
each pixel, the lamp's band limit at 1/2 to 16 cycles for each of its diameters, on our stand-in for
that scene (a plant, a knot, a grid, a blob and a ball over ground with a relief), an inset of 64 x
64 of its 256 x 256 pixels; the ground up to 32 pixels beside it traces rays, too. The reference has
2,048 stratified rays. The last column is the limit that each pixel chooses by the error it expects,
without the reference.

What the paper says is asked of 20 seeds, on every third pixel of the inset both ways. The best
limit is the one of least RMS error. Below some 1 cycle hardly anything changes any more: filters
are never so wide that most rays leave the lamp when they are slid.

The automatic limit is best where rays are not few. Both halves of one additive sequence err
together, which at 1 ray a pixel and fewer is taken for a bias, and asks for a filter that is too
sharp.
"""

from __future__ import annotations

import numpy as np

from figures.e11.shared import limits
from figures.e11.shared import space as scenes
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least
from firstorder import plotting
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow

CYCLES = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0])
EDGE, STEP = 32, 3  # pixels around the inset that trace rays; of those that seeds judge
RATES = (0.25, 1.0, 4.0, 16.0)


def draw(quick: bool = False) -> Drawing:
    """A table of images: rates down, limits across."""
    side = scenes.QUICK_SIDE if quick else scenes.SIDE
    rates = RATES[:3] if quick else RATES
    scene = scenes.gathering(side, leaves=4000) if quick else scenes.gathering(side)
    image = limits.ground(scene, quick)
    inset = limits.window(image.picture(image.true), side // 4)
    ground = image.part(inset, EDGE)
    figure, axes = plotting.panels(len(rates) + 1, len(CYCLES) + 1, width=1.8, height=1.9)
    part = image.picture(image.true)[inset]
    ends = [float(e) for e in np.nanquantile(part, (0.01, 0.99))]
    rms = np.empty((len(rates), len(CYCLES)))
    own, picked = (np.empty(len(rates)) for _ in range(2))
    predicted = np.empty_like(rms)
    arrays = {"reference": ground.picture(ground.true)}
    last = shown = None
    for i, rate in enumerate(rates):
        rungs = ground.answers(ground.traced(rate), CYCLES)
        chosen = ground.chosen(rungs)
        rms[i] = [ground.rms(v) for v in rungs.visible]
        predicted[i] = np.sqrt(np.mean(rungs.error**2, 1))
        own[i] = ground.rms(chosen.visible)
        picked[i] = rms[i, rungs.best_of_all]
        for k, values in enumerate((*rungs.visible, chosen.visible)):
            error = rms[i, k] if k < len(CYCLES) else own[i]
            ax = axes[len(rates) - 1 - i, k]
            best = k == int(np.argmin(rms[i]))
            shown = _inset(ax, ground.picture(values)[inset], f"{100 * error:.2f} %", ends, best)
        axes[len(rates) - 1 - i, 0].set_ylabel(f"{rate:g} {'ray' if rate == 1 else 'rays'} a pixel")
        arrays |= {f"visible {rate:g}": rungs.visible, f"chosen {rate:g}": chosen.visible}
        arrays |= {f"limit {rate:g}": chosen.limit * ground.diameter}
        last = chosen
    figure.colorbar(shown, ax=axes[:-1], label="light that is seen", shrink=0.5, aspect=40)
    _below(axes[-1], ground, image, last, inset, figure, ends)
    _errors_drawn(axes[-1, -2:], rates, rms, own)
    for k, c in enumerate(CYCLES):
        axes[0, k].set_title(f"{c:g} cycles\n" + axes[0, k].get_title())
    axes[0, -1].set_title("automatic\n" + axes[0, -1].get_title())
    arrays |= {"rates": np.array(rates), "cycles": CYCLES, "rms": rms, "automatic": own}
    arrays |= {"expected": predicted}
    seeds = np.array([_errors(ground, inset, rates, seed) for seed in range(1, 4 if quick else 21)])
    claims = _claims(seeds, rms, own, predicted, picked)
    size = f"{side} x {side} pixels, {ground.rays} rays of the reference"
    columns = {"rate": np.repeat(rates, len(CYCLES)), "cycles": np.tile(CYCLES, len(rates))}
    columns |= {"rms": rms.ravel(), "expected": predicted.ravel()}
    return Drawing(figure, arrays, claims, {"rms": columns}, size, limits.SEED)


def _inset(ax, values, title: str, ends, best: bool = False):
    """A part of the image, from its darkest to its brightest; the best limit of a row is framed."""
    drawn = scenes.show(ax, values, title, cmap="gray", vmin=ends[0], vmax=ends[1])
    ax.set_facecolor("#5b7fa6")  # what is no ground
    for spine in ax.spines.values():
        spine.set(color=plotting.COLOURS[1] if best else "0.3", linewidth=2.5 if best else 0.6)
    return drawn


def _errors_drawn(axes, rates, rms, own) -> None:
    """RMS errors over the limits, and of the automatic one as marks, in place of two panels."""
    grid = axes[0].get_subplotspec().get_gridspec()
    figure = axes[0].figure
    for ax in axes:
        ax.remove()
    ax = figure.add_subplot(grid[-1, -2:])
    for rate, row, chosen, color in zip(rates, rms, own, plotting.COLOURS, strict=False):
        ax.loglog(CYCLES, 100.0 * row, "-", color=color)
        ax.annotate(
            f"{rate:g} {'ray' if rate == 1 else 'rays'}", (CYCLES[0], 107.0 * row[0]), fontsize=6
        )
        ax.plot(CYCLES[-1] * 1.6, 100.0 * chosen, "o", color=color, markersize=4)
    ax.set(title="RMS error (%), dots: automatic", xlabel="limit (cycles)")
    ax.set_xticks(CYCLES, [f"{c:g}" for c in CYCLES])
    ax.minorticks_off()
    ax.set_ylim(None, 150.0 * np.max(rms))


def _below(axes, ground, image, chosen, inset, figure, ends) -> None:
    """The reference, and what the choice looks like at the highest rate."""
    _inset(axes[0], ground.picture(ground.true)[inset], "reference", ends)
    whole = image.picture(image.true)
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


def _errors(ground, inset, rates, seed: int) -> np.ndarray:
    """RMS errors on some pixels of the inset, by rates and limits."""
    inner = ground.part(inset)
    some = ground.scene.every(STEP)[inner.where]
    points, own, true = inner.receivers[some], inner.own[some], inner.true[some]
    lamp, pixel, rms = ground.scene.lamp, ground.scene.pixel, []
    for rate in rates:
        table = ground.traced(rate, seed)
        bounds = blocker_depths(lamp, table, points, pixel)
        for cycles in CYCLES:
            found = sheared_shadow(
                lamp, table, points, cycles / ground.diameter, pixel, own,
                falloff=scenes.falloff, bounds=bounds,
            ).visible  # fmt: skip
            rms.append(np.sqrt(np.mean((found - true) ** 2)))
    return np.reshape(rms, (len(rates), len(CYCLES)))


def _claims(seeds, rms, own, predicted, picked) -> list[Statement | Measurement]:
    """By errors of each seed, rate and limit; and by those of what is drawn."""
    best = np.log2(CYCLES)[np.argmin(seeds, 2)]
    rises = spread(best[:, -1] - best[:, 0])
    noisy = spread(seeds[:, 0, -1] / seeds[:, 0, 1])
    higher = seeds[:, -1, 2:]
    blurry = spread(seeds[:, -1, 1] / higher[:, np.argmin(higher.mean(0))])
    scanned = f"{len(seeds)} seeds, limits from 1/2 to 16 cycles, 0.25 to 16 rays"
    ratio = rms / predicted
    return [
        Statement(
            "Low sampling rates want a low band limit and high ones a higher: doublings of "
            "the best "
            "limit from the fewest rays to the most",
            "the best lie on the diagonal",
            rises[0],
            at_least(1.0, "'higher': twice, a step of the ladder, or more"),
            "E11 §7, Fig. 16",
            "doublings",
            rises[1],
            scanned,
            "What more rays leave is not blur by the limit, but bounds that do not know what lies "
            "under the filter and cells of the lamp: see e11_floors.",
        ),
        Statement(
            "A high limit is noisy if the sampling rate stays low: RMS error at 0.25 rays, "
            "16 cycles "
            "over 1",
            "noise",
            noisy[0],
            at_least(1.0, "'noise': a larger error"),
            "E11 §7",
            "times",
            noisy[1],
            scanned,
        ),
        Statement(
            "At a low limit shadows stay blurry as samples increase: RMS error at the most rays, 1 "
            "cycle over the best of the higher limits",
            "stay blurry",
            blurry[0],
            at_least(1.0, "'blurry': a larger error"),
            "E11 §7",
            "times",
            blurry[1],
            scanned,
        ),
        *(
            Measurement(f"Best limit at {rate:g} rays a pixel, mean of its logarithm",
                        float(2.0 ** np.mean(best[:, k])), "cycles")
            for k, rate in enumerate(RATES[: seeds.shape[1]])
        ),
        Measurement("RMS error of the automatic limit over the best fixed one found with the "
                    "reference, worst rate", float(np.max(own / rms.min(1))), "times"),
        Measurement("The same, one automatic limit for all pixels",
                    float(np.max(picked / rms.min(1))), "times"),
        Measurement("Measured over expected RMS error, least and largest over all rates and limits",
                    f"{ratio.min():.2f} and {ratio.max():.2f}", "times"),
        Measurement("RMS error of the automatic limit, most rays over fewest",
                    float(own[-1] / own[0]), "times"),
    ]  # fmt: skip
