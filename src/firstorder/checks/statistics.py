"""Tests for numbers that are random: z on means, chi-square on samplers, the slope of the error.

Every test states the probability with which it would be red by chance, for all its comparisons
together, and computes its threshold from that; a threshold is never grown.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.special import chdtrc, ndtri, stdtrit

from firstorder._argument_checks import (
    check_count,
    check_inside,
    check_not_negative,
    check_real,
)
from firstorder.checks.tolerance import _logarithms

LEVEL = 1e-4  # chance of a false alarm of one whole test
ROUNDING = 1e-12  # share of a whole by which a part of it may be negative
EXPECTED = 8.0  # fewest expected samples in a bin of a chi-square test


@dataclasses.dataclass(frozen=True)
class ZTest:
    """Means against known values.

    Attributes:
        z: deviations in standard errors, an array of the means' shape.
        threshold: the largest that passes, corrected for the number of comparisons.
    """

    z: np.ndarray
    threshold: float

    @property
    def worst(self) -> float:
        """Largest deviation; infinity if one is not a number."""
        worst = float(np.max(np.abs(self.z), initial=0.0))
        return worst if np.isfinite(worst) else float("inf")

    @property
    def passed(self) -> bool:
        """Whether all deviations are within the threshold."""
        return self.worst <= self.threshold


def z_threshold(
    comparisons: int, level: float = LEVEL, freedom: float | int | None = None
) -> float:
    """The deviation that the largest of several independent ones exceeds with chance `level`.

    Šidák's correction; with `freedom` for Student's t, where errors come from few samples.

    Args:
        comparisons: how many are made.
        level: chance that the largest of them exceeds it.
        freedom: degrees of freedom behind the errors; None for many.

    Raises:
        ValueError: if `level` is no chance, or `comparisons` no number of them.

    Example:
        >>> from firstorder.checks import z_threshold
        >>> round(z_threshold(1, 0.05), 3), round(z_threshold(100, 0.05), 3)
        (1.96, 3.474)
    """
    check_inside("level", level, 0.0, 1.0)
    check_not_negative("comparisons", comparisons)
    each = -np.expm1(np.log1p(-level) / max(comparisons, 1))
    return float(-ndtri(0.5 * each) if freedom is None else -stdtrit(freedom, 0.5 * each))


def z_test(
    mean: Any,
    error: Any,
    truth: Any,
    level: float = LEVEL,
    truth_error: Any = 0.0,
    freedom: float | int | None = None,
) -> ZTest:
    """Tests means with standard errors against known values, all at once.

    Valid when: each mean is one of enough independent samples to be normal. A mean with no error
    must be exact: its deviation is infinite otherwise, and always where its error is not known.

    Args:
        mean: of any shape.
        error: its standard error; infinite or NaN where it is not known.
        truth: what it should be.
        level: chance of a false alarm, of all comparisons together.
        truth_error: bound on the error of `truth`, taken off each deviation; infinite or NaN where
            it is not known.
        freedom: degrees of freedom behind `error`; None for many.

    Raises:
        ValueError: if `level` is no chance, there is no mean, or a number is complex.

    Example:
        >>> from firstorder.checks import z_test
        >>> z_test([1.1, 0.9], [0.1, 0.1], 1.0).passed, z_test(1.6, 0.1, 1.0).passed
        (True, False)
    """
    mean, error, truth = _real("mean", mean), _real("error", error), _real("truth", truth)
    slack = _real("truth_error", truth_error)
    off = np.maximum(np.abs(mean - truth) - slack, 0.0)
    error, slack = np.broadcast_to(error, off.shape), np.broadcast_to(slack, off.shape)
    z = np.where(off == 0.0, 0.0, off / np.where(error > 0.0, error, np.nan))
    z = np.where(np.isnan(z) | ~np.isfinite(error) | ~np.isfinite(slack), np.inf, z)
    if not z.size:
        raise ValueError("Argument `mean` must hold a number, but holds none.")
    return ZTest(z, z_threshold(z.size, level, freedom))


def _real(name: str, x: Any) -> np.ndarray:
    """Numbers whose imaginary part nobody compares, so that there must be none."""
    check_real(name, np.asarray(x))
    return np.asarray(x, float)


def z_test_of(estimate: Any, truth: Any, level: float = LEVEL, truth_error: Any = 0.0) -> ZTest:
    """`z_test` of an `Estimate`.

    Example:
        >>> from firstorder.checks import z_test_of
        >>> from firstorder.sampling import Estimate
        >>> z_test_of(Estimate(1.1, 0.1, 100.0), 1.0).passed
        True
    """
    return z_test(estimate.mean, estimate.error, truth, level, truth_error)


def chi_square(counts: Any, expected: Any) -> float:
    """The probability that counts differ from what is expected by at least so much, by chance.

    Neighbouring bins that expect fewer than `EXPECTED` are put together. The sum of `expected`
    must be that of the counts. A bin that expects nothing and holds something is impossible: 0.

    Raises:
        ValueError: if there are not equally many bins, the sums differ, one is no number or
            negative, or nothing is counted.

    Example:
        >>> from firstorder.checks import chi_square
        >>> chi_square([52, 48], [50, 50]) > 0.5, chi_square([80, 20], [50, 50]) < 1e-8
        (True, True)
    """
    seen, wanted = _real("counts", counts).ravel(), _real("expected", expected).ravel()
    if seen.size != wanted.size:
        raise ValueError(
            f"Arguments `counts` and `expected` must have equally many bins, "
            f"but have {seen.size} and {wanted.size}."
        )
    if not (seen.any() or wanted.any()):
        raise ValueError("Argument `counts` must hold samples, but holds none.")
    if not abs(seen.sum() - wanted.sum()) <= 1e-6 * max(seen.sum(), 1.0):
        raise ValueError(
            f"Arguments `counts` and `expected` must have one sum, "
            f"but have {seen.sum():g} and {wanted.sum():g}."
        )
    check_not_negative("counts", seen)
    wanted = np.where((wanted < 0.0) & (wanted >= -ROUNDING * wanted.sum()), 0.0, wanted)
    check_not_negative("expected", wanted)
    if np.any((wanted <= 0.0) & (seen > 0.0)):
        return 0.0
    seen, wanted = _pooled(seen, wanted)
    if seen.size < 2:
        return 1.0
    return float(chdtrc(seen.size - 1, np.sum((seen - wanted) ** 2 / wanted)))


def _pooled(seen: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bins put together from the left until each expects enough; the rest goes to the last."""
    out: list[list[float]] = [[0.0, 0.0]]
    for s, w in zip(seen, wanted, strict=True):
        if out[-1][1] >= EXPECTED:
            out.append([0.0, 0.0])
        out[-1][0] += s
        out[-1][1] += w
    if len(out) > 1 and out[-1][1] < EXPECTED:
        s, w = out.pop()
        out[-1][0] += s
        out[-1][1] += w
    pooled = np.array(out)
    return pooled[:, 0], pooled[:, 1]


