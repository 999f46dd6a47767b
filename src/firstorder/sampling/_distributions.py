"""Distributions of directions and choices in flatland: uniform numbers in, samples and density out.

Angles are local, counter-clockwise from the normal (conventions, Flatland), densities per radian.
The hemicircle is pi wide and the cosine integrates to 2 over it, where space has 2 pi and pi.
"""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import (
    check_finite,
    check_not_negative,
    check_one,
    is_concrete,
    nan_unless,
    not_negative,
)
from firstorder._display import Module
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import safe_sqrt
from firstorder.typing import as_float

HORIZON = 0.5 * jnp.pi

# `Gamma(x + 1/2) / Gamma(x + 1) = sum_k c_k w^(-2 k) / sqrt(w)` with w = x + 1/4, highest k first:
# c_k is (2 k)! binom(-1/2, 2 k) times that of t^(2 k) in `(t / (2 sinh(t / 2)))^(1/2)`.
SERIES = (-20898423 / 2**33, 180323 / 2**27, -671 / 2**19, 21 / 2**13, -1 / 64, 1.0)
STEPS = 8  # up to where these six are exact to 1e-13


class UniformDirections(Module):
    """Uniform directions of the hemicircle: density `1 / pi`.

    Reference: J12 §4.2.

    Example:
        >>> from firstorder.sampling import UniformDirections
        >>> even = UniformDirections()
        >>> round(even.sample(0.75).item(), 4), round(even.density(0.3).item(), 4)
        (0.7854, 0.3183)
    """

    def sample(self, u: ArrayLike) -> Float[Array, "*n"]:
        """The angle to a uniform number."""
        return jnp.pi * (as_float(u) - 0.5)

    def density(self, a: ArrayLike) -> Float[Array, "*n"]:
        """Density per radian; zero beyond the horizon."""
        a = as_float(a)
        density = jnp.where(jnp.abs(a) > HORIZON, 0.0, 1.0 / jnp.pi).astype(a.dtype)
        return nan_unless(a == a, density)


class CosineDirections(Module):
    """Directions by their cosine: density `cos(a) / 2`, as a diffuse surface reflects.

    The sine is uniform: `sin(a) = 2 u - 1`.

    Example:
        >>> from firstorder.sampling import CosineDirections
        >>> round(CosineDirections().sample(0.75).item(), 4), CosineDirections().density(0.0).item()
        (0.5236, 0.5)
    """

    def sample(self, u: ArrayLike) -> Float[Array, "*n"]:
        """The angle to a uniform number."""
        return jnp.arcsin(2.0 * as_float(u) - 1.0)

    def density(self, a: ArrayLike) -> Float[Array, "*n"]:
        """Density per radian; zero beyond the horizon."""
        a = as_float(a)
        return jnp.where(jnp.abs(a) > HORIZON, 0.0, 0.5 * jnp.maximum(jnp.cos(a), 0.0))


class CosinePowerLobe(Module):
    """Directions about a centre by a power of the cosine: density `cos^e(a - center) / A_e`.

    `A_e = sqrt(pi) Gamma((e + 1) / 2) / Gamma(e / 2 + 1)`. The sine of `a - center` is the abscissa
    of a point in the disc whose squared radius is `1 - u^(2 / e)` at a uniform azimuth: exact for
    any `e >= 0`, with no table. Part of the lobe may lie beyond the horizon: the density does not
    know.

    Args:
        exponent: `e`, not negative; 0 is uniform about the centre.
        center: where the lobe is highest [rad].

    Raises:
        ValueError: if the exponent is negative; a traced one gives NaN.

    Example:
        >>> from firstorder.sampling import CosinePowerLobe
        >>> round(CosinePowerLobe(1.0).density(0.0).item(), 6)
        0.5
    """

    exponent: Float[Array, "*n"] = eqx.field(converter=as_float)
    center: Float[Array, "*n"] = eqx.field(default=0.0, converter=as_float)

    def __check_init__(self):
        """Refuse a lobe that cannot be normalised near the horizon."""
        check_not_negative("exponent", self.exponent)

    def sample(self, u: ArrayLike, v: ArrayLike) -> Float[Array, "*n"]:
        """The angle to two uniform numbers."""
        e = not_negative(self.exponent)
        return self.center + jnp.arcsin(lobe_sine(e, as_float(u), as_float(v)))

    def density(self, a: ArrayLike) -> Float[Array, "*n"]:
        """Density per radian; zero where it is more than pi/2 from the centre."""
        t, e = as_float(a) - self.center, not_negative(self.exponent)
        c, square = jnp.cos(t), jnp.sin(t) ** 2
        # A rounded cosine near 1, to a high power, would be far off: its logarithm is not.
        near = (c > 0.0) & (square < 0.5)
        power = jnp.exp(0.5 * e * jnp.log1p(-jnp.where(near, square, 0.0)))
        return jnp.where(near, power, lobe_power(jnp.where(near, 1.0, c), e)) / lobe_area(e)


def lobe_sine(e: Float[Array, "*#n"], u: Float[Array, "*#n"], v: Float[Array, "*#n"]) -> Array:
    """The sine of a direction drawn by `cos^e` of its angle."""
    flat = e <= 0.0
    log = jnp.log(jnp.where(u > 0.0, u, 1.0))
    # 1 - u^(2 / e), of which a sharp lobe would leave no digit.
    square = jnp.where(flat | (u <= 0.0), 1.0, -jnp.expm1(2.0 * log / jnp.where(flat, 1.0, e)))
    return safe_sqrt(square) * jnp.cos(2.0 * jnp.pi * v)


