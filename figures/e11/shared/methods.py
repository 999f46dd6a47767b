"""E11's shadows by several methods on the same scenes, with what each costs.

All answer for the pixels that show the ground with the share of the lamp that they see. Rays are
counted for each pixel of the ground, whatever they were traced for. Times are of the processor.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
import scipy.ndimage

from figures.e11.competitors import baselines, photons, wavelets
from figures.e11.shared import compared
from figures.e11.shared import space as e11
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays

OWN = 64  # rays of receivers among blockers, as E11 §6.2 has it
BAND, GROWTH = 2.0, 0.25  # cycles across the lamp at one ray a pixel; as this power of the rays
UNDER = 16  # rays a pixel from which bounds of depths look where filters look
NEAREST = 0.015  # k of photons over N^(2/3): the shadows of bars are narrow
MARGIN = 0.15  # by which photons reach farther than what is seen [m]


class Answer(NamedTuple):
    """What a method makes of a scene.

    Attributes:
        visible: at each pixel of the ground.
        samples: effective number of rays there.
        rays: that were traced for each of these pixels, in the mean.
        trace: time for the rays [s].
        filter: for the rest [s].
    """

    visible: np.ndarray
    samples: np.ndarray
    rays: float
    trace: float
    filter: float

    @property
    def seconds(self) -> float:
        """Both together."""
        return self.trace + self.filter


def band_of(scene: e11.Scene, rays: float) -> float:
    """Band limit on the lamp that rises with the rays [cycles/m].

    Noise goes as `Omega / sqrt(rays)`, what is cut off as Omega^(-3/2) or so: both vanish.
    """
    return BAND * rays**GROWTH / float(2.0 * np.max(scene.lamp.half))


def cells_of(rays: float) -> int:
    """Cells along each edge of the lamp: 4, and more when there are rays to fill them."""
    return 4 if rays <= 4 else 8 if rays <= 16 else 16


def warm() -> None:
    """Compiles what `ours` runs, so that no time counts it."""
    ours(e11.grids(16), 1)


def ours(
    scene: e11.Scene,
    rays: float,
    seed: int = 0,
    Omega_y: float | None = None,
    judged: np.ndarray | None = None,
    dense: float = 1.0,
) -> Answer:
    """Sheared filtering; receivers among the blockers get `OWN` rays besides.

    Args:
        scene: the scene.
        rays: shared ones for each pixel of the ground.
        seed: of the random numbers.
        Omega_y: band limit on the lamp; by default that of `band_of` [cycles/m].
        judged: mask of the pixels that are answered where they show the ground; all by default.
        dense: pixels of the image to a pixel of 256 x 256 of the same view, for which `band_of` and
            `cells_of` are made.
    """
    known, own = rays * dense, max(OWN, round(rays))
    limit = band_of(scene, known) if Omega_y is None else Omega_y
    band = 2.0 * float(np.max(scene.lamp.half)) * limit
    options = dict(cells=cells_of(known), judged=judged, under=known >= UNDER)
    found = compared.shared(scene, rays, band, (own, 0), seed, **options)
    some = scene.floor if judged is None else scene.floor & judged
    visible, samples, share = (a.ravel()[some] for a in (found.visible, found.samples, found.own))
    return Answer(visible, samples + share * own, found.floor_rays, found.tracing, found.filtering)


def axis_aligned(scene: e11.Scene, rays: float, seed: int = 0) -> Answer:
    """The axis-aligned filter on the same rays, depth bounds and band limit."""
    floor = np.flatnonzero(scene.floor)
    receivers = scene.receivers[floor]
    begin = time.process_time()
    table, owner = trace_shadow_rays(scene.lamp, receivers, rays, scene.blockers, seed)
    traced = time.process_time()
    _, far = blocker_depths(scene.lamp, table, receivers, scene.pixel)
    depth = scene.lamp.local(receivers)[:, 2]
    width = baselines.axis_aligned_sigma(depth, far, band_of(scene, rays), scene.pixel)
    sums = baselines.pixel_sums(scene.lamp, table, owner, len(floor), e11.falloff)
    shape = (scene.side, scene.side)
    image = [np.nan_to_num(scene.picture(a, floor)) for a in sums]
    sigma = np.where(scene.floor, scene.picture(width, floor).ravel(), np.inf).reshape(shape)
    position = scene.receivers.reshape(*shape, 3)
    found, samples = baselines.axis_aligned(
        baselines.PixelSums(*image), position, sigma, scene.floor.reshape(shape)
    )
    end = time.process_time()
    visible = np.nan_to_num(found.ravel()[floor], nan=float(sums.mean.mean()))
    count = len(owner) / len(floor)
    return Answer(visible, samples.ravel()[floor], count, traced - begin, end - traced)


def stratified(scene: e11.Scene, rays: int, seed: int = 0) -> Answer:
    """Stratified rays of each pixel's own."""
    floor = np.flatnonzero(scene.floor)
    begin = time.process_time()
    visible = e11.own_rays(scene, floor, rays, seed + 7919)
    seconds = time.process_time() - begin
    return Answer(visible, np.full(len(floor), float(rays)), float(rays), seconds, 0.0)


def by_photons(scene: e11.Scene, rays: float, seed: int = 0) -> tuple[Answer, photons.Photons]:
    """Photons on the plane of the ground, as many as `rays` for each pixel of it; and the map."""
    receivers = scene.receivers[scene.floor]
    low, high = receivers.min(0) - MARGIN, receivers.max(0) + MARGIN
    corner = np.array([low[0], low[1], receivers[:, 2].mean()])
    edges = np.array([(high[0] - low[0], 0.0, 0.0), (0.0, high[1] - low[1], 0.0)])
    count = round(rays * len(receivers))
    begin = time.process_time()
    sent = photons.shoot(scene.lamp, corner, edges, count, scene.hides, seed, e11.falloff)
    traced = time.process_time()
    k = max(round(NEAREST * count ** (2.0 / 3.0)), 8)
    visible = photons.shares(sent, receivers, k)
    end = time.process_time()
    samples = np.full(len(receivers), float(k))
    return Answer(visible, samples, rays, traced - begin, end - traced), sent


def by_wavelets(scene: e11.Scene, rays: int, seed: int = 0) -> tuple[Answer, np.ndarray]:
    """Adaptive wavelets, and how many rays each pixel of the image got.

    Pixels that do not show the ground stand for the nearest one that does, for a wavelet knows no
    holes; their rays count as well.
    """
    shape = (scene.side, scene.side)
    floor = scene.floor.reshape(shape)
    nearest = scipy.ndimage.distance_transform_edt(
        ~floor, return_distances=False, return_indices=True
    )
    stand = np.ravel_multi_index(np.asarray(nearest), shape).ravel()
    spent = [0.0]
    shade = baselines.own_rays(scene.lamp, scene.receivers[stand], scene.hides, seed, e11.falloff)

    def timed(pixel, number):
        begin = time.process_time()
        found = shade(pixel, number)
        spent[0] += time.process_time() - begin
        return found

    begin = time.process_time()
    total = rays * int(scene.floor.sum())
    first = 4 if total >= 4 * scene.side**2 else 2
    samples = wavelets.sample_image(timed, shape, total, first)
    visible = wavelets.reconstructed(samples).ravel()[scene.floor]
    rest = time.process_time() - begin - spent[0]
    count = samples.number.ravel()[scene.floor].astype(float)
    return Answer(visible, count, float(rays), spent[0], rest), samples.number
