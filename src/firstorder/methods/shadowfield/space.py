r"""Soft shadows of a rectangular lamp from few rays that all pixels share: E11 §5 in space.

In the lamp's frame a ray is its foot y on the lamp and its slope v: at depth z below the lamp it is
at `y + v z`, two coordinates each. For a receiver at lateral X and depth d1 a ray that was traced
from elsewhere misses it by `delta = X - (y + v d1)`. Slid to X without leaving a blocker at depth
d2 it comes from `y' = y - delta / (d1/d2 - 1)`. Blockers from d2_min to d2_max spread that by

    W / Omega_y = 1/a - 1/b,   shear = (1/a + 1/b)/2,   a = d1/d2_max - 1,   b = d1/d2_min - 1

so rays count by a Gaussian in delta, as wide as the spread allows at the lamp's band limit Omega_y,
and are read at `y' = y - shear delta`: the product of two filters of flatland, since the axes of
the lamp are orthogonal.

Rays never start beyond the lamp's edges, so slid ones are fewer near them. The lamp is therefore
cut into cells; in each the weighted share of free rays stands for the cell's visibility, and cells
are averaged with the light's own falloff: a lamp of which any part is hidden comes out right.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder.errors import check_positive

BLOCK = 256  # receivers that are near each other, done at once
REACH = 3.0  # standard deviations of the Gaussian that count

Plane = Float[np.ndarray, "n 2"]
Numbers = Float[np.ndarray, " n"]


class LampFrame(NamedTuple):
    """Where a rectangular lamp is, and the frame in which its rays are told.

    Attributes:
        center: of the lamp [m].
        axes: rows: unit vectors along its two edges, and its normal, the way it shines.
        half: half of its edges [m].
    """

    center: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]
    half: Float[np.ndarray, "2"]

    def local(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Lateral coordinates and depth below the lamp [m]."""
        return (points - self.center) @ self.axes.T

    def world(self, local: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """The other way round."""
        return self.center + local @ self.axes


def lamp_frame(center, u, v) -> LampFrame:
    """The frame of a rectangle with half-edges u, v that shines along `u x v`.

    Raises:
        ValueError: if the edges are not orthogonal: the filter is a product of two only then.

    Example:
        >>> from firstorder.methods.shadowfield.space import lamp_frame
        >>> lamp_frame((0, 0, 3), (0, 1, 0), (2, 0, 0)).axes[2].tolist()  # it shines down
        [0.0, 0.0, -1.0]
    """
    center, u, v = (np.asarray(a, float) for a in (center, u, v))
    half = np.array([np.linalg.norm(u), np.linalg.norm(v)])
    check_positive("u", half[0])
    check_positive("v", half[1])
    if abs(u @ v) > 1e-9 * half[0] * half[1]:
        raise ValueError(f"Arguments `u` and `v` must be orthogonal, but u . v is {u @ v:g}.")
    e, f = u / half[0], v / half[1]
    return LampFrame(center, np.stack([e, f, np.cross(e, f)]), half)


class RayTable(NamedTuple):
    """Shadow rays in the lamp's frame, six numbers each: 24 bytes in single precision.

    Attributes:
        y: foot on the lamp [m].
        v: slope: lateral metres per metre of depth.
        near: depth below the lamp of the first thing that hides it, infinity for a free ray [m].
        far: of the last one, minus infinity for a free ray [m].
    """

    y: Float[np.ndarray, "n 2"]
    v: Float[np.ndarray, "n 2"]
    near: Float[np.ndarray, " n"]
    far: Float[np.ndarray, " n"]

    @property
    def free(self) -> Bool[np.ndarray, " n"]:
        """Whether nothing hides the lamp."""
        return np.isinf(self.near)

    def at(self, depth) -> Plane:
        """Lateral coordinates at a depth [m]."""
        return self.y + self.v * depth


Blockers = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def trace(
    lamp: LampFrame,
    receivers: Float[np.ndarray, "m 3"],
    rays: float | int,
    blockers: Blockers,
    seed: int = 0,
) -> tuple[RayTable, Int[np.ndarray, " n"]]:
    """Shadow rays from receivers to places on the lamp, stratified over both.

    Args:
        lamp: the lamp.
        receivers: points that the image shows, in the world [m].
        rays: for each receiver; below 1, that share of the receivers has one.
        blockers: from ends of rays in the world, receiver and lamp, to the shares of the way *from
            the lamp* of the first and the last thing in between; infinity and minus infinity for
            free rays.
        seed: of the random numbers.

    Returns:
        The rays, and of which receiver each is.
    """
    check_positive("rays", rays)
    rng = np.random.default_rng(seed)
    m = len(receivers)
    if rays >= 1:
        owner = np.repeat(np.arange(m), round(rays))
    else:
        owner = np.sort(rng.permutation(m)[: max(round(rays * m), 1)])
    local = lamp.local(receivers[owner])
    y = (2.0 * _spread(len(owner), rng) - 1.0) * lamp.half
    ends = lamp.world(np.concatenate([y, np.zeros((len(y), 1))], 1))
    first, last = blockers(receivers[owner], ends)
    depth = local[:, 2]
    v = (local[:, :2] - y) / depth[:, None]
    single = (a.astype(np.float32) for a in (y, v, first * depth, last * depth))
    return RayTable(*single), owner


def _spread(count: int, rng) -> Plane:
    """Places in the unit square, evenly spread in every run of them (an additive sequence)."""
    g = 1.32471795724474602596  # the real root of g^3 = g + 1
    k = np.arange(count)[:, None]
    return np.mod(rng.random(2) + k * np.array([1.0 / g, 1.0 / g**2]), 1.0)


# --- the filter at a receiver --------------------------------------------------------------------


class Shape(NamedTuple):
    """The sheared filter at receivers.

    Attributes:
        sigma: of the Gaussian across, in the receiver's plane; infinite if nothing can hide [m].
        shear: metres on the lamp for each metre across.
        inside: whether the receiver lies among the blockers, where there is no sheared filter.
    """

    sigma: Numbers
    shear: Numbers
    inside: Bool[np.ndarray, " n"]


def filter_shape(
    d1: Numbers,
    near: Numbers,
    far: Numbers,
    Omega_y: float,
    pixel: float | Numbers,
    extent: float = np.inf,
    margin: float = 0.02,
) -> Shape:
    """Width and shear of the filter: `sigma = 1 / (pi W)`, never below half a pixel.

    Blockers at a single depth allow any width. But rays that are slid by more than the lamp's
    extent leave it, so that `sigma <= extent / shear` loses none.

    Args:
        d1: depth of the receivers below the lamp [m].
        near: depth of the first blockers that can matter [m].
        far: depth of the last ones [m].
        Omega_y: band limit on the lamp [cycles/m].
        pixel: side of a pixel on the receiver [m].
        extent: half of the lamp's longer edge [m].
        margin: blockers nearer to the receiver than this share of d1 count as touching it.

    Reference: E11 §4, eqs. 9-10, with a Gaussian in place of the pixel's filter.

    Example:
        >>> import numpy as np
        >>> from firstorder.methods.shadowfield.space import filter_shape
        >>> one = np.ones(1)
        >>> shape = filter_shape(one, 0.25 * one, 0.5 * one, 2.0, 0.01)
        >>> round(shape.sigma[0].item(), 6), round(shape.shear[0].item(), 6)
        (0.238732, 0.666667)
    """
    check_positive("Omega_y", Omega_y)
    inside = far > (1.0 - margin) * d1
    some = np.isfinite(near) & ~inside
    low, high = np.where(some, near, 0.25 * d1), np.where(some, far, 0.5 * d1)
    steep, flat = high / (d1 - high), low / (d1 - low)  # 1/a, 1/b
    width = Omega_y * (steep - flat)
    shear = 0.5 * (steep + flat)
    with np.errstate(divide="ignore"):
        sigma = np.minimum(1.0 / (np.pi * width), extent / shear)
    sigma = np.maximum(sigma, 0.5 * np.asarray(pixel))
    return Shape(np.where(some, sigma, np.inf), shear, inside)


# --- reconstruction ------------------------------------------------------------------------------


class Shadows(NamedTuple):
    """What the filter finds at receivers.

    Attributes:
        visible: share of the lamp that is seen, weighed by its falloff.
        samples: effective number of rays, `(sum w)^2 / sum w^2`.
        near, far: bounds of the blockers' depths that were used [m].
        inside: whether there was no filter, and `fallback` was taken.
    """

    visible: Numbers
    samples: Numbers
    near: Numbers
    far: Numbers
    inside: Bool[np.ndarray, " n"]


def sheared(
    lamp: LampFrame,
    table: RayTable,
    receivers: Float[np.ndarray, "m 3"],
    Omega_y: float | int,
    pixel: float,
    fallback: Numbers,
    cells: int = 4,
    falloff: Callable[[Plane], Numbers] | None = None,
) -> Shadows:
    """Visibility of the lamp at receivers, from rays that were traced anywhere.

    Args:
        lamp: the lamp.
        table: the rays.
        receivers: in the world [m].
        Omega_y: band limit on the lamp: low for few rays, high for sharp shadows [cycles/m].
        pixel: side of a pixel on the receivers [m].
        fallback: what to take among the blockers: an estimate by rays of each receiver's own.
        cells: along each edge of the lamp.
        falloff: of the light over the lamp, from places in [-1, 1]^2; None for a constant.

    Reference: E11 §5; the cells, and bounds from first and last blockers, are ours.
    """
    check_positive("cells", cells)
    local = lamp.local(np.asarray(receivers, float))
    share = _cell_shares(cells, falloff)
    out = [np.empty(len(local)) for _ in range(4)] + [np.zeros(len(local), bool)]
    for rows in _blocks(local):
        at = local[rows]
        near, far = _bounds(lamp, table, at, pixel)
        shape = filter_shape(at[:, 2], near, far, Omega_y, pixel, float(np.max(lamp.half)))
        visible, samples = _filtered(lamp, table, at, shape, cells, share)
        lost = shape.inside | (samples == 0.0)
        found = np.where(lost & np.isfinite(near), fallback[rows], visible)
        for field, value in zip(out, (found, samples, near, far, shape.inside), strict=True):
            field[rows] = value
    return Shadows(*out)


def _blocks(local: np.ndarray) -> list[np.ndarray]:
    """Receivers near each other, at most `BLOCK` together: halves across the longest side."""
    found, left = [], [np.arange(len(local))]
    while left:
        rows = left.pop()
        if len(rows) <= BLOCK:
            if len(rows):
                found.append(rows)
            continue
        axis = int(np.argmax(np.ptp(local[rows], axis=0)))
        order = rows[np.argsort(local[rows, axis], kind="stable")]
        left += [order[: len(rows) // 2], order[len(rows) // 2 :]]
    return found


def _bounds(lamp, table: RayTable, at: np.ndarray, pixel: float) -> tuple[np.ndarray, np.ndarray]:
    """Depths of blockers in the frustum between the lamp and the whole pixel of each receiver."""
    near, far = np.full(len(at), np.inf), np.full(len(at), -np.inf)
    low, high = at[:, :2].min(0) - 0.5 * pixel, at[:, :2].max(0) + 0.5 * pixel
    deep = at[:, 2].min()
    hidden = np.flatnonzero(~table.free)
    for depth in (table.near[hidden], table.far[hidden]):
        p = table.y[hidden] + table.v[hidden] * depth[:, None]
        t = np.clip(depth / deep, 0.0, 1.0)[:, None]
        edge = lamp.half * (1.0 - t)
        close = np.all((p >= low * t - edge - 1e-9) & (p <= high * t + edge + 1e-9), 1)
        p, z = p[close], depth[close]
        if not len(z):
            continue
        t = z / at[:, 2, None]
        edge = lamp.half * (1.0 - t[..., None]) + 0.5 * pixel * t[..., None]
        inside = np.all(abs(p - at[:, None, :2] * t[..., None]) <= edge, -1) & (t < 1.0)
        near = np.minimum(near, np.min(np.where(inside, z, np.inf), 1))
        far = np.maximum(far, np.max(np.where(inside, z, -np.inf), 1))
    return near, far


def _filtered(lamp, table, at, shape: Shape, cells, share) -> tuple[np.ndarray, np.ndarray]:
    """The weighted share of free rays cell by cell, and the effective number of rays."""
    visible, samples = np.ones(len(at)), np.zeros(len(at))
    use = np.isfinite(shape.sigma)
    if not np.any(use):
        return visible, samples
    middle = 0.5 * (at[use, 2].min() + at[use, 2].max())
    reach = REACH * shape.sigma[use].max()
    slack = np.max(abs(table.v), initial=0.0) * 0.5 * np.ptp(at[use, 2])
    x = table.at(np.float32(middle))
    low, high = at[use, :2].min(0) - reach - slack, at[use, :2].max(0) + reach + slack
    close = np.flatnonzero(np.all((x >= low) & (x <= high), 1))
    y, v, free = table.y[close], table.v[close], table.free[close]
    for k in np.flatnonzero(use):
        delta = at[k, :2] - (y + v * at[k, 2])
        here = np.flatnonzero(np.sum(delta**2, 1) <= (REACH * shape.sigma[k]) ** 2)
        d = delta[here]
        w = np.exp(-0.5 * np.sum(d**2, 1) / shape.sigma[k] ** 2)
        foot = (y[here] - shape.shear[k] * d) / lamp.half
        on = np.all(abs(foot) <= 1.0, 1)
        w, foot, seen = w[on], foot[on], free[here][on]
        total = np.sum(w)
        if total == 0.0:
            continue
        samples[k] = total**2 / np.sum(w**2)
        i, j = np.minimum((0.5 * (foot + 1.0) * cells).astype(int), cells - 1).T
        cell = i * cells + j
        mass = np.bincount(cell, w, cells**2)
        open_ = np.bincount(cell, w * seen, cells**2)
        mean = np.sum(open_) / total
        each = np.where(mass > 0.0, open_ / np.where(mass > 0.0, mass, 1.0), mean)
        visible[k] = np.sum(share * each)
    return visible, samples


def _cell_shares(cells: int, falloff) -> Numbers:
    """How much of the light each cell sends, all together 1."""
    if falloff is None:
        return np.full(cells**2, 1.0 / cells**2)
    x = (2.0 * np.arange(8 * cells) + 1.0) / (8 * cells) - 1.0
    places = np.stack(np.meshgrid(x, x, indexing="ij"), -1)
    light = falloff(places.reshape(-1, 2)).reshape(cells, 8, cells, 8).sum((1, 3)).ravel()
    return light / np.sum(light)


__all__ = [
    "LampFrame",
    "RayTable",
    "Shadows",
    "Shape",
    "filter_shape",
    "lamp_frame",
    "sheared",
    "trace",
]
