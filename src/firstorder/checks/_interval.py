"""Intervals that are sure to hold the exact result: every operation rounds outwards.

Rounding model: sums, products, quotients and square roots err by at most half a unit in the last
place (IEEE 754), sines and cosines by at most `4 eps`, and nothing underflows. So each end moves
outwards by `eps` times itself, at least to the next number; an exact zero stays one. NaN in an end
says that nothing is known: comparisons ask for what is sure, and NaN makes nothing sure.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool

from firstorder._display import Module

TURNED = 4.0  # units of eps, absolute, by which a sine or a cosine may be wrong


class Interval(Module):
    """Numbers that are known to lie between two others; arrays of any one shape.

    Attributes:
        lo, hi: the ends.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.checks._interval import exact
        >>> third = exact(jnp.array(1.0)) / exact(jnp.array(3.0))
        >>> bool(third.lo < third.hi), bool((3.0 * third.hi >= 1.0) & (3.0 * third.lo <= 1.0))
        (True, True)
    """

    lo: Array
    hi: Array

    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo)

    def __add__(self, other: Interval) -> Interval:
        return outwards(self.lo + other.lo, self.hi + other.hi)

    def __sub__(self, other: Interval) -> Interval:
        return outwards(self.lo - other.hi, self.hi - other.lo)

    def __mul__(self, other: Interval) -> Interval:
        a, b = self.lo * other.lo, self.lo * other.hi
        c, d = self.hi * other.lo, self.hi * other.hi
        low, high = jnp.minimum(a, b), jnp.maximum(a, b)
        return outwards(jnp.minimum(low, jnp.minimum(c, d)), jnp.maximum(high, jnp.maximum(c, d)))

    def __truediv__(self, other: Interval) -> Interval:
        apart = other.positive | other.negative
        one = jnp.ones_like(other.lo)
        found = self * outwards(
            one / jnp.where(apart, other.hi, 1.0), one / jnp.where(apart, other.lo, 1.0)
        )
        return choose(apart, found, anything(found.lo))

    def __getitem__(self, key) -> Interval:
        return Interval(self.lo[key], self.hi[key])

    @property
    def positive(self) -> Bool[Array, "..."]:
        """Whether it surely is."""
        return self.lo > 0.0

    @property
    def negative(self) -> Bool[Array, "..."]:
        """Whether it surely is."""
        return self.hi < 0.0

    def square(self) -> Interval:
        """Its square, which is not negative."""
        a, b = self.lo * self.lo, self.hi * self.hi
        least = jnp.where(self.positive | self.negative, jnp.minimum(a, b), 0.0)
        return outwards(least, jnp.maximum(a, b))

    def sqrt(self) -> Interval:
        """The square root of what is not negative; what is cannot be meant."""
        found = outwards(jnp.sqrt(jnp.maximum(self.lo, 0.0)), jnp.sqrt(jnp.maximum(self.hi, 0.0)))
        return Interval(jnp.maximum(found.lo, 0.0), found.hi)

    def within(self, low: ArrayLike, high: ArrayLike) -> Interval:
        """The interval cut to one that is known to hold the number, too."""
        return Interval(jnp.clip(self.lo, low, high), jnp.clip(self.hi, low, high))


def outwards(lo: Array, hi: Array) -> Interval:
    """An interval around two rounded ends."""
    eps = jnp.finfo(lo.dtype).eps
    return Interval(lo - eps * jnp.abs(lo), hi + eps * jnp.abs(hi))


def exact(x: Array) -> Interval:
    """A number that is known."""
    return Interval(x, x)


def anything(like: Array) -> Interval:
    """Nothing known, in the form of another array."""
    return Interval(jnp.full_like(like, -jnp.inf), jnp.full_like(like, jnp.inf))


def choose(which: Bool[Array, "..."], a: Interval, b: Interval) -> Interval:
    """The first where the condition holds, else the second."""
    return Interval(jnp.where(which, a.lo, b.lo), jnp.where(which, a.hi, b.hi))


def hull(a: Interval, b: Interval) -> Interval:
    """The least interval that holds both."""
    return Interval(jnp.minimum(a.lo, b.lo), jnp.maximum(a.hi, b.hi))


def total(terms: Interval) -> Interval:
    """The sum of a row, in whatever order it is added; zeros do not round."""
    eps = jnp.finfo(terms.lo.dtype).eps

    def slack(x):
        return eps * (1.0 + jnp.sum(x != 0.0)) * jnp.sum(jnp.abs(x))

    return outwards(jnp.sum(terms.lo) - slack(terms.lo), jnp.sum(terms.hi) + slack(terms.hi))


# --- the plane ------------------------------------------------------------------------------------


def pair(x: Interval, y: Interval) -> Interval:
    """A vector of two coordinates."""
    return Interval(jnp.stack([x.lo, y.lo], -1), jnp.stack([x.hi, y.hi], -1))


def cross(a: Interval, b: Interval) -> Interval:
    """The signed area of two vectors."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def dot(a: Interval, b: Interval) -> Interval:
    """The scalar product of two vectors."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def square(a: Interval) -> Interval:
    """The squared length of a vector."""
    return a[..., 0].square() + a[..., 1].square()


def left(a: Interval) -> Interval:
    """A vector turned by a right angle counter-clockwise."""
    return pair(-a[..., 1], a[..., 0])


def scaled(s: Interval, a: Interval) -> Interval:
    """A vector times a number."""
    return pair(s * a[..., 0], s * a[..., 1])


def turned(angle: Interval) -> Interval:
    """The direction `(-sin a, cos a)` of an angle; that of zero is exact."""
    middle = 0.5 * (angle.lo + angle.hi)
    eps = jnp.finfo(middle.dtype).eps
    known = (angle.lo == 0.0) & (angle.hi == 0.0)
    wide = jnp.maximum(angle.hi - middle, middle - angle.lo)
    slack = jnp.where(known, 0.0, (1.0 + 4.0 * eps) * wide + TURNED * eps)[..., None]
    there = jnp.stack([-jnp.sin(middle), jnp.cos(middle)], -1)
    return Interval(there - slack, there + slack).within(-1.0, 1.0)
