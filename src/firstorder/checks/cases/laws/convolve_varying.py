"""Convolve with a lobe whose width changes with x: D05 §4.5's semi-convolution."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.conventions import Frame
from firstorder.fields import Field, Function, GaussianProfile, Grid, Jet
from firstorder.laws import Convolve
from firstorder.transport.events.reflection import VaryingGaussian

PERIOD = 12.0  # of the width and of the window: its series is then spectrally accurate
TURN = 2.0 * np.pi / PERIOD


def width(x):
    """The lobe's width, written out."""
    return 0.35 + 0.1 * np.sin(3.0 * TURN * x + 0.4)


SIGMA = Function(lambda x, t: 0.35 + 0.1 * jnp.sin(3.0 * TURN * x + 0.4))
MIRRORED = Function(lambda x, t: SIGMA.function(-x, t))


def brute(u):
    """Adaptive quadrature of `f(x, s) g(x, theta - s)`."""
    x, t = u
    s0 = width(x)

    def product(s):
        return bell(x, s) * np.exp(-0.5 * ((t - s) / s0) ** 2) / (s0 * np.sqrt(2.0 * np.pi))

    return quad(product, t - 9.0 * s0, t + 9.0 * s0, epsabs=1e-13, epsrel=1e-13)[0]


CASES = (
    Case(
        "convolve, varying in x",
        Convolve(
            VaryingGaussian(SIGMA, 0.45),
            window=Grid.spanning((64, 64), (0.5 * PERIOD, 0.5 * PERIOD)),
        ),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        expected={"covariance": "refused", "wavelet": "refused"},
    ),
)


class Frozen(Field):
    """A width that does not tell how it changes."""

    sigma: Field

    @property
    def frame(self) -> Frame:
        """Frame of the width, unchanged."""
        return self.sigma.frame

    def at(self, u):
        """Value of the width, unchanged."""
        return self.sigma.at(u)

    def jet(self, u):
        """No derivatives."""
        still = jax.tree.map(jnp.zeros_like, self.sigma.jet(u))
        return Jet(self.at(u), still.gradient, still.hessian, self.frame)


def with_width(change):
    """Fault that changes the width of the law's kernel."""
    return lambda s: eqx.tree_at(lambda m: m.kernel.sigma, s, change(s.kernel.sigma))


def at_one_place(m, F, Omega):
    """The convolution theorem, as if the lobe were the same everywhere."""
    return F.at(Omega) * GaussianProfile(0.35).transform(Omega[1])


def backwards(m, F, Omega):
    """The series convolved as if it were correlated."""
    series = m.kernel.semi_series(Omega[1], m.window)
    shifted = jax.vmap(F.at)(Omega + series.frequencies)
    return jnp.sum(series.coefficients * shifted)


JETS = ("gradient", "hessian")
FAULTS = (
    Fault("mirror the width", with_width(lambda s: MIRRORED), ("value", *JETS, "spectrum")),
    Fault(
        "square the width",
        with_width(lambda s: Function(lambda x, t: SIGMA.function(x, t) ** 2)),
        ("value", *JETS, "spectrum"),
    ),
    Fault(
        "the same lobe everywhere",
        with_width(lambda s: Function(lambda x, t: 0.35 + 0.0 * x)),
        ("value", *JETS),
    ),
    Fault("forget that the width varies", with_width(Frozen), JETS),
    Fault("the plain theorem", lambda s: twin(s, spectrum=at_one_place), ("spectrum",)),
    Fault(
        "shift the harmonics the wrong way",
        lambda s: twin(s, spectrum=backwards),
        ("spectrum",),
    ),
)
