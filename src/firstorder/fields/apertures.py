"""Apertures: bars, gratings and soft slits, transparencies along one linear form of the ray."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import erf
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_finite,
    check_kind,
    check_positive,
    is_concrete,
    nan_unless,
)
from firstorder.conventions import Frame, fourier_kernel
from firstorder.errors import Refused
from firstorder.fields._level_series import level_range, level_series, stair_series
from firstorder.fields._series import Series
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Affine, Constant, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid
from firstorder.typing import Ray, Scalar, as_float


class Bars(Field):
    """A stair of constant heights: `heights[k]` between the places k - 1 and k of `level`.

    `V(u) = heights[0] + sum_k (heights[k + 1] - heights[k]) H(level(u) - places[k])`, and on an
    edge the mean of its sides. A slit has two places, a comb of N teeth 2 N.

    Args:
        level: the linear form along which it varies.
        places: m increasing values of `level` where it jumps.
        heights: the m + 1 values between them.

    Raises:
        ValueError: if the places do not increase, or there is not one height more than places.

    Example:
        >>> from firstorder.fields import Affine
        >>> from firstorder.fields import Bars
        >>> slit = Bars(Affine([1.0, 0.0], 0.0), [-1.0, 1.0], [0.0, 1.0, 0.0])
        >>> slit(0.3, 0.0).item(), slit(1.3, 0.0).item()
        (1.0, 0.0)
    """

    level: Affine
    places: Float[Array, " m"] = eqx.field(converter=as_float)
    heights: Float[Array, " k"] = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse places out of order."""
        check_kind("level", self.level, Affine, "an `Affine`")
        check_finite("places", self.places)
        if self.heights.shape != (self.places.size + 1,):
            raise ValueError(
                f"Argument `heights` must have {self.places.size + 1} entries, "
                f"but has {self.heights.size}."
            )
        if is_concrete(self.places) and np.any(np.diff(np.asarray(self.places)) <= 0):
            raise ValueError("Argument `places` must increase, but does not.")

    @property
    def frame(self) -> Frame:
        """Frame of the level."""
        return self.level.frame

    @property
    def jumps(self) -> Float[Array, " m"]:
        """Height above each place minus the height below it."""
        heights = self._heights
        return heights[1:] - heights[:-1]

    @property
    def _heights(self) -> Float[Array, " k"]:
        """The heights; NaN if traced places are out of order."""
        return nan_unless(jnp.all(self.places[1:] > self.places[:-1]), self.heights)

    def at(self, u: Ray) -> Scalar:
        """The height there; on an edge, the mean of its sides."""
        side = 0.5 * (1.0 + jnp.sign(self.level.at(u) - self.places))
        return self._heights[0] + jnp.sum(self.jumps * side)

    def jet(self, u: Ray) -> Jet:
        """Flat between the edges."""
        return _flat(self, u)

    def edges(self) -> tuple[Edge, ...]:
        """One straight edge at each place."""
        return tuple(
            Edge(_raised(self.level, -self.places[k]), Constant(self.jumps[k], self.frame))
            for k in range(self.places.size)
        )

    def steps(self) -> tuple[Affine, Float[Array, " m"], Float[Array, " k"]]:
        """Level, places where it jumps, and the heights between them."""
        return self.level, self.places, self._heights

    def series(self, window: Grid) -> Series:
        """Closed form: each coefficient is exact on the window (see `stair_series`)."""
        return stair_series(*self.steps(), window)

    def covariance(self) -> Covariance:
        """Refused: an edge has none."""
        raise Refused("an edge has an infinite covariance: soften it, or see it under a window")


class Grating(Field):
    """Bars without end: `above` on the fraction `open` of every period, `below` on the rest.

    The spectrum is a comb of Diracs at multiples of `1 / period` under a sinc:
    `c_k = (above - below) sin(pi k open) / (pi k)`.

    Args:
        level: the linear form along which it varies; level 0 is the middle of an opening.
        period: in the unit of `level`.
        open: fraction of a period that is open, in (0, 1).
        below: transparency of the bars.
        above: transparency between them.
        teeth: how many bars on each side of level 0 report their edges; light must not reach
            farther.

    Raises:
        ValueError: if `period` is not positive or `open` lies outside (0, 1).

    Example:
        >>> from firstorder.fields import Affine
        >>> from firstorder.fields import Grating
        >>> comb = Grating(Affine([1.0, 0.0], 0.0), 2.0, 0.5)
        >>> comb(4.0, 0.0).item(), comb(5.0, 0.0).item()
        (1.0, 0.0)
    """

    level: Affine
    period: Scalar = eqx.field(converter=as_float)
    open: Scalar = eqx.field(converter=as_float, default=0.5)
    below: Scalar = eqx.field(converter=as_float, default=0.0)
    above: Scalar = eqx.field(converter=as_float, default=1.0)
    teeth: int = eqx.field(static=True, default=4)

    def __check_init__(self):
        """Refuse bars that have no width."""
        check_kind("level", self.level, Affine, "an `Affine`")
        check_positive("period", self.period)
        check_positive("open", self.open)
        if is_concrete(self.open) and float(self.open) >= 1.0:
            raise ValueError(f"Argument `open` must be less than 1, but is {self.open}.")

    @property
    def frame(self) -> Frame:
        """Frame of the level."""
        return self.level.frame

    @property
    def _contrast(self) -> Scalar:
        """`above - below`; NaN for traced bars that have no width."""
        valid = (self.period > 0) & (self.open > 0) & (self.open < 1)
        return nan_unless(valid, self.above - self.below)

    def at(self, u: Ray) -> Scalar:
        """Open or not; the mean of both on an edge."""
        t = self.level.at(u) / self.period
        away = jnp.abs(t - jnp.round(t))  # from the middle of the nearest opening, in periods
        side = 0.5 * (1.0 + jnp.sign(0.5 * self.open - away))
        return self.below + self._contrast * side

    def jet(self, u: Ray) -> Jet:
        """Flat between the edges."""
        return _flat(self, u)

    def edges(self) -> tuple[Edge, ...]:
        """Both ends of the openings nearest to level 0."""
        found = []
        for k in range(-self.teeth, self.teeth + 1):
            for side in (-1.0, 1.0):
                place = self.period * (k + 0.5 * side * self.open)
                jump = Constant(-side * self._contrast, self.frame)
                found.append(Edge(_raised(self.level, -place), jump))
        return tuple(found)

    def series(self, window: Grid) -> Series:
        """A comb under a sinc; the window says how many harmonics are kept."""
        half = max(window.size) // 2
        k = np.arange(-half, half + 1)
        c = self._contrast * self.open * jnp.sinc(k * self.open)
        c = c + jnp.where(k == 0, self.below, 0.0)
        phase = fourier_kernel(jnp.asarray(k)[:, None] / self.period, -self.level.offset[None])
        return Series((k / self.period)[:, None] * self.level.normal, c * phase)

    def covariance(self) -> Covariance:
        """Refused: an edge has none."""
        raise Refused("an edge has an infinite covariance: soften it, or see it under a window")


