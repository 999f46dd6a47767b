"""D05 §3.4: how strong the shadow of periodic blockers is, and when their average will do.

The paper has the argument (small blockers' high frequencies are removed by the diffuse integral)
and no numbers. Ours: bars half open, d2 = 0.5 m below a light, the receiver d1 = 1 m below it; a
uniform light 1 m wide, and a Gaussian one of the same variance. (a) the shadow of bars of three
periods under the uniform light, exact. (b) the height of the shadow's first wave, relative to the
mean, against the bars' frequency, and the exact bound of the error of average occlusion, `(1 -
open) p / ((1 - d2/d1) w)`: a uniform light leaves waves that fall only as the period does, a soft
one none. (c) two planes of bars (d2 = 0.25 and 0.5 m) whose lengths are in proportion to their
distance from the receiver: their moire keeps its full height however fine they are. For two
planes the claim does not hold.
"""

from __future__ import annotations

import numpy as np

from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_most, near
from firstorder import plotting
from firstorder.fields import BoxProfile, GaussianProfile, Separable
from firstorder.shadowfield import (
    PLANE,
    average_occlusion_bound,
    coarsest_average_period,
    moire,
    moire_frequency,
    shadow_harmonic,
)

D1, D2, OPEN, W = 1.0, 0.5, 0.5, 1.0
PERIODS = (0.6, 0.13, 0.03)


def draw(quick: bool) -> Drawing:
    n = 801 if quick else 6001
    x = np.linspace(0.0, 1.2, n)
    rates = np.geomspace(0.3, 24.0, 301 if quick else 1201)
    uniform = Separable([0.0], (BoxProfile(0.5 * W, "y", PLANE),)).spectrum()
    sigma = W / np.sqrt(12.0)
    soft = Separable([0.0], (GaussianProfile(sigma, "y", PLANE, W),)).spectrum()
    mean = OPEN * W
    waves = {
        name: 2.0 * np.abs(shadow_harmonic(1, 1.0 / rates, OPEN, light, D1, D2)) / mean
        for name, light in (("uniform", uniform), ("Gaussian", soft))
    }
    worst = np.array([_error(1.0 / rate) for rate in rates])
    bound = np.asarray(average_occlusion_bound(1.0 / rates, OPEN, W, D1, D2))
    figure, axes = plotting.panels(1, 3, 3.3, 2.6)
    shadows = {p: _shadow(x, p) for p in PERIODS}
    for p, h in shadows.items():
        axes[0, 0].plot(x, h, label=f"p = {p:g} m")
    axes[0, 0].axhline(mean, color="0.6", linestyle=":")
    axes[0, 0].set(xlabel=plotting.label("x"), ylim=(0.0, 1.0))
    axes[0, 0].set_title("a) shadow of bars", loc="left")
    axes[0, 0].legend(loc="upper right")
    for name, wave in waves.items():
        axes[0, 1].loglog(rates, wave, label=f"first wave, {name}")
    axes[0, 1].loglog(rates, worst, label="error of the average", linewidth=0.8)
    axes[0, 1].loglog(rates, bound, label="its bound")
    axes[0, 1].set(xlabel="bars (1/m)", ylim=(1e-7, 4.0))
    axes[0, 1].set_title("b) relative to the mean", loc="left")
    axes[0, 1].legend(loc="lower left")
    pairs = {p: np.asarray(moire(x, p, D1, 0.25, D2)) for p in (0.4, 0.1)}
    for p, h in pairs.items():
        axes[0, 2].plot(x, h, label=f"p = {p:g} m")
    axes[0, 2].set(xlabel=plotting.label("x"), ylim=(0.0, 0.7))
    axes[0, 2].set_title("c) two matched planes", loc="left")
    axes[0, 2].legend(loc="upper right")
    table = {"rate": rates, "uniform": waves["uniform"], "gaussian": waves["Gaussian"]}
    curves = {"waves": table | {"error": worst, "bound": bound}}
    arrays = {"x": x, **{f"h_{p:g}": h for p, h in shadows.items()}, **curves["waves"]}
    claims = _claims(rates, worst, bound, uniform, soft, mean)
    return Drawing(figure, arrays, claims, curves, f"{n} receivers, {rates.size} periods")


def _passed(u, period):
    """Length of the openings between 0 and u, an opening being centred at 0."""
    t = u / period + 0.5 * OPEN
    return period * (np.floor(t) * OPEN + np.minimum(t - np.floor(t), OPEN))


def _shadow(x, period):
    """The length of the uniform light that is seen, from the bars' primitive."""
    s = D2 / D1
    ends = [side * 0.5 * W * (1.0 - s) + x * s for side in (-1.0, 1.0)]
    return (_passed(ends[1], period) - _passed(ends[0], period)) / (1.0 - s)


def _error(period) -> float:
    """Largest relative error of the mean over one period of the shadow: its kinks are known."""
    s, half = D2 / D1, 0.5 * OPEN * period
    seen = 0.5 * W * (1.0 - s)
    kinks = [(k * period + side * half + end * seen) / s
             for k in (0, 1) for side in (-1, 1) for end in (-1, 1)]  # fmt: skip
    return float(np.max(np.abs(_shadow(np.array(kinks), period) / (OPEN * W) - 1.0)))


def _claims(rates, worst, bound, uniform, soft, mean) -> list[Statement | Measurement]:
    def wave(light, period):
        return 2.0 * float(abs(shadow_harmonic(1, period, OPEN, light, D1, D2))) / mean

    percent = float(coarsest_average_period(0.01, OPEN, W, D1, D2))
    # Beyond whole periods one opening is seen: the worst there is.
    fine = [(1.0 - D2 / D1) * W / (k + OPEN) for k in (40, 80)]
    order = float(np.log(_error(fine[0]) / _error(fine[1])) / np.log(fine[0] / fine[1]))
    heights = [float(np.ptp(moire(np.linspace(0, 3, 30001), p, D1, 0.25, D2))) for p in (0.1, 0.01)]
    factor = float(moire_frequency(0.01, D1, 0.25, D2) / moire_frequency(0.1, D1, 0.25, D2))
    removed = at_most(0.05, "'effectively removed': a twentieth is left")
    return [
        Statement("Small-enough blockers' high frequencies are removed by the integral: first wave "
                  "of bars of 2 cm, Gaussian light", "effectively removed", wave(soft, 0.02),
                  removed, "D05 §3.4", "of the mean"),
        Statement("... worst error of the average occlusion, bars of 1.2 cm, uniform light",
                  "effectively removed", _error(fine[0]), removed, "D05 §3.4", "of the mean"),
        Measurement("First wave of bars of 60 cm, uniform light", wave(uniform, 0.6),
                    "of the mean"),
        Statement("Error of average occlusion over its bound, at most", None,
                  float(np.max(worst / bound)), at_most(1.0, "a bound"), OURS,
                  scanned="periods of 4 cm to 3.3 m"),
        Statement("The worst error of fine bars under uniform light falls as this power of their "
                  "period", None, order, near(1.0, 1e-6, "the bound's own"), OURS),
        Measurement("Coarsest bars for which the average errs by at most 1 %", percent, "m"),
        Statement("... two matched planes of bars, ten times finer: height of the shadow's waves "
                  "over that before", "effectively removed", heights[1] / heights[0], removed,
                  "D05 §3.4",
                  reason="Bars of two planes whose periods are in proportion to their distances "
                  "from the receiver are in step along every ray's image: their moire does not "
                  "depend on how fine they are."),
        Measurement("... and their frequency, over that before", factor),
    ]  # fmt: skip
