"""Distant light of flatland: radiance as a function of the world angle it comes from.

A scene takes any function of an angle for its environment. These are the ones that a scene file can
name: the same from everywhere, a Gaussian, and a row of numbers once around the horizon. `breaks`
are the angles at which they are not smooth, and quadrature has to cut there.
"""

from __future__ import annotations

from typing import Any, ClassVar, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_finite,
    check_not_negative,
    check_one_or_bands,
    check_positive,
    not_negative,
    traced_nan_unless,
)
from firstorder._display import Module
from firstorder.numerics._select import whole_below
from firstorder.scene._bands import by_band
from firstorder.typing import as_float

_FULL = 2.0 * np.pi


def _radiance(L: Any) -> Array:
    """Radiance; NaN for a traced negative one."""
    return not_negative(as_float(L))


def _width(sigma: Any) -> Array:
    """A width; NaN for a traced one that is none."""
    return traced_nan_unless(lambda a: a > 0.0, as_float(sigma))


class ConstantSky(Module):
    """A sky of one radiance in every direction.

    Args:
        radiance: one number, or one for each band, not negative [W/(m rad)].

    Raises:
        ValueError: if the radiance is negative or not finite.

    Example:
        >>> from firstorder.flatland import ConstantSky
        >>> ConstantSky(2.0)(0.3).item()
        2.0
    """

    BANDED: ClassVar = {"radiance": 0}

    radiance: Float[Array, "*bands"] = eqx.field(converter=_radiance, default=1.0)

    def __check_init__(self):
        """Refuse darkness below zero."""
        check_one_or_bands("radiance", self.radiance)
        check_not_negative("radiance", self.radiance)

    @by_band()
    def __call__(self, angle: ArrayLike) -> Float[Array, "..."]:
        """Radiance from a world angle, counter-clockwise from +y [rad]."""
        return jnp.broadcast_to(self.radiance, jnp.shape(angle))

    @property
    def breaks(self) -> Float[Array, " b"]:
        """None."""
        return jnp.zeros(0, self.radiance.dtype)


class GaussianSky(Module):
    """Light that is brightest in one direction and falls off as a Gaussian, wrapped once around.

    `L(a) = radiance sum_k exp(-(a - center + 2 pi k)^2 / (2 sigma^2))`, which is smooth on the
    whole circle. With `sigma` up to about 0.6 rad the terms other than the nearest are below
    rounding wherever a receiver that faces the centre can see.

    Valid when: sigma is below some 2.5 rad; five terms are summed, and beyond that the ones left
    out show.

    Args:
        center: world angle of the maximum, counter-clockwise from +y [rad].
        sigma: standard deviation, positive [rad].
        radiance: at the maximum, not negative [W/(m rad)]; or one for each band.

    Raises:
        ValueError: if sigma is not positive, or a number is not finite.

    Reference: R07 §6.3 ("Gaussian variation in lighting, being maximal directly overhead").

    Example:
        >>> from firstorder.flatland import GaussianSky
        >>> sky = GaussianSky(0.0, 0.5)
        >>> print(f"{sky(0.5).item():.6f} {sky(0.5 - 6.283185307179586).item():.6f}")
        0.606531 0.606531
    """

    BANDED: ClassVar = {"radiance": 0}

    center: Float[Array, ""] = eqx.field(converter=as_float, default=0.0)
    sigma: Float[Array, ""] = eqx.field(converter=_width, default=0.5)
    radiance: Float[Array, "*bands"] = eqx.field(converter=_radiance, default=1.0)

    def __check_init__(self):
        """Refuse what is no Gaussian."""
        check_finite("center", self.center)
        check_positive("sigma", self.sigma)
        check_one_or_bands("radiance", self.radiance)
        check_not_negative("radiance", self.radiance)

    @by_band()
    def __call__(self, angle: ArrayLike) -> Float[Array, "..."]:
        """Radiance from a world angle, counter-clockwise from +y [rad]."""
        d = as_float(angle) - self.center
        turns = jax.lax.stop_gradient(jnp.round(d / _FULL))
        k = jnp.arange(-2.0, 3.0, dtype=d.dtype) - turns[..., None]
        z = (d[..., None] + _FULL * k) / self.sigma
        return self.radiance * jnp.sum(jnp.exp(-0.5 * z * z), -1)

    @property
    def breaks(self) -> Float[Array, " b"]:
        """None."""
        return jnp.zeros(0, self.sigma.dtype)


