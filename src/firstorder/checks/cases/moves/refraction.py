"""Refraction: Snell's warp of the angle with the radiance that goes with it, both ways."""

import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, bell, light
from firstorder.checks.cases.products.interface import reflectance
from firstorder.checks.faults import Fault
from firstorder.checks.squares import Case
from firstorder.transport import Snell, refraction
from firstorder.transport.event import Chain

REFUSED = dict.fromkeys(("spectrum", "covariance", "wavelet"), "refused")


def _case(name, eta, rays) -> Case:
    def brute(u):
        s = eta * np.sin(u[1])
        if abs(s) >= 1.0:
            return 0.0
        t = float(np.arcsin(s))
        return eta * (1.0 - reflectance(eta, t)) * bell(u[0], t)

    return Case(
        name,
        refraction(eta),
        light(),
        GRID,
        FREQUENCIES,
        np.array(rays),
        brute,
        expected=REFUSED,
    )


# One ray of each case lies where no light can come from: beyond the critical angle, below grazing.
CASES = (
    _case("refraction into glass", 1.5, [[0.3, 0.1], [-0.4, 0.4], [0.7, -0.35], [0.2, 0.9]]),
    _case("refraction out of glass", 1 / 1.5, [[0.3, 0.1], [-0.4, 0.6], [0.7, -0.9]]),
)


def eta(chain: Chain):
    """Index ratio of the chain's warp."""
    return chain.events[1].eta  # pyright: ignore[reportAttributeAccessIssue]


EVERY = ("value", "gradient", "hessian")
FAULTS = (
    Fault("Snell's law the wrong way", lambda s: s.events[0] >> Snell(1.0 / eta(s)), EVERY),
    Fault("do not bend", lambda s: s.events[0] >> Snell(1.0), EVERY),
    Fault("nothing is reflected, nothing scaled", lambda s: Chain((Snell(eta(s)),)), EVERY),
)
