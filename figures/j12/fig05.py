"""J12 Fig. 5: photon maps of scenes C and D seen directly, and through final gathering.

The paper gives no counts. Ours: 5000 photons in a run, a fixed radius of 0.04 m, 256 rays in strata
of equal cosine; the picture is one run. What the gathering removes in scene C is predicted: both
estimates are sums over independent photons, each with all its landings, so that their variance is
`flux^2 N (E[S^2] - E[S]^2)` with S a photon's contribution; its two moments are solved for on 100
panels a wall. Rays are strata here and add next to nothing.
"""

from __future__ import annotations

import itertools

import jax
import numpy as np

from figures.j12.shared.scenes import floor, reference, runs, viewed
from figures.spread import ratio_of_means
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_most
from firstorder import plotting
from firstorder.checks.statistics import LEVEL, spread_test
from firstorder.flatland.bounces import DensityEstimator, final_gather
from firstorder.flatland.library._scenes import scene_c, scene_d

SEED, RADIUS, RAYS, BOUNCES = 5, 0.04, 256, 8
SEVERAL = 20  # runs seen along the whole floor
RHO, POWER = 0.2, 2.0 * np.pi
PLACES = np.array([0.1, 0.3, 0.5, 0.8])  # on borders of panels, where spreads are compared


def draw(quick: bool) -> Drawing:
    count, number = (1000, 40) if quick else (5000, 100)
    s = np.linspace(0.01, 0.99, 50 if quick else 99)
    figure, axes = plotting.panels(2, 2, 3.3, 2.5)
    arrays, claims = {"s": s}, []
    how, some = DensityEstimator(radius=RADIUS), 3 if quick else SEVERAL
    for row, (name, make) in enumerate({"C": scene_c, "D": scene_d}.items()):
        scene = make()
        at = floor(scene, s)
        truth, *_ = reference(name, scene, at, quick)
        number_here = number if name == "C" else some
        maps = list(runs(scene, jax.random.key(SEED + row), count, number_here, BOUNCES))
        whole = _seen(scene, maps[:some], how, s)
        for ax, seen, title in zip(
            axes[row], whole[0], ("map seen directly", "final gathering"), strict=True
        ):
            ax.plot(s, truth, color="#c2410c", ls="-", label="reference")
            ax.plot(s, seen, color="#1b1b1b", ls="-", lw=0.9, label="one run")
            ax.set_title(f"scene {name}: {title}")
            ax.set_xlabel(plotting.label("x"))
            ax.set_ylabel("$E$ (W/m)")
            ax.set_ylim(0.0, 1.3 * float(np.max(truth)))
        claims += _reduced(name, whole, truth)
        if name == "C":
            claims += _noise(_seen(scene, maps, how, PLACES), count, number)
        direct, gathered = whole[0]
        arrays |= {f"truth_{name}": truth, f"direct_{name}": direct, f"gathered_{name}": gathered}
    axes[0, 0].legend(loc="lower center")
    size = f"{count} photons, {number} and {some} runs"
    return Drawing(figure, arrays, claims, size=size, seed=SEED)


def _seen(scene, maps, how, s) -> np.ndarray:
    """Both estimates along the floor: by run, directly or gathered, and place."""
    at = floor(scene, s)
    return np.array(
        [
            [
                viewed(scene, m, how, s),
                np.asarray(final_gather(scene, at, photons=m, how=how, rays=RAYS)),
            ]
            for m in maps
        ]
    )


def _reduced(name: str, whole, truth) -> list[Statement | Measurement]:
    """Noise is the scatter over runs, bias what their mean is off by."""
    direct, gathered = np.sqrt(np.mean((whole - truth) ** 2, axis=-1)).T
    rms = ratio_of_means(gathered, direct)
    noise = np.sqrt(np.mean(whole.var(0, ddof=1), axis=-1))
    bias = np.sqrt(np.mean((whole.mean(0) - truth) ** 2, axis=-1))
    return [
        Statement(
            f"Scene {name}: final gathering reduces noise and bias: RMS error over that of the map "
            "seen directly",
            paper="reduced",
            measured=rms.mean,
            rule=at_most(1.0, "'reduced'"),
            source="J12 §4.4, Fig. 5",
            error=rms.error,
        ),
        Measurement(
            f"Scene {name}: noise after gathering over noise before, and the same of the mean of "
            "all runs",
            f"{noise[1] / noise[0]:.3f}, {bias[1] / bias[0]:.3f}",
            source="J12 §4.4",
        ),
    ]


