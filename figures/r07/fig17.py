"""R07 Fig. 17: bumps whose frequency rises from left to right, sampled adaptively.

The paper gives no numbers. Ours: diffuse ground in waves of 1 to 5 cycles per metre over 2 m
(`flatland.library.bumps.ChirpBumps`), lit and seen as in Fig. 16; nine samples to begin with, 65 in
the picture, and grids from five to 33. Everything is measured over 64 chirps whose first frequency
runs from 1 to 2; the picture shows the first. Images are put together by lines through the samples,
as in the paper, and by cubics that know the gradients at them as well.

Refined by analytic gradients the error is a third of that by numeric differences, as the paper has
it. Lines through these samples are not "fairly accurate" (taken for a tenth of the contrast): the
gradient leaves cells alone that have an extremum near both ends, spends samples on straight flanks,
and stays behind an even grid. Cubics through the same samples are, over all grids; from coarse ones
even they are not. What is wrong is the driver: by how far a cell's line is from its cubic
("disagreement", from the same values and gradients) lines are accurate. The bumps are equally high
everywhere, and an even grid of 65 has still six samples to the shortest wave: none is far ahead of
it.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures.r07.shared import shadows as shared
from figures.spread import geometric
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.flatland.library.bumps import ChirpBumps

CHIRPS, INITIAL, SHOWN, ENOUGH = 64, 9, 65, 0.1
GRIDS = (9, 5, 17, 33)  # initial samples
BUDGETS = np.array([9, 13, 17, 25, 33, 49, 65, 97, 129])
SOURCE = "R07 §9.2, Fig. 17"
CLOSEUP = (1.2, 2.0)
COLOURS = dict(
    zip(("uniform", "numeric", "gradient", "second order"), plotting.COLOURS[:4], strict=True)
)
TITLES = {"gradient": "analytic gradients", "numeric": "numeric differences"}


def draw(quick: bool) -> Drawing:
    n, chirps, grids = (513, 8, GRIDS[:2]) if quick else (2049, CHIRPS, GRIDS)
    x = np.linspace(0.0, 2.0, n)
    first = np.linspace(1.0, 2.0, chirps)
    errors, needed, images = shared.over_grids(_chirp, first, x, grids, BUDGETS, ENOUGH)
    lines = shared.swept(_chirp, jnp.asarray(first[:1]), jnp.asarray(x), int(BUDGETS[-1]), INITIAL)
    middles = [shared.error_by_middles(i, x, INITIAL, SHOWN) for i in images]
    image = images[0, 0]
    shown = jax.tree.map(np.asarray, shared.phase_of(lines[0], 0))
    kept = {k: shared.cut(shared.one_of(shown, k), SHOWN) for k in shared.DRIVERS}

    figure, axes = plotting.panels(2, 5, 3.0, 2.4)
    for row, title in ((0, "original"), (1, "closeup")):
        axes[row, 0].plot(x, image, label="original")
        axes[row, 0].set(title=f"a) {title}", ylabel="$I$ (W/(m rad))")
        for column, name in enumerate(TITLES, 1):
            ax, line = axes[row, column], kept[name]
            ax.plot(x, image, color="0.7", linestyle="-", linewidth=2.2)
            ax.plot(line.x, line.value, "o-", color=COLOURS[name], markersize=2,
                    linewidth=0.9)  # fmt: skip
            ax.set(title=f"{'abc'[column]}) {TITLES[name] if row == 0 else 'closeup'}")
        for ax in axes[row, :3]:
            ax.set_xlabel("$x$ (m)")
    for ax in axes[1, :3]:
        ax.set_xlim(CLOSEUP)
    means = {k: shared.geometric_mean(e, 0) for k, e in errors[INITIAL, "lines"].items()}
    for name, colour in COLOURS.items():
        axes[0, 3].loglog(BUDGETS, means[name], "o-", color=colour, markersize=3, label=name)
    axes[0, 3].set(title="d) error", xlabel="samples", ylabel="rms (W/(m rad))")
    axes[0, 3].set_xticks([9, 17, 33, 65, 129], ["9", "17", "33", "65", "129"])
    axes[0, 3].minorticks_off()
    axes[0, 3].legend(fontsize=7)
    for name, style in (("numeric", "--"), ("gradient", "-."), ("second order", "-")):
        at = np.sort(kept[name].x)
        axes[1, 3].plot(at, np.arange(at.size), linestyle=style, color=COLOURS[name], label=name)
    axes[1, 3].plot([0.0, 2.0], [0, SHOWN], color="0.7", linestyle="-", zorder=0, label="even")
    axes[1, 3].set(title="e) samples so far", xlabel="$x$ (m)")
    axes[1, 3].legend(fontsize=7)

    order = sorted(grids)
    by_grid = {k: [v[grids.index(g)] for g in order] for k, v in needed.items()}
    title = "f) for a tenth of the contrast"
    shared.shown_needs(axes[0, 4], by_grid, order, int(BUDGETS[-1]), title)
    cubic = {k: shared.geometric_mean(e, 0) for k, e in errors[INITIAL, "cubics"].items()}
    for name, colour in COLOURS.items():
        axes[1, 4].loglog(BUDGETS, cubic[name], "o--", color=colour, markersize=3, label=name)
    axes[1, 4].set(title="g) error, cubics", xlabel="samples", ylabel="rms (W/(m rad))")
    axes[1, 4].set_xticks([9, 17, 33, 65, 129], ["9", "17", "33", "65", "129"])
    axes[1, 4].minorticks_off()

    contrast = np.std(images[:, 0], axis=1)
    words = "By analytic gradients in the middles of cells, 65 samples, lines: rms error"
    middle = geometric(middles / contrast)
    claims = [
        *_claims(errors, grids, contrast),
        *shared.need_claims(needed, int(BUDGETS[-1])),
        Measurement(words, middle.mean, "of the contrast", middle.error, SOURCE),
    ]
    curves = {
        "image": {"x": x, "image": image},
        "errors": {"samples": BUDGETS, **means},
        **{name: kept[name].columns() for name in TITLES},
    }
    arrays = {
        "first frequency": first,
        **{f"error {k}": e for k, e in errors[INITIAL, "lines"].items()},
    }
    return Drawing(figure, arrays, claims, curves, f"{chirps} chirps, rms over {n} places")


def _chirp(frequency):
    return ChirpBumps(0.6, frequency, 2.0)


def _claims(errors, grids, contrast) -> list[Statement | Measurement]:
    """Over chirps; each stands for the mean over its initial grids."""
    at = int(np.flatnonzero(BUDGETS == SHOWN)[0])
    scanned = f"{len(contrast)} chirps, initial grids of {min(GRIDS)} to {max(GRIDS)}"

    def shares(driver: str, kind: str = "lines") -> np.ndarray:
        each = [errors[g, kind][driver][:, at] / contrast for g in grids]
        return shared.geometric_mean(each, 0)

    worse = geometric(shares("numeric") / shares("gradient"))
    large = geometric(shares("numeric"))
    told = [
        Statement(f"Numerical sampling has significant errors beside analytic gradients, {SHOWN} "
                  "samples: ratio of errors, lines", "significant", worse.mean,
                  at_least(2.0, "'significant': twice the error"), SOURCE, "times", worse.error,
                  scanned),
        Statement(f"Numerical sampling has regions of large error, {SHOWN} samples: rms error, "
                  "lines", "large", large.mean,
                  at_least(0.1, "'large': above a tenth of the contrast"), SOURCE,
                  "of the contrast", large.error, scanned),
    ]  # fmt: skip
    reason = (
        "|f'| at a cell's ends is blind to what lies between two extrema: cells that begin with "
        "one near both ends are never split, wherever the first grid has about one or two samples "
        "a wave, and straight flanks get samples that lines do not need."
    )
    for kind in shared.INTERPOLANTS:
        got = geometric(shares("gradient", kind))
        told.append(
            Statement(f"Analytic gradients reconstruct a fairly accurate version, {SHOWN} samples: "
                      f"rms error, {kind}", "fairly accurate", got.mean,
                      at_most(ENOUGH, "'fairly accurate': a tenth of the contrast"), SOURCE,
                      "of the contrast", got.error, scanned, reason)
        )  # fmt: skip
    better = geometric(shares("gradient") / shares("disagreement"))
    told.append(
        Statement("By the distance of a cell's line from its cubic, from the same values and "
                  "gradients: error by |f'| over its own, lines", None, better.mean,
                  at_least(1.0, "smaller error"), OURS, "times", better.error, scanned)
    )  # fmt: skip
    others = ("uniform", "disagreement", "second order")
    words = ", ".join(f"{k} {geometric(shares(k)).mean:.2f}" for k in others)
    return [*told, Measurement(f"{SHOWN} samples by other drivers, lines: rms error", words,
                               "of the contrast")]  # fmt: skip
