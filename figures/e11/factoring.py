"""What factoring shading out of a shadow's integral costs, for diffuse and for glossy receivers.

E11 pulls r(x) out of the integral (eq. 2) and calls that common; it shows no glossy receiver and
proposes light times BRDF (§7). Ours: flat ground, 256 x 256 pixels, under two grids that lean one
behind the other, before a square lamp of 1 m with the paper's falloff, 3.7 m away and placed so
that the ground mirrors it to the camera. Receivers reflect evenly, or by a lobe `cos^e` of
exponent 5, 20 or 80 about the mirrored direction. Errors are root mean squares over the ground,
divided by the mean radiance there without blockers.

Factoring alone: 2 x 256 stratified rays for each pixel say what the integral is, and the seen share
of the light of each of 1, 4, 16 or 64 cells; 1 cell is eq. 2. Errors of both halves are multiplied,
so that noise of rays does not count as error. Bounds are drawn beside them. The whole way: 4 shared
rays for each pixel at 8 cycles of the lamp's diameter, in as many cells, on every second pixel both
ways. In 64 cells factoring leaves a tenth of that error or less: the rest is the filter's, noise
and blur, and is larger for sharp lobes, to which fewer rays matter.

Below, at equal rays: rays for pixels by E11's rates (App. B) beside as many for each; two light
fields (§8), told apart between the grids, put together by three rules. Errors are those of the
share of the lamp that is seen, on every eighth pixel both ways, over 20 seeds. And the filter in
passes along one coordinate each (§8 asks for a hierarchical one) beside one sum over all four.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures import timing
from figures.e11.competitors.cell_factoring import likely_factoring, worst_factoring
from figures.e11.competitors.factored import direct, factored, gridded_axis
from figures.e11.shared import space as scenes
from figures.e11.shared.glossy import CELLS, LOBES, SEED, Ground, ground, merged, surface
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.fields import Field, Gaussian
from firstorder.shadowfield import PLANE, factoring_bound, mean_form_factor
from firstorder.shadowfield.rendering._glossy_receivers import cell_light, cell_visibility
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.layers import layered_shadow
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays
from firstorder.shadowfield.rendering.sample_counts import distribute_rays, rays_per_pixel
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow

STRATA, QUICK_STRATA = 16, 8  # along each edge of the lamp, for each half of the rays
RAYS, CYCLES = 4, 8.0  # shared ones for each pixel; of the lamp's diameter
EQUAL_RAYS, EQUAL_CYCLES = 2, 2.0  # of the comparisons at equal totals
BETWEEN = 2.33  # depth below the lamp, between the grids [m]
SUBSET, QUICK_SUBSET = 2048, 256  # receivers of which bounds are taken


# --- what is compared ----------------------------------------------------------------------------


def factoring(g: Ground, subset: int) -> dict[str, np.ndarray]:
    """Errors by cells and lobe: of factoring alone, their bounds, and with few shared rays."""
    lamp = g.scene.lamp
    some = slice(None, None, max(len(g.points) // subset, 1))
    table, _ = trace_shadow_rays(lamp, g.points, RAYS, g.scene.blockers, SEED)
    limit = 0.5 * CYCLES / lamp.half[0]
    half = g.every(2)
    shared = cell_visibility(lamp, table, g.points[half], limit, g.scene.pixel, CELLS[-1])
    if np.any(shared.own):
        raise ValueError("The scene must keep blockers away from the ground.")
    found = {
        name: np.empty((len(LOBES), len(CELLS))) for name in ("alone", "floor", "worst", "likely")
    }
    found["shared"] = found["alone"].copy()
    for i, e in enumerate(LOBES):
        at, mean = surface(g.points[some], e), np.mean(g.whole[i])
        for j, c in enumerate(CELLS):
            halves = [g.factored(i, s, c) for s in g.seen]
            found["alone"][i, j], found["floor"][i, j] = g.rms(i, halves)
            found["shared"][i, j] = g.rms(i, g.factored(i, shared.cells, c, half), half)[0]
            at_nodes = (scenes.falloff, 32 // c)
            worst = worst_factoring(lamp, g.points[some], at, c, *at_nodes)
            seen = merged(g.seen.mean(0)[some] * g.share, c) / merged(g.share, c)
            likely = likely_factoring(lamp, g.points[some], at, np.clip(seen, 0, 1), *at_nodes)
            found["worst"][i, j] = np.sqrt(np.mean(worst**2)) / mean
            found["likely"][i, j] = np.sqrt(np.mean(likely**2)) / mean
    return found


def flatland_bounds(g: Ground) -> tuple[float, float]:
    """Over the light: in flatland and in space, of a receiver that faces the lamp from aside."""
    half, d, x = float(g.scene.lamp.half[0]), 3.7, 0.5
    bell: Field = Gaussian(jnp.zeros(1), jnp.full((1, 1), 4.0 / half**2), frame=PLANE)
    y = half * ((jnp.arange(256) + 0.5) / 128.0 - 1.0)

    @jax.jit
    def share(at):
        r = mean_form_factor(bell, d, -half, half)(at)
        light = jnp.sum(bell(y)) * half / 128.0
        return factoring_bound(bell, d, -half, half, at) / (r * light)

    flat = share(jnp.array([x]))[0]
    lamp = g.scene.lamp
    point = lamp.world(np.array([[x, 0.0, d]]))
    facing = surface(point, 0, -lamp.axes[2])
    space = worst_factoring(lamp, point, facing, 1, scenes.falloff, 64)
    return float(flat), float(space[0] / cell_light(lamp, point, facing, 8, scenes.falloff).sum())


def at_equal_rays(g: Ground, seed: int) -> dict[str, float]:
    """Errors of the share seen, on every eighth pixel both ways, by ways to use as many rays."""
    scene, lamp = g.scene, g.scene.lamp
    limit = 0.5 * EQUAL_CYCLES / lamp.half[0]
    pilot, _ = trace_shadow_rays(lamp, g.points, 1, scene.blockers, 1000 + seed)
    near, far = blocker_depths(lamp, pilot, g.points, scene.pixel)
    share = rays_per_pixel(lamp.local(g.points)[:, 2], near, far, limit, scene.pixel, lamp.half)
    total = EQUAL_RAYS * len(g.points)
    some = g.every(8)
    points, both = g.points[some], (near[some], far[some])

    def rms(visible: np.ndarray) -> float:
        a, b = (visible - v[some] for v in g.visible)
        return float(np.sqrt(max(np.mean(a * b), 0.0)))

    even = np.full(len(g.points), EQUAL_RAYS)
    counts = {"as many each": even, "E11's rates": distribute_rays(share, total, seed, 0.25)}
    found = {}
    for name, count in counts.items():
        table, owner = trace_shadow_rays(lamp, g.points, count, scene.blockers, seed)
        options = dict(falloff=scenes.falloff, bounds=both, weights=1.0 / count[owner])
        none = np.zeros(len(points))
        seen = sheared_shadow(lamp, table, points, limit, scene.pixel, none, **options).visible
        found[name] = rms(seen)
    # Each finds the bounds of its blockers' depths among the rays themselves.
    table, _ = trace_shadow_rays(lamp, g.points, even, scene.blockers, seed)
    one = sheared_shadow(
        lamp, table, points, limit, scene.pixel, np.zeros(len(points)), falloff=scenes.falloff
    )
    found["one light field"] = rms(one.visible)
    for rule in ("covariance", "product", "minimum"):
        seen = layered_shadow(
            lamp, table, points, BETWEEN, limit, scene.pixel, rule, 4, scenes.falloff
        )
        found[rule] = rms(seen)
    return found


def passes(side: int) -> tuple[timing.Ratio, float]:
    """Processor time of the direct sum over that of four passes, and how far they differ."""
    places = jnp.linspace(-0.46, 0.46, 12)

    def box(y):
        return jnp.where(jnp.abs(y) <= 0.5, 1.0, 0.0)

    axis = gridded_axis(0.1, places, 0.2, 0.7, box)
    f = jnp.asarray(np.random.default_rng(SEED).random((side, side, 12, 12)))

    slow = jax.jit(direct)
    off = float(jnp.max(jnp.abs(slow(f, axis, axis) - factored(f, axis, axis))))
    return timing.ratio(lambda: slow(f, axis, axis), lambda: factored(f, axis, axis), 5), off


# --- the picture ---------------------------------------------------------------------------------


def draw(quick: bool = False) -> Drawing:
    """Images, errors, and errors by cells."""
    side = scenes.QUICK_SIDE if quick else scenes.SIDE
    strata = QUICK_STRATA if quick else STRATA
    g = ground(side, strata)
    found = factoring(g, QUICK_SUBSET if quick else SUBSET)
    runs = [at_equal_rays(g, SEED + k) for k in range(3 if quick else 20)]
    equal = {key: np.array([run[key] for run in runs]) for key in runs[0]}
    speed = passes(12 if quick else 32)
    figure, axes = plotting.panels(3, 4, width=2.5, height=2.5)
    arrays = _images(figure, axes, g)
    _curves(axes[2, :3], found)
    _bars(axes[2, 3], equal)
    curves = {
        name(e).replace(" ", "_"): {"cells": np.array(CELLS) ** 2}
        | {k: v[i] for k, v in found.items()}
        for i, e in enumerate(LOBES)
    }
    claims = _claims(g, found, equal, speed)
    size = f"{side} x {side} pixels, 2 x {strata**2} stratified rays"
    return Drawing(figure, arrays, claims, curves, size, SEED)


def name(e: int) -> str:
    """Of a lobe."""
    return f"exponent {e}" if e else "diffuse"


def _images(figure, axes, g: Ground) -> dict[str, np.ndarray]:
    """What is true, and what one cell makes of it."""
    arrays, off = {}, {}
    for i, e in enumerate(LOBES):
        mean = np.mean(g.whole[i])
        true = g.true[:, i].mean(0) / mean
        off[name(e)] = np.mean([g.factored(i, s, 1) for s in g.seen], 0) / mean - true
        arrays[name(e)] = g.scene.picture(true, g.scene.floor)
        top = np.percentile(true, 99.5)
        scenes.show(axes[0, i], arrays[name(e)], name(e), cmap="gray", vmin=0, vmax=top)
    for ax, (key, values) in zip(axes[1], off.items(), strict=True):
        arrays[f"{key}, one cell is off by"] = g.scene.picture(values, g.scene.floor)
        top = float(np.percentile(abs(values), 99.5))
        image = g.scene.picture(values, g.scene.floor)
        drawn = scenes.show(
            ax, image, f"{key}, 1 cell: off by", cmap=plotting.SIGNED, vmin=-top, vmax=top
        )
        figure.colorbar(drawn, ax=ax, location="bottom", shrink=0.9)
    return arrays


def _curves(axes, found) -> None:
    cells = np.array(CELLS) ** 2
    titles = {"alone": "factoring alone", "likely": "its bounds", "shared": f"{RAYS} shared rays"}
    for ax, (key, title) in zip(axes, titles.items(), strict=True):
        for i, e in enumerate(LOBES):
            colour = plotting.COLOURS[i]
            shown = found[key][i]
            if key == "alone":
                shown = np.where(shown > found["floor"][i], shown, np.nan)
            ax.loglog(cells, shown, "o-", color=colour, label=name(e), ms=3)
            if key == "likely":
                ax.loglog(cells, found["worst"][i], "s:", color=colour, ms=2, lw=0.8)
        ax.set_xticks(cells, [str(c) for c in cells])
        ax.minorticks_off()
        ax.set(xlabel="cells of the lamp", title=title)
    low = 0.5 * np.min(found["alone"], where=found["alone"] > found["floor"], initial=0.01)
    for ax in axes:
        ax.set_ylim(low, 2.0 * found["worst"].max())
    axes[0].set_ylabel("RMS over mean light")
    axes[0].legend(fontsize=6)
    axes[1].text(0.04, 0.04, "dotted: any blocker\nsolid: by shares seen", fontsize=6,
                 transform=axes[1].transAxes)  # fmt: skip


def _bars(ax, equal: dict[str, np.ndarray]) -> None:
    colours = [plotting.COLOURS[k] for k in (0, 0, 1, 1, 1, 1)]
    ax.barh(range(len(equal)), [np.mean(v) for v in equal.values()], color=colours)
    ax.set_yticks(range(len(equal)), list(equal), fontsize=6)
    ax.invert_yaxis()
    ax.set(xlabel="RMS of the share seen", title=f"{EQUAL_RAYS} rays a pixel")


def _claims(g: Ground, found, equal, speed) -> list[Statement | Measurement]:
    return [
        *_errors_of_factoring(found),
        *_bounds(g, found),
        *_lobes(g, found["shared"]),
        *_at_equal_rays(equal),
        *_passes(speed),
    ]


def _errors_of_factoring(found) -> list[Measurement]:
    alone, floor = 100.0 * found["alone"], 100.0 * found["floor"]
    whole = [
        Measurement(
            f"RMS error of eq. 2's factoring over mean light, {name(e)}",
            float(alone[i, 0]),
            "%",
            source="E11 (2)",
        )
        for i, e in enumerate(LOBES)
    ]
    return whole + [
        Measurement(
            f"The same in 64 cells, {name(e)} (what noise of rays may make of none)",
            f"{alone[i, -1]:.2g} ({floor[i, -1]:.2g})",
            "%",
        )
        for i, e in enumerate(LOBES)
    ]


def _bounds(g: Ground, found) -> list[Statement | Measurement]:
    flat, space = flatland_bounds(g)
    reach = found["alone"] / np.minimum(found["likely"], found["worst"])
    return [
        Statement(
            "Bounds of factoring bound it: largest RMS error over the smaller of its two bounds",
            None,
            float(reach.max()),
            at_most(1.0, "bounds"),
            OURS,
            scanned="diffuse and three lobes, 1 to 64 cells",
        ),
        Measurement(
            "Worst error of eq. 2's factoring over light, diffuse, lamp seen from 0.5 m aside: "
            "in space (in flatland)",
            f"{100 * space:.3g} ({100 * flat:.3g})",
            "%",
        ),
    ]


def _lobes(g: Ground, shared) -> list[Statement]:
    """What E11 expects of receivers that are not diffuse."""
    spreads = [np.mean(a.sum(1) ** 2 / np.sum(a**2, 1)) / CELLS[-1] ** 2 for a in g.light]
    lobes = "receivers of one scene, all of its ground"
    return [
        Statement(
            "General BRDFs by light times BRDF in place of light: RMS error with 4 shared rays, "
            "exponent 80, of 1 cell over 64 cells",
            "can be achieved",
            float(shared[-1, 0] / shared[-1, -1]),
            at_least(1.0, "'can be achieved': a smaller error than without"),
            "E11 §7",
            "times",
            scanned=lobes,
        ),
        Statement(
            "Specular BRDFs have less savings: RMS error over mean light with 4 shared rays in 64 "
            "cells, exponent 80 over diffuse",
            "less savings",
            float(shared[-1, -1] / shared[0, -1]),
            at_least(1.0, "'less': a larger error from as many rays"),
            "E11 §7",
            "times",
            scanned=lobes,
        ),
        Statement(
            "For these it becomes more difficult to share rays: share of 64 cells that count, "
            "(sum L)^2 / (64 sum L^2), exponent 80 over diffuse",
            "more difficult",
            spreads[-1] / spreads[0],
            at_most(1.0, "'more difficult': fewer cells whose rays count"),
            "E11 §7",
            "times",
            scanned=lobes,
        ),
    ]


def _at_equal_rays(equal) -> list[Statement]:
    rates = spread(equal["E11's rates"] / equal["as many each"])
    layers = spread(equal["covariance"] / equal["one light field"])
    best = spread(equal["covariance"] / np.minimum(equal["product"], equal["minimum"]))
    seeds = f"{len(equal['covariance'])} seeds"
    return [
        Statement(
            "Quality is easier to control by a uniformly low density than by the rates of App. B: "
            "RMS error by these over that of as many rays for each pixel",
            "easier",
            rates[0],
            at_least(1.0, "'easier': the error of the rates is no smaller"),
            "E11 §5",
            "times",
            rates[1],
            seeds,
            "Rates put rays where filters are narrow, which are the pixels of the largest errors.",
        ),
        Statement(
            "Occlusion divided into multiple light fields could provide a large improvement: RMS "
            "error of two, by covariance, over that of one filter for all",
            "large improvement",
            layers[0],
            at_most(1.0, "'improvement': a smaller error"),
            "E11 §8",
            "times",
            layers[1],
            seeds,
        ),
        Statement(
            "Covariance puts light fields together best: its RMS error over the better of "
            "product's and minimum's",
            None,
            best[0],
            at_most(1.0, "'best': a smaller error"),
            OURS,
            "times",
            best[1],
            seeds,
        ),
    ]


def _passes(speed) -> list[Statement]:
    ratio, off = speed
    return [
        Statement(
            "Hierarchical integration speeds up filtering: time of one sum over all coordinates "
            "over that of passes along one each",
            "to speed up filtering",
            ratio.mean,
            at_least(1.0, "'speed up': less time"),
            "E11 §8",
            "times",
            ratio.error,
            "rounds in turns",
        ),
        Statement(
            "Both are one: largest difference of these two",
            None,
            off,
            at_most(1e-4, "single precision, or double"),
            OURS,
        ),
    ]
