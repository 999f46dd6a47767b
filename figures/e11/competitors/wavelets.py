r"""An image from samples that go where wavelets say noise is: after Overbeck et al. 2009.

A picture of means of samples, and the variance of each mean, are taken apart by a wavelet. Pixels
are independent and the transform is linear, `c = sum_p a_p f_p`, so a coefficient's variance is
`s^2 = sum_p a_p^2 v_p`: exact, at every level, for independent samples of known variance. Means of
samples that are evenly spread have less: of an additive sequence over a lamp 0.39, 0.31 and 0.19 of
it at 4, 8 and 32 samples. Coefficients are then shrunk more than they need be.

**Reconstruction** shrinks what may be noise: `c max(0, 1 - t^2 s^2 / c^2)` with t = 2, which takes
noise out whole and leaves what stands out nearly as it is (the non-negative garrote, between hard
and soft thresholds; Overbeck et al. shrink by standard deviations too). As samples are added s
goes to zero and the picture to the mean of all samples: there is no bias that stays.

**Where to sample.** A coefficient that is kept has an error of variance s^2, one that is shrunk
away has its own square, which samples do not change. With `keep = c^2 / (c^2 + s^2)` one more
sample at p of variance sigma_p^2 lowers the image's squared error by

    priority(p) = sigma_p^2 / (n_p (n_p + 1)) sum_c keep_c a_cp^2

so that smooth penumbrae are content with few samples in each pixel, edges and texture are not.

The wavelet is Cohen, Daubechies and Feauveau's 9/7 as in Overbeck et al.: its four vanishing
moments make few coefficients of a smooth penumbra, and it shows no blocks; nearly orthonormal, it
makes the sum of squares above nearly right. All is NumPy, for samples come from the host.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.ndimage
from jaxtyping import Float, Int

from firstorder._argument_checks import check_not_negative, check_positive

# Lifting steps of the 9/7 wavelet, and the scale that makes low passes of ones sqrt(2).
LIFT = (-1.586134342059924, -0.052980118572961, 0.882911075530934, 0.443506852043971)
SCALE = 1.149604398860241
SPREAD = 1.5  # pixels over which the samples' variance is averaged

Picture = Float[np.ndarray, "w h"]


# --- the transform -------------------------------------------------------------------------------


@functools.cache
def step_matrix(n: int) -> np.ndarray:
    """One level of the 9/7 analysis of n values, mirrored at the ends: n/2 low rows, then n/2 high.

    Raises:
        ValueError: if n is odd.

    Example:
        >>> import numpy as np
        >>> from figures.e11.competitors.wavelets import step_matrix
        >>> (step_matrix(8) @ np.ones(8)).round(6).tolist()  # sqrt(2), and nothing above the mean
        [1.414214, 1.414214, 1.414214, 1.414214, -0.0, -0.0, -0.0, -0.0]
    """
    check_positive("n", n)
    if n % 2:
        raise ValueError(f"Argument `n` must be even, but is {n}.")
    A = np.eye(n)
    for k, lift in enumerate(LIFT):
        own = np.arange(1 - k % 2, n, 2)
        before, after = abs(own - 1), own + 1
        after = np.where(after < n, after, 2 * (n - 1) - after)  # mirrored, the end not twice
        A[own] = A[own] + lift * (A[before] + A[after])
    return np.concatenate([SCALE * A[0::2], A[1::2] / SCALE])


class Axis(NamedTuple):
    """All levels along one axis.

    Attributes:
        low: matrices from n values to those of a level, the first the identity.
        high: from n values to the details of a level.
        back: from a level's low and high values to the level before.
    """

    low: tuple[np.ndarray, ...]
    high: tuple[np.ndarray, ...]
    back: tuple[np.ndarray, ...]


@functools.cache
def _axis(n: int, levels: int) -> Axis:
    low, high, back = [np.eye(n)], [], []
    for level in range(levels):
        half = n >> (level + 1)
        step = step_matrix(n >> level)
        high.append(step[half:] @ low[-1])
        low.append(step[:half] @ low[-1])
        back.append(np.linalg.inv(step))
    return Axis(tuple(low), tuple(high), tuple(back))


class Bands(NamedTuple):
    """A picture in wavelets, or the coefficients' variances.

    Attributes:
        rest: the coarsest low pass.
        details: of each level, finest first: low-high, high-low, high-high.
    """

    rest: np.ndarray
    details: tuple[tuple[np.ndarray, ...], ...]


def levels_of(shape: tuple[int, ...], least: int = 8) -> int:
    """How often both sides can be halved and stay at least `least`.

    Example:
        >>> from figures.e11.competitors.wavelets import levels_of
        >>> levels_of((256, 256)), levels_of((96, 48))
        (5, 2)
    """
    count = 0
    while all(n % 2 == 0 and n // 2 >= least for n in shape):
        shape, count = tuple(n // 2 for n in shape), count + 1
    return count


def decompose(picture: Picture, power: int = 1) -> Bands:
    """Coefficients `c = sum_p a_p f_p`; with power 2, `sum_p a_p^2 v_p`: variances from variances.

    Sides are halved while they are even and stay at least 8.

    Example:
        >>> import numpy as np
        >>> from figures.e11.competitors.wavelets import decompose
        >>> bands = decompose(np.ones((16, 16)))
        >>> bands.rest.shape, bands.rest[0, 0].round(6).item()
        ((8, 8), 2.0)
    """
    rows, columns = _both(picture.shape)
    details = tuple(
        tuple((a**power) @ picture @ (b**power).T for a, b in pairs)
        for pairs in _pairs(rows, columns)
    )
    rest = (rows.low[-1] ** power) @ picture @ (columns.low[-1] ** power).T
    return Bands(rest, details)


def recompose(bands: Bands) -> Picture:
    """The picture of coefficients: the inverse of `decompose`."""
    scale = 2 ** len(bands.details)
    rows, columns = _both((bands.rest.shape[0] * scale, bands.rest.shape[1] * scale))
    picture = bands.rest
    for level in reversed(range(len(bands.details))):
        lh, hl, hh = bands.details[level]
        whole = np.block([[picture, lh], [hl, hh]])
        picture = rows.back[level] @ whole @ columns.back[level].T
    return picture


def _both(shape) -> tuple[Axis, Axis]:
    count = levels_of(tuple(shape))
    return _axis(shape[0], count), _axis(shape[1], count)


def _pairs(rows: Axis, columns: Axis):
    """Of each level, the matrices from left and right: low-high, high-low, high-high."""
    for level, (a, b) in enumerate(zip(rows.high, columns.high, strict=True)):
        yield (rows.low[level + 1], b), (a, columns.low[level + 1]), (a, b)


def weight_of_pixels(kept: Bands, shape: tuple[int, int]) -> Picture:
    """`sum_c keep_c a_cp^2` at every pixel p: how much of its variance the picture keeps."""
    rows, columns = _both(shape)
    total = (rows.low[-1] ** 2).T @ kept.rest @ columns.low[-1] ** 2
    for pairs, details in zip(_pairs(rows, columns), kept.details, strict=True):
        for (a, b), keep in zip(pairs, details, strict=True):
            total = total + (a**2).T @ keep @ b**2
    return total


# --- what the samples say ------------------------------------------------------------------------


class Samples(NamedTuple):
    """Sums over the samples of each pixel.

    Attributes:
        number: of samples.
        total: of their values.
        square: of their values' squares.
    """

    number: Int[np.ndarray, "w h"]
    total: Picture
    square: Picture

    @property
    def mean(self) -> Picture:
        """Of each pixel's samples."""
        return self.total / self.number

    @property
    def variance(self) -> Picture:
        """Of a single sample: within pixels, averaged over a pixel's surroundings.

        A pixel's own few samples are often all alike where they should not be.
        """
        within = np.maximum(self.square - self.total**2 / self.number, 0.0)
        spare = scipy.ndimage.gaussian_filter(np.asarray(self.number - 1.0), SPREAD)
        return scipy.ndimage.gaussian_filter(within, SPREAD) / spare


