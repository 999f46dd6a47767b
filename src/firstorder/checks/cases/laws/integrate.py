"""Integrate over the angle, from far outside the light to far outside."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Covariance, Grid
from firstorder.laws import Integrate

FREQUENCIES = (np.array([-0.45, -0.1, 0.0, 0.33]),)
RAYS = np.array([[0.3], [-0.4], [0.7]])


def brute(u):
    """Adaptive quadrature."""
    return quad(lambda t: bell(u[0], t), -6.0, 6.0, epsabs=1e-13, epsrel=1e-13)[0]


CASES = (
    Case(
        "integrate",
        Integrate("theta", -6.0, 6.0),
        light(),
        Grid.spanning((97,), (6.0,)),
        FREQUENCIES,
        RAYS,
        brute,
        Grid.spanning((32, 32), (4.5, 4.5)),
    ),
)


def scaled(factor):
    """The law times a constant, in all portraits that are linear."""
    return lambda s: twin(
        s,
        value=lambda m, f, u: factor * Integrate.value(m, f, u),
        jet=lambda m, f, u: Integrate.jet(m, f, u).scaled(factor),
        spectrum=lambda m, F, w: factor * Integrate.spectrum(m, F, w),
        wavelet=lambda m, W: _times(Integrate.wavelet(m, W), factor),
    )


def _times(W, factor):
    return eqx.tree_at(lambda w: w.coefficients, W, W.coefficients * factor)


def marginal(m, S):
    """The block of the covariance: projected, not conditioned."""
    return Covariance(S.matrix[:1, :1], m.frame(S.frame))


def added(m, S):
    """The Schur complement with its sign flipped."""
    flipped = 2.0 * S.matrix[:1, :1] - Integrate.covariance(m, S).matrix
    return Covariance(flipped, m.frame(S.frame))


JETS = ("gradient", "hessian")
FAULTS = (
    Fault(
        "integrate over the position",
        lambda s: Integrate("x", s.lower, s.upper),
        ("value", *JETS, "spectrum", "covariance", "wavelet"),
    ),
    Fault("take the mean", scaled(1.0 / 12.0), ("value", *JETS, "spectrum", "wavelet")),
    Fault("divide by 2 pi", scaled(0.5 / np.pi), ("value", *JETS, "spectrum", "wavelet")),
    Fault("start at zero", lambda s: Integrate("theta", 0.0, s.upper), ("value", *JETS)),
    Fault(
        "slice beside zero frequency",
        lambda s: twin(s, spectrum=lambda m, F, w: F.at(jnp.insert(w, 1, 0.1))),
        ("spectrum",),
    ),
    Fault("project the covariance", lambda s: twin(s, covariance=marginal), ("covariance",)),
    Fault("flip the Schur complement", lambda s: twin(s, covariance=added), ("covariance",)),
    Fault(
        "the printed factor 1",
        lambda s: twin(s, wavelet=lambda m, W: _times(Integrate.wavelet(m, W), 1.0 / 3.0)),
        ("wavelet",),
    ),
)
