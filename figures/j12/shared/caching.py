"""What J12's caching figures share: regions by every method, caches of equal numbers of records.

Along a line and on a plane alike. Candidates are the midpoints of equal cells of a floor. Radii are
clamped below at the width of a cell, below which they cover nothing, and above where nothing is
left to cover. Each method's threshold is found, for every order of insertion, by halving for the
wanted number of records; errors are RMS over the floor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from matplotlib.ticker import NullFormatter

from firstorder.caching import (
    Cache,
    Candidates,
    Fit,
    ValidityRegion,
    derivative_norm,
    fit,
    radius_for,
    radius_with_events,
    random_orders,
    rms,
    scene_candidates,
)
from firstorder.caching.regions import CUT, FREE, RAISED
from firstorder.flatland import Receiver, irradiance
from firstorder.plotting.style import COLOURS

RECORDS, SEED = 20, 12
Regions = Callable[[float], ValidityRegion]

# --- light ---------------------------------------------------------------------------------------


def line_light(x):
    """E of scene A: a line light of radiance 1 from -0.5 to 0.5, one metre up; closed form."""
    u, v = x + 0.5, x - 0.5
    return u / (1.0 + u * u) ** 0.5 - v / (1.0 + v * v) ** 0.5


def wall_irradiance(height):
    """E on the wall of Fig. 14 at a height: the lamp from x = 0.8 to 1.2 at y = 1, closed form."""
    below = 1.0 - height
    return below / (0.64 + below**2) ** 0.5 - below / (1.44 + below**2) ** 0.5


def by_the_wall(scene) -> Callable[[Receiver], Array]:
    """Irradiance of Fig. 14 with what its wall reflects; all else is black, so one bounce is all.

    The wall is cut at heights that halve, so that the corner is resolved.
    """
    (wall,) = scene.named("wall")
    cuts = jnp.stack([jnp.zeros(14), 2.0 ** -jnp.arange(14.0)], -1)

    def sent(index, s, front, direction):
        side = jnp.where(front, 0, 1)
        reflected = 0.5 * scene.material.albedo[index, side] * wall_irradiance(1.0 - s)
        return scene.material.emission[index, side] + jnp.where(index == wall, reflected, 0.0)

    return lambda at: irradiance(scene, at, radiance=sent, nodes=16, cuts=cuts)


# --- regions -------------------------------------------------------------------------------------


class Limits(NamedTuple):
    """Smallest and largest radius [m], along a line (1) or on a plane (2)."""

    low: float
    high: float
    dims: int = 1

    def held(self, radius: np.ndarray) -> ValidityRegion:
        """`circular_regions` of plain arrays: a search for thresholds asks for thousands."""
        code = np.where(radius < self.low, RAISED, np.where(radius > self.high, CUT, FREE))
        inverse = 1.0 / np.clip(radius, self.low, self.high)
        return ValidityRegion(inverse[:, None, None] * np.eye(self.dims), code)


def limits(length: float, cells: int) -> Limits:
    """Those of a line: a cell, and the whole floor."""
    return Limits(length / cells, length)


def split(lengths: Any, within: Limits) -> Regions:
    """Radii proportional to a mean length of rays; a threshold is the accepted error of (34)."""
    finite = np.where(np.isfinite(lengths), lengths, 1e6)
    return lambda threshold: within.held(threshold * finite)


def scaled(radius: np.ndarray, power: float, within: Limits) -> Regions:
    """Radii that are given for the tolerance 1 and grow with a power of it."""
    return lambda tolerance: within.held(radius * tolerance**power)


def pointwise(
    derivative: Any, within: Limits, order: int = 1, definition: str = "total", value: Any = None
) -> Regions:
    """Radii of the first missing derivatives (m, d, ..., d), as J12 (55) and (70) have them.

    A threshold is the tolerated error; on a plane the direction of the largest derivative counts.
    """

    def found(size, tolerance, value):
        options = {"order": order, "definition": definition, "value": value, "dims": within.dims}
        return np.asarray(radius_for(size, tolerance, **options))

    double = float(found(1.0, 2.0, 1.0) / found(1.0, 1.0, 1.0))
    radius = found(derivative_norm(jnp.asarray(derivative), order + 1), 1.0, value)
    return scaled(radius, float(np.log2(double)), within)


def with_events(
    derivatives: list[Array], within: Limits, distances, kinks, order: int = 1
) -> Regions:
    """Radii along a line that also know the next derivative, or the kinks of E, or both."""

    @jax.jit
    def root(tolerance):
        low, high = within.low, within.high
        return radius_with_events(derivatives, tolerance, low, high, distances, kinks, order=order)

    return lambda tolerance: within.held(np.asarray(root(tolerance)))


# --- comparison ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Outcome:
    """Caches of one method, in all orders of insertion.

    Attributes:
        candidates: from which records were chosen.
        fit: thresholds and records.
        order: of the extrapolation.
        values: what each order's cache answers, one row for each.
        errors: RMS of these [W/m^d].
    """

    candidates: Candidates
    fit: Fit
    order: int
    values: np.ndarray
    errors: np.ndarray

    @property
    def mean(self) -> float:
        """Mean error over the orders of insertion."""
        return float(np.mean(self.errors))

    @property
    def spread(self) -> float:
        """Standard deviation over them."""
        return float(np.std(self.errors))

    @property
    def missed(self) -> float:
        """Share of orders in which the count jumped over the wanted one."""
        return 1.0 - float(np.mean(self.fit.exact))

    @property
    def acted(self) -> tuple[float, float]:
        """Share of the records whose radius was raised, and cut."""
        clamp = np.asarray(self.fit.region.clamp)[self.fit.records]
        return float(np.mean(clamp < 0)), float(np.mean(clamp > 0))

    def typical(self) -> int:
        """The order of insertion whose error is the median."""
        return int(np.argsort(self.errors)[len(self.errors) // 2])

    def cache(self, which: int | None = None) -> Cache:
        """The cache of one order of insertion, by default the typical one."""
        i = self.typical() if which is None else which
        return self.fit.cache(self.candidates, i, order=self.order)

    def positions(self) -> np.ndarray:
        """Places of the records of all orders, one after the other."""
        return np.concatenate([np.asarray(self.candidates.position)[r] for r in self.fit.records])

    def words(self) -> str:
        """Mean and spread."""
        return f"{self.mean:.2e} ± {self.spread:.1e}"


class Asked(NamedTuple):
    """Places at which caches are judged, the true light there, and which of them count."""

    x: np.ndarray
    truth: np.ndarray
    which: Any = slice(None)


def answered(candidates: Candidates, fitted: Fit, asked: Asked, order: int = 1) -> Outcome:
    """What the caches of a fit answer, and how wrong they are."""
    values = np.asarray(fitted.lookup(candidates, asked.x, order=order).value)[:, asked.which]
    return Outcome(candidates, fitted, order, values, rms(values, asked.truth))


def compare(
    candidates: Candidates,
    methods: dict[str, Regions],
    asked: Asked,
    orders: int,
    records: int = RECORDS,
    expansions: dict[str, int] | None = None,
) -> dict[str, Outcome]:
    """Every method's caches at equal numbers of records, in the same random orders of insertion."""
    visits = random_orders(candidates.count, orders, SEED)
    found = {}
    for name, regions in methods.items():
        fitted = fit(candidates, regions, visits, records, low=1e-14, high=1e9)
        found[name] = answered(candidates, fitted, asked, (expansions or {}).get(name, 1))
    return found


