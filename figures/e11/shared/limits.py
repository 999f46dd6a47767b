"""Shared shadow rays on the ground of one of E11's scenes, at several band limits of the lamp.

Band limits are told as the paper does, in cycles for each lamp's diameter; the lamp fades as the
paper's does. Among the blockers 16 stratified rays of the pixel's own are taken; errors are those
of the ground that the image shows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from figures.e11.shared import space as scenes
from firstorder.shadowfield.rendering.band_limit_choice import (
    BandLimitSweep,
    SelectedBandLimits,
    band_limit_sweep,
    select_band_limits,
)
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays

OWN = 16
SEED = 3


class Ground(NamedTuple):
    """What an image shows of the ground, with its reference.

    Attributes:
        scene: all of it.
        where: numbers of the pixels.
        true: what they see of the lamp, by the reference.
        own: the same by few stratified rays, 16 of them by default.
        rays: of the reference.
    """

    scene: scenes.Scene
    where: np.ndarray
    true: np.ndarray
    own: np.ndarray
    rays: int

    @property
    def receivers(self) -> np.ndarray:
        """Where they are [m]."""
        return self.scene.receivers[self.where]

    @property
    def image(self) -> tuple[np.ndarray, int]:
        """As `band_limit_sweep` asks for it."""
        return self.where, self.scene.side

    @property
    def diameter(self) -> float:
        """Of the lamp [m]."""
        return 2.0 * float(self.scene.lamp.half[0])

    def traced(self, rays: float | int, seed: int = SEED) -> RayTable:
        """Shadow rays of these pixels."""
        return trace_shadow_rays(self.scene.lamp, self.receivers, rays, self.scene.blockers, seed)[
            0
        ]

    def bounds(self, table: RayTable, pixel: float | None = None):
        """Of the blockers' depths, in the frustum of the whole pixel by default."""
        wide = self.scene.pixel if pixel is None else pixel
        return blocker_depths(self.scene.lamp, table, self.receivers, wide)

    def answers(self, table: RayTable, limits: np.ndarray, bounds=None) -> BandLimitSweep:
        """At band limits in cycles for each diameter, each twice the one before."""
        return band_limit_sweep(
            self.scene.lamp,
            table,
            self.receivers,
            np.asarray(limits, float) / self.diameter,
            self.scene.pixel,
            self.own,
            self.image,
            falloff=scenes.falloff,
            bounds=self.bounds(table) if bounds is None else bounds,
            own_rays=OWN,
        )

    def chosen(self, rungs: BandLimitSweep) -> SelectedBandLimits:
        """Each pixel at its own limit."""
        return select_band_limits(rungs, self.image)

    def rms(self, found: np.ndarray) -> float:
        """Error over all of these pixels."""
        return float(np.sqrt(np.mean((found - self.true) ** 2)))

    def picture(self, values: np.ndarray) -> np.ndarray:
        """As an image, NaN where something else is seen."""
        return self.scene.picture(values, self.where)

    def part(self, window: tuple[slice, slice], edge: int = 0) -> Ground:
        """That in a window of the image and `edge` pixels around it."""
        inside = np.zeros((self.scene.side, self.scene.side), bool)
        i, j = (slice(max(s.start - edge, 0), s.stop + edge) for s in window)
        inside[i, j] = True
        some = inside.ravel()[self.where]
        return self._replace(where=self.where[some], true=self.true[some], own=self.own[some])

    @property
    def own_error(self) -> float:
        """Of the reference: of as many tosses of a coin, which stratified rays do not reach."""
        return float(np.sqrt(np.mean(self.true * (1.0 - self.true)) / self.rays))


def ground(scene: scenes.Scene, quick: bool) -> Ground:
    """Of a scene, with a reference of 2,048 rays; of 256 if quick."""
    rays = scenes.QUICK_RAYS if quick else scenes.RAYS
    return ground_of(scene, scenes.reference(scene, rays), rays, OWN)


def ground_of(scene: scenes.Scene, true: np.ndarray, rays: int, own: int) -> Ground:
    """Of a scene whose reference, an image, is known; `own` rays of each pixel's own."""
    where = np.flatnonzero(scene.floor)
    at = scenes.own_rays(scene, where, own, 7)
    return Ground(scene, where, true.ravel()[where], at, rays)


def window(true: np.ndarray, size: int) -> tuple[slice, slice]:
    """The square of an image with the most penumbra in it, most of it ground."""
    change = np.nan_to_num(true * (1.0 - true)) - 0.25 * np.isnan(true)
    total = np.pad(np.cumsum(np.cumsum(change, 0), 1), ((1, 0), (1, 0)))
    sums = total[size:, size:] - total[:-size, size:] - total[size:, :-size] + total[:-size, :-size]
    i, j = np.unravel_index(np.argmax(sums), sums.shape)
    return slice(i, i + size), slice(j, j + size)
