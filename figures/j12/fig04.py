"""J12 Fig. 4: scene A by photon mapping, 100 runs: k nearest photons against a fixed radius.

The paper gives no counts. Ours: 2000 photons in a run, k = 10, radius 0.05 m. Predicted are the
means of both estimators for independent photons, exactly (`firstorder.sampling._density`): the
excess of k nearest, the curvature of E, and the loss at the ends of the receiver, where half of the
window is beyond it.

"Both approaches are consistent" is read as it is of density estimates: k grows with the photons
and k over their number falls, a radius shrinks. Then errors fall as they should (exactly, to 8
million photons). With k held as in the picture the excess k / (k - 1) stays however many photons
are thrown; it goes at any k if the farthest photon is left out.
"""

from __future__ import annotations

import jax
import numpy as np

from figures.j12.shared.scenes import FLUX, arrived, line_light, runs, viewed
from figures.spread import ratio_of_means, spread
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most, near
from firstorder import plotting
from firstorder.checks.statistics import LEVEL, z_test
from firstorder.flatland.bounces import DensityEstimator
from firstorder.flatland.library._scenes import scene_a
from firstorder.sampling._density import expected_fixed_radius, expected_k_nearest

RUNS, K, RADIUS, SEED = 100, 10, 0.05, 4
INSIDE = 0.7  # clear of the ends of the receiver, where half of the window is beyond it
COUNTS = tuple(2000 * 4**i for i in range(7))
HOW = {
    "printed": DensityEstimator(k=K, keep_farthest=True),
    "without the farthest": DensityEstimator(k=K),
    "fixed": DensityEstimator(radius=RADIUS),
}


def draw(quick: bool) -> Drawing:
    count = 1000 if quick else 2000
    scene, share = scene_a(), arrived(False)
    s = np.linspace(0.0, 1.0, 41 if quick else 81)
    x = 2.0 * s - 1.0
    truth = line_light(x, False)
    maps = list(runs(scene, jax.random.key(SEED), count, RUNS, 0))
    few = {name: np.stack([viewed(scene, m, how, s) for m in maps]) for name, how in HOW.items()}
    want = {
        "printed": expected_k_nearest(share, x, K, count),
        "without the farthest": expected_k_nearest(share, x, K, count, K - 1),
        "fixed": expected_fixed_radius(share, x, RADIUS, count),
    }
    figure, axes = plotting.panels(1, 2, 3.6, 2.7)
    _show(axes[0, 0], x, truth, few, want, ("printed", "without the farthest"))
    _show(axes[0, 1], x, truth, few, want, ("fixed",))
    axes[0, 0].set_title(f"{K} nearest photons")
    axes[0, 1].set_title(f"fixed radius {RADIUS} m")
    arrays = {"x": x, "truth": truth}
    for name in HOW:
        key = name.replace(" ", "_")
        arrays |= {f"mean_{key}": few[name].mean(0), f"predicted_{key}": FLUX * want[name].mean}
    claims = _claims(x, truth, few, want)
    return Drawing(figure, arrays, claims, size=f"{RUNS} runs of {count} photons", seed=SEED)


def _show(ax, x, truth, seen, want, names) -> None:
    ax.plot(x, truth, color="#c2410c", ls="-", label="truth")
    for name, marker in zip(names, ("o", "s"), strict=False):
        colour = "#1b1b1b" if marker == "o" else "#2563eb"
        label = "100 runs" if name == "fixed" else name
        ax.plot(x, seen[name].mean(0), marker, color=colour, ms=2.5, label=label)
        ax.plot(x, FLUX * want[name].mean, color=colour, ls="--", lw=0.9, label="predicted")
    ax.set_xlabel(plotting.label("x"))
    ax.set_ylabel("$E$ (W/m)")
    ax.set_ylim(0.0, 1.2)
    ax.set_xticks(np.linspace(-1.0, 1.0, 5))
    ax.legend(loc="lower center")