def lobe_power(cosine: Float[Array, "*#n"], e: Float[Array, "*#n"]) -> Array:
    """`cos^e` above the horizon of the lobe, zero below; 1 for `e = 0`."""
    below = cosine <= 0.0
    return jnp.where(below, 0.0, jnp.where(below, 1.0, cosine) ** e)


def lobe_area(e: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """`int cos^e(a) da` over the hemicircle: pi for 0, 2 for 1.

    `sqrt(pi) Gamma(z + 1/2) / Gamma(z + 1)` with z = e / 2, from the ratio's series at z + 8: the
    difference of two logarithms would lose all digits of single precision for sharp lobes.
    """
    z = 0.5 * e
    w = z + (STEPS + 0.25)
    ratio = jnp.polyval(jnp.asarray(SERIES, z.dtype), 1.0 / w**2) / jnp.sqrt(w)
    for k in range(STEPS):
        ratio = ratio * ((z + (k + 1.0)) / (z + (k + 0.5)))
    return jnp.sqrt(jnp.pi) * ratio


def _check_row(weights: Any) -> None:
    """Refuse weights that are not beside each other, or none."""
    shape = np.shape(weights)
    if len(shape) != 1 or shape == (0,):
        raise ValueError(f"Argument `weights` must be a row of numbers, but has shape {shape}.")


class Discrete(Module):
    """A choice among several by their weights.

    Args:
        weights: not negative. If all are zero, the first is always taken, with probability 0.

    Raises:
        ValueError: if a weight is negative, which gives NaN where it is traced, or they are no row
            of at least one.

    Example:
        >>> from firstorder.sampling import Discrete
        >>> pick = Discrete([1.0, 3.0])
        >>> pick.probability.tolist(), pick.sample(0.5)[0].item()
        ([0.25, 0.75], 1)
    """

    weights: Float[Array, " n"] = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse negative weights, and what is no row of them."""
        _check_row(self.weights)
        check_not_negative("weights", self.weights)

    @property
    def probability(self) -> Float[Array, " n"]:
        """Probability of each choice."""
        # In a unit of their own: the sum of weights may leave the range, and its square sooner.
        most = 1.0 / jnp.finfo(self.weights.dtype).tiny  # the compiler may divide by a reciprocal
        weights = not_negative(self.weights)
        shares = weights / jnp.minimum(power_of_two(weights), most)
        total = jnp.sum(shares)
        return shares / jnp.where(total == 0.0, 1.0, total)

    def sample(self, u: ArrayLike) -> tuple[Int[Array, "*n"], Float[Array, "*n"]]:
        """Number of the choice, and a fresh uniform number from the rest of u."""
        u = as_float(u)
        ends = jnp.cumsum(self.probability)
        # Added up in parts, the sums of many may rise by a rounding where nothing is added.
        taken = jnp.where(self.weights > 0.0, jax.lax.stop_gradient(ends), 0.0)
        # Weights of zero at the end are never reached by rounding: the last positive one takes all.
        last = jnp.max(jnp.where(self.weights > 0.0, jnp.arange(ends.shape[0]), 0))
        few = "compare_all" if ends.shape[0] <= 64 else "scan"
        found = jnp.searchsorted(jax.lax.cummax(taken), u, side="right", method=few)
        index = jnp.minimum(found, last)
        width = self.probability[index]
        rest = (u - (ends[index] - width)) / jnp.where(width > 0.0, width, 1.0)
        return index, jnp.clip(rest, 0.0, 1.0 - 0.5 * jnp.finfo(u.dtype).eps)


class PiecewiseConstant(Module):
    """A density that is constant on equal pieces of an interval.

    Args:
        weights: of the pieces, not negative. If all are zero so is the density, and places are
            those of the first piece.
        low: start of the interval.
        high: its end.

    Raises:
        ValueError: if a weight is negative, they are no row of at least one, or the interval has
            no length; traced ends that are none give NaN.

    Example:
        >>> from firstorder.sampling import PiecewiseConstant
        >>> import numpy as np
        >>> d = PiecewiseConstant([1.0, 3.0], 0.0, 2.0)
        >>> d.density(np.array([0.5, 1.5, 2.5])).tolist(), d.sample(0.25).item()
        ([0.25, 0.75, 0.0], 1.0)
    """

    weights: Float[Array, " n"] = eqx.field(converter=as_float)
    low: Float[Array, ""] = eqx.field(converter=as_float)
    high: Float[Array, ""] = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse negative weights, and an interval that does not begin before its end."""
        _check_row(self.weights)
        check_not_negative("weights", self.weights)
        check_one("low", self.low)
        check_one("high", self.high)
        check_finite("low", self.low)
        check_finite("high", self.high)
        if is_concrete((self.low, self.high)) and not self.low < self.high:
            raise ValueError(
                f"Argument `high` must be more than {self.low:g}, but is {self.high:g}."
            )

    def sample(self, u: ArrayLike) -> Float[Array, "*n"]:
        """The place to a uniform number."""
        index, rest = Discrete(self.weights).sample(u)
        place = self.low + (index + rest) * (self.high - self.low) / self.weights.shape[0]
        return nan_unless(self.low < self.high, place)

    def density(self, x: ArrayLike) -> Float[Array, "*n"]:
        """Density per unit of x; zero outside the interval."""
        n = self.weights.shape[0]
        place = (as_float(x) - self.low) / (self.high - self.low)
        index = jnp.clip(jnp.floor(place * n).astype(int), 0, n - 1)
        outside = (place < 0.0) | (place > 1.0)
        p = Discrete(self.weights).probability[index] * n / (self.high - self.low)
        # A place that is NaN is told: that of an interval that ends before it begins, or of x.
        known = (self.low < self.high) & (place == place)
        return nan_unless(known, jnp.where(outside, 0.0, p))
