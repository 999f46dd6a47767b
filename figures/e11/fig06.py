"""E11 Fig. 6: the filters in space, over (x, y) and over (v, y), and what they make of few rays.

The paper gives no numbers. Ours: the scene of Fig. 3 (d1 = 1 m, blockers 0.2 to 0.45 m below the
light), pixels of 1/24 m (band limit 12 cycles/m), a Gaussian light of deviation 0.25 m about y =
0.5 whose spectrum falls to a hundredth at 2 cycles/m, taken for its band limit. Footprints are
those of E11 §4: a pixel wide, the light (two deviations to either side) high, then scaled and
sheared. (e) and (f) rebuild h(x) from the same 2000 scattered rays with either filter; the truth
is a sum over 4000 rays for each receiver. Rays are shot to a strip of the light's plane that the
sheared filter reads, wider than the light: E11 does not, and normalises.
"""

from __future__ import annotations

import equinox as eqx
import numpy as np

from figures.e11.shared import scenes as e11
from figures.style import Claim, Drawing
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
    return Drawing(figure, arrays, _claims(sheared, simple, h), curves, size, SEED)


def _footprint(k) -> np.ndarray:
    """A pixel and the light, about the middle of both, as the filter's matrix takes them."""
    pixel, light = 0.25 / PIX, 2.0 * SIGMA
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [pixel, light]
    return corners @ np.asarray(k.primal_matrix).T + 0.5


def _light():
    return Separable([0.5], (GaussianProfile(SIGMA, "y", PLANE),))


def _profiles(scene, sheared, simple, X) -> dict[str, np.ndarray]:
    """The share of the light that arrives: rebuilt with either filter, and counted."""
    rng = np.random.default_rng(SEED)
    x, y = rng.uniform(-0.5, 1.5, RAYS), rng.uniform(-0.6, 1.6, RAYS)
    f = eqx.filter_jit(ray_visibility)(scene, x, y)
    fine = np.linspace(-0.5, 1.5, 4000)
    light = np.exp(-0.5 * ((fine - 0.5) / SIGMA) ** 2)
    truth = (
        np.asarray(eqx.filter_jit(ray_visibility)(scene, X[:, None], fine)) @ light / np.sum(light)
    )
    rebuild = eqx.filter_jit(reconstruct_irradiance)
    on = (y > 0.0) & (y < 1.0)  # two deviations to either side: all the rays that E11 shoots
    rays = {"sheared": (x, y, f), "simple": (x, y, f), "on_light": (x[on], y[on], f[on])}
    filters = {"sheared": sheared, "simple": simple, "on_light": sheared}
    found = {n: rebuild(filters[n], _light(), X, rays[n]) for n in rays}
    return {"truth": truth, **{n: np.asarray(a) for n, a in found.items()}}


def _claims(sheared, simple, h) -> list[Claim]:
    near, far = (1.0 / (D1 / d - 1.0) for d in FIG03_DEPTHS)
    wide = HIGH * (far - near)
    step_y, step_v = np.asarray(sheared.light_matrix(D1)) @ [1.0, 0.0]
    rms = {n: float(np.sqrt(np.mean((h[n] - h["truth"]) ** 2))) for n in h}
    scale, shear = float(sheared.primal_scale), float(sheared.primal_shear)
    depth = float(-step_y / step_v)
    inside = FIG03_DEPTHS[0] < depth < FIG03_DEPTHS[1]
    return [
        Claim("scale of the footprint (9)", 2 * PIX / wide, scale, "",
              abs(scale * wide / (2 * PIX) - 1.0) < 1e-12),
        Claim("shear of the footprint (10)", -0.5 * (near + far), shear, "m/m",
              abs(shear + 0.5 * (near + far)) < 1e-12),
        Claim("over (v, y) the footprint's slope is a depth between the blockers' (d2_avg)",
              "between d2_min and d2_max", depth, "m", inside),
        Claim("RMS error of h from the same scattered rays, sheared filter", "less than simple",
              rms["sheared"], "of the light", rms["sheared"] < rms["simple"]),
        Claim("... axis-aligned filter", None, rms["simple"], "of the light"),
        Claim("... sheared filter, without the rays that end beside the light", None,
              rms["on_light"], "of the light"),
    ]  # fmt: skip
