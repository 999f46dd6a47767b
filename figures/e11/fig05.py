"""E11 Fig. 5 and Appendix B: the simple and the sheared filter, and how close replicas may come.

The paper gives no numbers. Ours: d1 = 1 m, blockers between 0.25 and 0.5 m below the light
(slopes 1 and 3), a light of band limit 2 cycles/m, pixels of 16 cycles/m, blockers of 24 cycles/m
on their own planes. (a) the filter that takes all that can be displayed; (b) the sheared one; (c)
the replicas of the wedge at the rates that Appendix B prints, where they cut the filter's
corners; (d) at the corrected rate along the light, `Omega_y_max b (1/a - 1/b)`: (18) has a in
place of b, and that it is enough does not hold for that reason.

All is asked of many lay-outs: depths, light and pixels at random, the wedge below the light's band
limit being no wider than what pixels show, and blockers of at least the light's band limit.
"""

from __future__ import annotations

import numpy as np

from figures.e11.shared import scenes as e11
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.shadowfield import (
    SamplingRates,
    Wedge,
    axis_aligned_filter,
    light_rate_of_endless_wedge,
    receiver_rate,
    replicas_overlap,
    samples_per_receiver,
    sampling_rates,
    sheared_filter,
    wedge_corners,
)

D1, DEPTHS, HIGH, PIX, BAND = 1.0, (0.25, 0.5), 2.0, 16.0, 24.0
LAYOUTS = 40


def draw(quick: bool) -> Drawing:
    k, box = sheared_filter(D1, *DEPTHS, HIGH, PIX), axis_aligned_filter(HIGH, PIX)
    corners = np.asarray(wedge_corners(D1, *DEPTHS, BAND))
    a, b = (float(s) for s in Wedge(*DEPTHS).slopes(D1))
    printed = SamplingRates(receiver_rate(k, corners), HIGH * a * (1 / a - 1 / b))
    right = sampling_rates(k, corners)
    figure, axes = plotting.panels(1, 4, 2.8, 2.6)
    for ax, shape, title in ((axes[0, 0], box, "a) simple"), (axes[0, 1], k, "b) sheared")):
        _wedge(ax, corners, (0.0, 0.0), "0.55")
        e11.draw_filter(ax, shape, "#c2410c", 1.8)
        _frame(ax, title, 20.0, 20.0)
    for ax, rates, title in (
        (axes[0, 2], printed, "c) replicas, printed rate"),
        (axes[0, 3], right, "d) replicas, corrected"),
    ):
        for n in range(-14, 15):
            _wedge(ax, corners, (0.0, n * float(rates.y)), "0.2" if n == 0 else "#2563eb")
        e11.draw_filter(ax, k, "#c2410c", 1.8)
        _frame(ax, title, 3.2, 5.2)
    arrays = {"sheared": k.corners(), "simple": box.corners(), "wedge": corners}
    arrays |= {"rates_printed": [printed.x, printed.y], "rates": [right.x, right.y]}
    claims = _claims(k, right, printed)
    return Drawing(figure, arrays, claims, size="closed form")


def _wedge(ax, corners, shift, color) -> None:
    for sign in (1.0, -1.0):
        body = sign * corners + np.asarray(shift)
        ax.fill(*body.T, facecolor=color, alpha=0.25, linewidth=0)
        e11.outline(ax, body, color, 0.7)


def _frame(ax, title, x, y) -> None:
    ax.set_xlim(-x, x)
    ax.set_ylim(-y, y)
    ax.set_title(title, loc="left")
    ax.set_xlabel(plotting.label("Omega_x"))
    ax.set_ylabel(plotting.label("Omega_y"))


def _claims(k, right, printed) -> list[Statement | Measurement]:
    found = np.array([_layout(seed) for seed in range(LAYOUTS)])
    missed, area, rays, kept, kept_right, rate = found.T
    scanned = f"{LAYOUTS} lay-outs at random: depths, band limits, pixels"
    return [
        Statement("The sheared filter covers the frequencies that the simple one does: largest "
                  "share of a wedge below the light's band limit that it misses", "the same",
                  missed.max(), at_most(0.0, "'covers the same nonzero frequencies'"),
                  "E11 Fig. 5", "share", scanned=scanned),
        Statement("It is compact: least area of the simple filter over that of the sheared one",
                  "compact", area.min(), at_least(1.0, "'compactly covers'"), "E11 Fig. 5",
                  "times", scanned=scanned),
        Statement("It enables sparser sampling: largest ratio of rays per square metre, sheared "
                  "over simple, at the least rates that keep replicas apart", "much sparser",
                  rays.max(), at_most(1.0, "'sparser'"), "E11 §4, App. B", "times",
                  scanned=scanned),
        Statement("At the rates (17) and (18) replicas stay off the filter: share of lay-outs",
                  "prevent overlap", kept.mean(), at_least(1.0, "in each lay-out"),
                  "E11 (17), (18)", scanned=scanned,
                  reason="(18) has d1 / d2_max - 1 where d1 / d2_min - 1 belongs. The "
                  "printed rate is "
                         "enough only where blockers have hardly more frequencies than the light."),
        Statement("At the corrected rate along the light they do: share of lay-outs", None,
                  kept_right.mean(), at_least(1.0, "in each lay-out"), OURS, scanned=scanned),
        Statement("The rate (18) is the least that keeps replicas apart, for blockers without a "
                  "band limit: largest ratio of (18) to that rate", 1.0, rate.max(),
                  at_least(1.0, "'the lowest possible rate', of which (18) knows no band limit"),
                  "E11 (18)", "times", scanned=scanned,
                  reason="The ratio is (d1 / d2_max - 1) over (d1 / d2_min - 1): below 1 for any "
                         "two depths that differ."),
        Measurement("Rays under the sheared filter at the rates that are shown",
                    float(samples_per_receiver(k, right)), "rays"),
        Measurement("Rate along the light by (18) over the corrected one, as shown",
                    float(printed.y) / float(right.y), "times"),
    ]  # fmt: skip


def _layout(seed: int) -> list[float]:
    """Of a lay-out: share missed, ratio of areas and of rays, whether replicas stay off, rates."""
    rng = np.random.default_rng(seed)
    near, far = np.sort(rng.uniform(0.1, 0.8, 2) * D1)
    far = max(far, 1.05 * near)
    a, b = D1 / far - 1.0, D1 / near - 1.0
    high = rng.uniform(1.0, 8.0)
    pixels = high / a * rng.uniform(1.0, 8.0)
    k, box = sheared_filter(D1, near, far, high, pixels), axis_aligned_filter(high, pixels)
    # Its own plane is seen magnified: on the receiver the wedge is no wider than what is shown.
    corners = np.asarray(wedge_corners(D1, near, far, max(rng.uniform(0.5, 1.5) * pixels, high)))
    right, plain = sampling_rates(k, corners), sampling_rates(box, corners)
    printed = SamplingRates(receiver_rate(k, corners), high * a * (1.0 / a - 1.0 / b))
    t = np.linspace(-1.0, 1.0, 201) * 0.999999 * high
    slopes = [1.0 / (D1 / d - 1.0) for d in np.linspace(near, far, 41)]
    missed = 1.0 - np.mean([np.asarray(k.contains(s * t, t)) for s in slopes])
    return [
        float(missed),
        float(box.area / k.area),
        float(right.x * right.y) / float(plain.x * plain.y),
        not replicas_overlap(k, corners, printed, 8),
        not replicas_overlap(k, corners, right, 8),
        float(printed.y) / float(light_rate_of_endless_wedge(D1, near, far, high)),
    ]
