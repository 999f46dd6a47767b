"""E11's ray database: rays in a grid over their slopes, or over slopes and feet on the lamp (§5).

Both are one structure. On each axis of the lamp a ray has a slope v and a foot y; a grid has
`slopes` cells over the one and `feet` over the other, and E11's 2D grid has one for all feet. A
receiver at lateral X and depth d looks, on each axis, at the slopes that come from the lamp within
its filter's reach r,

    X - h - r <= v d <= X + h + r,    h half of the lamp's edge,

and in each of their cells at the feet `|X - y - v d| <= r`. All rays of these cells are weighed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from firstorder.numerics._native import native
from firstorder.shadowfield.rendering.lamp import LampFrame
from firstorder.shadowfield.rendering.ray_table import LEVEL, RayTable

REACH = 3.0  # standard deviations of the Gaussian that count


class RayGrid(NamedTuple):
    """Rays in the order of their cells: cells of slope and foot on one axis, then on the other.

    Attributes:
        rays: feet, slopes, depth of what hides them and of their start, a row for each.
        first: number of the first ray of each cell, and of all rays.
        low: least slope on each axis.
        step: width of a cell of slopes on each axis.
        slopes: cells of slopes on each axis.
        feet: cells of feet on each axis.
    """

    rays: Float[np.ndarray, "6 r"]
    first: Int[np.ndarray, " c"]
    low: Float[np.ndarray, "2"]
    step: Float[np.ndarray, "2"]
    slopes: int
    feet: int


class Query(NamedTuple):
    """What receivers found.

    Attributes:
        total: sum of weights.
        free: of the rays that nothing above the receiver hides.
        used: numbers of rays that have a weight.
        touched: numbers of rays that were weighed.
        visited: numbers of cells that were looked into.
    """

    total: np.ndarray
    free: np.ndarray
    used: np.ndarray
    touched: np.ndarray
    visited: np.ndarray


def ray_grid(lamp: LampFrame, table: RayTable, slopes: int, feet: int = 1) -> RayGrid:
    """Sort rays into a grid of so many cells on each axis."""
    y, v = table.y.astype(float), table.v.astype(float)
    low = v.min(0)
    step = (v.max(0) - low) * (1.0 + 1e-6) / slopes
    of_slope = np.clip(((v - low) / step).astype(int), 0, slopes - 1)
    of_foot = np.clip((0.5 * (y / lamp.half + 1.0) * feet).astype(int), 0, feet - 1)
    cell = of_slope * feet + of_foot
    number = cell[:, 0] * slopes * feet + cell[:, 1]
    order = np.argsort(number, kind="stable")
    first = np.searchsorted(number[order], np.arange((slopes * feet) ** 2 + 1))
    rays = np.stack([*y.T, *v.T, table.near, table.start])[:, order]
    return RayGrid(rays.astype(np.float32), first, low, step, slopes, feet)


def query(grid: RayGrid, lamp: LampFrame, local: Float[np.ndarray, "m 3"], sigma, shear) -> Query:
    """Weighted sums of the rays under each receiver's sheared filter.

    Args:
        grid: of the rays.
        lamp: the lamp.
        local: receivers in the lamp's frame [m].
        sigma: of the Gaussian, finite [m].
        shear: a ray counts as `y - shear delta` on the lamp, and not if that is beyond its edges.
    """
    at = np.column_stack([local, sigma, shear, (1.0 - LEVEL) * local[:, 2]])
    found = np.zeros((len(at), 5))
    _query(grid.rays, grid.first, grid.low, grid.step, grid.slopes, grid.feet, at, lamp.half, found)
    return Query(*found.T)


@native
def _query(rays, first, low, step, slopes, feet, at, half, found):
    for k in range(at.shape[0]):
        x0, x1, d, sigma, shear = at[k, 0], at[k, 1], at[k, 2], at[k, 3], at[k, 4]
        reach0 = _reach(REACH * sigma, half[0], abs(shear))
        reach1 = _reach(REACH * sigma, half[1], abs(shear))
        a0, b0 = _cells((x0 - half[0] - reach0) / d, (x0 + half[0] + reach0) / d, low[0], step[0])
        a1, b1 = _cells((x1 - half[1] - reach1) / d, (x1 + half[1] + reach1) / d, low[1], step[1])
        for c0 in range(max(a0, 0), min(b0, slopes - 1) + 1):
            e0, f0 = _feet(x0, d, reach0, low[0] + c0 * step[0], step[0], half[0], feet)
            for foot in range(e0, f0 + 1):
                row = (c0 * feet + foot) * slopes
                for c1 in range(max(a1, 0), min(b1, slopes - 1) + 1):
                    e1, f1 = _feet(x1, d, reach1, low[1] + c1 * step[1], step[1], half[1], feet)
                    if e1 > f1:
                        continue
                    base = (row + c1) * feet
                    found[k, 4] += f1 - e1 + 1
                    _weigh(rays, first[base + e1], first[base + f1 + 1], at[k], half, found[k])


@native
def _reach(radius, half, steep):
    """What a filter reaches on an axis: to its own rim, or where rays slide off the lamp."""
    return radius if steep * radius <= 2.0 * half else 2.0 * half / steep


@native
def _cells(least, most, low, step):
    """The first and the last cell of slopes."""
    return math.floor((least - low) / step), math.floor((most - low) / step)


@native
def _feet(x, d, reach, slope, step, half, feet):
    """The first and the last cell of feet, for slopes of one cell; none if that is the greater."""
    least, most = x - reach - (slope + step) * d, x + reach - slope * d
    if most < -half or least > half:
        return 1, 0
    first = math.floor(0.5 * (least / half + 1.0) * feet)
    last = math.floor(0.5 * (most / half + 1.0) * feet)
    return max(first, 0), min(last, feet - 1)


@native
def _weigh(rays, begin, end, at, half, found):
    """Adds the rays of a run to what a receiver has found."""
    x0, x1, d, shear, level = at[0], at[1], at[2], at[4], at[5]
    scale = 1.0 / (at[3] * at[3])
    for r in range(begin, end):
        d0 = x0 - rays[0, r] - rays[2, r] * d
        d1 = x1 - rays[1, r] - rays[3, r] * d
        q = (d0 * d0 + d1 * d1) * scale
        if q > REACH * REACH or rays[5, r] < level:
            continue
        if abs(rays[0, r] - shear * d0) > half[0] or abs(rays[1, r] - shear * d1) > half[1]:
            continue
        w = math.exp(-0.5 * q)
        found[0] += w
        found[2] += 1.0
        if rays[4, r] >= level:
            found[1] += w
    found[3] += end - begin