class PanoramaSky(Module):
    """A panorama: radiances in equal columns once around the horizon, left to right.

    The middle of the row is straight up (+y, angle 0); to the right of it lies +x, as on a map that
    one holds with +y ahead, so angles fall from +pi at the left end to -pi at the right. Value j
    stands at the middle of its column, `pi - 2 pi (j + 1/2) / n`, and neighbours are joined by
    straight lines (continuous; its slope jumps at every column) or by Catmull-Rom cubics (once
    continuously differentiable; may overshoot beside a jump). Both keep the mean of the row, and
    the first and the last column are neighbours.

    Args:
        values: n >= 4 radiances, differentiable leaves; or shape (n, bands) [W/(m rad)].
        smooth: cubics instead of lines.

    Raises:
        ValueError: if there are fewer than four values, or one is negative or not finite.

    Example:
        >>> import numpy as np
        >>> from firstorder.flatland import PanoramaSky
        >>> sky = PanoramaSky([1.0, 2.0, 3.0, 4.0])
        >>> print(sky(0.25 * np.pi).item(), sky(0.0).item(), sky(np.pi).item())
        2.0 2.5 2.5
    """

    BANDED: ClassVar = {"values": 1}

    values: Float[Array, "n *bands"] = eqx.field(converter=_radiance)
    smooth: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse what is too short to go around."""
        shape = jnp.shape(self.values)
        if len(shape) not in (1, 2) or shape[0] < 4:
            raise ValueError(f"Argument `values` must be four or more numbers, but has {shape}.")
        check_finite("values", self.values)
        check_not_negative("values", self.values)

    @by_band()
    def __call__(self, angle: ArrayLike) -> Float[Array, "..."]:
        """Radiance from a world angle, counter-clockwise from +y [rad]."""
        n = self.values.shape[0]
        column = (np.pi - jnp.asarray(angle, self.values.dtype)) * (n / _FULL) - 0.5
        j = whole_below(column)
        f = column - j
        at = j.astype(int)
        here, there = self.values[at % n], self.values[(at + 1) % n]
        if not self.smooth:
            return here + f * (there - here)
        before, after = self.values[(at - 1) % n], self.values[(at + 2) % n]
        a = 3.0 * (here - there) + after - before
        b = 2.0 * before - 5.0 * here + 4.0 * there - after
        return here + 0.5 * f * (there - before + f * (b + f * a))

    @property
    def breaks(self) -> Float[Array, " n"]:
        """The middles of the columns, from left to right: falling angles."""
        n = self.values.shape[0]
        return np.pi - _FULL * (jnp.arange(n, dtype=self.values.dtype) + 0.5) / n

    @by_band()
    def coarser(self, columns: int) -> PanoramaSky:
        """A row of fewer columns with the same mean: each the average of what it covers.

        Args:
            columns: how many, from 4 to as many as there are.

        Raises:
            ValueError: if there are not that many, or fewer than four.
        """
        n = self.values.shape[0]
        if not 4 <= columns <= n:
            raise ValueError(f"Argument `columns` must lie in [4, {n}], but is {columns}.")
        total = jnp.concatenate([jnp.zeros(1, self.values.dtype), jnp.cumsum(self.values)])
        ends = jnp.arange(columns + 1) * (n / columns)
        sums = jnp.interp(ends, jnp.arange(n + 1.0), total)
        means = jnp.diff(sums) * (columns / n)
        return PanoramaSky(jnp.where(means < 0.0, 0.0, means), self.smooth)  # by rounding


Sky: TypeAlias = ConstantSky | GaussianSky | PanoramaSky
