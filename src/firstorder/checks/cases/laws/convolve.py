"""Convolve along the line with a fixed kernel that is not symmetric."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND, Frame, fourier_kernel
from firstorder.fields import Covariance, GaussianProfile, Jet, Profile
from firstorder.laws import Convolve
from firstorder.typing import Scalar, as_float

WIDTH, OFFSET = 0.3, 0.17


class Leaning(Profile):
    """A Gaussian lobe off its centre: a symmetric one hides the sign of the difference."""

    sigma: Scalar = eqx.field(converter=as_float)
    offset: Scalar = eqx.field(converter=as_float)
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=FLATLAND)

    def _upright(self):
        return GaussianProfile(self.sigma, self.axis, self.frame)

    def half_width(self):
        """Nine standard deviations about the offset."""
        return self._upright().half_width() + jnp.abs(self.offset)

    def derivatives(self, t):
        """Derivatives of the upright lobe, shifted."""
        return self._upright().derivatives(t - self.offset)

    def transform(self, Omega):
        """A phase for the offset."""
        phase = fourier_kernel(jnp.stack([Omega]), jnp.stack([self.offset]))
        return self._upright().transform(Omega) * phase

    def spread(self):
        """The phase has no power."""
        return self._upright().spread()


def lobe(t):
    """The kernel, written out."""
    return np.exp(-0.5 * ((t - OFFSET) / WIDTH) ** 2) / (WIDTH * np.sqrt(2.0 * np.pi))


def brute(u):
    """Adaptive quadrature of `f(x, s) g(theta - s)`."""
    x, t = u
    low, high = t - OFFSET - 3.0, t - OFFSET + 3.0
    return quad(lambda s: bell(x, s) * lobe(t - s), low, high, epsabs=1e-13, epsrel=1e-13)[0]


CASES = (
    Case(
        "convolve",
        Convolve(Leaning(WIDTH, OFFSET)),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        expected={"wavelet": "refused"},
    ),
)


def with_kernel(change):
    """Fault that changes the kernel of the law."""
    return lambda s: eqx.tree_at(lambda m: m.kernel, s, change(s.kernel))


def on_both_factors(m, f, u):
    """`f_theta * g` and `f * g_theta` both: what the chain rule does not ask for."""
    right = Convolve.jet(m, f, u)
    return Jet(right.value, right.gradient * jnp.array([1.0, 2.0]), right.hessian, right.frame)


def by_multiplying(m, S):
    """Covariances added, as for a product."""
    e = jnp.array([0.0, 1.0])
    return Covariance(S.matrix + m.kernel.spread() * e[:, None] * e, S.frame)


JETS = ("gradient", "hessian")
EVERY = ("value", *JETS, "spectrum")
FAULTS = (
    Fault("correlate", with_kernel(lambda g: Leaning(g.sigma, -g.offset)), EVERY),
    Fault(
        "a lobe wider by a tenth",
        with_kernel(lambda g: Leaning(1.1 * g.sigma, g.offset)),
        (*EVERY, "covariance"),
    ),
    Fault(
        "convolve over the position",
        with_kernel(lambda g: Leaning(g.sigma, g.offset, "x")),
        (*EVERY, "covariance"),
    ),
    Fault("differentiate both factors", lambda s: twin(s, jet=on_both_factors), ("gradient",)),
    Fault(
        "drop the 2 pi of the transform",
        lambda s: twin(
            s,
            spectrum=lambda m, F, w: F.at(w) * m.kernel.transform(w[1] / (2.0 * jnp.pi)),
        ),
        ("spectrum",),
    ),
    Fault("add covariances", lambda s: twin(s, covariance=by_multiplying), ("covariance",)),
)