def reconstructed(samples: Samples, threshold: float | int = 2.0) -> Picture:
    """The picture from samples: coefficients are shrunk by `threshold` standard deviations.

    Args:
        samples: at least two in each pixel.
        threshold: t; 0 leaves the mean of the samples.

    Raises:
        ValueError: if the threshold is negative, or a pixel has fewer samples or no finite sum.

    Reference: Overbeck, Donner and Ramamoorthi 2009, §5.
    """
    check_not_negative("threshold", threshold)
    found, noise = _taken_apart(samples)
    details = tuple(
        tuple(_shrunk(c, v, threshold) for c, v in zip(level, spread, strict=True))
        for level, spread in zip(found.details, noise.details, strict=True)
    )
    return recompose(Bands(found.rest, details))


def _taken_apart(samples: Samples) -> tuple[Bands, Bands]:
    """Coefficients and their variances; one pixel that is no number would spread over them all."""
    if np.min(samples.number) < 2:
        raise ValueError("Argument `samples` must hold at least two samples in each pixel.")
    bad = ~(np.isfinite(samples.total) & np.isfinite(samples.square))
    if np.any(bad):
        raise ValueError(f"Argument `samples` must be finite, but {np.sum(bad)} pixels are not.")
    return decompose(samples.mean), decompose(samples.variance / samples.number, 2)


def _shrunk(c: np.ndarray, variance: np.ndarray, threshold: float | int) -> np.ndarray:
    least = threshold**2 * variance
    large = c**2 > least
    return np.where(large, c - least / np.where(large, c, 1.0), 0.0)


