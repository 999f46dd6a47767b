"""R07 Fig. 16: bumps of one frequency, and what a coarse grid's differences make of them.

The paper gives no numbers. Ours: diffuse ground in four sine waves of 0.5 m (slopes up to 0.63) in
light 0.35 rad wide about 0.5 rad to the right, seen from 4 m above:
`flatland.library.bumps.SineBumps`, the sky of `library.r07_fig16`, bumps as normals on a flat base.
Six samples to begin with, 1.25 to a wave, and grids from five (one to a wave) to 33. Everything is
measured over 96 phases of the wave; the picture shows the first. Images are put together by lines
through the samples, as in the paper, and by cubics that know the gradients at them as well.

"Usually accurate, regardless of the initial grid": an image is accurate when its rms error is below
a tenth of the contrast, "usually" is more than half of the phases, and "regardless" means that the
worst of the grids is asked. From five samples, one to a wave, analytic gradients are the same at
all of them; where they lie on extrema they vanish with the numeric ones. Cells that begin with an
extremum near both ends are never split. Second derivatives see them. On waves of one height and
length no driver can beat an even grid by much, and the gradient loses to it.
"""

from __future__ import annotations

import numpy as np

from figures.r07.shared import shadows as shared
from figures.spread import geometric, rms, spread
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.flatland.library.bumps import SineBumps

PHASES, INITIAL, SHOWN, ENOUGH = 96, 6, 65, 0.1
GRIDS = (5, 6, 9, 17, 33)  # initial samples
BUDGETS = np.array([5, 6, 9, 13, 17, 25, 33, 49, 65, 97, 129])
SOURCE = "R07 §9.2, Fig. 16"


def draw(quick: bool) -> Drawing:
    n, count, grids = (513, 8, GRIDS[:2]) if quick else (2049, PHASES, GRIDS)
    x = np.linspace(-1.0, 1.0, n)
    phases = np.arange(count) * (2.0 * np.pi / count)
    errors, needed, images = shared.over_grids(_waves, phases, x, grids, BUDGETS, ENOUGH)
    at = np.linspace(-1.0, 1.0, INITIAL)
    numeric, analytic = _gradients(images, x, at)
    true = np.array([rms(slope) for slope in images[:, 1]])

    figure, axes = plotting.panels(1, 4, 3.5, 2.9)
    a, b, c, d = axes[0]
    values = np.interp(at, x, images[0, 0])
    a.plot(x, images[0, 0], label="image")
    a.plot(at, values, "o--", color=plotting.COLOURS[1], markersize=3, label="as sampled")
    a.set(title="a) image and coarse samples", xlabel="$x$ (m)", ylabel="$I$ (W/(m rad))")
    a.set_ylim(0.19, 0.46)
    a.legend(fontsize=7, loc="upper center", ncols=2)
    b.plot(x, images[0, 1], label="exact", linewidth=1.0)
    b.step(at, np.append(numeric[0], numeric[0, -1]), where="post", color=plotting.COLOURS[1],
           linestyle="-", label="numeric")  # fmt: skip
    b.plot(at, analytic[0], "s", color=plotting.COLOURS[2], markersize=4, label="analytic")
    b.set(title="b) gradients", xlabel="$x$ (m)", ylabel=r"$I_x$ (W/(m$^2$ rad))")
    b.set_ylim(-2.1, 2.7)
    b.legend(fontsize=7, loc="upper center", ncols=3)
    for ax in (a, b):
        ax.set_xticks([-1.0, -0.5, 0.0, 0.5, 1.0])
    for name in ("uniform", "numeric", "gradient", "second order"):
        mean = shared.geometric_mean(errors[INITIAL, "lines"][name], 0)
        c.loglog(BUDGETS[1:], mean[1:], "o-", markersize=3, label=name)
    c.set(title="c) error after refinement", xlabel="samples", ylabel="rms (W/(m rad))")
    c.set_xticks([9, 17, 33, 65, 129], ["9", "17", "33", "65", "129"])
    c.minorticks_off()
    c.legend(fontsize=7)

    title = "d) for a tenth of the contrast"
    shared.shown_needs(d, needed, grids, int(BUDGETS[-1]), title)

    contrast = float(np.std(images[0, 0]))
    claims = [*_coarse(numeric, analytic, true), *_refined(errors, grids, contrast),
              *shared.need_claims(needed, int(BUDGETS[-1]))]  # fmt: skip
    curves = {
        "image": {"x": x, "image": images[0, 0], "gradient": images[0, 1]},
        "coarse": {
            "x": at,
            "value": values,
            "analytic": analytic[0],
            "numeric_to_the_right": np.append(numeric[0], np.nan),
        },
        "errors": {
            "samples": BUDGETS,
            **{k: shared.geometric_mean(e, 0) for k, e in errors[INITIAL, "lines"].items()},
        },
    }
    arrays = {"phases": phases, **{f"error {k}": e for k, e in errors[INITIAL, "lines"].items()}}
    return Drawing(figure, arrays, claims, curves, f"{count} phases, rms over {n} places")


