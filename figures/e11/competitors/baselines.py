r"""What sheared filters are compared with: stratified rays of a pixel's own, and axis-aligned ones.

All answer with the share of the lamp that is seen, weighed by its falloff, `int l f dy / int l dy`.

**Stratified rays.** Places on the lamp, one in each of a x b equal strata of the unit square,
warped so that they are as dense as the light is bright: the mean over rays is unbiased.

**Axis-aligned filter** (E11's simple filter made as narrow as the blockers allow; Mehta et al.
2012). In the lamp's frame visibility over (x, y) has its energy between the lines

    Omega_y = (d1/d2_max - 1) Omega_x   and   Omega_y = (d1/d2_min - 1) Omega_x

cut at the light's band limit |Omega_y| <= Omega_y_max. The box that covers this wedge reaches to

    Omega_x_max = Omega_y_max / (d1/d2_max - 1) = Omega_y_max d2_max / (d1 - d2_max)

along x, where the sheared filter is `W = Omega_y_max (1/a - 1/b)` wide. With the same Gaussian in
place of a box of full width W, `sigma = 1 / (pi W)`, that is `sigma = 1 / (2 pi Omega_x_max)`: the
last blocker alone decides, and a single depth gains nothing. Without a shear the lamp can be
integrated first, so that only the image is filtered, along columns and then along rows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.ndimage
from jaxtyping import Bool, Float, Int

from firstorder._argument_checks import check_positive
from firstorder.shadowfield.rendering.lamp import LampFrame
from firstorder.shadowfield.rendering.ray_table import ADDITIVE, Blockers, Plane, RayTable

TABLE = 256  # cells along each edge of the lamp in which the falloff is inverted
CHUNK = 1 << 20  # rays at once
EXPONENTS = 1 << 22  # of the filter at once

Falloff = Callable[[Plane], Float[np.ndarray, " n"]]
Numbers = Float[np.ndarray, " n"]
Picture = Float[np.ndarray, "w h"]


# --- places on the lamp --------------------------------------------------------------------------


def strata(count: int) -> tuple[int, int]:
    """A x b cells for a number of rays, as square as its divisors allow, a <= b.

    Example:
        >>> from figures.e11.competitors.baselines import strata
        >>> strata(2048), strata(7)
        ((32, 64), (1, 7))
    """
    check_positive("count", count)
    a = next(k for k in range(int(np.sqrt(count)), 0, -1) if count % k == 0)
    return a, count // a


def on_lamp(u: Plane, falloff: Falloff | None = None) -> Plane:
    """Places in [-1, 1]^2, as dense as the light is bright, from places in the unit square.

    The light is taken for constant in each of 256 x 256 cells; neighbours stay neighbours, so
    that strata stay strata.

    Args:
        u: uniform in [0, 1)^2.
        falloff: of the light, from places in [-1, 1]^2; None for a constant.

    Raises:
        ValueError: if the light is negative or dark everywhere.

    Example:
        >>> import numpy as np
        >>> from figures.e11.competitors.baselines import on_lamp
        >>> on_lamp(np.array([[0.5, 0.25]])).tolist()
        [[0.0, -0.5]]
    """
    if falloff is None:
        return 2.0 * u - 1.0
    x = (2.0 * np.arange(TABLE) + 1.0) / TABLE - 1.0
    places = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    light = np.asarray(falloff(places), float).reshape(TABLE, TABLE)
    if np.any(light < 0.0) or not np.sum(light) > 0.0:
        raise ValueError("Argument `falloff` must be positive somewhere and negative nowhere.")
    sums = np.concatenate([[0.0], np.cumsum(light.sum(1))])
    i, s = _inverted(sums[None], u[:, 0], np.zeros(len(u), int))
    rows = np.concatenate([np.zeros((TABLE, 1)), np.cumsum(light, 1)], 1)
    j, t = _inverted(rows, u[:, 1], i)
    return 2.0 * np.stack([i + s, j + t], 1) / TABLE - 1.0


def _inverted(sums, u: Numbers, row) -> tuple[np.ndarray, Numbers]:
    """In which cell of its row each share of the row's sum falls, and how far into it."""
    shares = np.arange(len(sums))[:, None] + sums / np.maximum(sums[:, -1:], np.finfo(float).tiny)
    k = np.searchsorted(shares[:, 1:].ravel(), row + u, side="right")
    k = np.minimum(k - row * (sums.shape[1] - 1), sums.shape[1] - 2)
    low, high = shares[row, k], shares[row, k + 1]
    some = high > low
    within = np.where(some, (row + u - low) / np.where(some, high - low, 1.0), 0.5)
    return k, np.clip(within, 0.0, 1.0)


