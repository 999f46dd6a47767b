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
lies below the receiver; one from above does not, and does not count (`ray_table.LEVEL` tells levels
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
(`depths_under_filter`), 68 % with four times the limit and 8 x 8 cells as well, when there are rays
to fill them. With all three raised as rays are added the error falls at each step, to .53 % at 256
rays a pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_count, check_not_negative, check_shape
from firstorder._display import in_print
from firstorder.shadowfield.rendering._below import where_below
from firstorder.shadowfield.rendering._filter_shape import (
    Numbers,
    cell_shares,
    filter_shape,
    or_lit,
    own_share,
)
from firstorder.shadowfield.rendering._weighted_sums import gather
from firstorder.shadowfield.rendering.depth_bounds import _check_each, _known_depths, blocker_depths
from firstorder.shadowfield.rendering.lamp import LampFrame, _receiver_rows
from firstorder.shadowfield.rendering.ray_table import Plane, RayTable, _check_rays

# --- the filter at a receiver --------------------------------------------------------------------


def depths_under_filter(
    lamp: LampFrame,
    table: RayTable,
    receivers: Float[np.ndarray, "m 3"],
    Omega_y: float | int,
    pixel: float,
    widest: int = 64,
) -> tuple[Numbers, Numbers]:
    """Depths of the first and last blockers under a receiver's filter [m].

    `blocker_depths` knows those between the lamp and the pixel. But a filter weighs rays from
    beside it, which other blockers may hide: where these lie at other depths, sliding leaves them
    in the wrong place, however many rays there are and whatever the band limit. Worst are places in
    full light beside a penumbra, whose frustum grazes one surface at one depth, which allows any
    width. So the frustum is widened, from a pixel to twice as much and so on, till its side is
    sigma or more; the filter's tails reach farther. Between sheets at different depths the mean of
    four runs of 4 and of 16 rays is off by .063 and .061 with bounds of the pixel, by .023 and .011
    with these (tests).

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
        As `blocker_depths`, for `sheared_shadow`.

    Raises:
        TypeError: if lamp or table are none.
        ValueError: if `widest` is not positive.

    Reference: ours; E11 §5 and §7 take the pixel's frustum, and name artifacts of its bounds.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import blocker_depths
        >>> from firstorder.shadowfield import lamp_frame
        >>> from firstorder.shadowfield import trace_shadow_rays
        >>> from firstorder.shadowfield import depths_under_filter
        >>> def two(a, b):  # sheets 1 m below the lamp over x < 0, and 0.4 m below it over x > 1
        ...     high, low = (0.8 * b + 0.2 * a)[:, 0] > 1.0, (0.5 * b + 0.5 * a)[:, 0] < 0.0
        ...     near = np.where(high, 0.2, np.where(low, 0.5, np.inf))
        ...     return near, np.where(high | low, np.where(low, 0.5, 0.2), -np.inf)
        >>> lamp = lamp_frame((0, 0, 2), (0, 1, 0), (1, 0, 0))
        >>> x = np.linspace(-1.0, 3.0, 400)
        >>> floor = np.column_stack([x, 0 * x, 0 * x])
        >>> table, _ = trace_shadow_rays(lamp, floor, 16, two)
        >>> at = np.array([[0.8, 0.0, 0.0]])
        >>> [float(b[0]) for b in blocker_depths(lamp, table, at, 0.01)]
        [1.0, 1.0]
        >>> [round(float(b[0]), 3) for b in depths_under_filter(lamp, table, at, 1.0, 0.01, 128)]
        [0.4, 1.0]
    """
    _check_rays(lamp, table)
    check_count("widest", widest)
    extent = float(np.max(lamp.half))

    def answer(points) -> tuple[Numbers, Numbers]:
        d1 = lamp.local(points)[:, 2]
        near, far = np.empty_like(d1), np.empty_like(d1)
        left, side = np.arange(len(d1)), 1
        while len(left):
            near[left], far[left] = blocker_depths(lamp, table, points[left], side * pixel)
            shape = filter_shape(d1[left], near[left], far[left], Omega_y, pixel, extent)
            # Where nothing is known, or among the blockers, there is no filter.
            more = np.isfinite(shape.sigma) & (shape.sigma > side * pixel)
            left, side = left[more & (2 * side <= widest)], 2 * side
        return near, far

    return where_below(lamp, receivers, answer)


# --- reconstruction ------------------------------------------------------------------------------


class ShearedShadow(NamedTuple):
    """Filtered visibility at receivers, with the depths used; NaN for receivers not below the lamp.

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

    __repr__ = in_print


def sheared_shadow(
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
) -> ShearedShadow:
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
        bounds: of the blockers' depths at each receiver, such as `depths_under_filter` gives,
            better where rays are many, or `smooth_depths`; by default those of `blocker_depths`.
        weights: of the rays: what each stands for where they are not equally dense; None for 1.

    Raises:
        TypeError: if lamp or table are none.
        ValueError: if shapes do not fit, a number that must be positive is not, a weight is
            negative, a bound of a receiver below the lamp is NaN or behind the other, or the light
            is negative or dark everywhere.

    Reference: E11 §5; the cells, and bounds from first and last blockers, are ours.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import lamp_frame, sheared_shadow, trace_shadow_rays
        >>> def free(a, b):
        ...     return np.full(len(a), np.inf), np.full(len(a), -np.inf)
        >>> lamp, floor = lamp_frame((0, 0, 2), (0, 0.5, 0), (0.5, 0, 0)), np.zeros((1, 3))
        >>> table, _ = trace_shadow_rays(lamp, floor, 4, free)
        >>> sheared_shadow(lamp, table, floor, 1.0, 0.1, np.ones(1)).visible.tolist()
        [1.0]
    """
    _check_rays(lamp, table)
    at = _receiver_rows(receivers)
    _check_each(len(at), fallback, bounds)
    if weights is not None:
        check_shape("weights", np.asarray(weights), table.near.shape)
        check_not_negative("weights", weights)
        weights = np.asarray(weights, float)
        weights = weights / (np.max(weights, initial=0.0) or 1.0)  # squares in single precision
    share = cell_shares(cells, falloff)

    def answer(points, fallback, bounds) -> ShearedShadow:
        local = lamp.local(points)
        near, far = _known_depths(lamp, table, points, pixel, bounds)
        shape = filter_shape(local[:, 2], near, far, Omega_y, pixel, float(np.max(lamp.half)))
        sums = gather(lamp, table, local, shape.sigma, shape.shear, cells, weights)
        visible, own = or_lit(np.sum(share * sums.seen, 1), sums), own_share(sums, near, shape)
        known = np.where(own > 0.0, fallback, 0.0)
        return ShearedShadow((1.0 - own) * visible + own * known, sums.samples, near, far, own)

    return where_below(lamp, at, answer, np.asarray(fallback), bounds)
