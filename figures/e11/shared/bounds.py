"""Bounds of depths found in several ways, and what filters make of them: Figs. 12 and 17.

E11 §7 names two faults of bounds: they miss blockers, and they jump from pixel to pixel, where
filters ring. So errors are taken of a window's ground, of its pixels whose bounds miss a blocker,
and of its pixels beside which the filter's width jumps twofold.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from figures.e11.shared import limits
from figures.e11.shared import space as scenes
from figures.spread import spread
from firstorder.shadowfield.rendering._filter_shape import filter_shape
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow

PLAIN, POINT, MORE, WIDENED = "of the rays", "of a frustum to a point", "of 32 rays", "widened"
BLURRED = ("blurred by 1 pixel", "blurred by 2 pixels")
WAYS = (PLAIN, POINT, MORE, WIDENED, *BLURRED)
ALL, JUMPS, MISSED = "all", "jumps", "missed"
STEP = 2  # of the pixels that are judged, both ways
TWICE = np.log(2.0)  # of the filter's width: a jump
# Why blurred bounds, and widened ones, may not help.
REASONS = (
    "A mean of depths on both sides of a jump holds the blockers of neither: what is slid there is "
    "slid to the wrong place.",
    "Widened bounds make filters narrower, which are noisier.",
)


class Compared(NamedTuple):
    """Errors by bounds and pixels.

    Attributes:
        rms: by way, kind of pixel and seed.
        share: of the pixels of each kind, by seed.
    """

    rms: dict[str, dict[str, np.ndarray]]
    share: dict[str, np.ndarray]

    def ratio(self, way: str, over: str, kind: str) -> tuple[float, float]:
        """RMS error by one kind of bounds over that by another, and its standard error."""
        return spread(self.rms[way][kind] / self.rms[over][kind])


def compared(
    ground: limits.Ground, window: tuple[slice, slice], rays: float, cycles: float, seeds: int
) -> Compared:
    """Errors of a window's ground by each of `WAYS`, with rays of as many seeds.

    Args:
        ground: what an image shows of it.
        window: part of the image; the ground in it traces the rays.
        rays: shared ones for each pixel.
        cycles: light band limit [cycles for each diameter of the lamp].
        seeds: how many.
    """
    part = ground.part(window)
    limit, side = cycles / ground.diameter, ground.scene.side
    judged = ground.scene.every(STEP)[part.where]
    rms = {way: {kind: [] for kind in (ALL, JUMPS, MISSED)} for way in WAYS}
    share = {kind: [] for kind in (JUMPS, MISSED)}
    for seed in range(1, seeds + 1):
        table, bounds = _bounds(part, rays, seed)
        width = _widths(part, bounds[PLAIN], limit).reshape(side, side)
        kinds = {
            ALL: judged,
            JUMPS: judged & _jumps(width).ravel()[part.where],
            MISSED: judged & _missed(bounds[PLAIN], bounds[MORE]),
        }
        for way, (near, far) in bounds.items():
            found = sheared_shadow(
                part.scene.lamp, table, part.receivers[judged], limit, part.scene.pixel,
                part.own[judged], falloff=scenes.falloff, bounds=(near[judged], far[judged]),
            ).visible  # fmt: skip
            off = found - part.true[judged]
            for kind, some in kinds.items():
                rms[way][kind].append(np.sqrt(np.mean(off[some[judged]] ** 2)))
        for kind, values in share.items():
            values.append(np.sum(kinds[kind]) / np.sum(judged))
    return Compared(
        {way: {k: np.array(v) for k, v in kinds.items()} for way, kinds in rms.items()},
        {kind: np.array(v) for kind, v in share.items()},
    )


def _bounds(part: limits.Ground, rays: float, seed: int):
    """The rays, and bounds of all ways."""
    lamp, points, blockers = part.scene.lamp, part.receivers, part.scene.blockers
    table = trace_shadow_rays(lamp, points, rays, blockers, seed)[0]
    more = trace_shadow_rays(lamp, points, 32, blockers, 1000 + seed)[0]
    plain = blocker_depths(lamp, table, points, part.scene.pixel)
    found = {
        PLAIN: plain,
        POINT: blocker_depths(lamp, table, points, 0.0),
        MORE: blocker_depths(lamp, more, points, part.scene.pixel),
        WIDENED: scenes.smoothed_bounds(part.scene, part.where, plain, 1),
    }
    for radius, name in enumerate(BLURRED, 1):
        found[name] = scenes.blended_bounds(part.scene, part.where, plain, radius)
    return table, found


def _missed(bounds, more) -> np.ndarray:
    """Whether better bounds reach further than these, by a millimetre, at either end."""
    return (more[0] < bounds[0] - 1e-3) | (more[1] > bounds[1] + 1e-3)


def _widths(part: limits.Ground, bounds, limit: float) -> np.ndarray:
    """Logarithm of the filter's width at all pixels, NaN where there is none."""
    depth = part.scene.lamp.local(part.receivers)[:, 2]
    extent = float(np.max(part.scene.lamp.half))
    sigma = filter_shape(depth, *bounds, limit, part.scene.pixel, extent).sigma
    return part.picture(np.log(np.where(np.isfinite(sigma), sigma, np.nan)))


def _jumps(width: np.ndarray) -> np.ndarray:
    """Mask of pixels one of whose four neighbours has a filter twice or half as wide."""
    found = np.zeros(width.shape, bool)
    for axis in range(2):
        jump = abs(np.diff(width, axis=axis)) > TWICE
        first, last = [(0, 1), (0, 0)], [(1, 0), (0, 0)]
        found |= np.pad(jump, first if axis == 0 else first[::-1])
        found |= np.pad(jump, last if axis == 0 else last[::-1])
    return found
