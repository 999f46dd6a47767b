"""Integrate between ends that move with x, one of them on a curve."""

import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import bell, light
from firstorder.checks.cases.laws.integrate import FREQUENCIES, RAYS
from firstorder.checks.cases.laws.integrate_edge import interior, reversed_jump
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Affine, Function, Grid
from firstorder.laws import Integrate

LOWER = Affine([0.3, 0.0], -0.8)
UPPER = Function(lambda x, t: 0.4 + 0.2 * jnp.sin(2.0 * x))


def brute(u):
    """Adaptive quadrature between the same ends."""
    ends = 0.3 * u[0] - 0.8, 0.4 + 0.2 * np.sin(2.0 * u[0])
    return quad(lambda t: bell(u[0], t), *ends, epsabs=1e-13, epsrel=1e-13)[0]


CASES = (
    Case(
        "integrate, moving ends",
        Integrate("theta", LOWER, UPPER),
        light(),
        Grid.spanning((97,), (6.0,)),
        FREQUENCIES,
        RAYS,
        brute,
        expected={p: "refused" for p in ("spectrum", "covariance", "wavelet")},
    ),
)

JETS = ("gradient", "hessian")
FAULTS = (
    Fault("forget the end terms", lambda s: twin(s, jet=interior), JETS),
    Fault("flip the end terms", lambda s: twin(s, jet=reversed_jump), JETS),
    Fault(
        "hold the lower end still",
        lambda s: Integrate("theta", -0.8, s.upper),
        ("value", *JETS),
    ),
    Fault(
        "straighten the upper end",
        lambda s: Integrate("theta", s.lower, Affine([0.4, 0.0], 0.4)),
        ("value", *JETS),
    ),
    Fault(
        "exchange the ends",
        lambda s: Integrate("theta", s.upper, s.lower),
        ("value", *JETS),
    ),
)
