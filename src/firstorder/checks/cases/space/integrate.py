"""Integrate in space over one direction: three coordinates are left."""

import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases.laws.integrate import scaled
from firstorder.checks.cases.space._light import (
    CENTER,
    FREQUENCIES,
    RAYS,
    SPREAD,
    bell,
    box,
    light,
)
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Covariance, Grid
from firstorder.laws import Integrate

REST = np.array([0, 1, 3])


def brute(u):
    """Adaptive quadrature over the third coordinate."""
    return quad(lambda v: bell([u[0], u[1], v, u[2]]), -4.5, 4.5, epsabs=1e-13, epsrel=1e-13)[0]


CASES = tuple(
    Case(
        f"integrate in space, {size}^3",
        Integrate("v", -4.5, 4.5),
        light(),
        box(size, CENTER[REST], SPREAD[np.ix_(REST, REST)]),
        (FREQUENCIES[0], FREQUENCIES[1], FREQUENCIES[3]),
        RAYS[:, REST],
        brute,
        Grid.spanning((8, 8, 32, 8), (2.0, 2.0, 4.5, 2.0)),
    )
    for size in (24, 25)
)


def projected(m, S):
    """The block of the covariance, not conditioned."""
    return Covariance(S.matrix[np.ix_(REST, REST)], m.frame(S.frame))


JETS = ("gradient", "hessian")
FAULTS = (
    Fault(
        "integrate over the other direction",
        lambda s: Integrate("w", s.lower, s.upper),
        ("value", *JETS, "spectrum", "covariance"),
    ),
    Fault(
        "integrate over a position",
        lambda s: Integrate("y", s.lower, s.upper),
        ("value", *JETS, "spectrum", "covariance"),
    ),
    Fault("divide by 2 pi", scaled(0.5 / np.pi), ("value", *JETS, "spectrum", "wavelet")),
    Fault("take the mean", scaled(1.0 / 9.0), ("spectrum", "wavelet")),
    Fault("the printed factor 1", scaled(1.0 / 3.0), ("wavelet",)),
    Fault("project the covariance", lambda s: twin(s, covariance=projected), ("covariance",)),
)
