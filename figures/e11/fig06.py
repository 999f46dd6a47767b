"""E11 Fig. 6: the filters in space, over (x, y) and over (v, y), and what they make of few rays.

The paper gives no numbers. Ours: the scene of Fig. 3 (d1 = 1 m, blockers 0.2 to 0.45 m below the
light), pixels of 1/24 m (band limit 12 cycles/m), a Gaussian light of deviation 0.25 m about y =
0.5 whose spectrum falls to a hundredth at 2 cycles/m, taken for its band limit. Footprints are
those of E11 §4: a pixel wide, the light (two deviations to either side) high, then scaled and
sheared. (e) and (f) rebuild h(x) from the same 2000 scattered rays with either filter; the truth is
a sum over 4000 rays for each receiver. Rays are shot to a strip of the light's plane that the
sheared filter reads, wider than the light: E11 does not, and normalises. Errors are those of 20
draws of the rays, of which the first is shown; what is said of footprints is asked of 50 lay-outs
at random.
"""

from __future__ import annotations

import equinox as eqx
import numpy as np

from figures.e11.shared import scenes as e11
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.fields import GaussianProfile, Grid, Separable
from firstorder.flatland.library._e11 import FIG03_DEPTHS, e11_fig03
from firstorder.shadowfield import (
    PLANE,
    axis_aligned_filter,
    ray_visibility,
    ray_visibility_by_slope,
    reconstruct_irradiance,
    sheared_filter,
    to_two_planes,
)

D1, PIX, HIGH, SIGMA, SEED, RAYS = 1.0, 12.0, 2.0, 0.25, 11, 2000
LAYOUTS = 50


def draw(quick: bool) -> Drawing:
    n = 96 if quick else 320
    scene, grid = e11_fig03(), Grid.spanning((n, n), (0.5, 0.8), (0.5, 0.5))
    x, y = grid.axis(0), grid.axis(1)
    v = np.linspace(-1.25, 1.25, n + 1)
    both = np.asarray(e11.visibility(scene, grid))
    slopes = np.asarray(eqx.filter_jit(ray_visibility_by_slope)(scene, y, v[:, None]))
    sheared = sheared_filter(D1, *FIG03_DEPTHS, HIGH, PIX, margin=0.5)
    simple = axis_aligned_filter(HIGH, PIX)
    X = np.linspace(0.15, 0.85, 29 if quick else 141)
    h = _profiles(scene, sheared, simple, X)
    draws = [
        h,
        *(_profiles(scene, sheared, simple, X, SEED + k) for k in range(1, 3 if quick else 20)),
    ]
    figure, axes = plotting.panels(2, 3, 3.0, 2.6)
    for k, (name, shape) in enumerate((("simple", simple), ("sheared", sheared))):
        plotting.show_light_field(
            axes[0, k], both, x, y, limit=1.0, names=("x", "y"), title=f"{'ab'[k]}) {name}"
        )
        plotting.show_light_field(
            axes[1, k], slopes, v, y, limit=1.0, names=("v", "y"), title=f"{'cd'[k]}) {name}"
        )
        over = _footprint(shape)
        e11.outline(axes[0, k], over, "#c2410c", 2.0)
        stored = (over @ np.asarray(to_two_planes(D1).M).T)[:, ::-1]
        e11.outline(axes[1, k], stored, "#c2410c", 2.0)
    for k, name in enumerate(("simple", "sheared")):
        axes[k, 2].plot(X, h["truth"], label="truth")
        axes[k, 2].plot(X, h[name], label=f"{name}, {RAYS} rays")
        axes[k, 2].set(xlabel=plotting.label("x"), ylim=(-0.1, 1.1))
        axes[k, 2].set_title(f"{'ef'[k]}) share of the light", loc="left")
        axes[k, 2].legend(loc="upper right")
    arrays = {"x": x, "y": y, "v": v, "f_xy": both, "f_vy": slopes, "X": X, **h}
    for name, shape in (("simple", simple), ("sheared", sheared)):
        arrays[f"footprint_{name}"] = _footprint(shape)
    size = f"{n}^2 rays shown, {RAYS} rays rebuilt from"
    curves = {"shadow": {"x": X, **h}}
    return Drawing(figure, arrays, _claims(draws), curves, size, SEED)


def _footprint(k) -> np.ndarray:
    """A pixel and the light, about the middle of both, as the filter's matrix takes them."""
    pixel, light = 0.25 / PIX, 2.0 * SIGMA
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [pixel, light]
    return corners @ np.asarray(k.primal_matrix).T + 0.5


