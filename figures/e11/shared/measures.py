"""What E11's figures measure shadows by: errors, effective rays, stratified rays of equal error.

A shadow is the share of the lamp that is seen, 0 to 1, so that an error of 0.01 is 1 % of the
unshadowed light. The reference is stratified rays and has an error of its own: an error that
comes near it says no more than that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from firstorder.checks.statistics import error_slope


class Errors(NamedTuple):
    """How far an image of shadows is from the reference, as shares of the unshadowed light.

    Attributes:
        rms: root mean square.
        percentile99: what 99 % of the pixels stay below.
        largest: of any pixel.
    """

    rms: float
    percentile99: float
    largest: float


def errors(found, true, where=None) -> Errors:
    """Errors over the pixels `where`, all by default; other pixels may be NaN."""
    found, true = np.asarray(found, float), np.asarray(true, float)
    off = abs(found - true)
    off = off.ravel() if where is None else off[np.asarray(where)]
    rms = np.sqrt(np.mean(off**2))
    return Errors(float(rms), float(np.percentile(off, 99.0)), float(np.max(off)))


def penumbra(true, least: float = 0.01) -> np.ndarray:
    """Pixels that see some of the lamp but not all of it, as E11 counts effective samples."""
    true = np.asarray(true)
    return (true > least) & (true < 1.0 - least)


def effective(samples, true) -> float:
    """Mean number of effective rays over the penumbra."""
    return float(np.mean(np.asarray(samples)[penumbra(true)]))


class EqualRays(NamedTuple):
    """How many stratified rays a pixel have the error of something else.

    Attributes:
        rays: for each pixel.
        inside: whether the measured curve reaches that error; beyond its ends it is continued by
            the slope there.
    """

    rays: float
    inside: bool

    @property
    def text(self) -> str:
        """The number for a claim."""
        return f"{self.rays:.3g}" + ("" if self.inside else " (continued)")


def equal_rays(rays, rms, target: float) -> EqualRays:
    """Rays at which a curve of errors that fall takes the value `target`, in log-log.

    Args:
        rays: for each pixel, rising.
        rms: errors at these, falling.
        target: error of the other method.
    """
    x, y = np.log(np.asarray(rays, float)), np.log(np.asarray(rms, float))
    at = np.log(target)
    # The segment that crosses the target; the first or the last one continues the curve.
    k = int(np.clip(np.searchsorted(-y, -at) - 1, 0, len(x) - 2))
    found = x[k] + (at - y[k]) * (x[k + 1] - x[k]) / (y[k + 1] - y[k])
    return EqualRays(float(np.exp(found)), bool(y[-1] <= at <= y[0]))


def slope(budgets, rms) -> float:
    """Exponent of an error in the budget, by least squares in log-log."""
    return error_slope(budgets, rms).slope


def without_reference(rms, of_reference: float):
    """Errors from which the reference's own is taken out, as independent errors add in square.

    NaN where nothing is left: the method is then as good as the reference.
    """
    left = np.square(np.asarray(rms, float)) - of_reference**2
    return np.sqrt(np.where(left > 0.0, left, np.nan))
