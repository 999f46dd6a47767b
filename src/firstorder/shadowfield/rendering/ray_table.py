"""Shadow rays of a rectangular lamp in its own frame, shared by pixels.

A ray is its foot y on the lamp and its slope v: at depth z below the lamp it is at `y + v z`, two
coordinates each. With the depths of the first and the last surface that hides it, and that of its
start, it is seven numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder._argument_checks import (
    check_finite,
    check_integer,
    check_kind,
    check_not_negative,
    check_positive,
    check_shape,
)
from firstorder._display import in_print
from firstorder.shadowfield.rendering.lamp import LampFrame, _receiver_rows, below

# Depths that differ by this share of the receiver's are one level: pixels are slanted and surfaces
# curved. With 0, rays of a slanted ground's upper parts are lost to its lower ones, and a slanted
# surface hides itself from rays from below. Measured on slats over ground that rises by 0.4 (24 x
# 24 pixels, 4 rays, tests of `sheared_filter`): RMS .0427 with 0, .0359 with 0.01, .0332 with 0.02,
# .0344 with 0.06. Depth runs along the lamp's normal, so that a tilted lamp slants level ground:
# E11 Fig. 1's stand-in has 653 effective rays where it had 695, with the same error; under a lamp
# that leans by 45 degrees (the figures' `mirror`, 4 rays, 8 cycles) the error is 8 % larger. Also
# lost are blockers as near as that of which only rays from below know: see `sheared_filter`.
LEVEL = 0.02
# Steps of an additive sequence: 1/g and 1/g^2 of the root of g^3 = g + 1.
ADDITIVE = (0.7548776662466927, 0.5698402909980532)

Plane = Float[np.ndarray, "n 2"]


class RayTable(NamedTuple):
    """Shadow rays in the lamp's frame, seven numbers each: 28 bytes in single precision.

    Attributes:
        y: foot on the lamp [m].
        v: slope: lateral metres per metre of depth.
        near: depth below the lamp of the first surface that hides it, infinity for a free ray [m].
        far: of the last one, minus infinity for a free ray [m].
        start: depth below the lamp of the receiver that it was traced from [m].

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import RayTable
        >>> far, none = np.full(1, -np.inf), np.full(1, np.inf)
        >>> RayTable(np.zeros((1, 2)), np.zeros((1, 2)), none, far, np.ones(1)).free.tolist()
        [True]
    """

    y: Float[np.ndarray, "n 2"]
    v: Float[np.ndarray, "n 2"]
    near: Float[np.ndarray, " n"]
    far: Float[np.ndarray, " n"]
    start: Float[np.ndarray, " n"]

    __repr__ = in_print

    @property
    def free(self) -> Bool[np.ndarray, " n"]:
        """Mask of rays that nothing hides from the lamp."""
        return np.isinf(self.near)

    def at(self, depth) -> Plane:
        """Lateral coordinates of the rays at a depth [m]."""
        return self.y + self.v * depth


def _check_rays(lamp: Any, table: Any) -> None:
    """Refuse what is no lamp and no table, such as the pair that `trace_shadow_rays` gives.

    Args:
        lamp: what was given as one.
        table: what was given as one.

    Raises:
        TypeError: if one is something else.
        ValueError: if a column of the table does not have a row for each ray.

    Example:
        >>> from firstorder.shadowfield import lamp_frame
        >>> from firstorder.shadowfield.rendering.ray_table import _check_rays
        >>> _check_rays(lamp_frame((0, 0, 2), (0, 1, 0), (1, 0, 0)), None)
        Traceback (most recent call last):
            ...
        TypeError: Argument `table` must be a table of `trace_shadow_rays`, but is a NoneType.
    """
    check_kind("lamp", lamp, LampFrame, "a lamp of `lamp_frame`")
    check_kind("table", table, RayTable, "a table of `trace_shadow_rays`")
    rays = len(table.near)
    for name, row in (("y", (2,)), ("v", (2,)), ("near", ()), ("far", ()), ("start", ())):
        check_shape(f"table.{name}", np.asarray(getattr(table, name)), (rays, *row))


Blockers = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def trace_shadow_rays(
    lamp: LampFrame,
    receivers: Float[np.ndarray, "m 3"],
    rays: float | int | Int[np.ndarray, " m"],
    blockers: Blockers,
    seed: int = 0,
) -> tuple[RayTable, Int[np.ndarray, " n"]]:
    """Shadow rays from receivers to places on the lamp, stratified over both.

    Args:
        lamp: the lamp.
        receivers: points that the image shows, in the world [m].
        rays: for each receiver; below 1, that share of the receivers has one. Or a number for each
            receiver (`distribute_rays`).
        blockers: from ends of rays in the world, receiver and lamp, shape (n, 3) each, to the
            shares of the way *from the lamp* of the first and the last surface in between, shape
            (n,) each; infinity and minus infinity for free rays.
        seed: of the random numbers.

    Returns:
        The rays, and of which receiver each is.

    Raises:
        TypeError: if `lamp` is none of `lamp_frame`.
        ValueError: if receivers that rays are asked for are nowhere or not below the lamp, there is
            not one whole number of rays for each, or `blockers` gives no two shares for each ray.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import lamp_frame, trace_shadow_rays
        >>> def free(a, b):
        ...     return np.full(len(a), np.inf), np.full(len(a), -np.inf)
        >>> lamp = lamp_frame((0, 0, 2), (0, 0.5, 0), (0.5, 0, 0))
        >>> table, whose = trace_shadow_rays(lamp, np.zeros((1, 3)), 4, free)
        >>> table.start.tolist(), whose.tolist()
        ([2.0, 2.0, 2.0, 2.0], [0, 0, 0, 0])
    """
    rng = np.random.default_rng(seed)
    receivers = _receiver_rows(receivers)
    check_finite("rays", rays)
    m = len(receivers)
    if np.ndim(rays):
        rays = np.asarray(rays)
        check_shape("rays", rays, (m,))
        check_not_negative("rays", rays)
        check_integer("rays", rays.flat[0].item() if m else 0)
    lost = ~below(lamp, receivers) & (np.asarray(rays) != 0)
    if np.any(lost):
        raise ValueError(
            "Argument `receivers` must be finite and below the lamp, but "
            f"{np.sum(lost)} of {m} are not."
        )
    if isinstance(rays, np.ndarray):
        owner = np.repeat(np.arange(m), rays)
    elif rays >= 1:
        check_integer("rays", rays if rays % 1 else int(rays))
        owner = np.repeat(np.arange(m), int(rays))
    else:
        check_positive("rays", rays)
        owner = np.sort(rng.permutation(m)[: max(round(rays * m), 1)])
    local = lamp.local(receivers[owner])
    y = (2.0 * _spread(len(owner), rng) - 1.0) * lamp.half
    ends = lamp.world(np.concatenate([y, np.zeros((len(y), 1))], 1))
    first, last = _shares(blockers(receivers[owner], ends), len(owner))
    depth = local[:, 2]
    v = (local[:, :2] - y) / depth[:, None]
    single = (a.astype(np.float32) for a in (y, v, first * depth, last * depth, depth))
    return RayTable(*single), owner


def _shares(found: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the way of the first and last blockers of rays, as `blockers` gave them."""
    if not isinstance(found, (tuple, list)) or len(found) != 2:
        raise ValueError("Argument `blockers` must give two arrays, the first and last shares.")
    first, last = (np.asarray(a, float) for a in found)
    for a in (first, last):
        check_shape("blockers", a, (count,))
    free = np.isposinf(first) & np.isneginf(last)
    if wrong := np.sum(~(free | (np.isfinite(first) & np.isfinite(last)))):
        raise ValueError(
            "Argument `blockers` must give the first share and the last, infinity and minus "
            f"infinity for free rays, but does not for {wrong} of {count} rays."
        )
    return first, last


def _spread(count: int, rng) -> Plane:
    """Places in the unit square, evenly spread in every run of them (an additive sequence)."""
    return np.mod(rng.random(2) + np.arange(count)[:, None] * ADDITIVE, 1.0)
