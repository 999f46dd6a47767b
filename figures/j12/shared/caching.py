"""What J12's caching figures share: radii by every method, and caches of equal numbers of records.

Candidates are the midpoints of equal cells of the floor. Radii are clamped below at the width of a
cell, below which they cover nothing, and above at the length of the floor, above which nothing is
left to cover. Each method's threshold is found, for every order of insertion, by halving for 20
records; errors are RMS over the floor at places that are no candidates.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from matplotlib.ticker import NullFormatter

from firstorder.caching import (
    Cache,
    Candidates,
    Fit,
    clamped,
    fit,
    interpolate,
    radius_for,
    radius_with_events,
    random_orders,
    rms,
    scene_candidates,
)
from firstorder.flatland import Receiver, irradiance
from firstorder.plotting.style import COLOURS

RECORDS, SEED = 20, 12
Radii = Callable[[Array], tuple[Array, Array]]

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


# --- radii ---------------------------------------------------------------------------------------


def split(lengths: Array, limits: tuple[float, float]) -> Radii:
    """Radii proportional to a mean length of rays; a threshold is the accepted error of (34)."""
    finite = jnp.where(jnp.isfinite(lengths), lengths, 1e6)
    return lambda threshold: clamped(threshold * finite, *limits)


def pointwise(
    derivative: Array, limits: tuple[float, float], order=1, definition="total", value=None
) -> Radii:
    """Radii of the first missing derivative; a threshold is the tolerated error."""

    def radii(tolerance):
        found = radius_for(derivative, tolerance, order=order, definition=definition, value=value)
        return clamped(found, *limits)

    return radii


def with_events(
    derivatives: list[Array], limits: tuple[float, float], distances, kinks, order=1
) -> Radii:
    """Radii that also know the next derivative, or the kinks of E, or both."""

    @jax.jit
    def root(tolerance):
        return radius_with_events(derivatives, tolerance, *limits, distances, kinks, order=order)

    return lambda tolerance: clamped(root(tolerance), *limits)


# --- comparison ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Outcome:
    """Caches of one method, in all orders of insertion.

    Attributes:
        fit: thresholds and records.
        rms: error of each order's cache [W/m].
        order: of the extrapolation.
        acted: share of the records whose radius was raised, and cut.
    """

    fit: Fit
    rms: np.ndarray
    order: int
    acted: tuple[float, float]

    @property
    def mean(self) -> float:
        """Mean error over the orders of insertion."""
        return float(np.mean(self.rms))

    @property
    def missed(self) -> float:
        """Share of orders in which the count jumped over the wanted one."""
        return 1.0 - float(np.mean(self.fit.exact))

    def typical(self) -> int:
        """The order of insertion whose error is the median."""
        return int(np.argsort(self.rms)[len(self.rms) // 2])

    def cache(self, candidates: Candidates, which: int | None = None) -> Cache:
        """The cache of one order of insertion, by default the typical one."""
        i = self.typical() if which is None else which
        radii = clamped(self.fit.radius[i], 1e-12, 1e12)._replace(clamp=self.fit.clamp[i])
        return Cache.of(candidates, radii, self.fit.records[i], order=self.order)

    def words(self) -> str:
        """Mean and spread."""
        return f"{self.mean:.2e} ± {np.std(self.rms):.1e}"


def compare(
    candidates: Candidates,
    methods: dict[str, Radii],
    x: np.ndarray,
    truth: np.ndarray,
    orders: int,
    expansions: dict[str, int] | None = None,
) -> dict[str, Outcome]:
    """Every method's caches at 20 records, in the same random orders of insertion."""
    visits = random_orders(candidates.x.shape[0], orders, SEED)
    found = {}
    for name, radii in methods.items():
        order = (expansions or {}).get(name, 1)
        fitted = fit(candidates, radii, visits, RECORDS, low=1e-12, high=1e4, halvings=30)
        values, _ = interpolate(candidates, fitted, x, order=order)
        clamp = np.asarray(fitted.clamp)[np.asarray(fitted.records)]
        acted = (float(np.mean(clamp < 0)), float(np.mean(clamp > 0)))
        found[name] = Outcome(fitted, rms(values, truth), order, acted)
    return found


def limits(length: float, cells: int) -> tuple[float, float]:
    """The clamps: a cell, and the whole floor."""
    return length / cells, length


def surveyed(scene, index: int, E, count: int, dense: int, columns: int = 4):
    """Candidates in the middles of equal cells, and places between them with the true E.

    Both come out of one survey, so that only one function is compiled.
    """
    s = np.concatenate([(np.arange(count) + 0.5) / count, (np.arange(dense) + 0.3183) / dense])
    all_of_it = scene_candidates(scene, index, s, E, count=columns, rays=512)
    candidates = jax.tree.map(lambda a: a[:count], all_of_it)
    x, truth = all_of_it.x[count:], all_of_it.derivatives[count:, 0]
    return candidates, s[:count], np.asarray(x), np.asarray(truth)


def draw_errors(ax, found: dict[str, Outcome], names: dict[str, str], mark: str) -> None:
    """Mean, median and the middle 80 % of each method's RMS errors over the orders of insertion."""
    at = np.arange(len(names))[::-1]
    for y, name in zip(at, names, strict=True):
        e = found[name].rms
        colour = COLOURS[1] if name == mark else "0.45"
        ax.plot(np.percentile(e, [10, 90]), [y, y], "-", color=colour, linewidth=1.0)
        ax.plot([np.median(e)], [y], "|", color=colour, markersize=8)
        ax.plot([np.mean(e)], [y], "o", color=colour, markersize=4)
    ax.set(xscale="log", yticks=at, ylim=(-0.7, len(names) - 0.3))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.yaxis.tick_right()
    ax.set_yticklabels(names.values(), fontsize=6.5)