def _claims(x, truth, few, want) -> list[Statement | Measurement]:
    inside = np.abs(x) < INSIDE

    def ratios(seen):
        """Mean over places of what is seen over the truth, by run."""
        return np.mean(seen[:, inside] / truth[inside], axis=1)

    printed, fixed, left_out = (ratios(few[name]) for name in HOW)
    excess = spread(printed - 1.0)
    return [
        Statement(
            f"{K} nearest photons as printed overestimate: mean over the truth",
            paper="overestimates",
            measured=1.0 + excess.mean,
            rule=at_least(1.0, "'overestimates'"),
            source="J12 Fig. 4",
            error=excess.error,
        ),
        _reduces("A fixed radius reduces the overestimate", fixed, printed, "J12 Fig. 4"),
        _reduces("Leaving out the farthest of k removes it", left_out, printed, OURS),
        *_consistent(x[inside], truth[inside]),
        _as_predicted(few, want),
        Measurement(
            "A fixed radius at the end of the receiver: mean over the truth",
            float(few["fixed"].mean(0)[0] / truth[0]),
            error=float(few["fixed"][:, 0].std(ddof=1) / np.sqrt(RUNS) / truth[0]),
        ),
    ]


def _reduces(words: str, less, printed, source: str) -> Statement:
    """What is left of the excess; the runs are the same for both."""
    left = ratio_of_means(less - 1.0, printed - 1.0)
    removes = source == OURS
    rule = at_most(0.25, "'removes'") if removes else at_most(1.0, "'reduces'")
    return Statement(
        f"{words}: what is left of the excess",
        paper=None if removes else "reduces",
        measured=abs(left.mean),
        rule=rule,
        source=source,
        error=left.error,
    )


def exact(x, truth) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Relative bias, and RMS error of one run with its noise, exactly, by number of photons."""
    share, found = arrived(False), {}
    methods = {
        "held": lambda n: expected_k_nearest(share, x, K, n),
        "nearest": lambda n: expected_k_nearest(share, x, round(K * (n / COUNTS[0]) ** 0.5), n),
        "fixed": lambda n: expected_fixed_radius(share, x, RADIUS * (n / COUNTS[0]) ** -0.2, n),
    }
    for name, method in methods.items():
        want = [method(n) for n in COUNTS]
        bias = np.array([np.mean(FLUX * w.mean / truth - 1.0) for w in want])
        off = [((FLUX * w.mean - truth) ** 2 + (FLUX * w.spread) ** 2) / truth**2 for w in want]
        found[name] = bias, np.sqrt(np.mean(off, axis=1))
    return found


def _consistent(x, truth) -> list[Statement | Measurement]:
    found = exact(x, truth)
    claims: list[Statement | Measurement] = [
        Statement(
            f"{words}: the estimate converges to the truth: power of the number with which RMS "
            "errors fall in the limit",
            paper="consistent",
            measured=float(np.log2(found[name][1][-1] / found[name][1][-2]) / 2.0),
            rule=near(order, 0.1, why),
            source="J12 Fig. 4",
            scanned=f"the last two of {COUNTS[0]} to {COUNTS[-1]} photons, exact means and spreads",
        )
        for name, words, order, why in (
            ("nearest", "k nearest, k growing as the root of the photons", -0.25, "noise k^(-1/2)"),
            ("fixed", "A fixed radius that shrinks as their power -1/5", -0.4, "bias r^2 as noise"),
        )
    ]
    ends = ", ".join(f"{found[name][1][-1]:.3f}" for name in ("nearest", "fixed"))
    words = f"Relative RMS error of one run of {COUNTS[-1]} photons, k nearest and fixed radius"
    claims.append(Measurement(words, ends))
    return [
        *claims,
        Statement(
            f"With k held at {K} the excess stays: of {COUNTS[-1]} photons over that of "
            f"{COUNTS[0]}",
            paper=None,
            measured=found["held"][0][-1] / found["held"][0][0],
            rule=near(1.0, 0.05, "it is 1 / (k - 1) for any number of photons"),
            source=OURS,
            scanned="exact means",
        ),
    ]


def _as_predicted(few, want) -> Statement:
    seen = np.stack([few[name] for name in HOW])
    means = np.stack([FLUX * want[name].mean for name in HOW])
    error = seen.std(1, ddof=1) / np.sqrt(RUNS)
    z = z_test(seen.mean(1), error, means, freedom=RUNS - 1)
    return Statement(
        f"The means of {RUNS} runs of all three estimators are the predicted ones: largest "
        "deviation",
        paper=None,
        measured=z.worst,
        rule=at_most(z.threshold, f"chance exceeds it once in {1.0 / LEVEL:g}"),
        source=OURS,
        unit="standard errors",
    )
