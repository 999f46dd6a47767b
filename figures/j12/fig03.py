"""J12 Fig. 3: path tracing of scenes A to D, against closed forms and the radiosity solution.

The paper gives no number of paths and no sizes (for those see
`firstorder.flatland.library._scenes`). Ours: 2^20 paths for each of the receivers on the floor that
are compared, lights sampled at every vertex. The bars in A and B are the standard deviation of a
mean of 64 paths, so that they can be seen; in C and D the lines are rays counted in NumPy, and what
the points are tested against is the radiosity solution (at quick size the counted rays too, within
what half as fine a mesh differs by).
"""

from __future__ import annotations

import jax
import numpy as np

from figures.j12.shared.scenes import counted, floor, line_light, reference
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Statement, at_most, near
from firstorder import plotting
from firstorder.checks.statistics import LEVEL, error_slope, z_test
from firstorder.flatland.bounces.pathtrace import path_irradiance
from firstorder.flatland.library._scenes import scene_a, scene_b, scene_c, scene_d

SEED = 3
SHOWN = 64  # paths behind a bar
SCENES = {"A": scene_a, "B": scene_b, "C": scene_c, "D": scene_d}


def draw(quick: bool) -> Drawing:
    paths = 2**13 if quick else 2**20
    s = np.linspace(0.02, 0.98, 9)
    figure, axes = plotting.panels(2, 2, 3.3, 2.5)
    arrays, claims, orders = {}, [], []
    for ax, (name, make), key in zip(
        axes.ravel(), SCENES.items(), jax.random.split(jax.random.key(SEED), 4), strict=True
    ):
        scene = make()
        at = floor(scene, s)
        x = np.asarray(at.position[:, 0])
        if name in "AB":
            truth, bound = line_light(x, name == "B"), 0.0
        else:
            truth, _, bound = reference(name, scene, at, quick)
        counts = (paths // 64, paths // 8, paths)
        found = [path_irradiance(scene, at, key=key, paths=n, lanes=64) for n in counts]
        _show(ax, name, x, truth, found[-1], paths)
        claims.append(_unbiased(name, found[-1], truth, bound))
        orders.append(_order(found, counts))
        arrays |= {f"x_{name}": x, f"truth_{name}": truth}
        arrays |= {f"mean_{name}": np.asarray(found[-1].mean)}
        arrays |= {f"error_{name}": np.asarray(found[-1].error)}
    axes[0, 0].legend(loc="lower center")
    axes[1, 0].legend(loc="lower center")
    size = f"{paths} paths for each of {s.size} receivers"
    return Drawing(figure, arrays, [*claims, _falls(orders)], size=size, seed=SEED)


def _show(ax, name, x, truth, E, paths) -> None:
    mean, one = np.asarray(E.mean), np.asarray(E.error) * np.sqrt(paths)
    if name in "AB":
        fine = np.linspace(-1.0, 1.0, 401)
        ax.plot(fine, line_light(fine, name == "B"), color="#c2410c", ls="-", label="closed form")
        band = one / np.sqrt(SHOWN)
        ax.errorbar(x, mean, band, fmt="none", ecolor="#1b1b1b", alpha=0.4, capsize=2.5)
    else:
        fine = np.linspace(0.002, 0.998, 250)
        whole, direct = counted(fine, name == "D", 48, 1440)
        ax.plot(fine, whole, color="#c2410c", ls="-", label="counted rays")
        ax.plot(fine, direct, color="#c2410c", ls=":", label="direct alone")
    ax.plot(x, mean, "o", color="#1b1b1b", ms=3.5, label="path tracing")
    ax.set_title(f"scene {name}")
    ax.set_xlabel(plotting.label("x"))
    ax.set_ylabel("$E$ (W/m)")
    ax.set_ylim(0.0, 1.15 * float(np.max(truth)))


def _unbiased(name, last, truth, bound) -> Statement:
    z = z_test(last.mean, last.error, truth, truth_error=bound)
    what = "analytic solution" if name in "AB" else "radiosity solution"
    return Statement(
        f"Scene {name}: the expected value matches the {what}: largest deviation",
        paper="matches",
        measured=z.worst,
        rule=at_most(z.threshold, f"chance exceeds it once in {1.0 / LEVEL:g}"),
        source="J12 Fig. 3",
        unit="standard errors",
    )


def _order(found, counts) -> float:
    """Power of the number of paths with which the standard error falls."""
    return error_slope(counts, [float(np.sqrt(np.mean(np.square(e.error)))) for e in found]).slope


def _falls(orders: list[float]) -> Statement:
    e = spread(orders)
    return Statement(
        "Increasing the number of paths rapidly reduces the variance: power of the number with "
        "which the standard error falls",
        paper="rapidly",
        measured=e.mean,
        rule=near(-0.5, 0.1, "that of independent paths"),
        source="J12 Fig. 3",
        error=e.error,
        scanned="scenes A to D",
    )
