"""R07 Fig. 17: bumps whose frequency rises from left to right, sampled adaptively.

The paper gives no numbers. Ours: diffuse ground in waves of 1 to 5 cycles per metre over 2 m
(`flatland.library.bumps.ChirpBumps`), lit and seen as in Fig. 16; nine samples to begin with, 65 in
the picture. Everything is measured over 32 chirps whose first frequency runs from 1 to 2; the
picture shows the first. An error is that of lines through the samples.

Refined by analytic gradients the error is a third of that by numeric differences, as the paper has
it. But it is not "fairly accurate" (taken for a tenth of the contrast): the gradient leaves cells
alone that have an extremum near both ends, spends samples on straight flanks, and stays behind an
even grid. The paper's own form, the gradient in the middle of a cell, does worse. So does, by less,
the second derivative until there are 129 samples: the bumps are equally high everywhere, and an
even grid of 65 has still six samples to the shortest wave.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures.r07.shared import shadows as shared
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.flatland.library.bumps import ChirpBumps

CHIRPS, INITIAL, SHOWN, BUDGETS = 32, 9, 65, np.array([17, 33, 65, 129])
CLOSEUP = (1.2, 2.0)
COLOURS = dict(
    zip(("uniform", "numeric", "gradient", "second order"), plotting.COLOURS[:4], strict=True)
)
TITLES = {"gradient": "analytic gradients", "numeric": "numeric differences"}


def draw(quick: bool) -> Drawing:
    n = 1025 if quick else 4097
    x = np.linspace(0.0, 2.0, n)
    first = np.linspace(1.0, 2.0, CHIRPS)
    lines, images = shared.swept(
        _chirp, jnp.asarray(first), jnp.asarray(x), int(BUDGETS[-1]), INITIAL
    )
    errors = shared.errors_over(lines, images, x, BUDGETS)
    middles = [shared.error_by_middles(i, x, INITIAL, SHOWN) for i in np.asarray(images)]
    image = np.asarray(images)[0, 0]
    shown = jax.tree.map(np.asarray, shared.phase_of(lines, 0))
    kept = {k: shared.cut(shared.one_of(shown, k), SHOWN) for k in shared.DRIVERS}

    figure, axes = plotting.panels(2, 4, 3.0, 2.4)
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
    means = {k: shared.geometric_mean(e, 0) for k, e in errors.items()}
    for name, colour in COLOURS.items():
        axes[0, 3].loglog(BUDGETS, means[name], "o-", color=colour, markersize=3, label=name)
    axes[0, 3].set(title="d) error", xlabel="samples", ylabel="rms (W/(m rad))")
    axes[0, 3].set_xticks(BUDGETS, [str(k) for k in BUDGETS])
    axes[0, 3].minorticks_off()
    axes[0, 3].legend(fontsize=7)
    for name, style in (("numeric", "--"), ("gradient", "-."), ("second order", "-")):
        at = np.sort(kept[name].x)
        axes[1, 3].plot(at, np.arange(at.size), linestyle=style, color=COLOURS[name], label=name)
    axes[1, 3].plot([0.0, 2.0], [0, SHOWN], color="0.7", linestyle="-", zorder=0, label="even")
    axes[1, 3].set(title="e) samples so far", xlabel="$x$ (m)")
    axes[1, 3].legend(fontsize=7)

    claims = _claims(errors, means, shared.geometric_mean(middles), float(np.std(image)))
    curves = {
        "image": {"x": x, "image": image},
        "errors": {"samples": BUDGETS, **means},
        **{name: kept[name].columns() for name in TITLES},
    }
    arrays = {"first frequency": first, **{f"error {k}": e for k, e in errors.items()}}
    return Drawing(figure, arrays, claims, curves, f"{CHIRPS} chirps, rms over {n} places")


def _chirp(frequency):
    return ChirpBumps(0.6, frequency, 2.0)


def _claims(errors, means, middles, contrast) -> list[Claim]:
    at = int(np.flatnonzero(BUDGETS == SHOWN)[0])
    pair = errors["numeric"][:, at] / errors["gradient"][:, at]
    share = {k: float(means[k][at] / contrast) for k in means}
    ratios = means["numeric"] / means["gradient"]
    return [
        Claim(
            f"{SHOWN} samples: error by numeric differences over that by analytic gradients",
            "significant errors against fairly accurate",
            float(ratios[at]),
            "times",
            bool(ratios[at] > 2.0),
        ),
        Claim(
            "The same for 17, 33, 65, 129 samples",
            None,
            ", ".join(f"{r:.2f}" for r in ratios),
            "times",
        ),
        Claim(
            "Chirps on which numeric differences do worse",
            None,
            float(np.sum(pair > 1.0)),
            f"of {CHIRPS}",
        ),
        Claim(
            f"{SHOWN} samples by analytic gradients: rms error",
            "fairly accurate",
            share["gradient"],
            "of the contrast",
            share["gradient"] < 0.1,
        ),
        Claim(
            f"{SHOWN} samples by numeric differences: rms error",
            "regions of large error",
            share["numeric"],
            "of the contrast",
            share["numeric"] > 0.1,
        ),
        Claim(
            f"{SHOWN} samples by analytic gradients in the middles of cells: rms error",
            "fairly accurate",
            float(middles / contrast),
            "of the contrast",
            bool(middles < 0.1 * contrast),
        ),
        Claim(f"{SHOWN} even samples: rms error", None, share["uniform"], "of the contrast"),
        Claim(
            f"{SHOWN} samples by second derivatives: rms error",
            None,
            share["second order"],
            "of the contrast",
        ),
        Claim(
            "By second derivatives over even samples, for 17, 33, 65, 129",
            None,
            ", ".join(f"{r:.2f}" for r in means["second order"] / means["uniform"]),
            "times",
        ),
    ]