def _noise(spreads, count, number) -> list[Statement | Measurement]:
    measured = spreads.std(0, ddof=1)
    want = np.array([predicted(x, count) for x in PLACES]).T
    z = spread_test(measured, want, number)
    words = "Scene C: noise that gathering leaves, over the direct, at four places: seen, predicted"
    return [
        Measurement(
            words,
            f"{np.mean(measured[1] / measured[0]):.4f}, {np.mean(want[1] / want[0]):.4f}",
        ),
        Statement(
            "Scene C: spreads of both are the predicted ones: largest deviation of the logarithm",
            paper=None,
            measured=z.worst,
            rule=at_most(z.threshold, f"chance exceeds it once in {1.0 / LEVEL:g}"),
            source=OURS,
            unit="standard errors",
        ),
    ]


# --- what independent photons predict in the square room -----------------------------------------

PANELS = 100


def predicted(x: float, count: int) -> tuple[float, float]:
    """Spread of one run at x on the floor: seen directly, and gathered."""
    landing, onward = _room()
    middle = (np.arange(PANELS) + 0.5) / PANELS
    on_floor = np.abs(middle - x) < RADIUS
    direct = np.concatenate([on_floor / (2.0 * RADIUS), np.zeros(3 * PANELS)])
    flux = POWER / count
    weights = direct, 0.5 * RHO * _smoothed(x)
    spreads = [flux * np.sqrt(count * _variance(w, landing, onward)) for w in weights]
    return spreads[0], spreads[1]


def _variance(w, landing, onward) -> float:
    """Variance of `S = sum of w over the landings of one photon`."""
    eye = np.eye(w.size)
    later = np.linalg.solve(eye - RHO * onward, w) - w  # mean of what follows a landing
    total = np.linalg.solve(eye - RHO * onward.T, landing)  # landings in all
    return float(total @ (w**2 + 2.0 * w * later) - (total @ w) ** 2)


def _room():
    """Chance to land first on each panel, and to go from panel to panel: angles and sines."""
    ends = np.linspace(0.0, 1.0, PANELS + 1)
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)], float)
    line = [a + ends[:, None] * (b - a) for a, b in itertools.pairwise(corners)]
    turned = np.arctan2(ends - 0.5, 0.5)
    landing = np.tile(np.diff(turned) / (2.0 * np.pi), 4)
    onward = np.zeros((4 * PANELS, 4 * PANELS))
    for wall in range(4):
        along = (corners[wall + 1] - corners[wall])[None, None]
        middle = 0.5 * (line[wall][1:] + line[wall][:-1])[:, None]
        for other in range(4):
            if other != wall:
                to = line[other][None] - middle
                sine = np.sum(to * along, -1) / np.linalg.norm(to, axis=-1)
                block = 0.5 * np.abs(np.diff(sine, axis=1))
                rows = slice(wall * PANELS, (wall + 1) * PANELS)
                onward[rows, other * PANELS : (other + 1) * PANELS] = block
    return landing, onward


def _smoothed(x: float) -> np.ndarray:
    """What a photon on each panel adds at x when its flux is spread over the window."""
    t = (np.arange(PANELS) + 0.5) / PANELS
    low, high = np.clip(t - RADIUS, 0.0, 1.0), np.clip(t + RADIUS, 0.0, 1.0)
    sines = (
        lambda t: (1.0 - x) / np.hypot(1.0 - x, t),
        lambda t: (1.0 - t - x) / np.hypot(1.0 - t - x, 1.0),
        lambda t: -x / np.hypot(x, 1.0 - t),
    )
    walls = [np.abs(sine(high) - sine(low)) / (2.0 * RADIUS) for sine in sines]
    return np.concatenate([np.zeros(PANELS), *walls])