def _light():
    return Separable([0.5], (GaussianProfile(SIGMA, "y", PLANE),))


def _profiles(scene, sheared, simple, X, seed=SEED) -> dict[str, np.ndarray]:
    """The share of the light that arrives: rebuilt with either filter, and counted."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-0.5, 1.5, RAYS), rng.uniform(-0.6, 1.6, RAYS)
    f = _traced(scene, x, y)
    fine = np.linspace(-0.5, 1.5, 4000)
    light = np.exp(-0.5 * ((fine - 0.5) / SIGMA) ** 2)
    truth = np.asarray(_traced(scene, X[:, None], fine)) @ light / np.sum(light)
    on = (y > 0.0) & (y < 1.0)  # two deviations to either side: all the rays that E11 shoots
    rays = {"sheared": (x, y, f), "simple": (x, y, f), "on_light": (x[on], y[on], f[on])}
    filters = {"sheared": sheared, "simple": simple, "on_light": sheared}
    found = {n: _rebuilt(filters[n], _light(), X, rays[n]) for n in rays}
    return {"truth": truth, **{n: np.asarray(a) for n, a in found.items()}}


_traced = eqx.filter_jit(ray_visibility)
_rebuilt = eqx.filter_jit(reconstruct_irradiance)


def _claims(draws) -> list[Statement | Measurement]:
    off, inside = np.array([_layout(seed) for seed in range(LAYOUTS)]).T
    rms = {n: np.array([np.sqrt(np.mean((h[n] - h["truth"]) ** 2)) for h in draws])
           for n in ("sheared", "simple", "on_light")}  # fmt: skip
    ratio, beside = spread(rms["sheared"] / rms["simple"]), spread(rms["on_light"] / rms["sheared"])
    scanned = f"{LAYOUTS} lay-outs at random: depths, band limits"
    return [
        Statement("The footprint is a pixel by the light, scaled by (9) and sheared by (10), over "
                  "(v, y) by (11) and (12): largest relative difference", 0.0, off.max(),
                  at_most(1e-9, "double precision, and x - y"), "E11 (9)-(12)", scanned=scanned),
        Statement("Over (v, y) the footprint's slope is a depth between the blockers': share of "
                  "lay-outs", "between d2_min and d2_max", inside.mean(),
                  at_least(1.0, "in each lay-out"), "E11 Fig. 6", scanned=scanned),
        Statement("The sheared filter enables sparser sampling: RMS error of h from the same "
                  "scattered rays over the axis-aligned filter's", "much sparser", ratio[0],
                  at_most(1.0, "a smaller error from as many rays"), "E11 §4", "times", ratio[1],
                  f"{len(draws)} draws of {RAYS} rays"),
        Measurement("RMS error without the rays that end beside the light, over that with them",
                    beside[0], "times", beside[1]),
        Measurement("RMS error of h, sheared filter", *_of_the_light(rms["sheared"])),
        Measurement("RMS error of h, axis-aligned filter", *_of_the_light(rms["simple"])),
    ]  # fmt: skip


def _of_the_light(values) -> tuple[float, str, float]:
    mean, error = spread(values)
    return mean, "of the light", error


def _layout(seed: int) -> tuple[float, bool]:
    """Largest relative difference of a footprint from the paper's steps, and if its depth is right.

    A corner (x, y) of pixel and light goes the paper's way, number by number.
    """
    rng = np.random.default_rng(seed)
    low, high = np.sort(rng.uniform(0.1, 0.8, 2) * D1)
    band, pixels = rng.uniform(1.0, 4.0), rng.uniform(8.0, 32.0)
    k = sheared_filter(D1, low, high, band, pixels)
    near, far = 1.0 / (D1 / high - 1.0), 1.0 / (D1 / low - 1.0)
    x = 2.0 * pixels / (band * (near - far))
    y = 1.0 - 0.5 * (near + far) * x
    right = np.array([y, (x - y) / D1])
    primal = np.asarray(k.primal_matrix) @ [1.0, 1.0]
    stored = (np.asarray(to_two_planes(D1).M) @ primal).ravel()
    step_y, step_v = np.asarray(k.light_matrix(D1)) @ [1.0, 0.0]
    return float(np.max(abs(stored / right - 1.0))), bool(low < -step_y / step_v < high)