def sampler_p_value(
    samples: Any,
    density: Callable[[np.ndarray], Any],
    low: float,
    high: float,
    bins: int = 64,
    nodes: int = 16,
) -> float:
    """Chi-square of samples in an interval against their own density, integrated bin by bin.

    A density whose integral is not 1 or that is negative, or samples outside the interval, count as
    failures; so does what is not a number.

    Args:
        samples: drawn.
        density: what they claim to follow.
        low: start of the interval that holds all of them.
        high: its end.
        bins: equal bins, two at least.
        nodes: of the quadrature in each.

    Returns:
        The probability of a deviation so large by chance; 0 for a density of the wrong integral.

    Raises:
        ValueError: for so few samples or bins that no test of them can fail.

    Example:
        >>> import numpy as np
        >>> from firstorder.checks import sampler_p_value
        >>> x = np.random.default_rng(0).uniform(size=4096)
        >>> sampler_p_value(x, np.ones_like, 0.0, 1.0) > 0.01
        True
        >>> sampler_p_value(x, lambda x: 2.0 * x, 0.0, 1.0) < 1e-6
        True
    """
    x = _real("samples", samples).ravel()
    check_count("bins", bins)
    if bins < 2:
        raise ValueError(f"Argument `bins` must be two at least, but is {bins}.")
    if x.size < 2 * EXPECTED:  # all bins would be one, which cannot differ
        raise ValueError(
            f"Argument `samples` must hold at least {2 * EXPECTED:g}, but holds {x.size}."
        )
    edges = np.linspace(low, high, bins + 1)
    check_count("nodes", nodes)
    t, w = np.polynomial.legendre.leggauss(nodes)
    half = 0.5 * (edges[1:] - edges[:-1])[:, None]
    at = 0.5 * (edges[1:] + edges[:-1])[:, None] + half * t
    share = np.sum(half * w * np.asarray(density(at), float), -1)
    whole = abs(share.sum() - 1.0) <= 1e-3 and np.all(share >= -ROUNDING)
    if not (whole and np.all((x >= low) & (x <= high))):
        return 0.0
    share = np.maximum(share, 0.0)
    return chi_square(np.histogram(x, edges)[0], x.size * share / share.sum())


