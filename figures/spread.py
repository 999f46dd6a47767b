"""Means over a scan or over several seeds, with their standard errors; root mean squares."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Spread(NamedTuple):
    """A mean over seeds, lay-outs or orders of insertion, and its standard error."""

    mean: float
    error: float


def spread(values: Any) -> Spread:
    """Mean of independent values, at least two.

    Example:
        >>> spread([1.0, 3.0])
        Spread(mean=2.0, error=1.0)
    """
    v = np.asarray(values, float).ravel()
    return Spread(float(np.mean(v)), float(np.std(v, ddof=1) / v.size**0.5))


def rms(values: Any) -> float:
    """Root of the mean square.

    Example:
        >>> rms([1.0, 7.0])
        5.0
    """
    return float(np.sqrt(np.mean(np.square(np.asarray(values)))))


def share(held: Any) -> Spread:
    """The share of true ones; one of a kind counts as one in n + 1 more, so no share is certain.

    Example:
        >>> share([True, True, True, False]).mean
        0.75
    """
    flags = np.asarray(held, bool).ravel()
    p = (np.sum(flags) + 1.0) / (flags.size + 2.0)
    return Spread(float(np.mean(flags)), float((p * (1.0 - p) / flags.size) ** 0.5))


def ratio_of_means(over: Any, under: Any) -> Spread:
    """Mean of one over the mean of the other, measured in pairs.

    Example:
        >>> ratio_of_means([2.0, 4.0], [1.0, 2.0])
        Spread(mean=2.0, error=0.0)
    """
    a, b = (np.asarray(v, float).ravel() for v in (over, under))
    ratio = float(np.mean(a) / np.mean(b))
    off = a - ratio * b  # of mean zero: its scatter is that of the ratio, to first order
    return Spread(ratio, float(np.std(off, ddof=1) / a.size**0.5 / abs(np.mean(b))))


def geometric(ratios: Any) -> Spread:
    """Geometric mean of ratios, and the standard error of it.

    Example:
        >>> geometric([2.0, 8.0]).mean
        4.0
    """
    log = spread(np.log(np.asarray(ratios, float)))
    mean = float(np.exp(log.mean))
    return Spread(round(mean, 12), mean * log.error)


def grouped(ratios: Any) -> Spread:
    """Geometric mean over groups, each of all its ratios, as those of one floor are alike.

    One group alone is spread by its own ratios.

    Example:
        >>> grouped([[1.0, 4.0], [8.0, 8.0]]).mean
        4.0
    """
    each = [geometric(group).mean for group in ratios]
    return geometric(each if len(each) > 1 else ratios[0])