def priority(samples: Samples) -> Picture:
    """By how much one more sample in each pixel would lower the picture's squared error.

    Raises:
        ValueError: if a pixel has fewer than two samples or no finite sum.
    """
    found, noise = _taken_apart(samples)

    def keep(c, v):
        return c**2 / np.maximum(c**2 + v, np.finfo(float).tiny)

    kept = tuple(
        tuple(keep(c, v) for c, v in zip(level, spread, strict=True))
        for level, spread in zip(found.details, noise.details, strict=True)
    )
    weight = weight_of_pixels(
        Bands(np.ones_like(found.rest), kept),
        (samples.total.shape[0], samples.total.shape[1]),
    )
    return weight * samples.variance / (samples.number * (samples.number + 1.0))


# --- the renderer --------------------------------------------------------------------------------

Shade = Callable[[Int[np.ndarray, " n"], Int[np.ndarray, " n"]], Float[np.ndarray, " n"]]


def sample_image(
    shade: Shade,
    shape: tuple[int, int],
    total: int,
    first: int = 4,
    rounds: int = 12,
) -> Samples:
    """Samples of an image: a few in each pixel, the others where `priority` says.

    Each round hands out an equal share of what is left to the pixels of highest priority, at most
    as many to one of them as it has.

    Args:
        shade: one value for each pair of the number of a pixel (row by row: `i * h + j`) and the
            number of its sample; it must depend on nothing else.
        shape: pixels across and upwards.
        total: samples; exactly so many are made.
        first: for each pixel to begin with, at least two.
        rounds: in which the others are handed out.

    Raises:
        ValueError: if `first` is less than 2, `total` is less than the first samples, or a value is
            not finite.

    Reference: Overbeck, Donner and Ramamoorthi 2009, §4.

    Example:
        >>> import numpy as np
        >>> from figures.e11.competitors.wavelets import reconstructed, sample_image
        >>> ramp = lambda pixel, number: pixel // 16 / 16.0
        >>> samples = sample_image(ramp, (16, 16), 1100)
        >>> int(samples.number.sum()), reconstructed(samples)[4, 4].round(9).item()
        (1100, 0.25)
    """
    pixels = shape[0] * shape[1]
    if first < 2:
        raise ValueError(f"Argument `first` must be at least 2, but is {first}.")
    if total < first * pixels:
        raise ValueError(
            f"Argument `total` must be at least {first * pixels}, `first` for each pixel, but is "
            f"{total}."
        )
    check_positive("rounds", rounds)
    zero = np.zeros(shape)
    samples = Samples(np.zeros(shape, int), zero, zero)
    samples = _with(samples, shade, np.full(pixels, first))
    left = total - first * pixels
    for k in range(rounds):
        if left:
            more = _handed_out(samples, -(-left // (rounds - k)))
            samples = _with(samples, shade, more)
            left -= int(more.sum())
    return samples


def _handed_out(samples: Samples, share: int) -> Int[np.ndarray, " n"]:
    """How many samples each pixel gets: as if given one by one to whatever gains most.

    `priority ~ 1 / (n (n + 1))`, so what a pixel gains when it goes on from any number of samples
    is known; a threshold on the gain that hands out the right number is found by halving.
    """
    n = samples.number.ravel().astype(float)
    gain = np.maximum(priority(samples).ravel(), 0.0) * n * (n + 1.0)
    # Where nothing varies there is nothing to choose by: all pixels in turn.
    gain = np.maximum(gain, 1e-12 * gain.max()) if gain.max() > 0.0 else np.ones_like(n)

    def given(threshold: float) -> np.ndarray:
        # The largest number m with (m - 1) m <= gain / threshold, which is what the last of them
        # gains, from n up to twice as many.
        m = np.floor(np.sqrt(0.25 + gain / threshold) + 0.5)
        return np.clip(m - n, 0.0, n).astype(int)

    low, high = 1e-30 * gain.max(), gain.max()
    for _ in range(120):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if given(middle).sum() > share else (low, middle)
    more = given(high)
    short = share - int(more.sum())
    # Ties: those that gain most of one more, in the order of their numbers.
    order = np.argsort(-gain / ((n + more) * (n + more + 1.0)), kind="stable")
    more += np.bincount(np.resize(order, short), minlength=len(more))
    return more


def _with(samples: Samples, shade: Shade, more: Int[np.ndarray, " n"]) -> Samples:
    """The samples and further ones, so many in each pixel."""
    pixel = np.repeat(np.arange(len(more)), more)
    begun = np.repeat(np.cumsum(more) - more, more)
    number = np.repeat(samples.number.ravel(), more) + np.arange(len(pixel)) - begun
    values = shade(pixel, number)
    if not np.all(np.isfinite(values)):
        bad = values[~np.isfinite(values)][0]
        raise ValueError(f"Argument `shade` must give finite values, but gave {bad}.")
    shape = samples.number.shape
    sums = [np.bincount(pixel, a, len(more)).reshape(shape) for a in (values, values**2)]
    return Samples(
        samples.number + more.reshape(shape), samples.total + sums[0], samples.square + sums[1]
    )


__all__ = [
    "Bands",
    "Samples",
    "decompose",
    "levels_of",
    "priority",
    "recompose",
    "reconstructed",
    "sample_image",
    "step_matrix",
    "weight_of_pixels",
]
