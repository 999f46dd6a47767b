r"""Distant light of space: radiance as a function of the world direction it comes from.

A scene takes any function of a direction for its sky. These are the ones that a scene file can
name: the same from everywhere, a Gaussian lobe, a panorama, and one without its high harmonics.
All are continuous on the whole sphere, poles included, so that quadrature finds no jump in them.

A panorama is a picture once around and from pole to pole (equirectangular). Its top row is the
zenith, +z. The middle of a row looks along +y, the right of it along +x, as seen from inside:

    direction(u, v) = (sin(pi v) sin(psi), sin(pi v) cos(psi), cos(pi v)),    psi = 2 pi (u - 1/2),

with u from left to right and v from top to bottom in [0, 1]. Its horizon is flatland's
`PanoramaSky`.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_finite,
    check_not_negative,
    check_one_or_bands,
    check_positive,
    is_concrete,
    not_negative,
    traced_nan_unless,
)
from firstorder._display import Module
from firstorder.numerics._select import whole_below
from firstorder.numerics._vectors import dot, near_one, unit
from firstorder.scene._bands import by_band
from firstorder.typing import as_float

_FULL = 2.0 * np.pi
Directions = Float[Array, "*n 3"]
Numbers = Float[Array, "*n"]


def _radiance(L: Any) -> Array:
    """Radiance; NaN for a traced negative one."""
    return not_negative(as_float(L))


def _width(sigma: Any) -> Array:
    """A width; NaN for a traced one that is none."""
    return traced_nan_unless(lambda a: a > 0.0, as_float(sigma))


class ConstantSky(Module):
    """A sky of one radiance in every direction.

    Args:
        radiance: not negative [W/(m^2 sr)]; or one for each band.

    Raises:
        ValueError: if the radiance is negative or not finite.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import ConstantSky
        >>> ConstantSky(2.0)(jnp.array([0.0, 0.0, 1.0])).item()
        2.0
    """

    BANDED: ClassVar = {"radiance": 0}

    radiance: Float[Array, "*bands"] = eqx.field(converter=_radiance, default=1.0)

    def __check_init__(self):
        """Refuse darkness below zero."""
        check_one_or_bands("radiance", self.radiance)
        check_not_negative("radiance", self.radiance)

    @by_band()
    def __call__(self, w: Directions) -> Numbers:
        """Radiance from a world direction."""
        return jnp.broadcast_to(self.radiance, w.shape[:-1])


class GaussianSky(Module):
    r"""A lobe that is brightest in one direction: `L(w) = radiance exp((w . m - 1) / sigma^2)`.

    For small angles a from m it is `exp(-a^2 / (2 sigma^2))`, R07's light that is "maximal directly
    overhead". Unlike that function of the angle it is smooth on the whole sphere, the point
    opposite to m included. All around it gives `2 pi radiance sigma^2 (1 - exp(-2 / sigma^2))`.

    Args:
        center: direction of the maximum, of any length but zero [no unit].
        sigma: its standard deviation, positive [rad].
        radiance: at the maximum, not negative [W/(m^2 sr)]; or one for each band.

    Raises:
        ValueError: if sigma is not positive, the centre has no direction, or a number is not
            finite.

    Reference: R07 §7 (environment-lit net visibility), with the lobe of von Mises and Fisher.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import GaussianSky
        >>> sky = GaussianSky((0.0, 0.0, 1.0), 0.5)
        >>> print(f"{sky(jnp.array([0.6, 0.0, 0.8])).item():.6f}")
        0.449329
    """

    BANDED: ClassVar = {"radiance": 0}

    center: Float[Array, "3"] = eqx.field(converter=as_float, default=(0.0, 0.0, 1.0))
    sigma: Float[Array, ""] = eqx.field(converter=_width, default=0.5)
    radiance: Float[Array, "*bands"] = eqx.field(converter=_radiance, default=1.0)

    def __check_init__(self):
        """Refuse what is no Gaussian."""
        if jnp.shape(self.center) != (3,):
            raise ValueError(
                f"Argument `center` must have shape (3,), but has {jnp.shape(self.center)}."
            )
        check_finite("center", self.center)
        if is_concrete(self.center) and not np.any(np.asarray(self.center)):
            raise ValueError("Argument `center` must have a direction, but is the zero vector.")
        check_positive("sigma", self.sigma)
        check_one_or_bands("radiance", self.radiance)
        check_not_negative("radiance", self.radiance)

    @property
    def _middle(self) -> Float[Array, "3"]:
        """The unit direction m of the maximum."""
        return unit(near_one(self.center))

    @by_band()
    def __call__(self, w: Directions) -> Numbers:
        """Radiance from a world direction, a unit vector."""
        return self.radiance * jnp.exp((dot(w, self._middle) - 1.0) / self.sigma**2)

    @by_band(-2)
    def gradient(self, w: Directions) -> Float[Array, "*n 3"]:
        """The gradient on the sphere, along which the radiance grows most; tangential to w.

        `grad L = L (m - (w . m) w) / sigma^2`, in W/(m^2 sr rad).
        """
        m = self._middle
        toward = m - dot(w, m)[..., None] * w
        return (self(w) / self.sigma**2)[..., None] * toward


class PanoramaSky(Module):
    """An equirectangular picture, bilinear in its two angles (the module says which way it looks).

    Pixel (i, j) is the middle of its cell, `v = (i + 1/2) / rows`, `u = (j + 1/2) / columns`. The
    last column and the first are neighbours. Each pole has one value, the mean of the row next
    to it, and the half cells there are bilinear between that and the row: continuous everywhere,
    its slope jumps at rows and columns.

    The mean over the sphere is close to the pixels' mean weighted by `sin(pi v)`, not equal to it.

    Args:
        values: shape (rows >= 2, columns >= 4), from the zenith down and from left to right, and
            perhaps a last axis of bands; differentiable leaves [W/(m^2 sr)].

    Raises:
        ValueError: if there are fewer values, or one is negative or not finite.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import PanoramaSky
        >>> sky = PanoramaSky([[1.0, 1.0, 1.0, 1.0], [0.0, 0.0, 0.0, 4.0]])
        >>> print(sky(jnp.array([0.0, 0.0, 1.0])).item(), sky(jnp.array([0.0, 0.0, -1.0])).item())
        1.0 1.0
    """

    BANDED: ClassVar = {"values": 2}

    values: Float[Array, "rows columns *bands"] = eqx.field(converter=_radiance)

    def __check_init__(self):
        """Refuse what is too small to go around."""
        shape = jnp.shape(self.values)
        if len(shape) not in (2, 3) or shape[0] < 2 or shape[1] < 4:
            raise ValueError(
                f"Argument `values` must have shape (rows >= 2, columns >= 4), but has {shape}."
            )
        check_finite("values", self.values)
        check_not_negative("values", self.values)

    @by_band()
    def __call__(self, w: Directions) -> Numbers:
        """Radiance from a world direction, of any length but zero."""
        rows, columns = self.values.shape
        psi, theta = _angles(w)
        u = (psi / _FULL + 0.5) * columns - 0.5
        v = theta / np.pi * rows - 0.5
        j, i = whole_below(u), jnp.clip(whole_below(v), -1.0, rows - 1.0)
        at, row = j.astype(int), i.astype(int)
        fu = u - j
        # The half cells at the poles are half as high.
        top, bottom = row < 0, row >= rows - 1
        fv = jnp.where(top, 2.0 * v + 1.0, jnp.where(bottom, 2.0 * (v - i), v - i))

        def along(k):
            inner = jnp.clip(k, 0, rows - 1)
            here, there = self.values[inner, at % columns], self.values[inner, (at + 1) % columns]
            return here + fu * (there - here)

        poles = jnp.mean(self.values[0]), jnp.mean(self.values[-1])
        upper = jnp.where(top, poles[0], along(row))
        lower = jnp.where(bottom, poles[1], along(row + 1))
        return upper + fv * (lower - upper)

    @by_band()
    def harmonic(self, degree: int) -> HarmonicSky:
        """The panorama without spherical harmonics above a degree: smooth, poles included.

        Of the function that the bilinear picture is, by quadrature on four points a pixel, so that
        a constant stays what it is to rounding.

        Args:
            degree: the highest that stays, 0 for the mean.

        Raises:
            ValueError: if the degree is negative.
        """
        if degree < 0:
            raise ValueError(f"Argument `degree` must not be negative, but is {degree}.")
        rows, columns = self.values.shape
        z, weights = np.polynomial.legendre.leggauss(2 * max(rows, degree + 1))
        around = 2 * max(columns, degree + 1)
        psi = _FULL * (np.arange(around) + 0.5) / around
        s = np.sqrt(1.0 - z * z)
        w = np.stack([np.outer(s, np.sin(psi)), np.outer(s, np.cos(psi)),
                      np.broadcast_to(z[:, None], (len(z), around))], -1)  # fmt: skip
        w = jnp.asarray(w, self.values.dtype)
        each = jnp.asarray(weights * _FULL / around, self.values.dtype)
        # Row by row: all directions times all harmonics would be large.
        rows_of = jax.jit(lambda w: jax.lax.map(lambda row: self(row) @ _harmonics(row, degree), w))
        return HarmonicSky(each @ rows_of(w))


class HarmonicSky(Module):
    """A sum of real spherical harmonics, polynomials of the direction: smooth to any order.

    Args:
        coefficients: (degree + 1)^2 of them, by degree l = 0, 1, ... and within it by order
            m = -l ... l, those with the sine of the azimuth first; or shape (.., bands)
            [W/(m^2 sr)]. The harmonics are orthonormal, and of degree 1 positive along y, z and x:
            there is no factor (-1)^m.

    Raises:
        ValueError: if their number is no square, or one is not finite.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import HarmonicSky
        >>> sky = HarmonicSky([0.0, 0.0, (4.0 * jnp.pi / 3.0) ** 0.5, 0.0])  # w_z
        >>> print(sky(jnp.array([0.0, 0.6, 0.8])))
        0.8
    """

    BANDED: ClassVar = {"coefficients": 1}

    coefficients: Float[Array, "k *bands"] = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse what is no full set."""
        shape = jnp.shape(self.coefficients)
        if len(shape) not in (1, 2) or not shape[0] or round(shape[0] ** 0.5) ** 2 != shape[0]:
            raise ValueError(
                f"Argument `coefficients` must be 1, 4, 9, ... numbers, but has {shape}."
            )
        check_finite("coefficients", self.coefficients)

    @property
    def degree(self) -> int:
        """The highest degree."""
        return round(self.coefficients.shape[0] ** 0.5) - 1

    @by_band()
    def __call__(self, w: Directions) -> Numbers:
        """Radiance from a world direction, a unit vector."""
        return _harmonics(w, self.degree) @ self.coefficients


