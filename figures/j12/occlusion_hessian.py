"""The occlusion-aware Hessian as a metric: J12 §9 asks for it, Schwarzhaupt et al. 2012 have one.

Eleven floors: J12's box with the block (indirect light, 40 x 120 rays, records with the stratified
gradient), and ten plates under a wide lamp (`j12.shared.shadows`: soft shadows, records with the
exact gradient). The occlusion-aware Hessian has 1,024 rays of its own at each place. All metrics
have the same orders of insertion and the same limits, a cell and 1.5 m; "tuned" is the shortest ray
with the best of 2 x 2 other limits. Second order extrapolates by the Hessian of its metric.

The radiometric Hessian leaves out edges, and in a penumbra edges are nearly all there is: to know
them leaves up to twice less error. As a metric J12 is right: radii by the exact Hessian, edges
included, leave less error than those by either of its own. But of a sampled one only as much is
left as its rays resolve of the edges: 1,024 rays are off by a third in the median, and with that
the geometric Hessian, which knows no edges but is large where surfaces are near and so where
shadows are, still does better. Four times the rays draw level with it; the last panel shows how the
error falls with the rays, towards the exact one. What the occlusion-aware Hessian gives beyond a
radius is second order, where the others' Hessians extrapolate wrongly.

J12 §8 has the cost: with the Hessian a gather takes "roughly 50 %" longer where tracing is fast,
and less where it is not. Times are of compiled gathers with the stratified gradient, with and
without the Hessian, in turns: in the box, and in a room full of boxes and balls.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.ticker import NullLocator

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
from figures.j12.shared.shadows import MORE, PLATES, shadow, with_hessian
from figures.spread import Spread, grouped, ratio_of_means
from figures.style import Drawing
from figures.timing import Ratio, ratio
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.caching import derivative_norm, neighbour_clamping, radius_for
from firstorder.caching.occlusion import OcclusionTable, occlusion_table
from firstorder.plotting.style import COLOURS
from firstorder.space import Scene, receiver
from firstorder.space.estimators import (
    hemisphere_strata,
    stratified_estimate,
    trace_strata,
)
from firstorder.space.estimators._gather_sums import surface_area_sums
from firstorder.space.estimators._irradiance_forms import Samples
from firstorder.space.library._scenes import clutter, j12_box

SCENES = {"block": "box with a block", "plate": "plate"}
SHOWN = ("minimum", "radiometric", "geometric", "occlusion-aware")
SPLIT = ("minimum", "harmonic", "neighbours", "tuned")
AWARE = "occlusion-aware"


class Floor(NamedTuple):
    """A case, what is gathered with edges, and the exact Hessian where there is one."""

    case: Case
    aware: OcclusionTable
    exact: np.ndarray | None


def draw(quick: bool) -> Drawing:
    s = Size(24, 16, 48, 60, 2) if quick else Size(40, 40, 120, 100, 4)
    rays = 256 if quick else 1024
    counts = (s.records, 120 if quick else 390)
    names = tuple(SCENES) if quick else ("block", *PLATES, *MORE)
    floors = {name: _floor(name, s, rays) for name in names}
    found = {name: [_compared(f, count, quick) for count in counts] for name, f in floors.items()}
    by_rays = _by_rays(floors["plate"], (rays // 4, rays, 4 * rays))
    figure, axes = plotting.panels(2, 6, 2.0, 2.2, width_ratios=[1, 1, 1, 1, 1, 1.1])
    for row, (name, words) in enumerate(SCENES.items()):
        c = floors[name].case
        show_light(axes[row, 0], c, words)
        most = 4.0 * found[name][0][AWARE].mean
        for k, method in enumerate(SHOWN):
            show_error(axes[row, k + 1], c, found[name][0][method], most, method)
    _bars(axes[0, 5], *found["block"])
    _rays_drawn(axes[1, 5], by_rays, found["plate"][0])
    arrays = {
        f"{name}_{count}_{m}".replace(" ", "_"): o.errors
        for name, of_counts in found.items()
        for count, here in zip(counts, of_counts, strict=True)
        for m, o in here.items()
    }
    claims = [
        *_claims(found),
        *_claims_of_rays(floors["plate"], by_rays, found["plate"][0]),
        *_second_order(floors, found),
        *_costs(quick),
    ]
    size = f"{s.pixels}^2 places, {counts[0]} and {counts[1]} records, {s.orders} orders"
    size += f", {len(names)} floors, {rays} rays"
    return Drawing(figure, arrays, claims, size=size, seed=12)


@functools.cache
def _floor(name: str, s: Size, rays: int) -> Floor:
    if name == "block":
        c, exact = case("j12_occluder", s), None
    else:
        c, jet = shadow(name, s)
        exact = jet.hessian
    return Floor(c, _gathered(c, rays), exact)


def _gathered(c: Case, rays: int) -> OcclusionTable:
    (floor,) = c.maps.scene.named("floor")
    return occlusion_table(c.maps, c.table.position, floor, rays=rays)


def _compared(floor: Floor, count: int, quick: bool) -> dict[str, Outcome]:
    c = floor.case
    within, table = floor_limits(c.size.pixels), c.table
    held = neighbour_clamping(table.position, table.harmonic)
    radii = metrics(c) | {"neighbours": split(held, within)}
    radii[AWARE] = pointwise(floor.aware.hessian, within)
    even = radius_for(derivative_norm(jnp.asarray(floor.aware.hessian), 2, "mean"), 1.0, dims=2)
    radii["aware, mean"] = scaled(np.asarray(even), 0.25, within)
    if floor.exact is not None:
        radii["exact"] = pointwise(floor.exact, within)
    found = compare(c, radii, count)
    limits = [(low, high) for low in ((1.0,) if quick else (1.0, 2.0)) for high in (0.1, 0.3)]
    found["tuned"] = tuned(c, table.minimum, limits, count).outcome
    return found


def _by_rays(floor: Floor, rays: tuple[int, ...]) -> dict[int, tuple[float, Outcome]]:
    """By rays: median relative error of the occlusion-aware Hessian, and caches by it."""
    c, found = floor.case, {}
    for number in rays:
        H = floor.aware.hessian if number == rays[1] else _gathered(c, number).hessian
        radii = {AWARE: pointwise(H, floor_limits(c.size.pixels))}
        found[number] = _off(floor, H), compare(c, radii)[AWARE]
    return found


def _off(floor: Floor, H: np.ndarray) -> float:
    """Median relative error of a Hessian against the exact one."""
    assert floor.exact is not None
    size = np.linalg.norm(floor.exact, axis=(1, 2))
    return float(np.median(np.linalg.norm(H - floor.exact, axis=(1, 2)) / size))


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
        for y, value in zip(at, over, strict=True):
            ax.text(0.05, y, f"{value:.2f}", va="center", fontsize=6.0)
    ax.axvline(1.0, color=COLOURS[1], linestyle="-", linewidth=0.8)
    ax.set(xlim=(0.0, 3.0), yticks=range(len(names)))
    ax.set_yticklabels(names, fontsize=6.5)
    ax.invert_yaxis()
    ax.yaxis.tick_right()
    ax.tick_params(axis="x", labelsize=6.5)
    ax.set_xlabel("RMS over occlusion-aware's", fontsize=7)


def _rays_drawn(ax, by_rays, found) -> None:
    """Error of the occlusion-aware Hessian's caches by its rays, between two that have none."""
    rays = list(by_rays)
    ax.plot(rays, [o.mean for _, o in by_rays.values()], "o-", color=COLOURS[0], label=AWARE)
    for name, colour in (("geometric", COLOURS[1]), ("exact", COLOURS[2])):
        ax.axhline(found[name].mean, color=colour, linestyle="--", linewidth=0.9, label=name)
    ax.set(xscale="log", xticks=rays, xlabel="rays of the occlusion-aware Hessian")
    ax.set_xticklabels([str(n) for n in rays], fontsize=6.5)
    ax.xaxis.set_minor_locator(NullLocator())
    ax.yaxis.tick_right()
    ax.tick_params(axis="y", labelsize=6.5)
    ax.set_title("plate: RMS error (W/m$^2$)", fontsize=8)
    ax.legend(fontsize=6)


