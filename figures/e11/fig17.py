"""What goes wrong with depth bounds, and what does not: no floor of the error is left unexplained.

E11 Fig. 17 shows an inset of its Fig. 12 at 4 rays for each pixel, and no numbers. Ours: a window
of 96 of the 256 x 256 pixels of our stand-in (49 knots, blobs, balls and grids over ground with a
relief), the one with most penumbra, 2 cycles for each of the lamp's diameters, 2,048 stratified
rays as the reference; 20 seeds are judged, on every second pixel both ways. (i) Bounds from fewer
rays miss blockers: those of the 4 rays beside those of 32 for each pixel, and a frustum that ends
in a point, which the paper has, beside one that covers the pixel. (ii) Bounds jump from pixel to
pixel: they are blurred, as the paper proposes, and widened (`smoothed`), which keeps every blocker
in them; what counts is the error at pixels beside which the filter's width jumps twofold.

Below: errors as rays are added, at a fixed band limit, at the automatic one, and by the pixels' own
stratified rays, with what the reference itself may be off by. What does not fall with the shared
rays, and is drawn: where the ground lies among the blockers, which it does not in this window, the
pixel's own 16 rays stay 16; the reference has noise of its own; and what a low limit blurs stays
blurred. The high limit has none of that bias and is noisier for as long as rays are few. That
frusta of pixels do not know what filters look at beside them is shown in `e11_floors`.
"""

from __future__ import annotations

import numpy as np

from figures.e11.shared import bounds as ways
from figures.e11.shared import limits
from figures.e11.shared import space as scenes
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.checks.statistics import error_slope
from firstorder.shadowfield.rendering._filter_shape import filter_shape

CYCLES = np.array([2.0, 4.0, 8.0, 16.0, 32.0])
RATES = (0.25, 1.0, 4.0, 16.0)
RAYS, MORE = 4, 32


