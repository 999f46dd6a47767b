r"""Expected error of shared shadow rays, and the band limit Omega_y that makes it least.

**Noise.** A receiver's answer is a sum over cells of the lamp, each the weighed share p of free
rays among its part of n effective ones: a coin tossed n times (`_noise`). Rays that are spread
evenly do better than that, so that it is rather too large.

**Bias.** What the filter with band limit Omega_y leaves out is the energy outside of it. On the
lamp it blurs blockers at the ends of the depth range by a Gaussian, `T(u) = exp(-u^2 / 2)` at
`u = Omega / Omega_y` for each axis, hence for frequencies in the plane too. The answer at Omega_y
is off by the sum of all steps to twice the limit, and so at most by the sum of their sizes: all of
it for a single frequency; 1.06 times as much where power falls with Omega^-4, as shadows with kinks
do: those of edges under a lamp with edges. There each step is 2^-1.5 of the one before, which
stands for the steps that are not made. The size of a step can be measured: every second ray gives
one answer and the others another; the mean over neighbours of the product of their steps is that
size squared, if the noise of both is independent.

**Which it is not within one `trace_shadow_rays`.** Its feet are one additive sequence; each half of
it misses what the other half misses. On the fence of the tests, for limits of 1 to 16 cycles/m, 16
seeds:

    rays   measured over expected error, one trace   two traces, interleaved   RMS at 4 cycles/m
    1      .39 .36 .38 .79 .75 (bias .089 for .035)  .85 .87 1.1 1.4 1.2       .0268, .0567
    4      1.2 1.2 1.2 .82 .52                       .79 .75 .76 1.0 .84       .0223, .0244
    16     .88 .87 .93 1.2 .65                       .85 .83 .87 1.1 .62       .0223, .0221

For unbiased error estimates, trace half of the rays with each of two seeds and lay them side by
side (example at `band_limit_sweep`). Single runs of that scatter by a factor of two either way up
to 4 rays, and few rays from two sequences are noisier than those of one: RMS is twice as large at 1
ray, 1.1 times at 4 (1.5 times at 8 cycles/m), the same at 16.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy.ndimage
from jaxtyping import Float, Int

from firstorder._argument_checks import check_count, check_positive, check_shape
from firstorder._display import in_print
from firstorder.shadowfield.rendering._below import where_below
from firstorder.shadowfield.rendering._filter_shape import (
    cell_shares,
    filter_shape,
    or_lit,
    own_share,
)
from firstorder.shadowfield.rendering._weighted_sums import Sums, gather
from firstorder.shadowfield.rendering.depth_bounds import _check_each, _known_depths
from firstorder.shadowfield.rendering.lamp import LampFrame, _receiver_rows
from firstorder.shadowfield.rendering.ray_table import Plane, RayTable, _check_rays

STEP = 2.0**-1.5  # sizes of steps where power falls with Omega^-4

Numbers = Float[np.ndarray, " m"]
Rungs = Float[np.ndarray, "k m"]


class BandLimitSweep(NamedTuple):
    """Answers at several band limits from the same rays, and the expected error of each.

    NaN for receivers that are nowhere or not below the lamp.

    Attributes:
        limits: Omega_y, each twice the one before [cycles/m].
        visible: share of the lamp that is seen.
        noise: standard deviation of it.
        bias: root mean square of what the filter leaves out.
        samples: effective numbers of rays.
    """

    limits: Float[np.ndarray, " k"]
    visible: Rungs
    noise: Rungs
    bias: Rungs
    samples: Rungs

    __repr__ = in_print

    @property
    def error(self) -> Rungs:
        """Noise and bias together, as the root of their squares."""
        return np.hypot(self.noise, self.bias)

    @property
    def best(self) -> Int[np.ndarray, " m"]:
        """Number of the band limit with the least error at each receiver."""
        return np.argmin(self.error, 0)

    @property
    def best_of_all(self) -> int:
        """Number of the one with the least mean square over all receivers."""
        return int(np.argmin(np.nanmean(self.error**2, 1)))


class SelectedBandLimits(NamedTuple):
    """An image, each pixel at its own band limit.

    Attributes:
        visible: share of the lamp that is seen.
        error: expected root mean square error.
        limit: Omega_y [cycles/m].
    """

    visible: Numbers
    error: Numbers
    limit: Numbers

    __repr__ = in_print


def _free_probability(
    sums: Sums, before: Float[np.ndarray, "m c"] | None = None
) -> Float[np.ndarray, "m c"]:
    """Probability that a ray of each cell is free, with two more rays of `before` as prior.

    A few rays that agree promise no certainty.

    Args:
        sums: of rays.
        before: the same from a wider filter; by default of all the receiver's rays, and one free
            and one hidden ray more (Laplace's rule).
    """
    total = np.where(sums.total > 0.0, sums.total, 1.0)
    n = sums.samples[:, None]
    laplace = (n * (np.sum(sums.free, 1) / total)[:, None] + 1.0) / (n + 2.0)
    each = n * sums.mass / total[:, None]
    return (each * sums.seen + 2.0 * (laplace if before is None else before)) / (each + 2.0)


def _noise(sums: Sums, share: Float[np.ndarray, " c"], free: Float[np.ndarray, "m c"]) -> Numbers:
    """Standard deviation of the share of the lamp that is seen.

    `sum share^2 p (1 - p) / (n / cells)`: rays start everywhere on the lamp.

    Args:
        sums: of rays.
        share: of each cell in the light.
        free: how likely a ray of each cell is free (`_free_probability`).

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield.rendering.band_limit_choice import _noise, _free_probability
        >>> from firstorder.shadowfield.rendering._weighted_sums import Sums
        >>> coin = Sums(np.array([[100.0]]), np.array([[50.0]]), np.array([100.0]))
        >>> _noise(coin, np.ones(1), _free_probability(coin)).tolist()  # sqrt(1/4 / 100)
        [0.05]
    """
    variance = np.sum(share**2 * free * (1.0 - free), 1) * len(share)
    return np.sqrt(variance / np.maximum(sums.samples, 1.0))


def band_limit_sweep(
    lamp: LampFrame,
    table: RayTable,
    receivers: Float[np.ndarray, "m 3"],
    limits: Float[np.ndarray, " k"],
    pixel: float,
    fallback: Numbers,
    image: tuple[Int[np.ndarray, " m"], int],
    cells: int = 4,
    falloff: Callable[[Plane], Numbers] | None = None,
    bounds: tuple[Numbers, Numbers] | None = None,
    own_rays: float = np.inf,
    radius: float = 4.0,
) -> BandLimitSweep:
    """Answers of `sheared_shadow` at several band limits, with their expected errors.

    Args:
        lamp: the lamp.
        table: the rays.
        receivers: in the world [m].
        limits: Omega_y, each twice the one before, at least two [cycles/m].
        pixel: side of a pixel on the receivers [m].
        fallback: what to take among the blockers; elsewhere it may be NaN.
        image: the receivers' numbers in a square image, and its side: for the mean of neighbours.
        cells: along each edge of the lamp.
        falloff: of the light over the lamp, from places in [-1, 1]^2; None for a constant.
        bounds: of the blockers' depths; by default those of `blocker_depths`.
        own_rays: how many rays `fallback` is made of.
        radius: standard deviation of the mean over neighbours [pixels].

    Valid when: shadows have edges, and the lamp too. A lamp that fades out leaves less energy
    outside than is expected here. Wrong where the sharpest limit still blurs far more than edges:
    what no answer shows cannot be measured.

    Raises:
        TypeError: if lamp or table are none.
        ValueError: if limits are not each twice the one before, the image does not hold one number
            of each receiver, or a bound is NaN or behind the other.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import band_limit_sweep
        >>> from firstorder.shadowfield import lamp_frame
        >>> from firstorder.shadowfield import RayTable
        >>> from firstorder.shadowfield import trace_shadow_rays
        >>> def bar(a, b):  # half way up, hides x < 0
        ...     hit = (a + b)[:, 0] < 0.0
        ...     return np.where(hit, 0.5, np.inf), np.where(hit, 0.5, -np.inf)
        >>> lamp = lamp_frame((0, 0, 2), (0, 0.5, 0), (0.5, 0, 0))
        >>> x = np.linspace(-0.7, 0.7, 16)
        >>> floor = np.stack([*np.meshgrid(x, x, indexing="ij"), np.zeros((16, 16))], -1)
        >>> floor = floor.reshape(-1, 3)
        >>> one, two = (trace_shadow_rays(lamp, floor, 2, bar, seed)[0] for seed in (0, 1))
        >>> columns = zip(one, two, strict=True)  # every second ray from the other seed
        >>> table = RayTable(*(np.stack(c, 1).reshape(-1, *c[0].shape[1:]) for c in columns))
        >>> image = np.arange(256), 16
        >>> rungs = band_limit_sweep(lamp, table, floor, np.array([1.0, 2.0]), 0.09, np.zeros(256),
        ...     image)
        >>> off = rungs.visible[0] - np.clip(0.5 + floor[:, 0], 0.0, 1.0)
        >>> ratio = np.mean(off**2) / np.mean(rungs.error[0] ** 2)  # measured over expected
        >>> bool(0.5 < np.sqrt(ratio) < 2.0)
        True
    """
    _check_rays(lamp, table)
    check_positive("radius", radius)
    check_positive("own_rays", 1.0 if own_rays == np.inf else own_rays)
    chosen, at = np.asarray(limits, float), _receiver_rows(receivers)
    if chosen.ndim != 1 or len(chosen) < 2 or not _doubles(chosen):
        raise ValueError(
            "Argument `limits` must hold numbers each twice the one before, two or more."
        )
    share, (numbers, side) = cell_shares(cells, falloff), _checked(image, len(at))
    fallback = np.asarray(fallback, float)
    _check_each(len(at), fallback, bounds)
    halves = [RayTable(*(a[k::2] for a in table)) for k in range(2)]

    def answer(points, fallback, where, bounds) -> tuple[Rungs, Rungs, Rungs, Rungs]:
        local = lamp.local(points)
        near, far = _known_depths(lamp, table, points, pixel, bounds)
        visible, spread, samples, steps, own = [], [], [], [], np.zeros(len(local))
        likely = None
        for Omega_y in chosen:
            shape = filter_shape(local[:, 2], near, far, Omega_y, pixel, float(np.max(lamp.half)))
            both = [gather(lamp, t, local, shape.sigma, shape.shear, cells) for t in halves]
            sums = Sums(*(a + b for a, b in zip(*both, strict=True)))
            visible.append(or_lit(np.sum(share * sums.seen, 1), sums))
            steps.append([np.where(h.square > 0.0, h.seen @ share, np.nan) for h in both])
            likely = _free_probability(sums, likely)
            spread.append(np.where(sums.square > 0.0, _noise(sums, share, likely), 0.0))
            samples.append(sums.samples)
            own = np.maximum(own, own_share(sums, near, shape))
        lost, known = _bias(np.array(steps), (where, side), radius), np.where(own > 0, fallback, 0)
        toss = known * (1.0 - known) / own_rays
        return (
            (1.0 - own) * np.array(visible) + own * known,
            np.sqrt(((1.0 - own) * np.array(spread)) ** 2 + own**2 * toss),
            (1.0 - own) * lost,
            np.array(samples),
        )

    return BandLimitSweep(chosen, *where_below(lamp, at, answer, fallback, numbers, bounds))


def _doubles(limits: Float[np.ndarray, " k"]) -> bool:
    """Whether each is twice the one before, in any unit."""
    return np.allclose(limits[1:], 2.0 * limits[:-1], atol=0.0)


def _checked(image: tuple[Any, Any], count: int) -> tuple[Int[np.ndarray, " m"], int]:
    """Numbers of receivers in a square image, and its side; refuses those that are not in it."""
    if not isinstance(image, tuple) or len(image) != 2:
        raise ValueError("Argument `image` must be a pair, the receivers' numbers and the side.")
    where, side = np.asarray(image[0]), image[1]
    check_count("image[1]", side)
    check_shape("image[0]", where, (count,))
    if where.dtype.kind not in "iu":
        raise ValueError(f"Argument `image[0]` must hold integers, but holds {where.dtype}.")
    if count and not 0 <= where.min() <= where.max() < side**2:
        raise ValueError(
            f"Argument `image[0]` must hold numbers of pixels, 0 to {side**2 - 1}, "
            f"but holds {where.min()} to {where.max()}."
        )
    return where, side


def _bias(halves: Float[np.ndarray, "k 2 m"], image, radius: float) -> Rungs:
    """The sizes of all steps upwards; those beyond the last rung by their ratio.

    Receivers count where both halves have rays for both answers.
    """
    change = np.diff(halves, axis=0)
    square = [_spread(a * b, image, radius) for a, b in change]
    step = np.sqrt(np.maximum(square, 0.0))
    steps = np.concatenate([step, step[-1:] * STEP / (1.0 - STEP)])
    return np.cumsum(steps[::-1], 0)[::-1]


def _spread(values: Numbers, image, radius: float) -> Numbers:
    """Mean over neighbours in the image that have a number; 0 where none has."""
    where, side = image
    some = np.isfinite(values)
    whole, shown = np.zeros((2, side**2))
    whole[where[some]], shown[where[some]] = values[some], 1.0
    both = [scipy.ndimage.gaussian_filter(a.reshape(side, side), radius) for a in (whole, shown)]
    return (both[0] / np.maximum(both[1], 1e-12)).ravel()[where]


def select_band_limits(
    rungs: BandLimitSweep, image: tuple[Int[np.ndarray, " m"], int], radius: float = 2.0
) -> SelectedBandLimits:
    """Each pixel at the band limit of least expected error, without jumps between neighbours.

    NaN where the ladder has no numbers; such pixels have no say in their neighbours' choice.

    Args:
        rungs: answers at several band limits.
        image: the receivers' numbers in a square image, and its side.
        radius: over which the choice is smoothed [pixels].

    Returns:
        For each receiver the share of the lamp that is seen, its expected error and the band limit
        [cycles/m]; a share between two rungs is the weighted mean of theirs.

    Raises:
        ValueError: if the image does not hold one number of each receiver.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import BandLimitSweep, select_band_limits
        >>> zero = np.zeros((2, 4))
        >>> noise = np.array([[0.1] * 4, [0.3] * 4])  # less on the first rung, at every pixel
        >>> sweep = BandLimitSweep(np.array([1.0, 2.0]), zero + 0.5, noise, zero, zero)
        >>> select_band_limits(sweep, (np.arange(4), 2)).limit.tolist()
        [1.0, 1.0, 1.0, 1.0]
    """
    check_positive("radius", radius)
    some = np.isfinite(rungs.error[0])
    image = _checked(image, len(some))
    at = _spread(np.where(some, rungs.best, np.nan), image, radius)
    low = np.minimum(at.astype(int), len(rungs.limits) - 2)
    t, here = at - low, np.arange(len(at))

    def between(values):
        return (1.0 - t) * values[low, here] + t * values[low + 1, here]

    error = np.sqrt(between(rungs.error**2))
    limit = np.where(some, rungs.limits[0] * 2.0**at, np.nan)
    return SelectedBandLimits(between(rungs.visible), error, limit)