# --- stratified rays -----------------------------------------------------------------------------


def stratified(
    lamp: LampFrame,
    receivers: Float[np.ndarray, "m 3"],
    rays: int,
    blockers: Blockers,
    seed: int | list[int] = 0,
    falloff: Falloff | None = None,
    warp: Callable[[Plane], Plane] | None = None,
) -> Numbers:
    """The share of the lamp that each receiver sees, by rays of its own in strata: unbiased.

    The error falls with the number of rays to the power of -3/4 where few straight edges cross
    the lamp (a share ~ n^(-1/2) of the strata is cut, each errs by ~ 1/n), and of -1/2 while
    strata are larger than the blockers' details.

    Args:
        lamp: the lamp.
        receivers: in the world [m].
        rays: for each receiver; a number with two near divisors stratifies best (`strata`).
        blockers: as `rays.trace` wants them.
        seed: of the random numbers, one or several as `numpy` takes them.
        falloff: of the light, from places in [-1, 1]^2; None for a constant.
        warp: what makes places in [-1, 1]^2 as dense as the light of those in the unit square, for
            who has a quicker one than `on_lamp` of the falloff.

    Raises:
        ValueError: if there is no ray.

    Reference: E11 §6; Mitchell 1996 for the powers.

    Example:
        >>> import numpy as np
        >>> from figures.e11.competitors.baselines import stratified
        >>> from firstorder.shadowfield.rendering.lamp import lamp_frame
        >>> lamp = lamp_frame((0, 0, 2), (0, 1, 0), (1, 0, 0))
        >>> def left_half(a, b):  # a sheet close to the lamp
        ...     hit = b[:, 0] < 0
        ...     return np.where(hit, 0.01, np.inf), np.where(hit, 0.01, -np.inf)
        >>> stratified(lamp, np.zeros((1, 3)), 64, left_half).tolist()
        [0.5]
    """
    a, b = strata(rays)
    rng = np.random.default_rng(seed)
    cells = np.stack(np.meshgrid(np.arange(a), np.arange(b), indexing="ij"), -1).reshape(-1, 2)
    receivers = np.asarray(receivers, float)
    seen, step = np.empty(len(receivers)), max(CHUNK // rays, 1)
    for begin in range(0, len(receivers), step):
        some = receivers[begin : begin + step]
        u = (cells + rng.random((len(some), rays, 2))) / (a, b)
        u = u.reshape(-1, 2)
        y = (on_lamp(u, falloff) if warp is None else warp(u)) * lamp.half
        ends = lamp.world(np.concatenate([y, np.zeros((len(y), 1))], 1))
        first, _ = blockers(np.repeat(some, rays, 0), ends)
        seen[begin : begin + step] = np.mean(np.isinf(first).reshape(-1, rays), 1)
    return seen


def own_rays(
    lamp: LampFrame,
    receivers: Float[np.ndarray, "m 3"],
    blockers: Blockers,
    seed: int = 0,
    falloff: Falloff | None = None,
) -> Callable[[np.ndarray, np.ndarray], Numbers]:
    """Shadow rays one at a time, for those who decide later how many each receiver gets.

    The k-th ray of a receiver goes to the k-th place of an additive sequence over the lamp,
    shifted by random numbers of the receiver's own: unbiased, and as it depends on nothing else,
    the same whatever was asked before.

    Args:
        lamp: the lamp.
        receivers: in the world [m].
        blockers: as `rays.trace` wants them.
        seed: of the shifts.
        falloff: of the light, from places in [-1, 1]^2; None for a constant.

    Returns:
        From numbers of receivers and numbers of their rays to 1 for free and 0 for hidden, as
        `figures.e11.competitors.wavelets.sample_image` asks.

    Example:
        >>> import numpy as np
        >>> from figures.e11.competitors.baselines import own_rays
        >>> from firstorder.shadowfield.rendering.lamp import lamp_frame
        >>> def nothing(a, b):
        ...     return np.full(len(a), np.inf), np.full(len(a), -np.inf)
        >>> lamp = lamp_frame((0, 0, 2), (0, 1, 0), (1, 0, 0))
        >>> own_rays(lamp, np.zeros((1, 3)), nothing)(np.zeros(2, int), np.arange(2)).tolist()
        [1.0, 1.0]
    """
    shift = np.random.default_rng(seed).random((len(receivers), 2))

    def shade(receiver, number):
        found = np.empty(len(receiver))
        for begin in range(0, len(receiver), CHUNK):
            some = slice(begin, begin + CHUNK)
            u = np.mod(shift[receiver[some]] + number[some, None] * ADDITIVE, 1.0)
            y = on_lamp(u, falloff) * lamp.half
            ends = lamp.world(np.concatenate([y, np.zeros((len(y), 1))], 1))
            found[some] = np.isinf(blockers(receivers[receiver[some]], ends)[0])
        return found

    return shade


# --- the axis-aligned filter ---------------------------------------------------------------------


class PixelSums(NamedTuple):
    """What each pixel's own rays say; sums, so that pixels of any number of rays add up.

    Attributes:
        seen: of the light where rays are free.
        weight: of the light of all rays; 0 without rays.
        squares: of the light's square, of all rays.
    """

    seen: Numbers
    weight: Numbers
    squares: Numbers

    @property
    def mean(self) -> Numbers:
        """The share seen by each pixel's own rays, 1 where there are none."""
        some = self.weight > 0.0
        return np.where(some, self.seen / np.where(some, self.weight, 1.0), 1.0)


def pixel_sums(
    lamp: LampFrame,
    table: RayTable,
    owner: Int[np.ndarray, " n"],
    count: int,
    falloff: Falloff | None = None,
) -> PixelSums:
    """Adds up rays by receiver, each as its place on the lamp is bright.

    Args:
        lamp: the lamp.
        table: the rays.
        owner: of which receiver each is, as `rays.trace` says.
        count: of receivers.
        falloff: of the light, from places in [-1, 1]^2; None for a constant.
    """
    light = np.ones(len(owner)) if falloff is None else falloff(table.y / lamp.half)
    parts = (light * table.free, light, light**2)
    return PixelSums(*(np.bincount(owner, a, count) for a in parts))


def axis_aligned_sigma(
    d1: Float[np.ndarray, "*n"],
    far: Float[np.ndarray, "*n"],
    Omega_y: float | int,
    pixel: float | int,
) -> Float[np.ndarray, "*n"]:
    """Width of the axis-aligned filter: `sigma = (d1/d2_max - 1) / (2 pi Omega_y)` [m].

    Args:
        d1: depth of receivers below the lamp [m].
        far: depth of the last blockers before them, minus infinity for none [m].
        Omega_y: band limit on the lamp [cycles/m].
        pixel: side of a pixel on the receiver [m]; sigma is never below half of it.

    Returns:
        Infinity where nothing hides.

    Reference: Mehta, Wang and Ramamoorthi 2012, whose width has the same `d1/d2_max - 1`.

    Example:
        >>> import numpy as np
        >>> from figures.e11.competitors.baselines import axis_aligned_sigma
        >>> depth, none = 0.5 * np.ones(1), np.full(1, -np.inf)
        >>> axis_aligned_sigma(2 * depth, depth, 1 / (2 * np.pi), 0.01).tolist()
        [1.0]
        >>> axis_aligned_sigma(2 * depth, none, 1 / (2 * np.pi), 0.01).tolist()
        [inf]
    """
    check_positive("Omega_y", Omega_y)
    check_positive("pixel", pixel)
    some = np.isfinite(far)
    gap = d1 / np.where(some, far, 1.0) - 1.0
    return np.where(some, np.maximum(gap / (2.0 * np.pi * Omega_y), 0.5 * pixel), np.inf)


def axis_aligned(
    sums: PixelSums,
    position: Float[np.ndarray, "w h 3"],
    sigma: Picture,
    surface: Bool[np.ndarray, "w h"] | None = None,
) -> tuple[Picture, Picture]:
    """Averages pixels' own rays with their neighbours' on the receiver, in two passes.

        h(p) = sum_q w_pq seen_q / sum_q w_pq weight_q,   w = exp(-|x_p - x_q|^2 / 2 sigma_p^2)

    Along columns first, then along rows, each with the pixel's own sigma: 2 n^3 exponents for
    n x n pixels instead of n^4.

    Args:
        sums: by pixel, in the order of `position`.
        position: of the pixels on their receiver [m].
        sigma: width of the Gaussian at each pixel [m]; infinity where nothing hides.
        surface: pixels that show a receiver; all by default.

    Valid when: sigma changes slowly from pixel to pixel, and the image's axes are at right angles
    on the receiver; else the two passes are not the filter, and blur somewhat differently.

    Returns:
        The share of the lamp that is seen, 1 where nothing hides, NaN off the receivers and where
        no ray came by; and the effective number of rays, `(sum w)^2 / sum w^2`.

    Raises:
        ValueError: if a width on a receiver is not positive.

    Reference: E11 Fig. 5 (a); Mehta et al. 2012 for the two passes.
    """
    shape = sigma.shape
    ok = np.ones(shape, bool) if surface is None else np.asarray(surface, bool)
    if np.any(~(sigma[ok] > 0.0)):
        raise ValueError("Argument `sigma` must be positive where there is a receiver.")
    hides = ok & np.isfinite(sigma)
    place = np.where(ok[..., None], position, 0.0)
    width = _spread_over(sigma, hides)
    parts = [np.where(ok, np.reshape(a, shape), 0.0) for a in sums]
    for axis in (1, 0):
        parts = _pass(parts, place, width, ok, axis)
    seen, weight, squares = parts
    some = hides & (weight > 0.0)
    mean = np.where(some, seen / np.where(some, weight, 1.0), np.nan)
    count = np.where(some, weight**2 / np.where(some, squares, 1.0), 0.0)
    return np.where(ok & ~hides, 1.0, mean), count


def _spread_over(sigma: Picture, known) -> Picture:
    """Widths at all pixels: where there is none, that of the nearest pixel that has one.

    The first pass makes sums at every pixel that the second one reads.
    """
    if not np.any(known):
        return np.ones_like(sigma)
    nearest = scipy.ndimage.distance_transform_edt(
        ~known, return_distances=False, return_indices=True
    )
    return sigma[tuple(np.asarray(nearest))]


def _pass(parts, position, sigma, ok, axis: int) -> list[np.ndarray]:
    """One pass along an axis: sums with Gaussians of each pixel's width; squared for the last."""
    parts = [np.moveaxis(a, axis, 1) for a in parts]
    x, width, use = (np.moveaxis(a, axis, 1) for a in (position, sigma, ok))
    out = [np.empty_like(a) for a in parts]
    step = max(EXPONENTS // x.shape[1] ** 2, 1)
    for begin in range(0, len(x), step):
        rows = slice(begin, begin + step)
        far = np.sum((x[rows, :, None] - x[rows, None, :]) ** 2, -1)
        w = np.exp(-0.5 * far / width[rows, :, None] ** 2) * use[rows, None, :]
        for a, b, each in zip(out, parts, (w, w, w**2), strict=True):
            a[rows] = np.einsum("kij,kj->ki", each, b[rows])
    return [np.moveaxis(a, 1, axis) for a in out]


__all__ = [
    "PixelSums",
    "axis_aligned",
    "axis_aligned_sigma",
    "on_lamp",
    "own_rays",
    "pixel_sums",
    "strata",
    "stratified",
]
