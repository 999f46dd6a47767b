"""Bumpy ground of flatland: height over a flat base, its normal, and how fast that turns.

    n(x) = arctan h'(x)        dn/dx = h''(x) / (1 + h'(x)^2)

`x` runs along the flat base. The profiles answer in closed form; `bumpy_ground` makes a polyline of
one.
"""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_finite,
    check_integer,
    check_not_negative,
    check_positive,
)
from firstorder._display import Module
from firstorder.flatland.shapes.build import polyline
from firstorder.flatland.shapes.kinds import Segments
from firstorder.typing import as_float


class Bumps(Module):
    """Ground `y = h(x)` over a flat base."""

    @abc.abstractmethod
    def heights(self, x: ArrayLike) -> tuple[Array, Array, Array]:
        """Height, slope and second derivative at positions on the base [m], [1], [1/m]."""

    def height(self, x: ArrayLike) -> Float[Array, "..."]:
        """Height over the base [m]."""
        return self.heights(x)[0]

    def normal(self, x: ArrayLike) -> Float[Array, "..."]:
        """Angle n of the normal, counter-clockwise from +y [rad]."""
        return jnp.arctan(self.heights(x)[1])

    def kappa(self, x: ArrayLike) -> Float[Array, "..."]:
        """Curvature along the base: rate of the normal, `dn/dx`, positive in a valley [rad/m]."""
        _, slope, second = self.heights(x)
        return second / (1.0 + slope**2)


class SineBumps(Bumps):
    """Ground in waves of one length: `h = amplitude sin(2 pi frequency x + phase)`.

    Args:
        amplitude: [m], not negative.
        frequency: cycles per metre, positive.
        phase: [rad].

    Raises:
        ValueError: if one is out of range.

    Reference: R07 Fig. 16 ("essentially a sine wave").

    Example:
        >>> from firstorder.flatland.library import SineBumps
        >>> waves = SineBumps(0.5, 1.0)
        >>> print(f"{waves.height(0.25).item():.3f} {waves.kappa(0.25).item():.3f}")
        0.500 -19.739
    """

    amplitude: Float[Array, ""] = eqx.field(converter=as_float, default=0.05)
    frequency: Float[Array, ""] = eqx.field(converter=as_float, default=2.0)
    phase: Float[Array, ""] = eqx.field(converter=as_float, default=0.0)

    def __check_init__(self):
        """Refuse what is no wave."""
        check_not_negative("amplitude", self.amplitude)
        check_positive("frequency", self.frequency)
        check_finite("phase", self.phase)

    def heights(self, x: ArrayLike) -> tuple[Array, Array, Array]:
        """The sine and its derivatives."""
        w = 2.0 * np.pi * self.frequency
        angle = w * as_float(x) + self.phase
        h = self.amplitude * jnp.sin(angle)
        return h, w * self.amplitude * jnp.cos(angle), -(w**2) * h


class ChirpBumps(Bumps):
    """Ground in waves that get shorter to the right, all of them about equally steep.

    `h = steepness / (2 pi f) sin(2 pi (frequency x + rate x^2 / 2))` with `f = frequency + rate x`,
    the local frequency: what equal bumps look like as they recede.

    Valid when: `f > 0`, so to the right of `-frequency / rate`; NaN elsewhere.

    Args:
        steepness: slope at the zero crossings, not negative.
        frequency: at x = 0, cycles per metre, positive.
        rate: how fast it rises, not negative [cycles per metre squared].

    Raises:
        ValueError: if one is out of range.

    Reference: R07 Fig. 17 ("bumps whose frequency varies, increasing from left-to-right").

    Example:
        >>> from firstorder.flatland.library import ChirpBumps
        >>> print(f"{ChirpBumps(0.6, 1.0, 2.0).heights(0.0)[1].item():.3f}")
        0.600
    """

    steepness: Float[Array, ""] = eqx.field(converter=as_float, default=0.6)
    frequency: Float[Array, ""] = eqx.field(converter=as_float, default=1.0)
    rate: Float[Array, ""] = eqx.field(converter=as_float, default=2.0)

    def __check_init__(self):
        """Refuse what is no chirp."""
        check_not_negative("steepness", self.steepness)
        check_positive("frequency", self.frequency)
        check_not_negative("rate", self.rate)

    def heights(self, x: ArrayLike) -> tuple[Array, Array, Array]:
        """With `h = a sin p`, `a = m / w`, `w = dp/dx`, `c = dw/dx`: the product rule."""
        x = as_float(x)
        f = self.frequency + self.rate * x
        w, c = 2.0 * np.pi * jnp.where(f > 0.0, f, jnp.nan), 2.0 * np.pi * self.rate
        p = 2.0 * np.pi * (self.frequency * x + 0.5 * self.rate * x**2)
        sin, cos, m = jnp.sin(p), jnp.cos(p), self.steepness
        slope = m * cos - m * c / w**2 * sin
        second = -m * w * sin - m * c / w * cos + 2.0 * m * c**2 / w**3 * sin
        return m / w * sin, slope, second


def bumpy_ground(bumps: Bumps, low: float, high: float, pieces: int) -> Segments:
    """The ground between two positions of the base as a polyline with normals upward.

    A polyline misses its curve by at most `max |h''| step^2 / 8`.

    Args:
        bumps: the profile.
        low: where it begins [m].
        high: where it ends, to the right of it [m].
        pieces: how many segments, equally far along the base.

    Raises:
        ValueError: if it ends before it begins, or has no piece.

    Example:
        >>> from firstorder.flatland.library import SineBumps, bumpy_ground
        >>> bumpy_ground(SineBumps(), -1.0, 1.0, 32).count
        32
    """
    check_integer("pieces", pieces)
    if pieces < 1:
        raise ValueError(f"Argument `pieces` must be positive, but is {pieces}.")
    check_positive("high - low", high - low)
    x = jnp.linspace(low, high, pieces + 1)
    return polyline(jnp.stack([x, bumps.height(x)], -1))