@dataclasses.dataclass(frozen=True)
class ErrorSlope:
    """A power law fitted to errors.

    Attributes:
        slope: the exponent.
        error: its standard error, from the scatter of the errors about the fit.
    """

    slope: float
    error: float

    def is_near(self, exponent: float, level: float = LEVEL, count: int = 3) -> bool:
        """Whether the exponent lies within the scatter of the fit (Student, `count` points)."""
        bound = z_threshold(1, level, max(count - 2, 1)) * self.error
        return abs(self.slope - exponent) <= bound


def error_slope(counts: Any, errors: Any) -> ErrorSlope:
    """Fits `errors ~ counts^slope` by least squares of logarithms.

    Raises:
        ValueError: if counts or errors are not positive, not equally many, or all counts are one.

    Example:
        >>> from firstorder.checks import error_slope
        >>> round(error_slope([1e2, 1e4, 1e6], [1e-1, 1e-2, 1e-3]).slope, 6)
        -0.5
    """
    x, y = _logarithms(counts=counts, errors=errors)
    x0 = x - x.mean()
    slope = float(np.sum(x0 * y) / np.sum(x0**2))
    rest = y - y.mean() - slope * x0
    scatter = np.sum(rest**2) / max(x.size - 2, 1)
    return ErrorSlope(slope, float(np.sqrt(scatter / np.sum(x0**2))))


def spread_test(measured: Any, predicted: Any, runs: int, level: float = LEVEL) -> ZTest:
    """Standard deviations over runs against predicted ones.

    The logarithm of a standard deviation of `runs` nearly normal values has the standard error
    `1 / sqrt(2 (runs - 1))`.

    Args:
        measured: standard deviations over the runs.
        predicted: what they should be.
        runs: how many, two at least.
        level: chance of a false alarm, of all comparisons together.

    Raises:
        ValueError: for fewer than two runs.

    Example:
        >>> from firstorder.checks import spread_test
        >>> spread_test([1.1, 0.9], 1.0, 100).passed, spread_test(2.0, 1.0, 100).passed
        (True, False)
    """
    if runs < 2:
        raise ValueError(f"Argument `runs` must be two at least, but is {runs}.")
    measured, predicted = _real("measured", measured), _real("predicted", predicted)
    with np.errstate(divide="ignore", invalid="ignore"):  # what is not positive is not near
        off = np.log(measured) - np.log(predicted)
    return z_test(off, 1.0 / np.sqrt(2.0 * (runs - 1.0)), 0.0, level)
