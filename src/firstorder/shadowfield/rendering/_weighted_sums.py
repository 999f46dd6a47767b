"""Weighted sums over the rays under each receiver's sheared filter, by cell of the lamp.

In two ways that give the same: `_by_rows`, where numba is there, and `_by_groups`, which does
without. In single precision, counted from a place among the receivers, since rays are kept in that.

    by groups   groups of receivers, each with the rays near any of them, all pairs weighed by JAX
    by rows     runs of sorted rays that are near one receiver (`_row_sums`): 10 to 17 times as fast

A ray counts for receivers at the level where it starts and above (`ray_table.LEVEL`), not for those
below, of which it does not know what hides them; and it is free there if what hides it lies deeper.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder.numerics._native import HAVE_NATIVE
from firstorder.shadowfield.rendering._culling import narrowed
from firstorder.shadowfield.rendering.lamp import LampFrame
from firstorder.shadowfield.rendering.ray_table import LEVEL, RayTable

REACH = 3.0  # standard deviations of the Gaussian that count
GROUP, CHUNK = 64, 1024  # receivers and rays that are weighed at once by groups
ROWS = 4096  # of rays, at most
SLAB = 1.3  # largest of the depths of receivers that share rows over the least
PRECISION: type = np.float32

Numbers = Float[np.ndarray, " n"]


class Sums(NamedTuple):
    """Weighted sums over rays, for each receiver and cell.

    Attributes:
        mass: of their weights, by receiver and cell.
        free: of the weights of rays that nothing above the receiver hides, by receiver and cell.
        square: of the squares of weights, by receiver.
    """

    mass: Float[np.ndarray, "m c"]
    free: Float[np.ndarray, "m c"]
    square: Numbers

    @property
    def total(self) -> Numbers:
        """All weights of each receiver."""
        return np.sum(self.mass, 1)

    @property
    def samples(self) -> Numbers:
        """Effective number of rays: `(sum w)^2 / sum w^2`."""
        return self.total**2 / np.where(self.square > 0.0, self.square, 1.0)

    @property
    def seen(self) -> Float[np.ndarray, "m c"]:
        """Share of free rays in each cell; in cells without rays, of all the receiver's rays."""
        total = np.where(self.total > 0.0, self.total, 1.0)
        mean = np.sum(self.free, 1) / total
        some = self.mass > 0.0
        return np.where(some, self.free / np.where(some, self.mass, 1.0), mean[:, None])


def gather(
    lamp: LampFrame,
    table: RayTable,
    local: Float[np.ndarray, "m 3"],
    sigma: Numbers,
    shear: Numbers,
    cells: int,
    weights: Float[np.ndarray, " r"] | None = None,
) -> Sums:
    """Weighted sums of the rays `delta = X - (y + v d1)` beside each receiver, Gaussian in delta.

    Args:
        lamp: the lamp.
        table: the rays.
        local: receivers in the lamp's frame [m].
        sigma: of the Gaussian; infinite for receivers that want no ray [m].
        shear: a ray counts as `y - shear delta` on the lamp, and not if that is beyond its edges.
        cells: along each edge of the lamp.
        weights: of the rays, by which theirs are multiplied; None for 1.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield.rendering._weighted_sums import gather
        >>> from firstorder.shadowfield import lamp_frame
        >>> from firstorder.shadowfield import trace_shadow_rays
        >>> lamp = lamp_frame((0, 0, 1), (0, 1, 0), (1, 0, 0))
        >>> free = lambda a, b: (np.full(len(a), np.inf), np.full(len(a), -np.inf))
        >>> table, _ = trace_shadow_rays(lamp, np.zeros((1, 3)), 8, free)
        >>> one = np.ones(1)
        >>> round(float(gather(lamp, table, np.array([[0.0, 0.0, 1.0]]), one, one, 2).samples[0]))
        8
    """
    use = np.flatnonzero(np.isfinite(sigma))
    heavy = np.ones(len(table.y)) if weights is None else np.asarray(weights, float)
    parts = (local[use], sigma[use], shear[use], cells, heavy)
    found = Sums(
        np.zeros((len(local), cells**2)), np.zeros((len(local), cells**2)), np.zeros(len(local))
    )
    if not len(heavy):
        return found
    some = (_by_rows if HAVE_NATIVE else _by_groups)(lamp, table, *parts)
    for a, b in zip(found, some, strict=True):
        a[use] = b
    return found


# --- in machine code -----------------------------------------------------------------------------


def _by_rows(
    lamp: LampFrame, table: RayTable, at: np.ndarray, sigma, shear, cells: int, heavy: np.ndarray
) -> Sums:
    """The sums from rays in rows, those of receivers at about the same depth together."""
    from firstorder.shadowfield.rendering._row_sums import sum_rows  # half a second for numba

    found = Sums(np.zeros((len(at), cells**2)), np.zeros((len(at), cells**2)), np.zeros(len(at)))
    for some in _slabs(at[:, 2]):
        middle = 0.5 * (at[some].min(0) + at[some].max(0))
        depth, step = middle[2], 1.5 * float(np.median(sigma[some]))
        y = table.y.astype(float)
        p = y + table.v * depth - middle[:2]
        low, high = p[:, 0].min(), p[:, 0].max()
        step = max(step, (high - low) / ROWS)
        row = ((p[:, 0] - low) / step).astype(np.int32)
        order = np.lexsort((p[:, 1], row))
        first = np.searchsorted(row[order], np.arange(row.max() + 2))
        parts = (*y.T, *p.T, table.near, table.start, heavy)
        rays = np.stack([a[order].astype(PRECISION) for a in parts])
        t, level = at[some, 2] / depth, (1.0 - LEVEL) * at[some, 2]
        x = at[some, :2] - middle[:2] * t[:, None]
        here = np.column_stack([x, t, sigma[some], shear[some], level]).astype(PRECISION)
        sums = [np.zeros((len(some), *a.shape[1:])) for a in found]
        half, reach = lamp.half.astype(PRECISION), PRECISION(REACH)
        sum_rows(rays, first, low, step, here, half, reach, cells, *sums)
        for a, b in zip(found, sums, strict=True):
            a[some] = b
    return found


