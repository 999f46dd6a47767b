"""Shadow rays of a rectangular lamp, told in its own frame: what pixels share.

A ray is its foot y on the lamp and its slope v: at depth z below the lamp it is at `y + v z`, two
coordinates each. With the depths of the first and the last thing that hides it, and that of its
start, it is seven numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder.errors import check_not_negative, check_positive

# Depths that differ by this share of the receiver's are one level: pixels are slanted and surfaces
# curved. With 0, rays of a slanted ground's upper parts are lost to its lower ones, and a slanted
# thing hides itself from rays from below. Measured on slats over ground that rises by 0.4 (24 x 24
# pixels, 4 rays, tests of `space`): RMS .0427 with 0, .0359 with 0.01, .0332 with 0.02, .0344 with
# 0.06. Depth runs along the lamp's normal, so that a tilted lamp slants level ground: E11 Fig. 1's
# stand-in has 653 effective rays where it had 695, with the same error; under a lamp that leans by
# 45 degrees (the figures' `mirror`, 4 rays, 8 cycles) the error is 8 % larger. Also lost are
# blockers as near as that of which only rays from below know: see `space`.
LEVEL = 0.02
# Steps of an additive sequence: 1/g and 1/g^2 of the root of g^3 = g + 1.
ADDITIVE = (0.7548776662466927, 0.5698402909980532)

Plane = Float[np.ndarray, "n 2"]
Answer = TypeVar("Answer")


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
        >>> from firstorder.shadowfield.rendering.ray_table import lamp_frame
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


def below(lamp: LampFrame, receivers: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
    """Which receivers are somewhere and below the lamp; no ray can come to the others.

    Args:
        lamp: the lamp.
        receivers: in the world [m].
    """
    some = np.all(np.isfinite(receivers), 1)
    return some & (lamp.local(np.where(some[:, None], receivers, lamp.center))[:, 2] > 0.0)


def where_below(
    lamp: LampFrame,
    receivers: Float[np.ndarray, "m 3"],
    answer: Callable[..., Answer],
    *each,
) -> Answer:
    """`answer(receivers, *each)` of the receivers `below` the lamp, NaN for the others.

    A single one that is nowhere would spoil the box of all its neighbours.

    Args:
        lamp: the lamp.
        receivers: in the world [m].
        answer: arrays, in tuples or not, with a number for each receiver along their last axis.
        each: what it wants besides: arrays of m, in tuples or not, or None.
    """
    some = below(lamp, receivers)
    if np.all(some):
        return answer(receivers, *each)

    def whole(values):
        found = np.full((*values.shape[:-1], len(some)), np.nan)
        found[..., some] = values
        return found

    return jax.tree.map(whole, answer(*jax.tree.map(lambda a: a[some], (receivers, *each))))


class RayTable(NamedTuple):
    """Shadow rays in the lamp's frame, seven numbers each: 28 bytes in single precision.

    Attributes:
        y: foot on the lamp [m].
        v: slope: lateral metres per metre of depth.
        near: depth below the lamp of the first thing that hides it, infinity for a free ray [m].
        far: of the last one, minus infinity for a free ray [m].
        start: depth below the lamp of the receiver that it was traced from [m].
    """

    y: Float[np.ndarray, "n 2"]
    v: Float[np.ndarray, "n 2"]
    near: Float[np.ndarray, " n"]
    far: Float[np.ndarray, " n"]
    start: Float[np.ndarray, " n"]

    @property
    def free(self) -> Bool[np.ndarray, " n"]:
        """Whether nothing hides the lamp from where they start."""
        return np.isinf(self.near)

    def at(self, depth) -> Plane:
        """Lateral coordinates at a depth [m]."""
        return self.y + self.v * depth


Blockers = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def trace(
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
            receiver (`counts.ray_counts`).
        blockers: from ends of rays in the world, receiver and lamp, to the shares of the way *from
            the lamp* of the first and the last thing in between; infinity and minus infinity for
            free rays.
        seed: of the random numbers.

    Returns:
        The rays, and of which receiver each is.

    Raises:
        ValueError: if receivers that rays are asked for are nowhere or not below the lamp.
    """
    rng = np.random.default_rng(seed)
    m = len(receivers)
    lost = ~below(lamp, receivers) & (np.asarray(rays) != 0)
    if np.any(lost):
        raise ValueError(
            "Argument `receivers` must be finite and below the lamp, but "
            f"{np.sum(lost)} of {m} are not."
        )
    if isinstance(rays, np.ndarray):
        check_not_negative("rays", rays)
        owner = np.repeat(np.arange(m), rays)
    elif rays >= 1:
        owner = np.repeat(np.arange(m), round(rays))
    else:
        check_positive("rays", rays)
        owner = np.sort(rng.permutation(m)[: max(round(rays * m), 1)])
    local = lamp.local(receivers[owner])
    y = (2.0 * _spread(len(owner), rng) - 1.0) * lamp.half
    ends = lamp.world(np.concatenate([y, np.zeros((len(y), 1))], 1))
    first, last = blockers(receivers[owner], ends)
    depth = local[:, 2]
    v = (local[:, :2] - y) / depth[:, None]
    single = (a.astype(np.float32) for a in (y, v, first * depth, last * depth, depth))
    return RayTable(*single), owner


def _spread(count: int, rng) -> Plane:
    """Places in the unit square, evenly spread in every run of them (an additive sequence)."""
    return np.mod(rng.random(2) + np.arange(count)[:, None] * ADDITIVE, 1.0)


__all__ = ["LEVEL", "LampFrame", "RayTable", "below", "lamp_frame", "trace", "where_below"]