class SoftSlit(Field):
    """A slit with edges blurred by a Gaussian: `V = Phi((s - a) / b) - Phi((s - a - w) / b)`.

    With `s = level(u)`, Phi the normal distribution, w the width and b the blur: smooth, so it has
    a covariance.

    Args:
        level: the linear form s; the slit is centred at level 0.
        width: distance w between the blurred edges [unit of the level].
        blur: standard deviation b of the blur.

    Raises:
        ValueError: if `width` or `blur` is not positive.

    Example:
        >>> from firstorder.fields import Affine
        >>> from firstorder.fields import SoftSlit
        >>> V = SoftSlit(Affine([1.0, 0.0], 0.0), 2.0, 0.1)
        >>> round(V(1.0, 0.0).item(), 12)  # on a blurred edge
        0.5
    """

    level: Affine
    width: Scalar = eqx.field(converter=as_float)
    blur: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse a slit that is none."""
        check_kind("level", self.level, Affine, "an `Affine`")
        check_positive("width", self.width)
        check_positive("blur", self.blur)

    @property
    def frame(self) -> Frame:
        """Frame of the level."""
        return self.level.frame

    def at(self, u: Ray) -> Scalar:
        """Difference of two blurred steps."""
        return self._profile(self.level.at(u))[0]

    def jet(self, u: Ray) -> Jet:
        """Chain rule along the level's normal."""
        n = self.level.normal
        V, first, second = self._profile(self.level.at(u))
        return Jet(V, first * n, second * n[:, None] * n, self.frame)

    @property
    def _sizes(self) -> tuple[Scalar, Scalar]:
        """Width and blur; NaN for traced ones that are none."""
        valid = (self.width > 0) & (self.blur > 0)
        return nan_unless(valid, self.width), nan_unless(valid, self.blur)

    def _profile(self, s: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """V and its first two derivatives in s."""
        w, b = self._sizes
        low, high = (s + 0.5 * w) / b, (s - 0.5 * w) / b
        V = 0.5 * (erf(low / np.sqrt(2.0)) - erf(high / np.sqrt(2.0)))
        bells = [jnp.exp(-0.5 * t**2) / (b * np.sqrt(2.0 * np.pi)) for t in (low, high)]
        return V, bells[0] - bells[1], (high * bells[1] - low * bells[0]) / b

    def series(self, window: Grid) -> Series:
        """A sinc under a Gaussian, sampled at the harmonics of the window."""
        w, b = self._sizes
        low, high = level_range(self.level, window)
        reach = 0.5 * w + 9.0 * b  # a period holds all of the slit, and all of the window

        def coefficients(k, period):
            s = jnp.asarray(k) / period
            return w * jnp.sinc(w * s) * jnp.exp(-2.0 * (np.pi * b * s) ** 2) / period

        low, high = jnp.minimum(low, -reach), jnp.maximum(high, reach)
        return level_series(coefficients, self.level, low, high, window)

    def covariance(self) -> Covariance:
        """`int V'^2 / (4 pi^2 int V^2)` along the normal, in closed form."""
        w, b = self._sizes
        lost = -jnp.expm1(-(w**2) / (4.0 * b**2))
        slope2 = lost / (b * np.sqrt(np.pi))
        power = w * erf(0.5 * w / b) - 2.0 * b / np.sqrt(np.pi) * lost
        n = self.level.normal
        return Covariance(slope2 / (4.0 * np.pi**2 * power) * n[:, None] * n, self.frame)


def _flat(field: Field, u: Ray) -> Jet:
    """The jet of a field that is constant between its edges."""
    n = u.size
    return Jet(field.at(u), jnp.zeros(n, u.dtype), jnp.zeros((n, n), u.dtype), field.frame)


def _raised(level: Affine, by) -> Affine:
    """The level plus a constant."""
    return Affine(level.normal, level.offset + by, level.frame)
