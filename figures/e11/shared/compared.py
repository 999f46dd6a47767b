"""Shared rays beside stratified ones on E11's scenes: what Figs. 1, 12, 13, 14 measure.

Errors are counted over pixels of the ground, as shares of the unshadowed light. Effective rays are
counted over the ground's penumbra. Times are those of the processor, all its cores together.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from figures import timing
from figures.e11.shared import space
from figures.e11.shared.measures import EqualRays, Errors, effective, equal_rays, errors
from figures.verdicts import Measurement
from firstorder.shadowfield.rendering._filter_shape import filter_shape
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays
from firstorder.shadowfield.rendering.sheared_filter import depths_under_filter, sheared_shadow

COUNTS = (1, 4, 16, 64, 256)  # stratified rays of the curve
PAPER_RAYS = 637_000  # in the table of the paper's Fig. 1


class Shared(NamedTuple):
    """An image by shared rays, and what it took; all but the first are NaN off the ground.

    Attributes:
        visible: share of the lamp.
        samples: effective number of rays.
        near, far: bounds of the blockers' depths [m].
        own: share of own rays in the result.
        table: the shared rays.
        floor_rays: of all kinds, for each pixel of the ground.
        tracing, filtering: processor time [s].
    """

    visible: np.ndarray
    samples: np.ndarray
    near: np.ndarray
    far: np.ndarray
    own: np.ndarray
    table: RayTable
    floor_rays: float
    tracing: float
    filtering: float


def shared(
    scene: space.Scene,
    rays: float,
    band: float,
    own: tuple[int, int] = (64, 4),
    seed: int = 0,
    radius: int = 0,
    cells: int = 4,
    judged: np.ndarray | None = None,
    under: bool = False,
) -> Shared:
    """Shadows from few rays that all pixels of the ground share, as E11 §6.2 has it.

    Shared rays start on the ground, and objects' own pixels have own rays and share none: that is
    better, see `e11.shared.space`.

    Args:
        scene: the scene.
        rays: shared ones for each pixel of the ground.
        band: light band limit [wavelengths per side of the lamp].
        own: own rays of pixels of the ground among blockers, at least one, and of all pixels of
            objects; 0 of these for none, then objects are NaN.
        seed: of the random numbers.
        radius: over which bounds are smoothed [pixels]; 0 for not.
        cells: along each edge of the lamp.
        judged: mask of the pixels of the ground that are answered, all by default; where it is
            given no object is.
        under: whether bounds are those under the filter (`depths_under_filter`), ours, in place of
            those of the pixel.
    """
    lamp, floor = scene.lamp, scene.floor if judged is None else scene.floor & judged
    points, extent = scene.receivers[floor], float(np.max(lamp.half))
    Omega_y = 0.5 * band / extent
    clock = [time.process_time()]
    table, _ = trace_shadow_rays(lamp, scene.receivers[scene.floor], rays, scene.blockers, seed)
    clock.append(time.process_time())
    if under:
        near, far = depths_under_filter(lamp, table, points, Omega_y, scene.pixel)
    else:
        near, far = blocker_depths(lamp, table, points, scene.pixel)
    if radius:
        near, far = space.smoothed_bounds(scene, floor, (near, far), radius)
    shape = filter_shape(lamp.local(points)[:, 2], near, far, Omega_y, scene.pixel, extent)
    clock.append(time.process_time())
    by_own = np.full(scene.side**2, np.nan)
    objects = scene.shown & ~scene.floor & (judged is None)
    among = np.flatnonzero(floor)[shape.touched > 0.0]
    by_own[among] = space.own_rays(scene, among, own[0], [seed, 1])
    if own[1]:
        by_own[objects] = space.own_rays(scene, objects, own[1], [seed, 2])
    clock.append(time.process_time())
    known = np.nan_to_num(by_own[floor])
    options = dict(cells=cells, falloff=space.falloff, bounds=(near, far))
    found = sheared_shadow(lamp, table, points, Omega_y, scene.pixel, known, **options)
    clock.append(time.process_time())
    # Where no ray came by, there are own ones after all.
    none = np.flatnonzero(floor)[(found.own == 1.0) & np.isnan(by_own[floor])]
    by_own[none] = space.own_rays(scene, none, own[0], [seed, 3])
    clock.append(time.process_time())
    visible = by_own.copy()
    visible[floor] = np.where(found.own == 1.0, by_own[floor], found.visible)
    spent = np.diff(clock)
    own_ones = (len(among) + len(none)) * own[0]
    images = (found.samples, found.near, found.far, found.own)
    return Shared(
        scene.picture(visible),
        *(scene.picture(a, floor) for a in images),
        table,
        float(len(table.near) / scene.floor.sum() + own_ones / floor.sum()),
        float(spent[0] + spent[2] + spent[4]),
        float(spent[1] + spent[3]),
    )


class Stratified(NamedTuple):
    """Images by stratified rays, and their errors.

    Attributes:
        images: one for each of `COUNTS`, NaN off the ground.
        rms: of each.
        seconds: for a ray of all the ground's pixels together, at the largest count.
    """

    images: list[np.ndarray]
    rms: np.ndarray
    seconds: float

    def of(self, count: int) -> np.ndarray:
        """The image by so many rays."""
        return self.images[COUNTS.index(count)]


def stratified(scene: space.Scene, true: np.ndarray) -> Stratified:
    """Stratified rays on the ground, for each of `COUNTS`."""
    images, rms, spent = [], [], 0.0
    floor = ground_of(scene)
    for count in COUNTS:
        start = time.process_time()
        seen = space.own_rays(scene, scene.floor, count, [99, count])
        spent = time.process_time() - start
        images.append(scene.picture(seen, scene.floor))
        rms.append(errors(images[-1], true, floor).rms)
    return Stratified(images, np.array(rms), spent / COUNTS[-1])


def ground_of(scene: space.Scene) -> np.ndarray:
    """The mask of the ground, as an image."""
    return scene.picture(scene.floor) > 0.0


class Judged(NamedTuple):
    """Shared rays, judged.

    Attributes:
        found: images and times.
        off: errors on the ground.
        effective: mean number of rays in the ground's penumbra.
        equal: stratified rays of the same root mean square.
    """

    found: Shared
    off: Errors
    effective: float
    equal: EqualRays


def judged(
    scene: space.Scene, true: np.ndarray, plain: Stratified, rays: float, band: float, **options
) -> Judged:
    """Renders the ground with shared rays and compares it."""
    floor = ground_of(scene)
    found = shared(scene, rays, band, **options)
    off = errors(found.visible, true, floor)
    equal = equal_rays(COUNTS, plain.rms, off.rms)
    mean = effective(np.nan_to_num(found.samples), np.where(floor, true, 0.0))
    return Judged(found, off, mean, equal)


class Repeated(NamedTuple):
    """Shared rays with one seed after the other.

    Attributes:
        visible: of each seed, at the pixels that are judged.
        true: the reference there.
        effective: mean number of rays in the penumbra, of each seed.
    """

    visible: np.ndarray
    true: np.ndarray
    effective: np.ndarray

    @property
    def rms(self) -> np.ndarray:
        """Of each seed."""
        return np.sqrt(np.mean((self.visible - self.true) ** 2, 1))

    @property
    def largest(self) -> np.ndarray:
        """Error of each seed."""
        return np.max(abs(self.visible - self.true), 1)

    @property
    def noise(self) -> np.ndarray:
        """Of each seed: how far it is from the mean of all, which has what is common to them."""
        many = len(self.visible)
        off = self.visible - np.mean(self.visible, 0)
        return np.sqrt(np.mean(off**2, 1) * many / (many - 1))


def repeated(
    scene: space.Scene,
    true: np.ndarray,
    rays: float,
    band: float,
    seeds: int,
    where: np.ndarray,
    **options,
) -> Repeated:
    """Renders some pixels of the ground with several seeds, the first of which is 1.

    Args:
        scene: the scene, whose whole ground traces rays.
        true: the reference, an image.
        rays: shared ones for each pixel of the ground.
        band: light band limit [wavelengths per side of the lamp].
        seeds: how many.
        where: mask of the pixels that are judged, as far as they show the ground.
        **options: of `shared`.
    """
    some = scene.floor & where
    at = true.ravel()[some]
    answers, counts = [], []
    for seed in range(1, seeds + 1):
        found = shared(scene, rays, band, seed=seed, judged=some, **options)
        answers.append(found.visible.ravel()[some])
        counts.append(effective(found.samples.ravel()[some], at))
    return Repeated(np.array(answers), at, np.array(counts))


def stratified_rms(
    scene: space.Scene, some: Repeated, where: np.ndarray, counts: tuple[int, ...] = COUNTS
) -> np.ndarray:
    """RMS errors of stratified rays at the same pixels, (seeds, counts): new ones for each seed."""
    judged = scene.floor & where
    rows = [
        [space.own_rays(scene, judged, count, [97, seed, count]) - some.true for count in counts]
        for seed in range(len(some.visible))
    ]
    return np.sqrt(np.mean(np.square(rows), -1))


def equal_stratified(some: Repeated, rms: np.ndarray, counts: tuple[int, ...] = COUNTS):
    """Stratified rays of the error of shared ones at the same pixels, by seed.

    Their errors are those of `stratified_rms`: both ways have chance in them.
    """
    pairs = zip(rms, some.rms, strict=True)
    return np.array([equal_rays(counts, row, e).rays for row, e in pairs])


def speedup(
    scene: space.Scene, equal: tuple[float, float], rays: float, band: float, rounds: int = 4
) -> timing.Ratio:
    """Time of `equal` stratified rays a pixel of the ground over that of shared ones.

    Both are called in turns. Stratified rays take their time one by one, so that 16 are timed.

    Args:
        scene: the scene.
        equal: stratified rays of equal error, and the standard error of their number.
        rays: shared ones for each pixel of the ground.
        band: light band limit [wavelengths per side of the lamp].
        rounds: how often.
    """
    return at_equal_error(timing.ratio(*both_ways(scene, rays, band), rounds), equal)


def both_ways(scene: space.Scene, rays: float, band: float):
    """Calls whose times are compared: 16 stratified rays a pixel of the ground, and shared ones."""
    return (
        lambda: space.own_rays(scene, scene.floor, 16, 98),
        lambda: shared(scene, rays, band, (64, 0)).visible,
    )


def at_equal_error(found: timing.Ratio, equal: tuple[float, float]) -> timing.Ratio:
    """The ratio of `both_ways`, for as many stratified rays as have the error of shared ones."""
    mean = found.mean * equal[0] / 16.0
    return timing.Ratio(mean, mean * float(np.hypot(found.error / found.mean, equal[1] / equal[0])))


def warm() -> None:
    """Compiles what `judged` runs, so that no time counts it."""
    scene = space.grids(16)
    shared(scene, 1.0, 1.0, own=(4, 0))


def error_measurements(rays: float, one: Judged) -> list[Measurement]:
    """RMS, 99th percentile and maximum, and stratified rays of equal RMS.

    Args:
        rays: shared ones for each pixel.
        one: by these.
    """
    at = f"at {rays:g} shared ray{'s' if rays != 1 else ''} a pixel"
    parts = (("RMS error", one.off.rms), ("99th percentile of the error", one.off.percentile99))
    return [
        *(Measurement(f"{name} {at}", 100.0 * e, "% of light") for name, e in parts),
        Measurement(f"Largest error {at}", 100.0 * one.off.largest, "% of light"),
        Measurement(
            f"Stratified rays of equal RMS {at}, and rays of all kinds it took",
            f"{one.equal.text} and {one.found.floor_rays:.3g}",
            "rays a pixel",
        ),
    ]