def _claims(found) -> list[Statement | Measurement]:
    every = list(found.values())
    exact = [of_counts for of_counts in every if "exact" in of_counts[0]]
    further = "'further improvements': a smaller error"
    coarse = (
        "Its rays resolve edges too coarsely: of 1,024 the Hessian is off by a third in the "
        "median. The error falls with the rays, and of the exact Hessian it is smaller."
    )
    return [
        *(
            _better(f"The exact Hessian, edges included, over the {m}", "exact", (m,), exact,
                    at_least(1.0, further), "J12 §9")
            for m in ("radiometric", "geometric")
        ),
        _better("The occlusion-aware Hessian of rays over the radiometric", AWARE,
                ("radiometric",), every, at_least(1.0, further), "J12 §9"),
        _better("The occlusion-aware Hessian of rays over the geometric", AWARE, ("geometric",),
                every, at_least(1.0, "a smaller error"), OURS, coarse),
        _measured("The occlusion-aware Hessian of rays over the best split sphere (minimum, "
                  "harmonic, neighbours, tuned limits)", AWARE, SPLIT, every),
        _measured("The exact Hessian over that best split sphere", "exact", SPLIT, exact),
        _measured("The exact Hessian over the occlusion-aware one of rays", "exact", (AWARE,),
                  exact),
        _measured("The mean of |x H x| around over the largest eigenvalue, occlusion-aware",
                  "aware, mean", (AWARE,), every),
    ]  # fmt: skip


def _ratios(method: str, others, here) -> Spread:
    """Least error of others over that of a method: over floors, each of all counts."""
    return grouped(
        [[min(h[m].mean for m in others) / h[method].mean for h in floor] for floor in here]
    )


