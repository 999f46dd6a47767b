r"""Blockers at very different depths: two layers, each with a filter of its own.

A ray is free if no layer hides it: `f = f1 f2`. A filter that serves both layers at once is narrow,
for it must leave both in place; one for each layer alone is wide. But the lamp that both leave
free is no product of what each leaves free, and no minimum either:

    E[f1 f2] = E[f1] E[f2] + Cov(f1, f2)

over each cell of the lamp. Only the covariance needs both layers at once, and it is estimated with
the narrow filter. Products of deviations vary less than f does: for layers that are independent by
`p1 (1 - p1) p2 (1 - p2)`, at most 1/16, in place of `p (1 - p)`, at most 1/4. The product alone is
right for layers that know nothing of each other, the minimum if all that one hides lies behind the
other: both go wrong where bars stand behind bars, however many rays there are.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_positive
from firstorder.shadowfield.rendering._below import where_below
from firstorder.shadowfield.rendering._filter_shape import cell_shares, filter_shape
from firstorder.shadowfield.rendering._weighted_sums import gather
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.lamp import LampFrame
from firstorder.shadowfield.rendering.ray_table import Plane, RayTable, _check_rays

Numbers = Float[np.ndarray, " m"]


class _DepthLayers(NamedTuple):
    """Two ray tables of the same rays: blockers above and below a depth."""

    upper: RayTable
    lower: RayTable


def _split_at_depth(table: RayTable, depth: float) -> _DepthLayers:
    """Ray tables of the blockers above and below a depth below the lamp.

    First and last blockers say of every ray whether each layer hides it. What lies between them is
    not known: the last blocker above and the first one below may be others than those kept here.

    Valid when: rays start at the receivers' level. A ray from farther below that something above
    the depth hides may have its last blocker below the receivers, and says nothing then of what the
    lower layer hides from them, but is taken for free there.

    Args:
        table: the rays.
        depth: below the lamp [m].

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield.rendering.layers import _split_at_depth
        >>> from firstorder.shadowfield import RayTable
        >>> none = np.zeros((3, 2), np.float32)
        >>> near = np.array([1.0, 1.0, np.inf], np.float32)
        >>> far = np.array([3.0, 1.5, -np.inf], np.float32)
        >>> start = np.full(3, 4.0, np.float32)
        >>> upper, lower = _split_at_depth(RayTable(none, none, near, far, start), 2.0)
        >>> upper.far.tolist(), lower.near.tolist()
        ([1.0, 1.5, -inf], [3.0, inf, inf])
    """
    check_positive("depth", depth)
    above, below = table.near < depth, table.far >= depth
    inf = np.float32(np.inf)
    far_above = np.where(table.far < depth, table.far, table.near)
    near_below = np.where(table.near >= depth, table.near, table.far)
    upper = table._replace(
        near=np.where(above, table.near, inf), far=np.where(above, far_above, -inf)
    )
    lower = table._replace(
        near=np.where(below, near_below, inf), far=np.where(below, table.far, -inf)
    )
    return _DepthLayers(upper, lower)


def layered_shadow(
    lamp: LampFrame,
    table: RayTable,
    receivers: Float[np.ndarray, "m 3"],
    depth: float,
    Omega_y: float | int,
    pixel: float,
    rule: str = "covariance",
    cells: int = 4,
    falloff: Callable[[Plane], Numbers] | None = None,
) -> Numbers:
    """Share of the lamp that is seen past two layers of blockers.

    Valid when: rays start at the receivers' level, as `_split_at_depth` wants them.

    Args:
        lamp: the lamp.
        table: the rays.
        receivers: in the world [m].
        depth: below the lamp, that tells the layers apart [m].
        Omega_y: band limit on the lamp [cycles/m].
        pixel: side of a pixel on the receivers [m].
        rule: how what each layer leaves free becomes what both do; `covariance` is right.
        cells: along each edge of the lamp.
        falloff: of the light over the lamp, from places in [-1, 1]^2; None for a constant.

    Returns:
        NaN for receivers that are nowhere or not below the lamp, and where nothing is known: among
        the blockers, and where a filter that has to keep blockers in place meets no ray. Rays of
        the receiver's own are the answer there. 1 where no blocker is known.

    Raises:
        TypeError: if lamp or table are none.
        ValueError: if `rule` is none of the three.

    Reference: E11 §8 proposes several light fields and leaves open how they go together.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import lamp_frame, layered_shadow, trace_shadow_rays
        >>> def free(a, b):
        ...     return np.full(len(a), np.inf), np.full(len(a), -np.inf)
        >>> lamp, floor = lamp_frame((0, 0, 2), (0, 0.5, 0), (0.5, 0, 0)), np.zeros((1, 3))
        >>> table, _ = trace_shadow_rays(lamp, floor, 4, free)
        >>> layered_shadow(lamp, table, floor, 1.0, 1.0, 0.1).tolist()
        [1.0]
    """
    _check_rays(lamp, table)
    if rule not in ("covariance", "product", "minimum"):
        raise ValueError(
            f"Argument `rule` must be covariance, product or minimum, but is {rule!r}."
        )
    share, parts, extent = (
        cell_shares(cells, falloff),
        _split_at_depth(table, depth),
        float(lamp.half.max()),
    )

    def answer(points) -> Numbers:
        local = lamp.local(points)
        both = [blocker_depths(lamp, t, points, pixel) for t in parts]

        def seen(near, far, *tables: RayTable) -> list[np.ndarray]:
            """Free rays by cell, under the filter for such bounds; NaN where it meets none."""
            shape = filter_shape(local[:, 2], near, far, Omega_y, pixel, extent)
            found, none = [], np.where(np.isfinite(near), np.nan, 1.0)[:, None]
            for t in tables:
                sums = gather(lamp, t, local, shape.sigma, shape.shear, cells)
                found.append(np.where(sums.square[:, None] > 0.0, sums.seen, none))
            return found

        p, q = (seen(*b, t)[0] for t, b in zip(parts, both, strict=True))
        if rule != "covariance":
            return (p * q if rule == "product" else np.minimum(p, q)) @ share
        near, far = np.minimum(both[0][0], both[1][0]), np.maximum(both[0][1], both[1][1])
        f, f1, f2 = seen(near, far, table, *parts)
        return np.clip(p * q + f - f1 * f2, 0.0, 1.0) @ share

    return where_below(lamp, receivers, answer)
