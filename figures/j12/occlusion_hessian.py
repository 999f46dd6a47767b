"""The occlusion-aware Hessian as a metric: J12 §9 asks for it, Schwarzhaupt et al. 2012 have one.

Two floors: J12's box with the block (indirect light, 40 x 120 rays, records with the stratified
gradient), and a plate under a wide lamp (`j12.shared.shadows`: soft shadow, records with the exact
gradient). The occlusion-aware Hessian has 1,024 rays of its own at each place. All metrics have the
same orders of insertion and the same limits, a cell and 1.5 m; "tuned" is the shortest ray with the
best of 3 x 2 other limits. Second order extrapolates by the Hessian of its metric.

The radiometric Hessian leaves out edges, and in a penumbra edges are nearly all there is: to know
them leaves 1.2 to 2.3 times less error. But the geometric Hessian, which knows no edges either, is
large where surfaces are near, and so where shadows are: it has some 10 % less error still, without
any radiance. In the penumbra the split spheres do as well, and even the exact Hessian is only a
sixth to a quarter better than the occlusion-aware one. What the latter gives beyond a radius is
second order, where the others' Hessians extrapolate wrongly.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from figures.j12.shared.box import (
    Case,
    Size,
    case,
    compare,
    floor_limits,
    metrics,
    show_error,
    show_light,
    tuned,
)
from figures.j12.shared.caching import Outcome, pointwise, scaled, split
from figures.j12.shared.shadows import shadow, with_hessian
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.caching import derivative_norm, neighbour_clamping, radius_for
from firstorder.caching.occlusion import OcclusionTable, occlusion_table
from firstorder.plotting.style import COLOURS

SCENES = {"block": "box with a block", "plate": "plate"}
SHOWN = ("minimum", "radiometric", "geometric", "occlusion-aware")
SPLIT = ("minimum", "harmonic", "neighbours", "tuned")


class Floor(NamedTuple):
    """A case, what is gathered with edges, and the exact Hessian where there is one."""

    case: Case
    aware: OcclusionTable
    exact: np.ndarray | None


def draw(quick: bool) -> Drawing:
    s = Size(24, 16, 48, 60, 1) if quick else Size(64, 40, 120, 256, 3)
    counts = (s.records, 120 if quick else 1000)
    figure, axes = plotting.panels(2, 6, 2.0, 2.2, width_ratios=[1, 1, 1, 1, 1, 1.1])
    claims, arrays = [], {}
    for row, (name, words) in enumerate(SCENES.items()):
        floor = _floor(name, s, 256 if quick else 1024)
        found = [_compared(floor, count, quick) for count in counts]
        second = {m: _second(floor, m) for m in ("radiometric", "occlusion-aware")}
        show_light(axes[row, 0], floor.case, words)
        most = 4.0 * found[0]["occlusion-aware"].mean
        for k, method in enumerate(SHOWN):
            show_error(axes[row, k + 1], floor.case, found[0][method], most, method)
        _bars(axes[row, 5], *found)
        for count, here in zip(counts, found, strict=True):
            arrays |= {f"{name}_{count}_{m}".replace(" ", "_"): o.errors for m, o in here.items()}
        claims += _claims(words, found, second)
        if floor.exact is not None:
            claims += _against_exact(words, floor, found)
    size = f"{s.pixels}^2 places, {s.records} and {counts[1]} records, {s.orders} orders"
    return Drawing(figure, arrays, claims, size=size, seed=12)


@functools.cache
def _floor(name: str, s: Size, rays: int) -> Floor:
    if name == "block":
        c, exact = case("j12_occluder", s), None
    else:
        c, jet = shadow(name, s)
        exact = jet.hessian
    (floor,) = c.maps.scene.named("floor")
    return Floor(c, occlusion_table(c.maps, c.table.position, floor, rays=rays), exact)


def _compared(floor: Floor, count: int, quick: bool) -> dict[str, Outcome]:
    c = floor.case
    within, table = floor_limits(c.size.pixels), c.table
    held = neighbour_clamping(table.position, table.harmonic)
    radii = metrics(c) | {"neighbours": split(held, within)}
    radii["occlusion-aware"] = pointwise(floor.aware.hessian, within)
    even = radius_for(derivative_norm(jnp.asarray(floor.aware.hessian), 2, "mean"), 1.0, dims=2)
    radii["aware, mean"] = scaled(np.asarray(even), 0.25, within)
    if floor.exact is not None:
        radii["exact"] = pointwise(floor.exact, within)
    found = compare(c, radii, count)
    lows = (1.0,) if quick else (1.0, 1.5, 2.0)
    limits = [(low, high) for low in lows for high in (0.1, 0.3)]
    found["tuned"] = tuned(c, table.minimum, limits, count).outcome
    return found


def _second(floor: Floor, method: str) -> Outcome:
    c = floor.case
    H = c.table.hessian if method == "radiometric" else floor.aware.hessian
    return compare(
        with_hessian(c, H), {method: pointwise(H, floor_limits(c.size.pixels))}, order=2
    )[method]


def _bars(ax, few, many) -> None:
    """Errors over the occlusion-aware Hessian's, with few records and with many."""
    names = [m for m in few if m != "occlusion-aware"]
    for k, (found, colour) in enumerate(((few, "0.45"), (many, "0.75"))):
        own = found["occlusion-aware"].mean
        at = np.arange(len(names)) + 0.4 * k - 0.2
        over = [found[m].mean / own for m in names]
        ax.barh(at, over, 0.38, color=colour)
        for y, ratio in zip(at, over, strict=True):
            ax.text(0.05, y, f"{ratio:.2f}", va="center", fontsize=6.0)
    ax.axvline(1.0, color=COLOURS[1], linestyle="-", linewidth=0.8)
    ax.set(xlim=(0.0, 3.0), yticks=range(len(names)))
    ax.set_yticklabels(names, fontsize=6.5)
    ax.invert_yaxis()
    ax.yaxis.tick_right()
    ax.tick_params(axis="x", labelsize=6.5)
    ax.set_xlabel("RMS over occlusion-aware's", fontsize=7)