def _better(what: str, method: str, others, here, rule, source: str, reason="") -> Statement:
    r = _ratios(method, others, here)
    return Statement(
        f"{what}: how many times less RMS error, geometric mean",
        paper=None if source == OURS else "further improvements",
        measured=r.mean,
        rule=rule,
        source=source,
        error=r.error,
        scanned=f"{len(here)} floors, few and many records",
        reason=reason,
    )


def _measured(what: str, method: str, others, here) -> Measurement:
    r = _ratios(method, others, here)
    return Measurement(f"{what}: how many times less RMS error", r.mean, error=r.error)


def _claims_of_rays(floor: Floor, by_rays, found) -> list[Statement | Measurement]:
    off = [o for o, _ in by_rays.values()]
    few, *_, many = (outcome for _, outcome in by_rays.values())
    gain = ratio_of_means(few.errors, many.errors)
    rays = ", ".join(str(n) for n in by_rays)
    over = ", ".join(f"{o.mean / found['geometric'].mean:.2f}" for _, o in by_rays.values())
    assert floor.exact is not None
    return [
        Statement(
            "Plate: the error of the occlusion-aware Hessian's radii falls with its rays: of a "
            "quarter of the rays over that of four times as many",
            paper=None,
            measured=gain.mean,
            rule=at_least(1.0, "'falls'"),
            source=OURS,
            error=gain.error,
        ),
        Measurement(
            f"Plate: RMS error of the occlusion-aware Hessian of {rays} rays over the geometric's",
            over,
        ),
        Measurement(
            f"Plate: median relative error of the occlusion-aware Hessian of {rays} rays, and of "
            "the radiometric one",
            ", ".join(f"{e:.2f}" for e in (*off, _off(floor, floor.case.table.hessian))),
        ),
    ]


def _second_order(floors: dict[str, Floor], found) -> list[Measurement]:
    """First over second order, with the Hessian of each metric."""
    told = []
    for method in ("radiometric", AWARE):
        plates = [name for name in floors if name != "block"]
        gains = [
            found[n][0][method].mean / _second(floors[n], method).mean for n in (*plates, "block")
        ]
        words = f"RMS error of first over second order, {method} Hessian: plates, mean; block"
        mean = float(np.exp(np.mean(np.log(gains[:-1]))))
        told.append(Measurement(words, f"{mean:.2f}, {gains[-1]:.2f}"))
    return told


# --- the cost of a Hessian -----------------------------------------------------------------------


def _costs(quick: bool) -> list[Statement | Measurement]:
    plain, crowded = (_cost(scene, quick) for scene in (j12_box(), clutter()))
    return [
        Statement(
            "Computing the Hessian too results in roughly 50 % more time where tracing is fast: "
            "time of a gather with it over one without, box",
            paper=1.5,
            measured=plain.mean,
            rule=at_most(1.5, "the paper's 50 % more, of an unoptimised program"),
            source="J12 §8",
            error=plain.error,
            reason="Here the sums over rays weigh more than tracing a few rectangles.",
        ),
        Statement(
            "That share decreases with the scene: extra time in a room full of boxes and balls "
            "over that in the box",
            paper="decreases significantly",
            measured=(crowded.mean - 1.0) / (plain.mean - 1.0),
            rule=at_most(1.0, "'decreases'"),
            source="J12 §8",
            error=float(np.hypot(crowded.error, plain.error) / (plain.mean - 1.0)),
            reason="The extra time of a Hessian is within the noise of tracing.",
        ),
    ]


def _hessian(seen: Samples):
    """By surface area in the receiver's plane, (65) and (66): what the metric needs, no more."""
    met = jnp.isfinite(seen.distance) & (seen.cosine > 0.0)
    inverse = jnp.where(met, 1.0 / jnp.where(met, seen.distance, 1.0), 0.0)
    toward = seen.strata.directions
    near = (seen.strata.weights * seen.radiance * toward[..., 2] * inverse).reshape(1, -1)
    normal = seen.normal / jnp.where(met, seen.cosine, 1.0)[..., None]
    u, n = (v[..., :2].reshape(-1, 2).T for v in (toward, normal))
    return surface_area_sums(near, near[0] * inverse.ravel(), u, n)[1]


def _cost(scene: Scene, quick: bool) -> Ratio:
    """Time of gathers with the stratified gradient, with and without the Hessian."""
    rows, columns, places = (8, 24, 16) if quick else (40, 120, 16)
    where = hemisphere_strata(rows, columns)
    (floor,) = scene.named("floor")
    x = jnp.linspace(0.2, 0.8, places)
    at = jax.vmap(lambda x: receiver(jnp.stack([x, 0.5 * x + 0.2, 0.0 * x]), on=floor))(x)

    def gather(at, hessian: bool):
        seen = trace_strata(scene, at, where=where)
        first = stratified_estimate(seen).translation()
        return first.value, first.gradient, _hessian(seen) if hessian else ()

    # Both compiled apart: what is not asked for is not computed.
    with_it, without = (
        jax.jit(lambda at, h=h: jax.lax.map(lambda a: gather(a, h), at)) for h in (True, False)
    )
    return ratio(lambda: with_it(at), lambda: without(at), 3 if quick else 75)
