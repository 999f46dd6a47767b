"""Stairs: factors that jump along a linear form, and their product where their levels are parallel.

The Fourier series of an edge falls off as 1/k, and so does the spectrum of light behind it. Two
edges whose levels are parallel would make a sum of 1/k^2, whose truncation is felt. But their
product is again a stair along the same form, known exactly: it is formed first, and only one series
meets the light.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import is_concrete
from firstorder._display import Module
from firstorder.fields._level_series import stair_waves
from firstorder.fields._series import Series
from firstorder.fields.apertures import Bars
from firstorder.fields.field import Affine, Field
from firstorder.fields.mask import HalfPlane
from firstorder.laws.base import FieldImage
from firstorder.laws.move import Move
from firstorder.numerics._order import order_of
from firstorder.typing import Scalar


class Stair(Module):
    """`heights[j]` where `places[j - 1] < level < places[j]`, as a series of a stated period.

    Attributes:
        level: the linear form along which it varies.
        places: m values of the level where it jumps, in increasing order; equal ones are allowed.
        heights: the m + 1 values between them.
        low: start of the period of its series, a value of the level.
        high: its end; the light must lie between the two.
        harmonics: waves on each side of zero.
    """

    level: Affine
    places: Float[Array, " m"]
    heights: Float[Array, " k"]
    low: Scalar
    high: Scalar
    harmonics: int = eqx.field(static=True)

    def series(self) -> Series:
        """The Fourier series on its period."""
        return stair_waves(
            self.level, self.places, self.heights, self.low, self.high, self.harmonics
        )

    def moved(self, move: Move) -> Stair:
        """The stair in the coordinates after a move; its values and its period stay."""
        return eqx.tree_at(lambda s: s.level, self, move.level(self.level))


Steps = tuple[Affine, Array, Array]


def steps_of(field: Field) -> Steps | None:
    """Level, places and heights of a field that is a stair along a linear form, or None."""
    if type(field) is HalfPlane or type(field) is Bars:
        return field.steps()
    if type(field) is FieldImage and type(field.law) is Move:
        steps = steps_of(field.operand)
        if steps is not None:
            level = field.law.level(steps[0])
            assert isinstance(level, Affine)  # a straight level stays straight
            return level, *steps[1:]
    return None


def merged(stairs: list[Stair]) -> list[Stair]:
    """Product of stairs in which those of parallel levels are made one.

    Where it cannot be known yet whether two levels are parallel, because they are traced, both
    stairs stay, and where they are, the one takes all steps and the other becomes 1.
    """
    found: list[Stair] = []
    for stair in stairs:
        rest: Stair | None = stair
        for i, other in enumerate(found):
            if rest is not None:
                found[i], rest = _pair(other, rest)
        if rest is not None:
            found.append(rest)
    return found


def _pair(a: Stair, b: Stair) -> tuple[Stair, Stair | None]:
    """Two stairs whose product is that of a and b: the second None, or 1, where they merge."""
    concrete = is_concrete((a.level.normal, b.level.normal))
    parallel, ratio = _parallel(
        *((np if concrete else jnp).asarray(s.level.normal) for s in (a, b))
    )
    if concrete and not parallel:
        return a, b
    # level_b = ratio level_a + (offset_b - ratio offset_a)
    shift = b.level.offset - ratio * a.level.offset
    places = (b.places - shift) / ratio
    turned = ratio < 0
    places = jnp.where(turned, places[::-1], places)
    heights = jnp.where(turned, b.heights[::-1], b.heights)
    ends = jnp.stack([b.low - shift, b.high - shift]) / ratio
    all_places, all_heights = _product(a.places, a.heights, places, heights)
    # Both periods hold the light, so what they share does, with the finest waves for their count.
    low, high = jnp.maximum(a.low, jnp.min(ends)), jnp.minimum(a.high, jnp.max(ends))
    low, high = jnp.where(high > low, low, a.low), jnp.where(high > low, high, a.high)
    harmonics = max(a.harmonics, b.harmonics)
    both = Stair(a.level, all_places, all_heights, low, high, harmonics)
    if concrete:
        return both, None
    m = b.places.size
    alone = Stair(
        a.level,
        jnp.concatenate([a.places, jnp.broadcast_to(a.places[-1:], (m,))]),
        jnp.concatenate([a.heights, jnp.broadcast_to(a.heights[-1:], (m,))]),
        a.low,
        a.high,
        harmonics,
    )
    first = jax.tree.map(lambda x, y: jnp.where(parallel, x, y), both, alone)
    one = jnp.where(parallel, jnp.ones_like(b.heights), b.heights)
    return first, eqx.tree_at(lambda s: s.heights, b, one)


def _parallel(a, b):
    """Whether two normals are parallel to rounding, and the ratio b / a (1 where they are not)."""
    xp = np if isinstance(a, np.ndarray) else jnp
    k = xp.argmax(xp.abs(a * b))  # entry by entry: they have units of their own
    ratio = b[k] / xp.where(a[k] == 0.0, 1.0, a[k])
    rounding = 64.0 * float(jnp.finfo(a.dtype).eps) * (xp.abs(b) + xp.abs(ratio * a))
    parallel = xp.all(xp.abs(b - ratio * a) <= rounding) & (ratio != 0.0)
    return parallel, xp.where(parallel, ratio, 1.0)


def _product(p: Array, f: Array, q: Array, g: Array) -> tuple[Array, Array]:
    """Places and heights of the product of two stairs along the same form."""
    places = jnp.concatenate([p, q])
    order = order_of(places)
    first = jnp.concatenate([jnp.zeros(1, int), jnp.cumsum(order < p.size)])
    second = jnp.arange(places.size + 1) - first
    return places[order], f[first] * g[second]
