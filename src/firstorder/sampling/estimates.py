"""Estimates with error bars: means of independent samples, and how runs are combined.

Moments are carried as (count, mean, sum of squares about the mean) and merged pairwise, so that
single precision is enough for long runs and no sum of squares cancels.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_broadcast,
    check_integer,
    check_kind,
    check_not_negative,
    check_real,
    check_real_attributes,
    check_zero_or_one,
)
from firstorder._display import Module
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import safe_sqrt
from firstorder.typing import as_float


class Estimate(Module):
    """A mean of independent samples with its standard error.

    Attributes:
        mean: the estimate.
        error: standard deviation of `mean`, itself estimated; infinity if there is one sample.
        count: how many samples.

    Raises:
        ValueError: if `count` is negative, or a number complex.

    Example:
        >>> from firstorder.sampling import Estimate
        >>> Estimate(1.2, 0.1, 100.0).z(1.0).round(6).item()  # standard errors above the truth
        2.0
    """

    mean: Float[Array, "*n"] = eqx.field(converter=as_float)
    error: Float[Array, "*n"] = eqx.field(converter=as_float)
    count: Float[Array, "*n"] | Float[Array, ""] = eqx.field(converter=lambda c: as_float(c))

    def __check_init__(self):
        """Refuse a negative count, and complex numbers."""
        check_real_attributes(self)
        check_not_negative("count", self.count)

    def z(self, truth: ArrayLike) -> Float[Array, "*n"]:
        """Deviation from a known value in standard errors; zero where both agree without error."""
        off = self.mean - as_float(truth)
        exact = (off == 0.0) & (self.error == 0.0)
        error = jnp.where(self.error == 0.0, jnp.where(exact, 1.0, 0.0), self.error)
        return jnp.where(exact, 0.0, off / error)

    def scaled(self, factor: ArrayLike) -> Estimate:
        """The estimate of `factor` times the quantity."""
        factor = as_float(factor)
        return Estimate(self.mean * factor, self.error * jnp.abs(factor), self.count)


class Moments(Module):
    """Count, mean and sum of squares about the mean of samples seen so far.

    Attributes:
        count: samples.
        mean: theirs.
        square: sum of squared deviations from it.

    Raises:
        ValueError: if `count` is negative, or a number complex.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.sampling import Moments
        >>> seen = Moments.none().add(1.0).add(3.0)
        >>> seen.estimate().mean.item(), seen.estimate().error.item()
        (2.0, 1.0)
    """

    count: Float[Array, "*n"] = eqx.field(converter=as_float)
    mean: Float[Array, "*n"] = eqx.field(converter=as_float)
    square: Float[Array, "*n"] = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse a negative count, and complex numbers."""
        check_real_attributes(self)
        check_not_negative("count", self.count)

    @staticmethod
    def none(shape: tuple[int, ...] = (), dtype=None) -> Moments:
        """Moments of no samples."""
        zero = jnp.zeros(shape, dtype or jnp.result_type(float))
        return Moments(zero, zero, zero)

    def add(self, value: ArrayLike, weight: ArrayLike = 1.0) -> Moments:
        """Moments with one more sample (Welford); weight 0 leaves it out, 1 takes it.

        Raises:
            ValueError: if the sample is complex or of another shape, or the weight is neither.
        """
        check_real("value", value)
        check_broadcast("value", value, self.mean.shape)
        check_zero_or_one("weight", weight)
        value = jnp.asarray(value, self.mean.dtype)
        weight = jnp.asarray(weight, self.mean.dtype)
        value = jnp.where(weight == 0.0, self.mean, value)  # zero times infinity would be NaN
        count = self.count + weight
        delta = value - self.mean
        mean = self.mean + weight * delta / jnp.maximum(count, 1.0)
        return Moments(count, mean, self.square + weight * delta * (value - mean))

    def merged(self, axis: int = -1) -> Moments:
        """Moments of all entries along an axis together."""
        count = jnp.sum(self.count, axis)
        safe = jnp.maximum(count, 1.0)
        mean = jnp.sum(self.count * self.mean, axis) / safe
        spread = self.count * (self.mean - jnp.expand_dims(mean, axis)) ** 2
        return Moments(count, mean, jnp.sum(self.square + spread, axis))

    def variance(self) -> Float[Array, "*n"]:
        """Unbiased variance of one sample; infinity if fewer than two were seen."""
        several = self.count > 1.0
        v = self.square / jnp.where(several, self.count - 1.0, 1.0)
        return jnp.where(several, v, jnp.inf)

    def estimate(self) -> Estimate:
        """The mean and its standard error."""
        error = safe_sqrt(self.variance() / jnp.maximum(self.count, 1.0))
        return Estimate(self.mean, error, self.count)


def estimate(samples: Any, axis: int = 0) -> Estimate:
    """Mean and standard error of independent samples along an axis.

    Args:
        samples: real numbers.
        axis: along which they are independent.

    Raises:
        ValueError: if they have no such axis, or are complex.

    Example:
        >>> from firstorder.sampling import estimate
        >>> estimate([1.0, 3.0]).error.item()
        1.0
    """
    x = as_float(samples)
    check_real("samples", x)
    check_integer("axis", axis)
    if not -x.ndim <= axis < x.ndim:
        raise ValueError(f"Argument `samples` must have an axis {axis}, but has shape {x.shape}.")
    unit = _unit(x, axis)
    shares = x / jnp.expand_dims(unit, axis)
    seen = Moments(jnp.ones_like(x), shares, jnp.zeros_like(x)).merged(axis)
    return seen.estimate().scaled(unit)


def combine(estimates: Sequence[Estimate]) -> Estimate:
    """Estimate of independent runs together, each counted by its number of samples.

    Weights by the estimated errors would be biased where mean and error are correlated, as they
    are for light: a run that missed the bright paths is dark and looks sure of itself.

    Args:
        estimates: of the same quantity.

    Raises:
        ValueError: if there are none.
        TypeError: if one is no estimate.

    Example:
        >>> from firstorder.sampling import combine, estimate
        >>> both = combine([estimate([1.0, 3.0]), estimate([2.0, 4.0, 6.0, 8.0])])
        >>> both.mean.item(), both.count.item()
        (4.0, 6.0)
    """
    check_kind("estimates", estimates, (list, tuple), "a list of estimates")
    for number, one in enumerate(estimates):
        check_kind(f"estimates[{number}]", one, Estimate, "an `Estimate`")
    if not estimates:
        raise ValueError("Argument `estimates` must hold at least one estimate, but is empty.")

    mean = jnp.stack([e.mean for e in estimates])
    count = jnp.stack([jnp.broadcast_to(e.count, e.mean.shape) for e in estimates])
    # Of a single sample the error is infinite, and the sum of squares zero.
    error = jnp.where(count > 1.0, jnp.stack([e.error for e in estimates]), 0.0)
    unit = _unit(jnp.concatenate([mean, error]), 0)
    mean, error = mean / unit, error / unit
    return Moments(count, mean, error**2 * count * (count - 1.0)).merged(0).estimate().scaled(unit)


def _unit(x: Float[Array, "..."], axis: int) -> Float[Array, "..."]:
    """A unit in which squares of numbers along an axis stay in the range of their precision."""
    if not x.shape[axis]:
        return jnp.ones(jnp.sum(x, axis).shape, x.dtype)
    most = 1.0 / jnp.finfo(x.dtype).tiny  # the compiler may divide by a reciprocal
    return jnp.minimum(power_of_two(jnp.moveaxis(x, axis, -1)), most)
