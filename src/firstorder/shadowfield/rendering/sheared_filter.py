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

A ray from below a receiver knows all that hides it, and counts as free there if what hides the ray
lies below the receiver; one from above does not, and does not count (`rays.LEVEL` tells levels
apart). So one table serves the ground and what stands on it. Measured on a card over ground behind
slats, whose pixels trace 4 rays each (24 x 24, tests): with the ground's rays the card's RMS error
is .021 in place of .031, and the ground's .036 with or without the card's. With starts not told
they are .23 and .065 (40 x 40).

Contact shadows, of blockers nearer to the receiver than LEVEL, are not told by the filter. Where
rays of the receiver's own level meet them it lies among the blockers, and the fallback is taken:
exact, for a card 1 to 1.9 % of d1 above a shelf. If only rays from below the shelf are in the table
the card has no shadow at all (RMS .42, 17 % of the shelf being dark): trace rays from everything
that asks. From 3 % of d1 on it is told either way (.026 from below, .029 by rays of its own).

What stays as rays are added: at a band limit held, the error of E11's Fig. 13 scene stops at 1.9 %
(the figures' `e11_floors`). 45 % of that is taken away by bounds of what lies under the filter
(`bounds_under_filter`), 68 % with four times the limit and 8 x 8 cells as well, when there are rays
to fill them. With all three raised as rays are added the error falls at each step, to .53 % at 256
rays a pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder.errors import check_positive
from firstorder.shadowfield.rendering.depth_bounds import depth_bounds
from firstorder.shadowfield.rendering.ray_table import LampFrame, Plane, RayTable, where_below
from firstorder.shadowfield.rendering.weighted_sums import Sums, gather

Numbers = Float[np.ndarray, " n"]


# --- the filter at a receiver --------------------------------------------------------------------


class Shape(NamedTuple):
    """The sheared filter at receivers.

    Attributes:
        sigma: of the Gaussian across, in the receiver's plane; infinite if nothing can hide [m].
        shear: metres on the lamp for each metre across.
        touched: 1 where the receiver lies among the blockers and there is no sheared filter, 0
            where they keep away from it, and smooth in between.
    """

    sigma: Numbers
    shear: Numbers
    touched: Numbers


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

    Blockers at a single depth allow any width. But rays that are slid off the lamp are lost: of
    those slid by s extents a share 1 - |s|/2. Weighed by exp(-s^2/2), as with the largest width
    allowed, `sigma = extent / shear`, they are (int w)^2 / int w^2 = 1.833 effective ones, and 2
    with any greater width: on both axes of a square lamp that keeps 84 % of all there can be.

    Args:
        d1: depth of the receivers below the lamp [m].
        near: depth of the first blockers that can matter [m].
        far: depth of the last ones [m].
        Omega_y: band limit on the lamp [cycles/m].
        pixel: side of a pixel on the receiver [m].
        extent: half of the lamp's longer edge [m].
        margin: blockers nearer to the receiver than this share of d1 touch it; they begin to at
            three times as far.

    Reference: E11 §4, eqs. 9-10, with a Gaussian in place of the pixel's filter.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield.rendering.sheared_filter import filter_shape
        >>> one = np.ones(1)
        >>> shape = filter_shape(one, 0.25 * one, 0.5 * one, 2.0, 0.01)
        >>> round(shape.sigma[0].item(), 6), round(shape.shear[0].item(), 6)
        (0.238732, 0.666667)
    """
    check_positive("Omega_y", Omega_y)
    gap = np.where(np.isfinite(near), 1.0 - far / d1, 1.0)
    t = np.clip((3.0 * margin - gap) / (2.0 * margin), 0.0, 1.0)
    touched = t * t * (3.0 - 2.0 * t)
    some = np.isfinite(near) & (touched < 1.0)
    low, high = np.where(some, near, 0.25 * d1), np.where(some, far, 0.5 * d1)
    steep, flat = high / (d1 - high), low / (d1 - low)  # 1/a, 1/b
    width = Omega_y * (steep - flat)
    shear = 0.5 * (steep + flat)
    with np.errstate(divide="ignore"):
        sigma = np.minimum(1.0 / (np.pi * width), extent / shear)
    sigma = np.maximum(sigma, 0.5 * np.asarray(pixel))
    return Shape(np.where(some, sigma, np.inf), shear, touched)


def bounds_under_filter(
    lamp: LampFrame,
    table: RayTable,
    receivers: Float[np.ndarray, "m 3"],
    Omega_y: float | int,
    pixel: float,
    widest: int = 64,
) -> tuple[Numbers, Numbers]:
    """Depths of the first and last blockers before what lies under a receiver's filter [m].

    `depth_bounds` knows those between the lamp and the pixel. But a filter weighs rays from beside
    it, which other blockers may hide: where these lie at other depths, sliding leaves them in the
    wrong place, however many rays there are and whatever the band limit. Worst are places in full
    light beside a penumbra, whose frustum grazes one thing at one depth, which allows any width.
    So the frustum is widened, from a pixel to twice as much and so on, till its side is sigma or
    more; the filter's tails reach farther. Between sheets at different depths the mean of four runs
    of 4 and of 16 rays is off by .063 and .061 with bounds of the pixel, by .023 and .011 with
    these (tests).

    Filters become narrower, so that few rays gain least. RMS in % on the ground of the figures'
    scenes, 256 x 256 pixels, 1 cycle of the lamp's diameter, by bounds of the pixel and by these:

        rays  gathering   grids       array
        1     2.25, 2.09  2.97, 2.94  4.29, 4.37
        4     1.56, 1.26  1.41, 1.40  2.37, 2.32

    Args:
        lamp: the lamp.
        table: the rays.
        receivers: in the world [m].
        Omega_y: band limit on the lamp [cycles/m].
        pixel: side of a pixel on the receivers [m].
        widest: side of the widest frustum [pixels].

    Returns:
        As `depth_bounds`, for `sheared`.

    Reference: ours; E11 §5 and §7 take the pixel's frustum, and name artifacts of its bounds.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield.rendering.depth_bounds import depth_bounds
        >>> from firstorder.shadowfield.rendering.ray_table import lamp_frame, trace
        >>> from firstorder.shadowfield.rendering.sheared_filter import bounds_under_filter
        >>> def two(a, b):  # sheets 1 m below the lamp over x < 0, and 0.4 m below it over x > 1
        ...     high, low = (0.8 * b + 0.2 * a)[:, 0] > 1.0, (0.5 * b + 0.5 * a)[:, 0] < 0.0
        ...     near = np.where(high, 0.2, np.where(low, 0.5, np.inf))
        ...     return near, np.where(high | low, np.where(low, 0.5, 0.2), -np.inf)
        >>> lamp = lamp_frame((0, 0, 2), (0, 1, 0), (1, 0, 0))
        >>> x = np.linspace(-1.0, 3.0, 400)
        >>> floor = np.column_stack([x, 0 * x, 0 * x])
        >>> table, _ = trace(lamp, floor, 16, two)
        >>> at = np.array([[0.8, 0.0, 0.0]])
        >>> [float(b[0]) for b in depth_bounds(lamp, table, at, 0.01)]
        [1.0, 1.0]
        >>> [round(float(b[0]), 3) for b in bounds_under_filter(lamp, table, at, 1.0, 0.01, 128)]
        [0.4, 1.0]
    """
    check_positive("widest", widest)
    extent = float(np.max(lamp.half))

    def answer(points) -> tuple[Numbers, Numbers]:
        d1 = lamp.local(points)[:, 2]
        near, far = np.empty_like(d1), np.empty_like(d1)
        left, side = np.arange(len(d1)), 1
        while len(left):
            near[left], far[left] = depth_bounds(lamp, table, points[left], side * pixel)
            shape = filter_shape(d1[left], near[left], far[left], Omega_y, pixel, extent)
            # Where nothing is known, or among the blockers, there is no filter.
            more = np.isfinite(shape.sigma) & (shape.sigma > side * pixel)
            left, side = left[more & (2 * side <= widest)], 2 * side
        return near, far

    return where_below(lamp, np.asarray(receivers, float), answer)


# --- reconstruction ------------------------------------------------------------------------------


class Shadows(NamedTuple):
    """What the filter finds at receivers; NaN for those that are nowhere or not below the lamp.

    Attributes:
        visible: share of the lamp that is seen, weighed by its falloff.
        samples: effective number of rays, `(sum w)^2 / sum w^2`.
        near, far: bounds of the blockers' depths that were used [m].
        own: share of `fallback` in it: 1 among the blockers, or where a blocker is known but no ray
            came by. 0 where no blocker is known, be it that none is there or that no ray has met
            any: that counts as lit, with an answer of 1 from 0 samples.
    """

    visible: Numbers
    samples: Numbers
    near: Numbers
    far: Numbers
    own: Numbers


def sheared(
    lamp: LampFrame,
    table: RayTable,
    receivers: Float[np.ndarray, "m 3"],
    Omega_y: float | int,
    pixel: float,
    fallback: Numbers,
    cells: int = 4,
    falloff: Callable[[Plane], Numbers] | None = None,
    bounds: tuple[Numbers, Numbers] | None = None,
    weights: Float[np.ndarray, " r"] | None = None,
) -> Shadows:
    """Visibility of the lamp at receivers, from rays that were traced anywhere.

    Args:
        lamp: the lamp.
        table: the rays.
        receivers: in the world [m].
        Omega_y: band limit on the lamp: low for few rays, high for sharp shadows [cycles/m].
        pixel: side of a pixel on the receivers [m].
        fallback: what to take among the blockers: an estimate by rays of each receiver's own.
            Towards them it is blended in; elsewhere it may be NaN.
        cells: along each edge of the lamp.
        falloff: of the light over the lamp, from places in [-1, 1]^2; None for a constant.
        bounds: of the blockers' depths at each receiver, such as `bounds_under_filter` gives,
            better where rays are many, or `depths.smoothed`; by default those of `depth_bounds`.
        weights: of the rays: what each stands for where they are not equally dense; None for 1.

    Reference: E11 §5; the cells, and bounds from first and last blockers, are ours.
    """
    check_positive("cells", cells)
    share = cell_shares(cells, falloff)

    def answer(points, fallback, bounds) -> Shadows:
        local = lamp.local(points)
        near, far = depth_bounds(lamp, table, points, pixel) if bounds is None else bounds
        shape = filter_shape(local[:, 2], near, far, Omega_y, pixel, float(np.max(lamp.half)))
        sums = gather(lamp, table, local, shape.sigma, shape.shear, cells, weights)
        visible, own = or_lit(np.sum(share * sums.seen, 1), sums), own_share(sums, near, shape)
        known = np.where(own > 0.0, fallback, 0.0)
        return Shadows((1.0 - own) * visible + own * known, sums.samples, near, far, own)

    return where_below(lamp, np.asarray(receivers, float), answer, np.asarray(fallback), bounds)


def or_lit(seen: np.ndarray, sums: Sums) -> np.ndarray:
    """What rays say at receivers, along the first axis; 1 where none weighs anything."""
    some = sums.square > 0.0
    return np.where(some.reshape(-1, *(1,) * (seen.ndim - 1)), seen, 1.0)


def own_share(sums: Sums, near: Numbers, shape: Shape) -> Numbers:
    """Share of a receiver's own rays in its answer: 1 where a blocker is known and no ray weighs.

    Args:
        sums: under the filter.
        near: depth of the first blockers, infinity for none [m].
        shape: of the filter.
    """
    return np.where(np.isfinite(near) & (sums.square == 0.0), 1.0, shape.touched)


def cell_shares(cells: int, falloff: Callable[[Plane], Numbers] | None = None) -> Numbers:
    """How much of the light each cell sends, all together 1.

    Args:
        cells: along each edge of the lamp.
        falloff: of the light, from places in [-1, 1]^2; None for a constant.
    """
    if falloff is None:
        return np.full(cells**2, 1.0 / cells**2)
    x = (2.0 * np.arange(8 * cells) + 1.0) / (8 * cells) - 1.0
    places = np.stack(np.meshgrid(x, x, indexing="ij"), -1)
    light = falloff(places.reshape(-1, 2)).reshape(cells, 8, cells, 8).sum((1, 3)).ravel()
    return light / np.sum(light)


__all__ = [
    "Shadows",
    "Shape",
    "bounds_under_filter",
    "cell_shares",
    "filter_shape",
    "or_lit",
    "own_share",
    "sheared",
]