def _angles(w: Directions) -> tuple[Numbers, Numbers]:
    """Azimuth psi from +y to +x in [-pi, pi] and polar angle theta from +z in [0, pi].

    At the poles the azimuth is 0, and both have the derivative zero.
    """
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    flat = x * x + y * y
    off = flat > 0.0
    psi = jnp.arctan2(jnp.where(off, x, 0.0), jnp.where(off, y, 1.0))
    rho = jnp.where(off, jnp.sqrt(jnp.where(off, flat, 1.0)), 0.0)
    return psi, jnp.where(off, jnp.arctan2(rho, z), jnp.where(z < 0.0, np.pi, 0.0))


def _harmonics(w: Directions, degree: int) -> Float[Array, "*n k"]:
    r"""Real orthonormal spherical harmonics of all degrees up to one, as polynomials of (x, y, z).

    `Y_lm = N_lm Q_lm(z) (Re or Im of (x + i y)^|m|)`, in the order l = 0, 1, ..., and m = -l ... l
    with the imaginary parts (sin) first; `Q_lm` is the m-th derivative of the Legendre polynomial,
    by its recurrence in l. No angle occurs, so the poles are points like others.

    Args:
        w: unit vectors.
        degree: the highest.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space.skies import _harmonics
        >>> up = _harmonics(jnp.array([0.0, 0.0, 1.0]), 1)
        >>> [round(float(v), 3) for v in up * jnp.sqrt(4.0 * jnp.pi / 3.0)]
        [0.577, 0.0, 1.0, 0.0]
    """
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    cosine, sine = jnp.ones_like(z), jnp.zeros_like(z)
    found: dict[tuple[int, int], Array] = {}
    start = math.sqrt(0.25 / np.pi)  # N_mm times (2 m - 1)!!, kept together against overflow
    for m in range(degree + 1):
        if m:
            cosine, sine = x * cosine - y * sine, x * sine + y * cosine
            start *= math.sqrt((2 * m + 1) / (2 * m))
        before, here = jnp.zeros_like(z), jnp.full_like(z, start)
        for k in range(m, degree + 1):
            scale = math.sqrt(2.0) if m else 1.0
            found[k, m] = scale * here * cosine
            if m:
                found[k, -m] = scale * here * sine
            n = k + 1
            a = math.sqrt((4.0 * n * n - 1.0) / (n * n - m * m))
            b = math.sqrt(((n - 1.0) ** 2 - m * m) / (4.0 * (n - 1.0) ** 2 - 1.0)) if k > m else 0.0
            before, here = here, a * (z * here - b * before)
    return jnp.stack([found[k, m] for k in range(degree + 1) for m in range(-k, k + 1)], -1)


Sky: TypeAlias = ConstantSky | GaussianSky | PanoramaSky | HarmonicSky
