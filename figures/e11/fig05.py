"""E11 Fig. 5 and Appendix B: the simple and the sheared filter, and how close replicas may come.

The paper gives no numbers. Ours: d1 = 1 m, blockers between 0.25 and 0.5 m below the light
(slopes 1 and 3), a light of band limit 2 cycles/m, pixels of 16 cycles/m, blockers of 24 cycles/m
on their own planes. (a) the filter that takes all that can be displayed; (b) the sheared one; (c)
the replicas of the wedge at the rates that Appendix B prints, where they cut the filter's
corners; (d) at the corrected rate along the light, `Omega_y_max b (1/a - 1/b)`: (18) has a in
place of b, and the claims that it is enough do not hold for that reason.
"""

from __future__ import annotations

import numpy as np

from figures.e11.shared import scenes as e11
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.shadowfield import (
    SamplingRates,
    Wedge,
    axis_aligned_filter,
    light_rate,
    light_rate_of_endless_wedge,
    receiver_rate,
    replicas_overlap,
    samples_per_receiver,
    sampling_rates,
    sheared_filter,
    wedge_corners,
)

D1, DEPTHS, HIGH, PIX, BAND = 1.0, (0.25, 0.5), 2.0, 16.0, 24.0


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
    claims = _claims(k, box, corners, printed, right)
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


def _claims(k, box, corners, printed, right) -> list[Claim]:
    t = np.linspace(-1.0, 1.0, 201) * 0.999999 * HIGH
    slopes = [1.0 / (D1 / d - 1.0) for d in np.linspace(*DEPTHS, 41)]
    missed = 1.0 - np.mean([np.asarray(k.contains(s * t, t)) for s in slopes])
    ratio = float(box.area / k.area)
    plain = sampling_rates(box, corners)
    counts = [float(r.x * r.y) for r in (right, plain)]
    shown = replicas_overlap(k, corners, printed, 8), replicas_overlap(k, corners, right, 8)
    endless = float(light_rate_of_endless_wedge(D1, *DEPTHS, HIGH))
    return [
        Claim("wedge below the light's band limit that the sheared filter misses", 0.0, missed,
              "share", missed == 0.0),
        Claim("area of the simple filter over that of the sheared one", "more than 1", ratio, "",
              ratio > 1.0),
        Claim("rays per square metre, sheared filter over simple", "less than 1",
              counts[0] / counts[1], "", counts[0] < counts[1]),
        Claim("rays under the sheared filter at these rates", None,
              float(samples_per_receiver(k, right)), "rays"),
        Claim("at the printed rates (17), (18) replicas stay off the filter", "they do",
              "they overlap" if shown[0] else "they do", "", not shown[0]),
        Claim("at the corrected rate along the light they do", None,
              "they overlap" if shown[1] else "they do", "", not shown[1]),
        Claim("rate along the light (18)", float(printed.y), float(light_rate(k, corners)),
              "1/m", abs(float(light_rate(k, corners)) / float(printed.y) - 1.0) < 1e-9),
        Claim("... and if the blockers had no band limit", float(printed.y), endless, "1/m",
              abs(endless / float(printed.y) - 1.0) < 1e-9),
    ]  # fmt: skip