def _claims(words: str, found, second) -> list[Claim]:
    claims = []
    for here, count in zip(found, ("few", "many"), strict=True):
        own = here["occlusion-aware"].mean
        best = min(here[m].mean for m in SPLIT)
        for what, error in (
            ("radiometric Hessian", here["radiometric"].mean),
            ("geometric Hessian", here["geometric"].mean),
            ("best split sphere (minimum, harmonic, neighbours, tuned limits)", best),
        ):
            claims.append(
                Claim(
                    f"RMS error of the {what} over that of the occlusion-aware Hessian, "
                    f"{words}, {count} records",
                    "> 1",
                    error / own,
                    "",
                    error > own,
                )
            )
    even = [h["aware, mean"].mean / h["occlusion-aware"].mean for h in found]
    claims.append(
        Claim(
            "RMS error with the mean of |x H x| around over that with the largest eigenvalue, "
            f"occlusion-aware Hessian, {words}, few and many records",
            None,
            ", ".join(f"{ratio:.2f}" for ratio in even),
            "",
            max(even) < 1.0,
        )
    )
    for method, outcome in second.items():
        ratio = found[0][method].mean / outcome.mean
        claims.append(
            Claim(
                f"RMS error of first over second order, {method} Hessian, {words}, few records",
                "> 2",
                ratio,
                "",
                ratio > 2.0,
            )
        )
    return claims


def _against_exact(words: str, floor: Floor, found) -> list[Claim]:
    def apart(H):
        size = np.linalg.norm(floor.exact, axis=(1, 2))
        return float(np.median(np.linalg.norm(H - floor.exact, axis=(1, 2)) / size))

    both = apart(floor.aware.hessian), apart(floor.case.table.hessian)
    return [
        Claim(
            f"RMS error of the exact Hessian's records over the occlusion-aware one's, {words}, "
            "few and many records",
            None,
            ", ".join(f"{h['exact'].mean / h['occlusion-aware'].mean:.2f}" for h in found),
        ),
        Claim(
            "Median relative error of the occlusion-aware Hessian and of the radiometric one "
            f"against the exact, {words}",
            None,
            ", ".join(f"{e:.2f}" for e in both),
            "",
            both[0] < both[1],
        ),
    ]
