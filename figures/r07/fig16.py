"""R07 Fig. 16: bumps of one frequency, and what a coarse grid's differences make of them.

The paper gives no numbers. Ours: diffuse ground in four sine waves of 0.5 m (slopes up to 0.63) in
light 0.35 rad wide about 0.5 rad to the right, seen from 4 m above:
`flatland.library.bumps.SineBumps`, the sky of `library.r07_fig16`, bumps as normals on a flat base.
Six samples to begin with, 1.25 to a wave. Everything is measured over 32 phases of the wave; the
picture shows the first. An error is that of lines through the samples.

"Usually accurate, regardless of the initial grid" (taken for a tenth of the contrast) holds of most
phases and not of all: cells that begin with an extremum near both ends are never split, and where
all samples happen to lie on extrema, one to a wave, the analytic gradients vanish with the numeric
ones. Second derivatives see them. On waves of one height and length no driver can beat an even grid
by much, and the gradient loses to it.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.r07.shared import shadows as shared
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.flatland.library.bumps import SineBumps

PHASES, INITIAL, RESONANT, BUDGETS = 32, 6, 5, np.array([17, 33, 65])


def draw(quick: bool) -> Drawing:
    n = 1025 if quick else 4097
    x = np.linspace(-1.0, 1.0, n)
    phases = np.arange(PHASES) * (2.0 * np.pi / PHASES)
    budget = int(BUDGETS[-1])
    runs = {
        initial: shared.swept(_waves, jnp.asarray(phases), jnp.asarray(x), budget, initial)
        for initial in (INITIAL, RESONANT)
    }
    errors = {k: shared.errors_over(*run, x, BUDGETS) for k, run in runs.items()}
    images = np.asarray(runs[INITIAL][1])
    at = np.linspace(-1.0, 1.0, INITIAL)
    numeric, analytic = _gradients(images, x, at)
    true = np.array([shared.rms(image[1]) for image in images])

    figure, axes = plotting.panels(1, 3, 3.7, 2.9)
    a, b, c = axes[0]
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
        c.loglog(BUDGETS, shared.geometric_mean(errors[INITIAL][name], 0), "o-", markersize=3,
                 label=name)  # fmt: skip
    c.set(title="c) error after refinement", xlabel="samples", ylabel="rms (W/(m rad))")
    c.set_xticks(BUDGETS, [str(k) for k in BUDGETS])
    c.minorticks_off()
    c.legend(fontsize=7)

    claims = _claims(errors, numeric, analytic, true, float(np.std(images[0, 0])))
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
            **{k: shared.geometric_mean(e, 0) for k, e in errors[INITIAL].items()},
        },
    }
    arrays = {"phases": phases, **{f"error {k}": e for k, e in errors[INITIAL].items()}}
    return Drawing(figure, arrays, claims, curves, f"{PHASES} phases, rms over {n} places")


def _waves(phase):
    return SineBumps(0.05, 2.0, phase)


def _gradients(images, x, at) -> tuple[np.ndarray, np.ndarray]:
    """Differences between neighbouring samples, and the image gradients at them."""
    values = np.stack([np.interp(at, x, image[0]) for image in images])
    analytic = np.stack([np.interp(at, x, image[1]) for image in images])
    return np.diff(values) / np.diff(at), analytic


def _claims(errors, numeric, analytic, true, contrast) -> list[Claim]:
    low = np.array([shared.rms(g) for g in numeric]) / true
    fair = np.array([shared.rms(g) for g in analytic]) / true
    e = errors[INITIAL]
    last = {name: shared.geometric_mean(e[name][:, -1]) for name in e}
    worst = {k: float(np.max(errors[k]["gradient"][:, -1]) / contrast) for k in errors}
    second = float(np.max(errors[RESONANT]["second order"][:, -1]) / contrast)
    ratio = last["numeric"] / last["gradient"]
    return [
        Claim(
            f"{INITIAL} samples over 4 waves: rms numeric gradient, of the true one's (mean)",
            "significantly lower",
            float(np.mean(low)),
            "",
            bool(np.max(low) < 0.5),
        ),
        Claim(
            "The same for the analytic gradients at these samples (mean over phases)",
            "usually accurate",
            float(np.mean(fair)),
            "",
            bool(abs(np.mean(fair) - 1.0) < 0.1),
        ),
        Claim("The same, least and most", None, f"{np.min(fair):.2f} to {np.max(fair):.2f}", ""),
        Claim(
            "Refined to 65 samples: error by numeric differences over that by gradients",
            None,
            float(ratio),
            "times",
            bool(ratio > 1.0),
        ),
        Claim(
            "Refined to 65 samples: error by gradients over that of an even grid",
            None,
            float(last["gradient"] / last["uniform"]),
            "times",
        ),
        Claim(
            "Refined to 65 samples: error by second derivatives over that of an even grid",
            None,
            float(last["second order"] / last["uniform"]),
            "times",
        ),
        Claim(
            f"Worst phase from {INITIAL} samples, refined by gradients: rms error",
            "accurate, regardless of the initial grid",
            worst[INITIAL],
            "of the contrast",
            worst[INITIAL] < 0.1,
        ),
        Claim(
            f"Worst phase from {RESONANT} samples, one to a wave, refined by gradients: rms error",
            "accurate, regardless of the initial grid",
            worst[RESONANT],
            "of the contrast",
            worst[RESONANT] < 0.1,
        ),
        Claim("The same, refined by second derivatives", None, second, "of the contrast"),
    ]
