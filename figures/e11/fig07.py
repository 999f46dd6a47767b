"""E11 Fig. 7: a scene of random thin and round blockers, its spectrum, the wedge, what is lost.

The paper gives x and y in [0, 1] and two numbers: a light band limit of 1/2 and 0.5 % of the
energy outside the filter. It gives neither a unit for the first nor says which energy the second
is of. Ours: 18 strips and 12 discs, seed 7, between 0.1 and 0.4 m below the light (`e11_fig07`),
rays on a regular grid over (x, y); spectra under a Hann window, without which the ends of [0, 1]
put a cross through every spectrum. "Energy" is all of it, the mean included (a tenth of it stands
at frequency zero alone, the window smears the rest of the mean to its neighbours); "outside" is
outside the sheared filter of the depths' true range.

Read as half a cycle per metre, 1/2 leaves all but frequency zero outside: that reading does not
hold. Read as half a cycle per sample, the filter's height is all of the picture, and what is
outside lies beside the wedge; how much depends on the picture's size, for the energy of edges
falls off as 1 / Omega. The setting that leaves 0.5 % is given in cycles/m, from the power law
that the last eight settings follow.

(g) asks how true the wedge is for denser blockers: energy outside the wedge (and two bins on
either side, which is what the window smears), the mean apart, over scenes of 4 to 64 blockers,
mean and spread of several seeds. There each sample is the mean of 3 x 3 rays, or the aliases of
sharp edges would count as energy outside. What is left comes from shadows that multiply, and from
blockers that have depth themselves; it grows with their number.

The filtered h(x) is compared on the middle eight tenths of the receiver: zeroing frequencies of
[0, 1] treats the scene as if it were periodic, which it is not.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.e11.shared import scenes as e11
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.flatland.library._e11 import e11_fig07
from firstorder.shadowfield import (
    Wedge,
    depth_range,
    energy_outside,
    power_spectrum,
    sheared_filter,
    zero_outside,
)

D1, SEED, SHOWN = 1.0, 7, 8.0
COUNTS = (4, 8, 16, 32, 64)


def draw(quick: bool) -> Drawing:
    n, seeds = (256, 1) if quick else (1024, 6)
    scene, grid = e11_fig07(SEED), e11.unit_grid(n)
    depths = depth_range(scene)
    f = np.asarray(e11.visibility(scene, grid))
    axes_, (Ox, Oy) = e11.frequencies(grid)
    energy = power_spectrum(f, grid, mean=True)
    limits = np.geomspace(0.5, 0.5 * n, 25)
    outside = np.array([_outside(energy, Ox, Oy, depths, w) for w in limits])
    k = sheared_filter(D1, *depths, SHOWN, 0.5 * n)
    inside = np.asarray(k.contains(Ox, Oy))
    h = {"original": f.mean(axis=1), "filtered": np.asarray(zero_outside(f, inside)).mean(axis=1)}
    density = _density(80 if quick else 256, seeds)
    figure, axes = plotting.panels(2, 4, 2.7, 2.5)
    e11.draw_map(axes[0, 0], scene, "a) scene")
    plotting.show_light_field(
        axes[0, 1], f, *map(grid.axis, (0, 1)), limit=1.0, names=("x", "y"), title="b) f(x, y)"
    )
    _spectra(axes[0], energy, axes_, depths, k, inside)
    x = grid.axis(0)
    for name, style in (("original", "-"), ("filtered", "--")):
        axes[1, 0].plot(x, h[name], style, label=name)
    axes[1, 0].set(xlabel=plotting.label("x"))
    axes[1, 0].set_title(f"e) h(x), {SHOWN:g} cycles/m", loc="left")
    axes[1, 0].legend()
    axes[1, 1].loglog(limits, outside)
    axes[1, 1].axhline(0.005, color="0.6", linestyle=":")
    axes[1, 1].set(xlabel=r"$\Omega_y^{max}$ (cycles/m)")
    axes[1, 1].set_title("f) energy outside", loc="left")
    middle, spread = density.mean(axis=1), density.std(axis=1)
    axes[1, 2].errorbar(COUNTS, middle, spread, linestyle="-", capsize=2.0)
    axes[1, 2].set(xscale="log", xlabel="blockers", ylim=(0.0, None))
    axes[1, 2].set_xticks(COUNTS, [str(c) for c in COUNTS])
    axes[1, 2].minorticks_off()
    axes[1, 2].set_title("g) outside the wedge", loc="left")
    axes[1, 3].set_axis_off()
    arrays = {"f": f.astype(np.uint8), "limits": limits, "outside": outside, "density": density}
    curves = {
        "outside": {"Omega_y_max": limits, "outside": outside},
        "density": {"blockers": np.array(COUNTS), "mean": middle, "spread": spread},
        "shadow": {"x": x, **h},
    }
    claims = _claims(energy, Ox, Oy, depths, limits, outside, h, density, n)
    return Drawing(figure, arrays, claims, curves, f"{n}^2 rays, {seeds} seeds in (g)", SEED)


def _spectra(axes, energy, axes_, depths, k, inside) -> None:
    """The middle of the spectrum, whole and cut."""
    near = [np.abs(a) <= 48.0 for a in axes_]
    shown = np.sqrt(np.asarray(energy))[np.ix_(*near)]
    kept = np.where(inside[np.ix_(*near)], shown, 0.0)
    short = [a[m] for a, m in zip(axes_, near, strict=True)]
    for ax, data, title in ((axes[2], shown, "c) spectrum"), (axes[3], kept, "d) filtered")):
        plotting.show_spectrum(
            ax, data, *short, decades=3.0, reference=shown.max(), names=("x", "y"), title=title
        )
        e11.draw_wedge(ax, Wedge(*depths), D1, 48.0)
        e11.draw_filter(ax, k)
        ax.set_xlim(-24.0, 24.0)
        ax.set_ylim(-48.0, 48.0)


def _outside(energy, Ox, Oy, depths, limit) -> float:
    k = sheared_filter(D1, *depths, limit, 1e4)
    return float(energy_outside(energy, k.contains(Ox, Oy)))


def _density(n: int, seeds: int) -> np.ndarray:
    """Energy outside the wedge, a row for each number of blockers."""
    grid, rows = e11.unit_grid(n), []
    for count in COUNTS:
        row = []
        for seed in range(seeds):
            scene = e11_fig07(seed, thin=count // 2, round=count // 2)
            rays = np.asarray(e11.visibility(scene, e11.unit_grid(3 * n)))
            samples = rays.reshape(n, 3, n, 3).mean(axis=(1, 3))
            row.append(e11.leak(samples, grid, Wedge(*depth_range(scene))))
        rows.append(row)
    return np.array(rows)


def _claims(energy, Ox, Oy, depths, limits, outside, h, density, n) -> list[Claim]:
    metre = _outside(energy, Ox, Oy, depths, 0.5)
    sample = _outside(energy, Ox, Oy, depths, 0.5 * n)
    mean = float(jnp.sum(jnp.where((Ox == 0.0) & (Oy == 0.0), energy, 0.0)) / jnp.sum(energy))
    # The share falls as 1 / Omega: the last settings say so.
    order = np.polyfit(np.log(limits[-8:]), np.log(outside[-8:]), 1)
    setting = float(np.exp((np.log(0.005) - order[1]) / order[0]))
    middle = slice(n // 10, n - n // 10)
    rms = float(np.sqrt(np.mean((h["filtered"] - h["original"])[middle] ** 2)))
    few, many = density.mean(axis=1)[[0, -1]]
    return [
        Claim("energy outside for a band limit of 1/2 cycle/m", 0.005, metre, "share",
              metre <= 0.01),
        Claim("energy outside for a band limit of 1/2 cycle per sample", 0.005, sample, "share",
              sample <= 0.01),
        Claim("light band limit that leaves 0.5 % outside", None, setting, "cycles/m"),
        Claim("energy at frequency zero alone", None, mean, "share"),
        Claim("order at which the energy outside falls with the band limit", None,
              float(order[0]), ""),
        Claim("RMS change of h(x) by the filter of 8 cycles/m", "minimal", rms,
              "of the light", None),
        Claim("energy outside the wedge, 4 blockers", "a good fit", float(few), "share",
              few < 0.05),
        Claim("energy outside the wedge, 64 blockers", "a good fit", float(many), "share",
              many < 0.05),
    ]  # fmt: skip