def surveyed(scene, index: int, E, count: int, dense: int, derivatives: int = 3):
    """Candidates in the middles of equal cells, and places between them with the true E.

    Both come out of one survey, so that only one function is compiled.
    """
    s = np.concatenate([(np.arange(count) + 0.5) / count, (np.arange(dense) + 0.3183) / dense])
    both = scene_candidates(scene, index, s, E, derivatives=derivatives, rays=512)
    between = both.at(slice(count, None))
    asked = Asked(np.asarray(between.position), np.asarray(between.value))
    return both.at(slice(count)), s[:count], asked


def columns(candidates: Candidates) -> np.ndarray:
    """E, E', E'', ... of candidates along a line, one column each."""
    held = [a for a in (candidates.gradient, candidates.hessian, candidates.third) if a is not None]
    every = [np.asarray(a).reshape(candidates.count) for a in (candidates.value, *held)]
    return np.stack(every, axis=-1)


def draw_errors(ax, found: dict[str, Outcome], names: dict[str, str], mark: str) -> None:
    """Mean, median and the middle 80 % of each method's RMS errors over the orders of insertion."""
    at = np.arange(len(names))[::-1]
    for y, name in zip(at, names, strict=True):
        e = found[name].errors
        colour = COLOURS[1] if name == mark else "0.45"
        ax.plot(np.percentile(e, [10, 90]), [y, y], "-", color=colour, linewidth=1.0)
        ax.plot([np.median(e)], [y], "|", color=colour, markersize=8)
        ax.plot([np.mean(e)], [y], "o", color=colour, markersize=4)
    ax.set(xscale="log", yticks=at, ylim=(-0.7, len(names) - 0.3))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.yaxis.tick_right()
    ax.set_yticklabels(names.values(), fontsize=6.5)
