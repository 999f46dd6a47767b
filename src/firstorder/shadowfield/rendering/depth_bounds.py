"""Bounds of the depths of each receiver's blockers, from traced rays.

A blocker at lateral p and depth z can come between the lamp and a pixel at (X, d1) if p lies in the
frustum of both: `|p - X t| <= half (1 - t) + pixel t / 2`, `t = z / d1 < 1`, on both axes. What a
ray from below the receiver meets within `ray_table.LEVEL` above it may be the receiver's own
surface, and does not count. What rays of its own level meet there does.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.ndimage
from jaxtyping import Float

from firstorder._argument_checks import check_count, check_not_negative, check_shape
from firstorder.numerics._native import HAVE_NATIVE
from firstorder.shadowfield.rendering._below import where_below
from firstorder.shadowfield.rendering._culling import ROUNDING, narrowed
from firstorder.shadowfield.rendering.lamp import LampFrame
from firstorder.shadowfield.rendering.ray_table import LEVEL, RayTable, _check_rays

GROUP = 64  # receivers that are searched at once

Numbers = Float[np.ndarray, " n"]


def blocker_depths(
    lamp: LampFrame, table: RayTable, receivers: Float[np.ndarray, "m 3"], pixel: float
) -> tuple[Numbers, Numbers]:
    """Depths of the first and last blockers that the table knows before each receiver [m].

    Those in the frustum between the lamp and the whole pixel count: one that ends in a point misses
    blockers near the receiver, of which E11 Fig. 17 shows the marks.

    Args:
        lamp: the lamp.
        table: the rays.
        receivers: in the world [m].
        pixel: side of a pixel on the receivers, 0 for points [m].

    Returns:
        Infinity and minus infinity where there is none; NaN for receivers that are nowhere or not
        below the lamp.

    Raises:
        TypeError: if lamp or table are none.
        ValueError: if `pixel` is negative, or receivers are not rows of three coordinates.

    Reference: E11 §5 and §7.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import blocker_depths, lamp_frame, trace_shadow_rays
        >>> def half(a, b):  # a sheet half way up hides all
        ...     return np.full(len(a), 0.5), np.full(len(a), 0.5)
        >>> lamp, floor = lamp_frame((0, 0, 2), (0, 0.5, 0), (0.5, 0, 0)), np.zeros((1, 3))
        >>> table, _ = trace_shadow_rays(lamp, floor, 4, half)
        >>> [depth.tolist() for depth in blocker_depths(lamp, table, floor, 0.1)]
        [[1.0], [1.0]]
    """
    _check_rays(lamp, table)
    check_not_negative("pixel", pixel)
    places = _places(table)
    return where_below(lamp, receivers, lambda at: _bounds(lamp, places, lamp.local(at), pixel))


def _known_depths(
    lamp: LampFrame,
    table: RayTable,
    receivers: Float[np.ndarray, "m 3"],
    pixel: float,
    bounds: tuple[Numbers, Numbers] | None,
) -> tuple[Numbers, Numbers]:
    """The bounds of the blockers' depths that are given, or else those of `blocker_depths`.

    Args:
        lamp: the lamp.
        table: the rays.
        receivers: below the lamp, in the world [m].
        pixel: side of a pixel on the receivers [m].
        bounds: of each receiver, or None [m].

    Raises:
        ValueError: if a given bound is NaN, or the first lies behind the last: where no blocker is
            known a receiver counts as lit.
    """
    if bounds is None:
        return blocker_depths(lamp, table, receivers, pixel)
    near, far = (np.asarray(b, float) for b in bounds)
    none = np.isposinf(near) & np.isneginf(far)
    wrong = np.flatnonzero(~(none | ((near >= 0.0) & (near <= far) & np.isfinite(far))))
    if wrong.size:
        raise ValueError(
            "Argument `bounds` must hold the first and the last depth, infinity and minus infinity "
            f"for none, but holds {near[wrong[0]]} and {far[wrong[0]]}."
        )
    return near, far


def _bounds(lamp: LampFrame, places, local, pixel: float) -> tuple[Numbers, Numbers]:
    """First and last places before receivers in the lamp's frame."""
    if HAVE_NATIVE:
        from firstorder.shadowfield.rendering._blocker_tree import first_and_last  # takes numba

        return first_and_last(places, local, lamp.half, pixel)
    return _by_groups(lamp, places, local, pixel)


