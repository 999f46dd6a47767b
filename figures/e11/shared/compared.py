"""Shared rays beside stratified ones on E11's scenes: what Figs. 1, 12, 13, 14 measure.

Errors are counted over pixels of the ground, as shares of the unshadowed light. Effective rays are
counted over the ground's penumbra. Times are those of the processor, all its cores together.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from figures.e11.shared import space
from figures.e11.shared.measures import EqualRays, Errors, effective, equal_rays, errors
from figures.style import Claim
from firstorder.shadowfield.rendering._filter_shape import filter_shape
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow

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
        rays: of all kinds, for each pixel that shows something.
        floor_rays: the same, of the ground's pixels alone.
        tracing, filtering: processor time [s].
    """

    visible: np.ndarray
    samples: np.ndarray
    near: np.ndarray
    far: np.ndarray
    own: np.ndarray
    table: RayTable
    rays: float
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
    """
    floor, lamp = scene.floor, scene.lamp
    points, extent = scene.receivers[floor], float(np.max(lamp.half))
    Omega_y = 0.5 * band / extent
    clock = [time.process_time()]
    table, _ = trace_shadow_rays(lamp, points, rays, scene.blockers, seed)
    clock.append(time.process_time())
    near, far = blocker_depths(lamp, table, points, scene.pixel)
    if radius:
        near, far = space.smoothed_bounds(scene, floor, (near, far), radius)
    shape = filter_shape(lamp.local(points)[:, 2], near, far, Omega_y, scene.pixel, extent)
    clock.append(time.process_time())
    by_own = np.full(scene.side**2, np.nan)
    objects = scene.shown & ~floor
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
    count = len(table.near) + (len(among) + len(none)) * own[0] + objects.sum() * own[1]
    images = (found.samples, found.near, found.far, found.own)
    return Shared(
        scene.picture(visible),
        *(scene.picture(a, floor) for a in images),
        table,
        float(count / scene.shown.sum()),
        float(len(table.near) + (len(among) + len(none)) * own[0]) / floor.sum(),
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
        speedup: time of those over that of the shared rays.
    """

    found: Shared
    off: Errors
    effective: float
    equal: EqualRays
    speedup: float


def judged(
    scene: space.Scene, true: np.ndarray, plain: Stratified, rays: float, band: float, **options
) -> Judged:
    """Renders the ground with shared rays and compares it."""
    floor = ground_of(scene)
    found = shared(scene, rays, band, **options)
    off = errors(found.visible, true, floor)
    equal = equal_rays(COUNTS, plain.rms, off.rms)
    mean = effective(np.nan_to_num(found.samples), np.where(floor, true, 0.0))
    spent = found.tracing + found.filtering
    return Judged(found, off, mean, equal, equal.rays * plain.seconds / spent)


def warm() -> None:
    """Compiles what `judged` runs, so that no time counts it."""
    scene = space.grids(16)
    shared(scene, 1.0, 1.0, own=(4, 0))


def error_claims(rays: float, one: Judged, largest: str | None = None) -> list[Claim]:
    """RMS, 99th percentile and maximum, and stratified rays of equal RMS.

    Args:
        rays: shared ones for each pixel.
        one: by these.
        largest: the paper's word on the largest error, "6" for "below 6 %".
    """
    at = f"at {rays:g} shared ray{'s' if rays != 1 else ''} a pixel"
    most = 100.0 * one.off.largest
    return [
        Claim(f"RMS error {at}", None, 100.0 * one.off.rms, "% of light"),
        Claim(
            f"99th percentile of the error {at}", None, 100.0 * one.off.percentile99, "% of light"
        ),
        Claim(
            f"Largest error {at}",
            None if largest is None else f"below {largest}",
            most,
            "% of light",
            None if largest is None else most < float(largest),
        ),
        Claim(
            f"Stratified rays of equal RMS {at}, and rays of all kinds it took",
            None,
            f"{one.equal.text} and {one.found.floor_rays:.3g}",
            "rays a pixel",
        ),
    ]
