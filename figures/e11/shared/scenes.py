"""What E11's flatland figures share: maps of the scenes, traced visibility, frequencies."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder import plotting
from firstorder.fields import Grid
from firstorder.flatland import Circles, Scene, Segments
from firstorder.flatland.shapes._crossings import Crossings
from firstorder.shadowfield import Wedge, grid_visibility, power_spectrum, visible_lengths

UNIT = (0.5, 0.5)  # x and y both run from 0 to 1
LIGHT_INK, WEDGE_INK = "#e0a526", "white"


def unit_grid(n: int) -> Grid:
    """N x n samples of (x, y), each from 0 to 1."""
    return Grid.spanning((n, n), UNIT, UNIT)


def visibility(scene: Scene, grid: Grid):
    """f(x, y) on a grid. Rays need no crossings, whose number would compile each scene anew."""
    none = Crossings(jnp.zeros((0, 2), jnp.int32), jnp.zeros((0, 2)))
    return _visibility(eqx.tree_at(lambda s: s.crossings, scene, none), grid)


def smooth_visibility(scene: Scene, n: int) -> np.ndarray:
    """f(x, y) on n x n samples, means of 3 x 3 rays, or aliases of edges counted as energy."""
    rays = np.asarray(visibility(scene, unit_grid(3 * n)))
    return rays.reshape(n, 3, n, 3).mean(axis=(1, 3))


@eqx.filter_jit
def _visibility(scene: Scene, grid: Grid):
    return grid_visibility(scene, grid)


@eqx.filter_jit
def shadow(scene: Scene, x):
    """h(x), exact."""
    return visible_lengths(scene, x)


def frequencies(grid: Grid):
    """Both axes, and both meshes."""
    axes = [np.asarray(grid.frequencies(i)) for i in range(2)]
    return axes, np.meshgrid(*axes, indexing="ij")


def bins(grid: Grid, count: float = 2.0) -> float:
    """Width of the Hann window's main lobe to one side: two bins of frequency."""
    return count / float(grid.extent[0])


def leak(samples, grid: Grid, wedge: Wedge, d1: float = 1.0, margin: float | None = None) -> float:
    """Share of the energy, the mean apart, that lies outside the wedge and its margin."""
    _, (Ox, Oy) = frequencies(grid)
    inside = wedge.contains(Ox, Oy, d1, bins(grid) if margin is None else margin)
    energy = power_spectrum(samples, grid)
    return float(jnp.sum(jnp.where(inside, 0.0, energy)) / jnp.sum(energy))


def draw_map(ax, scene: Scene, title: str = "", rays=()) -> None:
    """Light, floor, blockers; rays as pairs (x, y) from the floor to the light."""
    plotting.map_axes(ax, title)
    own = {scene.names.index(name) for name in ("floor", "light")}
    first = 0
    for group in scene.groups:
        for k in range(group.count):
            if isinstance(group, Segments) and first + k not in own:
                ends = np.stack([group.start[k], group.end[k]])
                ax.plot(*ends.T, color="0.15", linestyle="-", linewidth=2.0)
            if isinstance(group, Circles):
                t = np.linspace(0.0, 2.0 * np.pi, 49)
                rim = np.asarray(group.center[k])[:, None] + group.radius[k] * np.stack(
                    [np.cos(t), np.sin(t)]
                )
                ax.fill(*rim, color="0.15", linewidth=0)
        first += group.count
    for x, y in rays:
        ax.plot([x, y], [0.0, 1.0], color="#2563eb", linestyle="-", linewidth=0.8)
    ax.plot([0.0, 1.0], [1.0, 1.0], color=LIGHT_INK, linestyle="-", linewidth=4.0)
    plotting.draw_surface(ax, [(0.0, 0.0), (1.0, 0.0)], depth=0.04)
    ax.set_xlim(-0.04, 1.04)


def draw_wedge(ax, wedge: Wedge, d1: float, reach: float, color: str = WEDGE_INK) -> None:
    """The two lines that bound the wedge over (Omega_x, Omega_y)."""
    for slope in wedge.slopes(d1):
        t = min(reach, reach / abs(float(slope)))
        ends = np.array([-t, t])
        ax.plot(ends, float(slope) * ends, color=color, linestyle="--", linewidth=0.9)


def draw_filter(ax, k, color: str = "#e0a526", width: float = 1.4, **options) -> None:
    """The outline of a filter over (Omega_x, Omega_y)."""
    outline(ax, np.asarray(k.corners()), color, width, **options)


def outline(ax, corners, color: str, width: float = 1.4, style: str = "-", **options) -> None:
    """A closed polygon."""
    loop = np.concatenate([corners, corners[:1]])
    ax.plot(*loop.T, color=color, linestyle=style, linewidth=width, **options)