def _by_groups(lamp: LampFrame, places, local, pixel: float) -> tuple[Numbers, Numbers]:
    """Depth bounds without numba, in groups of neighbours."""
    columns = [np.ascontiguousarray(column) for column in places.T]  # one axis each: faster

    def keep(rows, some):
        """Mask of places in the hull of the frusta: their sides are straight in t."""
        at, z = local[rows], columns[2][some]
        shallow, deep = z / at[:, 2].max(), np.minimum(z / at[:, 2].min(), 1.0)
        inside = columns[3][some] < at[:, 2].max()
        for axis in range(2):
            p, half = columns[axis][some], lamp.half[axis]
            low = at[:, axis].min() - 0.5 * pixel + half
            high = at[:, axis].max() + 0.5 * pixel - half
            epsilon = ROUNDING * (half + np.max(np.abs(at[:, axis])))
            inside &= p >= low * (deep if low < 0.0 else shallow) - half - epsilon
            inside &= p <= high * (deep if high > 0.0 else shallow) + half + epsilon
        return inside

    near, far = np.full(len(local), np.inf), np.full(len(local), -np.inf)
    for rows, some in narrowed(local, len(places), keep, GROUP):
        near[rows] = _first(lamp, local[rows], places[some], pixel, np.inf)
        far[rows] = _first(lamp, local[rows], places[some[::-1]], pixel, -np.inf)
    return near, far


def _places(table: RayTable) -> Float[np.ndarray, "k 4"]:
    """Places of the rays' first and last blockers, by depth; once if they are the same.

    And the depth that receivers must exceed for it to come before them.
    """
    hidden = ~table.free
    parts = []
    for depth, some in ((table.near, hidden), (table.far, hidden & (table.far != table.near))):
        z = depth[some].astype(float)
        level = np.minimum(z / (1.0 - LEVEL), table.start[some] / (1.0 + LEVEL))
        place = table.y[some] + table.v[some] * z[:, None]
        parts.append(np.column_stack([place, z, np.maximum(z, level)]))
    places = np.concatenate(parts)
    return places[np.argsort(places[:, 2], kind="stable")]


def _first(lamp, at, places, pixel: float, none: float) -> Numbers:
    """Depth of the first of the places in each receiver's frustum: all in turn, till all have one.

    Most receivers in shadow find theirs soon, and those in light have few places to look at.
    """
    found, left, start, step = np.full(len(at), none), np.arange(len(at)), 0, 64
    while len(left) and start < len(places):
        p = places[start : start + step]
        t = p[:, 2] / at[left, 2, None]
        edge = lamp.half * (1.0 - t[..., None]) + 0.5 * pixel * t[..., None]
        off = abs(p[:, :2] - at[left, None, :2] * t[..., None])
        inside = np.all(off <= edge, -1) & (p[:, 3] < at[left, 2, None])
        some = np.any(inside, 1)
        found[left[some]] = p[np.argmax(inside[some], 1), 2]
        left, start, step = left[~some], start + step, 2 * step
    return found


def _check_each(count: int, fallback: Any, bounds: tuple[Any, Any] | None) -> None:
    """Refuse fallbacks and bounds that are not one number for each receiver.

    Args:
        count: of receivers.
        fallback: among the blockers.
        bounds: of the blockers' depths, or None.

    Raises:
        ValueError: if a shape is another.
    """
    check_shape("fallback", np.asarray(fallback), (count,))
    for bound in () if bounds is None else bounds:
        check_shape("bounds", np.asarray(bound), (count,))


def smooth_depths(
    near: Float[np.ndarray, "w h"], far: Float[np.ndarray, "w h"], radius: int
) -> tuple[Float[np.ndarray, "w h"], Float[np.ndarray, "w h"]]:
    """Depth bounds of an image without jumps from pixel to pixel, at which filters would ring.

    First the least and the largest within the radius, so that bounds stay bounds, then a Gaussian
    of half of it. Pixels without blockers stay without unless others within the radius have some.
    What is NaN stays so, and gives its neighbours nothing.

    Args:
        near: depths of first blockers, infinity for none [m].
        far: of last ones, minus infinity for none [m].
        radius: in pixels.

    Raises:
        ValueError: if `radius` is not positive, or both are not images of one shape.

    Reference: E11 §7 names the ringing and this cure.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import smooth_depths
        >>> near, far = smooth_depths(np.full((3, 3), 0.5), np.full((3, 3), 0.75), 1)
        >>> near[1, 1].item(), far[1, 1].item()
        (0.5, 0.75)
    """
    check_count("radius", radius)
    near, far = np.asarray(near), np.asarray(far)
    if near.ndim != 2:
        raise ValueError(f"Argument `near` must be an image, but has shape {near.shape}.")
    check_shape("far", far, near.shape)
    size = 2 * radius + 1
    low = scipy.ndimage.minimum_filter(np.where(np.isnan(near), np.inf, near), size)
    high = scipy.ndimage.maximum_filter(np.where(np.isnan(far), -np.inf, far), size)
    some = np.isfinite(low)
    weight = scipy.ndimage.gaussian_filter(some.astype(float), 0.5 * radius)
    found = []
    for a, none in ((low, np.inf), (high, -np.inf)):
        spread = scipy.ndimage.gaussian_filter(np.where(some, a, 0.0), 0.5 * radius)
        found.append(np.where(some, spread / np.where(some, weight, 1.0), none))
    return np.minimum(found[0], near), np.maximum(found[1], far)
