"""E11 Fig. 18: two sets of blockers whose shadows are sharper than the wedge allows.

The paper gives no numbers. Ours, with light and floor 1 m long and 1 m apart, blockers between
0.25 and 0.5 m below the light: (a) two combs, half open, in proportion to their distance from the
floor, which cover the light with a common period of 1/8 m; (b) 17 thin walls before the light
that all point at the middle of the floor (and as many on either side). Both shadows have closed
forms: a triangle wave between 0 and 1/2, and a spike `max(0, 1 - (2/3) walls |x - 1/2|)`.

Energy outside the wedge is measured on 0/1 samples under a Hann window, the mean apart, two bins
beside the wedge counted as inside; the random scene of Fig. 7, with its own wedge, stands beside
it. What matters for the shadow is the share of its own energy, on the line Omega_y = 0: the wedge
has only the mean there, so all of the shadow's variation at a light as wide as this one lies
outside.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.e11.shared import scenes as e11
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.flatland.library._e11 import FIG18_DEPTHS, e11_fig07, e11_fig18a, e11_fig18b
from firstorder.shadowfield import Wedge, depth_range, moire, moire_frequency, power_spectrum

D1, PERIOD, WALLS = 1.0, 0.125, 17


def draw(quick: bool) -> Drawing:
    n = 256 if quick else 768
    grid, wedge = e11.unit_grid(n), Wedge(*FIG18_DEPTHS)
    x = np.linspace(0.003, 0.997, 201 if quick else 801)
    scenes = {"a": e11_fig18a(PERIOD), "b": e11_fig18b(WALLS)}
    names = {"a": "a) double slit", "b": "b) funnel"}
    arrays: dict = {"x": x}
    figure, axes = plotting.panels(2, 4, 2.8, 2.5)
    for row, (key, scene) in zip(axes, scenes.items(), strict=True):
        f, h = np.asarray(e11.visibility(scene, grid)), np.asarray(e11.shadow(scene, x))
        e11.draw_map(row[0], scene, names[key])
        plotting.show_light_field(
            row[1], f, *map(grid.axis, (0, 1)), limit=1.0, names=("x", "y"), title="f(x, y)"
        )
        axes_, _ = e11.frequencies(grid)
        near = [np.abs(a) <= 40.0 for a in axes_]
        F = np.sqrt(np.asarray(power_spectrum(f, grid)))[np.ix_(*near)]
        short = [a[m] for a, m in zip(axes_, near, strict=True)]
        plotting.show_spectrum(
            row[2], F, *short, decades=2.5, names=("x", "y"), title="spectrum, wedge"
        )
        e11.draw_wedge(row[2], wedge, D1, 40.0)
        row[2].set_xlim(-40.0, 40.0)
        row[2].set_ylim(-40.0, 40.0)
        row[3].plot(x, h)
        row[3].set(xlabel=plotting.label("x"))
        row[3].set_title("h(x)", loc="left")
        arrays |= {f"f_{key}": f.astype(np.uint8), f"h_{key}": h}
    curves = {"shadow": {"x": x, "double_slit": arrays["h_a"], "funnel": arrays["h_b"]}}
    claims = _claims(arrays, grid, wedge, x)
    return Drawing(figure, arrays, claims, curves, f"{n}^2 rays, {x.size} receivers", 7)


def _claims(arrays, grid, wedge, x) -> list[Claim]:
    truth = np.asarray(moire(x, 0.75 * PERIOD, D1, *FIG18_DEPTHS))
    spike = np.maximum(0.0, 1.0 - 2.0 / 3.0 * WALLS * np.abs(x - 0.5))
    errors = [float(np.max(np.abs(arrays[k] - t))) for k, t in (("h_a", truth), ("h_b", spike))]
    finer = np.asarray(e11.shadow(e11_fig18a(0.5 * PERIOD), x))
    narrower = np.asarray(e11.shadow(e11_fig18b(2 * WALLS + 1), x))
    waves = [float(moire_frequency(0.75 * p, D1, *FIG18_DEPTHS)) for p in (PERIOD, 0.5 * PERIOD)]
    widths = [float(np.mean(h > 0.5)) for h in (arrays["h_b"], narrower)]
    random = e11_fig07(7)
    compared = e11.leak(e11.visibility(random, grid), grid, Wedge(*depth_range(random)))
    leaks = [e11.leak(arrays[f"f_{k}"].astype(float), grid, wedge) for k in "ab"]
    heights = float(np.ptp(finer)) / float(np.ptp(arrays["h_a"]))
    return [
        Claim("double slit: the shadow is a triangle wave, largest difference", 0.0, errors[0],
              "of the light", errors[0] < 1e-12),
        Claim("funnel: the shadow is a spike of full height, largest difference", 0.0, errors[1],
              "of the light", errors[1] < 1e-12),
        Claim("slits of half the size: frequency of the shadow over that before", 2.0,
              waves[1] / waves[0], "", abs(waves[1] / waves[0] - 2.0) < 1e-9),
        Claim("... height of the shadow over that before", 1.0, heights, "",
              abs(heights - 1.0) < 0.02),
        Claim("walls twice as close: width of the spike over that before", 0.5,
              widths[1] / widths[0], "", abs(widths[1] / widths[0] - 0.5) < 0.1),
        Claim("double slit: energy outside the wedge", "significant", leaks[0], "share",
              leaks[0] > 0.1),
        Claim("funnel: energy outside the wedge", "significant", leaks[1], "share",
              leaks[1] > 0.1),
        Claim("random blockers (Fig. 7): energy outside the wedge", "a good fit", compared,
              "share", compared < 0.05),
        Claim("double slit: energy on the axis Omega_y = 0, two bins beside it included", None,
              _on_axis(arrays["f_a"], grid), "share"),
    ]  # fmt: skip


def _on_axis(f, grid) -> float:
    """What a light as wide as the picture makes a shadow of."""
    _, (Ox, Oy) = e11.frequencies(grid)
    energy = power_spectrum(f.astype(float), grid)
    margin = e11.bins(grid)
    axis = (np.abs(Oy) <= margin) & (np.abs(Ox) > margin)
    return float(jnp.sum(jnp.where(axis, energy, 0.0)) / jnp.sum(energy))
