"""E11 Fig. 18: two sets of blockers whose shadows are sharper than the wedge allows.

The paper gives no numbers. Ours, with light and floor 1 m long and 1 m apart, blockers between
0.25 and 0.5 m below the light: (a) two combs, half open, in proportion to their distance from the
floor, which cover the light with a common period of 1/8 m; (b) 17 thin walls before the light
that all point at the middle of the floor (and as many on either side). Both shadows have closed
forms: a triangle wave between 0 and 1/2, and a spike `max(0, 1 - (2/3) walls |x - 1/2|)`.

Energy outside the wedge is measured as in Fig. 7, where random scenes are: on means of 3 x 3 rays
under a Hann window, the mean apart, two bins beside the wedge counted as inside, over combs of 12
periods and funnels that point at 12 places on the floor. What matters for the shadow is the share
of its own energy, on the line Omega_y = 0: the wedge has only the mean there, so all of the
shadow's variation at a light as wide as this one lies outside.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.e11.shared import scenes as e11
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most, near
from firstorder import plotting
from firstorder.flatland.library._e11 import FIG18_DEPTHS, e11_fig18a, e11_fig18b
from firstorder.shadowfield import Wedge, moire, power_spectrum

D1, PERIOD, WALLS = 1.0, 0.125, 17
SCALES = (1, 2, 3)


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
    claims = _claims(arrays, grid, wedge, x, 2 if quick else 12)
    return Drawing(figure, arrays, claims, curves, f"{n}^2 rays, {x.size} receivers")


def _claims(arrays, grid, wedge, x, layouts) -> list[Statement | Measurement]:
    coarse = e11.unit_grid(grid.size[0] // 3)  # of means of 3 x 3 rays
    truth = np.asarray(moire(x, 0.75 * PERIOD, D1, *FIG18_DEPTHS))
    spike = np.maximum(0.0, 1.0 - 2.0 / 3.0 * WALLS * np.abs(x - 0.5))
    errors = [float(np.max(np.abs(arrays[k] - t))) for k, t in (("h_a", truth), ("h_b", spike))]
    fine = np.linspace(0.25, 0.75, 4001)
    combs = [np.asarray(e11.shadow(e11_fig18a(PERIOD / n), fine)) for n in SCALES]
    faster = [_crossings(h) / _crossings(combs[0]) / n for h, n in zip(combs, SCALES, strict=True)]
    heights = [float(np.ptp(h) / np.ptp(combs[0])) for h in combs]
    funnels = [np.asarray(e11.shadow(e11_fig18b(WALLS * n), fine)) for n in SCALES]
    widths = [n * float(np.mean(h) / np.mean(funnels[0]))
              for h, n in zip(funnels, SCALES, strict=True)]  # fmt: skip
    leaks = [
        spread([e11.leak(e11.smooth_visibility(s, coarse.size[0]), coarse, wedge) for s in some])
        for some in (
            [e11_fig18a(p) for p in np.linspace(0.08, 0.16, layouts)],
            [e11_fig18b(WALLS, m) for m in np.linspace(0.3, 0.7, layouts)],
        )
    ]
    much = at_least(0.1, "'significant': a tenth of the energy, the mean apart")
    scaled = "slits, or the distances of walls, a half and a third as large"
    return [
        Statement("Double slit: the shadow is a triangle wave, largest difference from it",
                  "roughly a triangle wave", errors[0], at_most(1e-12, "the exact shadow"),
                  "E11 §7", "of the light"),
        Statement("Funnel: complete visibility at a place that quickly fades to none, largest "
                  "difference from a spike", "complete visibility", errors[1],
                  at_most(1e-12, "the exact shadow"), "E11 §7", "of the light"),
        Statement("Scaling slits makes arbitrarily high frequencies: frequency over that before, "
                  "times the scale, farthest from 1", "arbitrarily high",
                  max(faster, key=lambda r: abs(r - 1.0)),
                  near(1.0, 0.01, "receivers are an eighth of a millimetre apart"), "E11 §7",
                  scanned=scaled),
        Statement("... with no change in amplitude: height over that before, farthest from 1",
                  "no change", max(heights, key=lambda r: abs(r - 1.0)),
                  near(1.0, 0.01, "receivers are an eighth of a millimetre apart"), "E11 §7",
                  scanned=scaled),
        Statement("Squeezing the funnel's edges gives a sharper and sharper spike: its width over "
                  "that before, over the distance of the walls, farthest from 1",
                  "sharper and sharper", max(widths, key=lambda r: abs(r - 1.0)),
                  near(1.0, 0.01, "receivers are an eighth of a millimetre apart"), "E11 §7",
                  scanned=scaled),
        Statement("Double slit: energy outside the wedge", "significant", leaks[0][0], much,
                  "E11 Fig. 18", "share", leaks[0][1], f"{layouts} periods from 8 to 16 cm"),
        Statement("Funnel: energy outside the wedge", "significant", leaks[1][0], much,
                  "E11 Fig. 18", "share", leaks[1][1], f"{layouts} places that walls point at"),
        Measurement("Double slit: energy on the axis Omega_y = 0, two bins beside it included",
                    _on_axis(arrays["f_a"], grid), "share"),
    ]  # fmt: skip


def _crossings(h) -> float:
    """How often a wave passes the middle of its range, for each of its samples."""
    off = h - 0.5 * (np.min(h) + np.max(h))
    k = np.flatnonzero(off[1:] * off[:-1] < 0.0)
    place = k + off[k] / (off[k] - off[k + 1])
    return float((len(k) - 1) / (place[-1] - place[0]))


def _on_axis(f, grid) -> float:
    """What a light as wide as the picture makes a shadow of."""
    _, (Ox, Oy) = e11.frequencies(grid)
    energy = power_spectrum(f.astype(float), grid)
    margin = e11.bins(grid)
    axis = (np.abs(Oy) <= margin) & (np.abs(Ox) > margin)
    return float(jnp.sum(jnp.where(axis, energy, 0.0)) / jnp.sum(energy))
