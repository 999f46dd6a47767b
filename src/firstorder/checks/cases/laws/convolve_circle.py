"""Convolve on the circle: all directions, and a Fourier series instead of an integral."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import i0e
from scipy.integrate import quad
from scipy.special import i0

from firstorder.checks.cases import RAYS
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND, Frame
from firstorder.errors import Refused
from firstorder.fields import Field, Function, Grid, Profile, SampledSpectrum
from firstorder.laws import Circle, Convolve
from firstorder.typing import Scalar, as_float

GRID = Grid.spanning((64, 33), (6.0, np.pi))
FREQUENCIES = np.array([-0.3, 0.0, 0.22]), np.array([-2.0, -1.0, 0.0, 1.0, 3.0]) / (2.0 * np.pi)
SHARP, LEAN = 3.0, 0.3


class Ring(Field):
    """Light from all around: a bell in x, a von Mises bell in theta that turns with x."""

    frame: Frame = eqx.field(static=True, default=FLATLAND)

    def _function(self):
        return Function(
            lambda x, t: jnp.exp(-2.0 * (x - 0.2) ** 2 + 1.5 * (jnp.cos(t - 0.4 - 0.5 * x) - 1.0))
        )

    def at(self, u):
        """The value."""
        return self._function().at(u)

    def jet(self, u):
        """By autodiff."""
        return self._function().jet(u)

    def spectrum(self):
        """Spectrum of one period, sampled; right at whole multiples of 1 / (2 pi)."""
        return SampledSpectrum.of(self, Grid.spanning((72, 40), (6.0, np.pi)))

    def covariance(self):
        """Refused."""
        raise Refused("Fourier series have no covariance rule here")


class VonMises(Profile):
    """`exp(k (cos(t - lean) - 1)) / c` with integral 1 over the circle."""

    sharpness: Scalar = eqx.field(converter=as_float)
    lean: Scalar = eqx.field(converter=as_float)
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=FLATLAND)

    def half_width(self):
        """Half a period."""
        return jnp.asarray(np.pi)

    def derivatives(self, t):
        """Chain rule."""
        k, a = self.sharpness, t - self.lean
        p = jnp.exp(k * (jnp.cos(a) - 1.0)) / (2.0 * np.pi * i0e(k))
        return p, -k * jnp.sin(a) * p, (k**2 * jnp.sin(a) ** 2 - k * jnp.cos(a)) * p

    def transform(self, Omega):
        """Over one period, by the trapezoid rule: spectrally accurate at the harmonics."""
        a = 2.0 * np.pi * np.arange(48) / 48
        values = self.derivatives(jnp.asarray(a))[0]
        return jnp.sum(values * jnp.exp(-2j * np.pi * Omega * a)) * 2.0 * np.pi / 48


def brute(u):
    """Adaptive quadrature over one fixed period."""
    x, t = u

    def product(s):
        ring = np.exp(-2.0 * (x - 0.2) ** 2 + 1.5 * (np.cos(s - 0.4 - 0.5 * x) - 1.0))
        return ring * np.exp(SHARP * np.cos(t - s - LEAN)) / (2.0 * np.pi * i0(SHARP))

    return quad(product, 0.0, 2.0 * np.pi, epsabs=1e-13, epsrel=1e-13)[0]


CASES = (
    Case(
        "convolve, circle",
        Convolve(VonMises(SHARP, LEAN), Circle()),
        Ring(),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        expected={"covariance": "refused", "wavelet": "refused"},
    ),
)


def with_kernel(change):
    """Fault that changes the kernel of the law."""
    return lambda s: eqx.tree_at(lambda m: m.kernel, s, change(s.kernel))


EVERY = ("value", "gradient", "hessian", "spectrum")
FAULTS = (
    Fault("correlate", with_kernel(lambda g: VonMises(g.sharpness, -g.lean)), EVERY),
    Fault("a lobe sharper by a tenth", with_kernel(lambda g: VonMises(3.3, g.lean)), EVERY),
    Fault(
        "divide by 2 pi",
        lambda s: twin(
            s,
            value=lambda m, f, u: Convolve.value(m, f, u) / (2.0 * np.pi),
            jet=lambda m, f, u: Convolve.jet(m, f, u).scaled(0.5 / np.pi),
            spectrum=lambda m, F, w: Convolve.spectrum(m, F, w) / (2.0 * np.pi),
        ),
        EVERY,
    ),
)