def _waves(phase):
    return SineBumps(0.05, 2.0, phase)


def _gradients(images, x, at) -> tuple[np.ndarray, np.ndarray]:
    """Differences between neighbouring samples, and the image gradients at them."""
    values = np.stack([np.interp(at, x, image[0]) for image in images])
    analytic = np.stack([np.interp(at, x, image[1]) for image in images])
    return np.diff(values) / np.diff(at), analytic


def _coarse(numeric, analytic, true) -> list[Statement | Measurement]:
    """Of the gradients at the initial samples."""
    low, fair = (np.array([rms(g) for g in found]) / true for found in (numeric, analytic))
    got = spread(low)
    return [
        Statement(f"Initial samples placed coarsely ({INITIAL} over 4 waves): the numerically "
                  "computed gradient is much lower, rms of the actual one's", "much lower",
                  got.mean, at_most(0.5, "'much lower': below half"), SOURCE, "", got.error,
                  f"{len(low)} phases"),
        Measurement("The same for the analytic gradients at these samples, least and most",
                    f"{np.min(fair):.2f} to {np.max(fair):.2f}", source=SOURCE),
    ]  # fmt: skip


def _refined(errors, grids, contrast: float) -> list[Statement | Measurement]:
    """Of images refined to 65 samples."""
    at = int(np.flatnonzero(BUDGETS == SHOWN)[0])
    last = {kind: {k: e[:, at] for k, e in errors[INITIAL, kind].items()}
            for kind in shared.INTERPOLANTS}  # fmt: skip
    lines = last["lines"]
    phases = f"{len(lines['numeric'])} phases"
    numeric = geometric(lines["numeric"] / lines["gradient"])
    second = geometric(lines["gradient"] / lines["second order"])
    told: list[Statement | Measurement] = [
        Statement(f"Refined to {SHOWN} samples: error by numeric differences over that by "
                  "analytic gradients", "inaccurate", numeric.mean,
                  at_least(1.0, "smaller error by gradients"), SOURCE, "times", numeric.error,
                  phases),
        Statement(f"Refined to {SHOWN} samples: error by gradients over that by second derivatives",
                  None, second.mean, at_least(1.0, "smaller error by second derivatives"), OURS,
                  "times", second.error, phases),
    ]  # fmt: skip
    for kind in shared.INTERPOLANTS:
        shares = np.array([
            errors[g, kind]["gradient"][:, at] <= ENOUGH * contrast for g in grids
        ])  # fmt: skip
        worst = spread(shares[np.argmin(np.mean(shares, 1))])
        told += [
            Statement("Analytic gradients are usually accurate, regardless of the initial grid: "
                      f"share of phases with an error below a tenth of the contrast, {SHOWN} "
                      f"samples, {kind}, worst grid", "usually", worst.mean,
                      at_least(0.5, "'usually': more than half"),
                      SOURCE if kind == "lines" else OURS, "", worst.error,
                      f"{phases}, initial grids of {GRIDS[0]} to {GRIDS[-1]}",
                      "|f'| at the ends of a cell is blind to what lies between two extrema: cells "
                      "that begin with one near both ends are never split. It fails for grids of "
                      "about one to two samples a wave."),
            Measurement(f"The same on each initial grid, {kind}",
                        ", ".join(f"{g}: {np.mean(row):.2f}"
                                  for g, row in zip(grids, shares, strict=True))),
        ]  # fmt: skip
    return told
