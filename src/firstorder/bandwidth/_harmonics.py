"""What a pixel leaves of the harmonics of something periodic, and roots of what bounds add up."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from firstorder._argument_checks import check_positive, check_real, is_concrete
from firstorder.bandwidth._spectral_norm import reach as times
from firstorder.numerics._select import safe_sqrt
from firstorder.typing import RealLike


def left_by_pixel(width: Array, cutoff_x: Array, frequency: Array, across: Array) -> Array:
    """`sqrt(t + u + t u)`, the filter's root mean square over a lattice of harmonics without zero.

    Harmonics lie in rows along a frequency f, and the rows `across` apart. Light moves all of them
    by up to `cutoff_x` along either. Along a row a Gaussian's squares sum up to at most
    `1 + 2 q^2 + 2 q^8 + ... < 1 + t` with `t = 2 q^2 / (1 - q^6)`, wherever the row begins, for
    the sum over a shifted row is largest where a harmonic lies at its middle.
    """
    along, between = (_along_row(width, f - cutoff_x) for f in (frequency, across))
    some = jnp.isfinite(along)
    row = jnp.where(some, along, 0.0)  # an endless one leaves nothing to multiply: 0 * inf is NaN
    both = safe_sqrt(row**2 + between**2 * (1.0 + row**2))
    return jnp.where(some & jnp.isfinite(across), both, along)


def _along_row(width: Array, apart: Array) -> Array:
    """`sqrt(2 / (1 - q^6)) q` with `q = exp(-2 pi^2 w^2 apart^2)`; infinite unless `apart > 0`."""
    near = jnp.isfinite(apart)
    fall = 2.0 * (np.pi * width * jnp.where(near, jnp.maximum(apart, 0.0), 1.0)) ** 2
    some = fall > 0.0
    fall = jnp.where(some, fall, 1.0)
    left = jnp.where(some, jnp.exp(-fall) * jnp.sqrt(-2.0 / jnp.expm1(-6.0 * fall)), jnp.inf)
    return jnp.where(near, left, 0.0)


def averaged_from(share: Array, rows: Array | bool) -> Array:
    """Cycles per standard deviation of a pixel at which it leaves at most a share of modulation.

    `2 y / (1 - y^3) <= t` for `y = q^2 = e (1 - e^3)`, `e = t / 2`, where t is `share^2` along one
    row of harmonics, and `sqrt(1 + share^2) - 1` where there are rows: `t + t + t^2 = share^2`.
    """
    square = jnp.where((share > 0) & (share <= 1), share, 0.5) ** 2
    e = 0.5 * jnp.where(rows, square / (1.0 + jnp.sqrt(1.0 + square)), square)
    return jnp.sqrt(-0.25 * jnp.log(e * (1.0 - e**3))) / np.pi


def times_share(modulation: Array, left: Array) -> Array:
    """`min(1, modulation) left`, nothing where nothing is modulated."""
    return times(jnp.minimum(1.0, modulation), left)


def over(a: Array | float, b: Array) -> Array:
    """Quotient, infinite where b is 0."""
    return jnp.where(b > 0, a / jnp.where(b > 0, b, 1.0), jnp.inf)


def root(first: Array, second: Array, e: Array) -> Array:
    """Where `first a + second a^2 = e`, infinite if both are 0."""
    square = first**2 + 4.0 * second * e
    found = jnp.sqrt(jnp.where(square > 0, square, 1.0))
    return over(2.0 * e, jnp.where(square > 0, first + found, 0.0))


def check_frequency_across(frequency: RealLike) -> None:
    """Refuse what is not positive; of grooves it is infinite."""
    check_real("frequency_across", frequency)
    if is_concrete(frequency):
        given = np.asarray(frequency, float)
        check_positive("frequency_across", np.where(given == np.inf, 1.0, given))