def _slabs(depth: Numbers) -> Iterator[np.ndarray]:
    """Numbers of receivers of which the deepest is at most `SLAB` times as deep as the first."""
    order = np.argsort(depth, kind="stable")
    while len(order):
        count = int(np.searchsorted(depth[order], SLAB * depth[order[0]], side="right"))
        yield order[:count]
        order = order[count:]


# --- without -------------------------------------------------------------------------------------


def _by_groups(
    lamp: LampFrame, table: RayTable, at: np.ndarray, sigma, shear, cells: int, heavy: np.ndarray
) -> Sums:
    """The sums over all pairs of a group of receivers and the rays near any of them."""
    wide = REACH * sigma
    y, v = table.y.astype(float), table.v.astype(float)

    columns = [(y[:, axis].copy(), v[:, axis].copy()) for axis in range(2)]
    least = table.start * (1.0 + 1e-6) / (1.0 - LEVEL)  # receivers deeper than this want none

    def keep(rows, some):
        """Mask of rays that pass within reach of the group's box, at some of its depths."""
        low, high = at[rows].min(0), at[rows].max(0)
        away = np.where(least[some] < low[2], np.inf, 0.0)
        for axis, (start, slope) in enumerate(columns):
            p, q = start[some], slope[some]
            a = p + q * low[2]
            b = a if low[2] == high[2] else p + q * high[2]
            beside = np.maximum(low[axis] - np.maximum(a, b), np.minimum(a, b) - high[axis])
            away += np.maximum(beside, 0.0) ** 2
        return away <= np.max(wide[rows]) ** 2 * (1.0 + 1e-9)

    found = Sums(np.zeros((len(at), cells**2)), np.zeros((len(at), cells**2)), np.zeros(len(at)))
    half = lamp.half.astype(PRECISION)
    for mine, some in narrowed(at, len(y), keep, GROUP):
        middle = at[mine].mean(0)
        k = np.resize(np.arange(len(mine)), GROUP)  # the rest of the group is thrown away
        level = (1.0 - LEVEL) * at[mine, 2]
        here = np.column_stack([at[mine] - middle, sigma[mine], shear[mine], level])[k]
        place = y[some] + v[some] * middle[2] - middle[:2]
        parts = [y[some], v[some], place, table.near[some], table.start[some], heavy[some]]
        rays = np.column_stack(parts)
        sums = _all_chunks(here.astype(PRECISION), rays.astype(PRECISION), half, cells)
        for a, b in zip(found, sums, strict=True):
            a[mine] = b[: len(mine)]
    return found


def _all_chunks(here, rays, half, cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Over all rays, chunk by chunk, the last filled up with rays that weigh nothing."""
    cellwise, square = np.zeros((len(here), cells**2, 2)), np.zeros(len(here))
    waiting = []
    for start in range(0, len(rays), CHUNK):
        part = rays[start : start + CHUNK]
        part = np.pad(part, ((0, CHUNK - len(part)), (0, 0)))
        waiting.append(_weighed(here, part, half, cells))
    for a, b in waiting:
        cellwise += np.asarray(a)
        square += np.asarray(b)
    return cellwise.sum(-1), cellwise[..., 1], square


@functools.partial(jax.jit, static_argnums=3)
def _weighed(
    here: Float[Array, "k 6"], rays: Float[Array, "c 9"], half: Float[Array, "2"], cells: int
) -> tuple[Float[Array, "k cc 2"], Float[Array, " k"]]:
    """Sums of weights by cell, of hidden and of free rays, and of squares."""
    X, Y, depth, sigma, shear, level = (a[:, None] for a in here.T)
    y0, y1, v0, v1, x0, x1, near, start, heavy = rays.T
    d0, d1 = X - (x0 + v0 * depth), Y - (x1 + v1 * depth)  # one axis each: pairs fill the lanes
    far = (d0**2 + d1**2) / sigma**2
    f0, f1 = (y0 - shear * d0) / half[0], (y1 - shear * d1) / half[1]
    counts = (far <= REACH**2) & (jnp.abs(f0) <= 1.0) & (jnp.abs(f1) <= 1.0) & (start >= level)
    w = jnp.where(counts, jnp.exp(-0.5 * far), 0.0) * heavy
    i, j = (jnp.clip((0.5 * (f + 1.0) * cells).astype(jnp.int32), 0, cells - 1) for f in (f0, f1))
    cell = i * cells + j
    free = (near >= level).astype(jnp.int32)
    place = (jnp.arange(len(here))[:, None] * cells**2 + cell) * 2 + free
    sums = jax.ops.segment_sum(w.ravel(), place.ravel(), len(here) * cells**2 * 2)
    return sums.reshape(len(here), cells**2, 2), jnp.sum(w**2, 1)
