"""Diffuse shading of smooth light in slopes: weigh, then gather.

The covariance rule takes the weight for a Gaussian, which it is not: measured, approximate.
"""

import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import bell, light
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Covariance, Grid
from firstorder.laws import Integrate, Multiply
from firstorder.transport.event import Chain
from firstorder.transport.events.diffuse import (
    DifferentialIrradiance,
    Gather,
    SlopeWeight,
    diffuse,
)

RHO, REACH = 0.4, 4.0
WINDOW = Grid.spanning((96, 128), (6.0, REACH))
GATHER = Gather(reach=REACH, nodes=64)


def irradiance(u):
    """Adaptive quadrature over the angle, of light times the cosine."""
    integral = quad(
        lambda theta: np.cos(theta) * bell(u[0], np.tan(theta)),
        np.arctan(-REACH),
        np.arctan(REACH),
        epsabs=1e-13,
        epsrel=1e-13,
        limit=200,
    )
    return RHO * integral[0]


CASES = (
    Case(
        "diffuse shading",
        diffuse(RHO, REACH, WINDOW),
        light(FLATLAND_SLOPE),
        Grid.spanning((97,), (5.0,)),
        (np.array([-0.45, -0.1, 0.0, 0.2, 0.33]),),
        np.array([[0.3], [-0.6], [0.9]]),
        irradiance,
        Grid.spanning((16, 64), (3.0, REACH)),
        bounds={"covariance": 1e-2},
        expected={"covariance": "approximate"},
    ),
)


class _NoCosine(SlopeWeight):
    """The Jacobian of the angle alone, 1 / (1 + v^2)."""

    @property
    def _exponent(self) -> float:
        return 1.0


def weighted(change):
    """The step with the law of the weight changed."""
    return lambda s: Chain((twin_law(s.events[0], change), *s.events[1:]))


def gathered(change):
    """The step with the law of the sum changed."""
    return lambda s: s.events[0] >> twin_law(s.events[1], change)


NUMBERS = ("value", "gradient", "hessian", "spectrum", "wavelet")
FAULTS = (
    Fault(
        "forget the cosine",
        weighted(lambda m: Multiply(_NoCosine(FLATLAND_SLOPE, RHO), WINDOW)),
        NUMBERS,
    ),
    Fault(
        "lose three tenths",
        weighted(lambda m: Multiply(0.7 * SlopeWeight(FLATLAND_SLOPE, RHO), WINDOW)),
        NUMBERS,
    ),
    Fault(
        "rho twice",
        lambda s: DifferentialIrradiance(RHO**2, WINDOW) >> GATHER,
        NUMBERS,
    ),
    Fault(
        "the upper half of the slopes",
        gathered(lambda m: Integrate("v", 0.0, REACH)),
        ("value", "gradient", "hessian"),
    ),
    Fault(
        "the weight narrows nothing",
        weighted(lambda m: twin(m, covariance=lambda m, S: S)),
        ("covariance",),
    ),
    Fault(
        "forget what x and v share",
        gathered(
            lambda m: twin(
                m, covariance=lambda m, S: Covariance(S.matrix[:1, :1], m.frame(S.frame))
            )
        ),
        ("covariance",),
    ),
    Fault(
        "drop 4 pi^2 of the weight's covariance",
        weighted(
            lambda m: twin(
                m,
                covariance=lambda m, S: Covariance(
                    S.matrix + 4.0 * np.pi**2 * m.factor.covariance().matrix, S.frame
                ),
            )
        ),
        ("covariance",),
    ),
)