def draw(quick: bool = False) -> Drawing:
    """Bounds that miss and bounds that jump; curves of errors."""
    side = scenes.QUICK_SIDE if quick else scenes.SIDE
    image = limits.ground(scenes.array(side), quick)
    window = limits.window(image.picture(image.true), side * 3 // 8)
    ground = image.part(window)
    table = ground.traced(RAYS)
    plain = ground.bounds(table)
    bounds = {
        "bounds of 4 rays": plain,
        "frustum to a point": ground.bounds(table, 0.0),
        "blurred bounds": scenes.blended_bounds(ground.scene, ground.where, plain, 1.0),
        f"bounds of {MORE} rays": ground.bounds(ground.traced(MORE, seed=9)),
    }
    found = {
        name: ground.answers(table, CYCLES[:2], both).visible[0] for name, both in bounds.items()
    }
    whole = ground.picture(ground.true)
    inset = window
    figure, axes = plotting.panels(3, 4, width=2.3, height=2.4)
    top = 4.0 * ground.rms(found["bounds of 4 rays"])
    for k, (name, values) in enumerate(found.items()):
        title = f"{name}\nRMS {100 * ground.rms(values):.2f} %"
        scenes.show(axes[0, k], ground.picture(values)[inset], title, cmap="gray", vmin=0, vmax=1)
        off = ground.picture(values - ground.true)[inset]
        drawn = scenes.show(axes[1, k], off, "off by", cmap=plotting.SIGNED, vmin=-top, vmax=top)
        figure.colorbar(drawn, ax=axes[1, k], location="bottom", shrink=0.8)
    rms = _curves(ground, RATES[:3] if quick else RATES)
    _last_row(figure, axes[2], ground, plain, rms, inset)
    arrays = {name: ground.picture(values) for name, values in found.items()}
    arrays |= {"reference": whole, "first blocker": ground.picture(plain[0])}
    arrays |= {f"last blocker, {name}": ground.picture(b[1]) for name, b in bounds.items()}
    compared = ways.compared(image, window, RAYS, CYCLES[0], 3 if quick else 20)
    claims = _claims(ground, compared, bounds, rms)
    size = f"a window of {side} x {side} pixels, {ground.rays} rays of the reference"
    return Drawing(figure, arrays, claims, {"rms": rms}, size, limits.SEED)


def _curves(ground, rates) -> dict[str, np.ndarray]:
    """Errors as rays are added."""
    rows = []
    for rate in rates:
        rungs = ground.answers(ground.traced(rate), CYCLES)
        own = np.nan
        if rate >= 1.0:
            stratified = scenes.own_rays(ground.scene, ground.where, int(rate), 11)
            own = ground.rms(stratified)
        rows.append(
            [rate, ground.rms(rungs.visible[0]), ground.rms(rungs.visible[-1]),
             ground.rms(ground.chosen(rungs).visible), own]
        )  # fmt: skip
    names = ("rays", "low", "high", "automatic", "stratified")
    return dict(zip(names, np.array(rows).T, strict=True))


def _own_noise(ground, bounds) -> float:
    """Measured error of the pixels' own rays, as far as they are blended in."""
    depth = ground.scene.lamp.local(ground.receivers)[:, 2]
    limit = CYCLES[0] / ground.diameter
    share = filter_shape(depth, *bounds, limit, ground.scene.pixel).touched
    return float(np.sqrt(np.mean((share * (ground.own - ground.true)) ** 2)))


def _last_row(figure, axes, ground, bounds, rms, inset) -> None:
    """The reference, the bounds, and the curves."""
    scenes.show(
        axes[0], ground.picture(ground.true)[inset], "reference", cmap="gray", vmin=0, vmax=1
    )
    depth = ground.scene.lamp.local(ground.receivers)[:, 2]
    near = np.where(np.isfinite(bounds[1]), bounds[1] / depth, np.nan)
    drawn = scenes.show(axes[1], ground.picture(near)[inset], "last blocker", vmin=0.6, vmax=1.0)
    figure.colorbar(drawn, ax=axes[1], location="bottom", shrink=0.8, label="depth / d1")
    space = axes[2].get_subplotspec()
    axes[3].remove()
    axes[2].remove()
    ax = figure.add_subplot(space.get_gridspec()[2, 2:])
    label = {"low": f"{CYCLES[0]:g} cycles", "high": f"{CYCLES[-1]:g} cycles"}
    for k, name in enumerate(("low", "high", "automatic", "stratified")):
        colour = plotting.COLOURS[(1, 2, 0, 3)[k]]
        ax.loglog(rms["rays"], rms[name], "o-", color=colour, label=label.get(name, name))
    ax.axhline(_own_noise(ground, bounds), color="0.3", ls="--", label="own rays among blockers")
    ax.axhline(ground.own_error, color="0.5", ls=":", label="reference, at most")
    ax.set_xticks(rms["rays"], [f"{r:g}" for r in rms["rays"]])
    ax.minorticks_off()
    ax.set(xlabel="rays for each pixel", ylabel="RMS error", title="errors as rays are added")
    ax.set_ylim(top=2.0)
    ax.legend(fontsize=6, loc="upper center", ncols=3)


def _claims(ground, found: ways.Compared, bounds, rms) -> list[Statement | Measurement]:
    plain = spread(found.rms[ways.PLAIN][ways.ALL])
    missed = spread(found.share[ways.MISSED])
    seeds = f"{len(found.share[ways.MISSED])} seeds"
    more = found.ratio(ways.PLAIN, ways.MORE, ways.MISSED)
    point = found.ratio(ways.POINT, ways.PLAIN, ways.ALL)
    claims = [
        Statement(
            "4 samples produce results very close to the ground truth: RMS error",
            "very close",
            plain[0],
            at_most(0.05, "'very close': 5 % of the light"),
            "E11 Fig. 17",
            "of the light",
            plain[1],
            seeds,
        ),
        Statement(
            "Shadows are inaccurate where bounds miss occluders: RMS error there, with bounds of "
            "the 4 rays over bounds of 32",
            "inaccurate",
            more[0],
            at_least(1.0, "'inaccurate': a larger error than with better bounds"),
            "E11 Fig. 17 (i)",
            "times",
            more[1],
            seeds,
            "Blockers that 4 rays a pixel miss lie at depths near those that they meet, and what "
            "is lost to a filter that is too wide is won by its rays.",
        ),
        Statement(
            "A frustum that ends in a point is the cause of misses: RMS error over that with one "
            "that covers the pixel",
            "the cause",
            point[0],
            at_least(1.0, "'due to': a larger error"),
            "E11 §7",
            "times",
            point[1],
            seeds,
            "A pixel is small beside the lamp, so that both frusta are nearly one.",
        ),
    ]
    for way in (*ways.BLURRED, ways.WIDENED):
        beside, everywhere = (found.ratio(way, ways.PLAIN, k) for k in (ways.JUMPS, ways.ALL))
        claims += [
            Statement(
                "Blurring the bounds helps where they jump, 4 rays a pixel: RMS error there with "
                f"bounds {way}, over that without",
                "would help",
                beside[0],
                at_most(1.0, "'help to alleviate': a smaller error beside jumps"),
                "E11 §7",
                "times",
                beside[1],
                seeds,
                ways.REASONS[way == ways.WIDENED],
            ),
            Measurement(f"The same on all ground, {way}", everywhere[0], "times", everywhere[1]),
        ]
    slope = error_slope(rms["rays"], rms["automatic"]).slope
    low, automatic = (float(rms[k][-1]) for k in ("low", "automatic"))
    own = _own_noise(ground, bounds["bounds of 4 rays"])
    return [
        *claims,
        Measurement("Receivers whose bounds miss a blocker that 32 rays see", missed[0],
                    "of the ground", missed[1]),
        Measurement("Slope of the automatic limit's error in rays", slope),
        Measurement("RMS error, low limit, most rays", low),
        Measurement("RMS error, automatic limit, most rays", automatic),
        Measurement("RMS error of the pixels' own rays among blockers, which shared rays do not "
                    "lower", own),
        Measurement("RMS error of the reference, at most", ground.own_error),
    ]  # fmt: skip
