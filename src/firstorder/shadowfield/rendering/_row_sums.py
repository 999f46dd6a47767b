"""Weighted sums under sheared filters from rays in rows, in machine code.

    delta = X - (y + v d1) = X - y (1 - t) - p t,    p = y + v d0,    t = d1 / d0

p is where a ray crosses the plane at a common depth d0. Rays lie in rows of p's first coordinate,
in each by the second. A filter is a disc in delta, and a ray whose slid foot is beyond the lamp's
edges does not count, so that `|delta| <= min(reach sigma, 2 half / shear)` on each axis: a run of
rays in each of some rows. A run is weighed in three passes that fill the processor's lanes
(squares of distances, weights, cells), and one that adds them up.

`exp(-q / 2)` is the eighth power of eight terms of a series: off by 4e-8 at most, for q up to 9.
"""

from __future__ import annotations

import math

import numpy as np

from firstorder.numerics._native import native

F = np.float32
BLOCK = 2048  # rays that are weighed at once
COPIES = 4  # of the bins, a power of two


@native
def sum_rows(rays, first, low, step, at, half, reach, cells, mass, free, square):
    """Fills in what each receiver gets, as in `_weighted_sums.Sums`.

    Args:
        rays: in rows: y, p, near, start and weight, an array's row for each number.
        first: number of the first ray of each row, and of all rays.
        low: p's first coordinate where the first row begins.
        step: width of a row.
        at: by receiver: X, t, sigma, shear, depth of its level.
        half: of the lamp's edges.
        reach: of the filter, in standard deviations.
        cells: along each edge of the lamp.
        mass: of weights.
        free: of weights of free rays.
        square: of squares of weights.
    """
    far, code = np.empty(BLOCK, rays.dtype), np.empty(BLOCK, np.int32)
    bins, last = np.zeros((COPIES, 2 * cells * cells)), first.size - 2
    y0, y1, p0, p1 = rays[0], rays[1], rays[2], rays[3]  # one by one, or lanes stay empty
    near, start, heavy = rays[4], rays[5], rays[6]
    for k in range(at.shape[0]):
        x0, x1, t, sigma = at[k, 0], at[k, 1], at[k, 2], at[k, 3]
        radius, steep = reach * sigma, abs(at[k, 4])
        off0, off1 = half[0] * abs(F(1.0) - t), half[1] * abs(F(1.0) - t)
        side0 = _narrower(radius, half[0], steep)
        total = 0.0
        begin = max(math.floor(((x0 - side0 - off0) / t - low) / step), 0)
        end = min(math.floor(((x0 + side0 + off0) / t - low) / step), last)
        for row in range(begin, end + 1):
            middle = x0 - (low + (row + 0.5) * step) * t
            beside = max(abs(middle) - 0.5 * step * t - off0, 0.0)
            if beside > radius:
                continue
            side1 = _narrower(math.sqrt(radius * radius - beside * beside), half[1], steep)
            a = _place(p1, first[row], first[row + 1], (x1 - side1 - off1) / t)
            b = _place(p1, a, first[row + 1], (x1 + side1 + off1) / t)
            while a < b:
                e = min(a + BLOCK, b)
                run = y0[a:e], y1[a:e], p0[a:e], p1[a:e]
                _distances(*run, start[a:e], at[k], half, reach, far)
                total += _weights(heavy[a:e], reach, far)
                _cells(*run, near[a:e], at[k], half, cells, code)
                _add(far[: e - a], code, bins)
                a = e
        square[k] = total
        for c in range(cells * cells):
            free[k, c] = bins[:, 2 * c + 1].sum()
            mass[k, c] = bins[:, 2 * c].sum() + free[k, c]
        bins[:, :] = 0.0


@native
def _narrower(side, half, steep):
    """What a filter reaches on an axis: to its own rim, or where rays slide off the lamp."""
    return side if steep * side <= 2.0 * half else 2.0 * half / steep


@native
def _place(sorted_values, a, b, value):
    """Number of the first that is not below the value, among those from a to b."""
    while a < b:
        middle = (a + b) >> 1
        if sorted_values[middle] < value:
            a = middle + 1
        else:
            b = middle
    return a


@native
def _distances(y0, y1, p0, p1, start, at, half, reach, far):
    """Squares of distances in standard deviations; more than counts for rays that do not."""
    x0, x1, t, shear, level = at[0], at[1], at[2], at[4], at[5]
    s, one, none = F(1.0) - t, F(1.0) / (at[3] * at[3]), F(2.0) * reach * reach
    h0, h1 = half[0], half[1]  # read once: `far` might be the same memory
    for r in range(y0.size):
        d0 = x0 - y0[r] * s - p0[r] * t
        d1 = x1 - y1[r] * s - p1[r] * t
        on = (abs(y0[r] - shear * d0) <= h0) & (abs(y1[r] - shear * d1) <= h1)
        far[r] = (d0 * d0 + d1 * d1) * one if on & (start[r] >= level) else none


@native
def _weights(heavy, reach, far):
    """Weights in the place of squares of distances, and the sum of their squares."""
    most, total = reach * reach, F(0.0)
    for r in range(heavy.size):
        x = min(far[r], most) * F(-1.0 / 16.0)
        e = F(1.0 / 120.0) + x * (F(1.0 / 720.0) + x * F(1.0 / 5040.0))
        e = F(1.0) + x * (F(1.0) + x * (F(0.5) + x * (F(1.0 / 6.0) + x * (F(1.0 / 24.0) + x * e))))
        e = e * e
        e = e * e
        w = e * e * heavy[r] if far[r] <= most else F(0.0)
        far[r] = w
        total += w * w
    return total


@native
def _cells(y0, y1, p0, p1, near, at, half, cells, code):
    """Twice the cell in which each ray counts, and 1 more if nothing hides it there."""
    x0, x1, t, shear, level = at[0], at[1], at[2], at[4], at[5]
    s, middle, top, row = F(1.0) - t, F(0.5 * cells), F(cells - 1), np.int32(cells)
    c0, c1 = middle / half[0], middle / half[1]
    for r in range(y0.size):
        f0 = (y0[r] - shear * (x0 - y0[r] * s - p0[r] * t)) * c0 + middle
        f1 = (y1[r] - shear * (x1 - y1[r] * s - p1[r] * t)) * c1 + middle
        cell = np.int32(min(max(f0, F(0.0)), top)) * row + np.int32(min(max(f1, F(0.0)), top))
        code[r] = cell + cell + np.int32(near[r] >= level)


@native
def _add(weights, code, bins):
    """Adds each weight to its bin, in turns to copies that need not wait for each other."""
    for r in range(weights.size):
        bins[r & (COPIES - 1), code[r]] += weights[r]
