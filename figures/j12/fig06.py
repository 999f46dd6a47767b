"""J12 Fig. 6: scene B by photon mapping, 100 runs: the shadow is overestimated.

The paper gives no counts. Ours: 2000 photons in a run and ten times as many, 50 nearest of which
the farthest is left out, so that what is seen is the boundary bias and not the excess of Fig. 4.
The bias is predicted exactly from the window's law and E in closed form: the window that holds 50
photons reaches out of the shadow.
"""

from __future__ import annotations

import jax
import numpy as np

from figures.j12.shared.scenes import FLUX, arrived, line_light, runs, viewed
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.checks.statistics import z_test, z_threshold
from firstorder.flatland.bounces import DensityEstimator
from firstorder.flatland.library._scenes import scene_b
from firstorder.sampling._density import expected_k_nearest

RUNS, K, SEED = 100, 50, 6


def draw(quick: bool) -> Drawing:
    few = 1000 if quick else 2000
    scene, share = scene_b(), arrived(True)
    s = np.linspace(0.0, 1.0, 41 if quick else 81)
    x = 2.0 * s - 1.0
    truth = line_light(x, True)
    seen, want = {}, {}
    for i, count in enumerate((few, 10 * few)):
        maps = runs(scene, jax.random.key(SEED + i), count, RUNS, 0)
        seen[count] = np.stack([viewed(scene, m, DensityEstimator(k=K), s) for m in maps])
        want[count] = FLUX * expected_k_nearest(share, x, K, count, K - 1).mean
    figure, axes = plotting.panels(1, 2, 3.6, 2.7)
    for ax, count in zip(axes[0], seen, strict=True):
        ax.plot(x, truth, color="#c2410c", ls="-", label="truth")
        ax.plot(x, seen[count].mean(0), "o", color="#1b1b1b", ms=2.5, label="mean of 100 runs")
        ax.plot(x, want[count], color="#1b1b1b", ls="--", lw=0.9, label="predicted")
        ax.set_title(f"{count} photons, {K} nearest")
        ax.set_xlabel(plotting.label("x"))
        ax.set_ylabel("$E$ (W/m)")
        ax.set_ylim(0.0, 0.85)
        ax.set_xticks(np.linspace(-1.0, 1.0, 5))
    axes[0, 0].legend(loc="upper center")
    arrays = {"x": x, "truth": truth}
    for word, count in zip(("few", "many"), seen, strict=True):
        arrays |= {f"mean_{word}": seen[count].mean(0), f"predicted_{word}": want[count]}
    size = f"{RUNS} runs of {few} and of {10 * few} photons"
    return Drawing(figure, arrays, _claims(x, truth, seen, want), size=size, seed=SEED)


def _claims(x, truth, seen, want) -> list[Claim]:
    few, many = seen
    dark = int(np.argmin(np.abs(x)))
    over = {n: float(seen[n].mean(0)[dark] / truth[dark]) - 1.0 for n in seen}
    expected = {n: float(want[n][dark] / truth[dark]) - 1.0 for n in seen}
    noise = float(seen[few][:, dark].std(ddof=1) / np.sqrt(RUNS) / truth[dark])
    claims = [
        Claim(
            "The shadow's middle is overestimated (excess over the truth; predicted here)",
            expected[few],
            over[few],
            "",
            over[few] > z_threshold(1) * noise,
        ),
        Claim(
            "The boundary bias diminishes with ten times the photons (its ratio; predicted here)",
            expected[many] / expected[few],
            over[many] / over[few],
            "",
            abs(over[many]) < 0.5 * over[few],
        ),
    ]
    for word, n in (("few", few), ("many", many)):
        error = seen[n].std(0, ddof=1) / np.sqrt(RUNS)
        z = z_test(seen[n].mean(0), error, want[n], freedom=RUNS - 1)
        claims.append(
            Claim(
                f"The mean of 100 runs of {word} photons is the predicted one (largest deviation)",
                None,
                z.worst,
                "sigma",
                z.passed,
            )
        )
    return claims
