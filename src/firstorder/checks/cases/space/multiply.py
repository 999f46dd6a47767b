"""Multiply in space, by a bell that is correlated in its own way."""

import numpy as np

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
from firstorder.conventions import SPACE_SLOPE
from firstorder.fields import Gaussian, Grid
from firstorder.laws import Move, Multiply

OTHER = 1.6 * SPREAD[::-1, ::-1] + 0.1 * np.eye(4)
AWAY = np.array([-0.3, 0.25, 0.1, 0.2])
P, Q = np.linalg.inv(SPREAD), np.linalg.inv(OTHER)
BOTH = np.linalg.inv(P + Q)


def brute(u):
    """Two bells."""
    return bell(u) * bell(u, AWAY, OTHER, 0.8)


CASES = tuple(
    Case(
        f"multiply in space, {size}^4",
        Multiply(Gaussian(AWAY, Q, 0.8, SPACE_SLOPE), box(27, AWAY, OTHER)),
        light(),
        box(size, BOTH @ (P @ CENTER + Q @ AWAY), BOTH),
        FREQUENCIES,
        RAYS,
        brute,
        Grid.spanning((2, 4, 2, 4), (1.0, 1.0, 1.0, 1.0)),
    )
    for size in (24, 25)
)


def moved(M):
    """The factor seen through a linear map that should not be there."""
    return lambda s: Multiply(Move(M)(s.factor), s.window)


EVERY = ("value", "gradient", "hessian", "covariance", "wavelet")
FAULTS = (
    Fault("reverse the factor's axes", moved(np.eye(4)[::-1]), EVERY),
    Fault("flip the directions", moved(np.diag([1.0, 1.0, -1.0, -1.0])), EVERY),
    Fault("stretch the factor by a tenth", moved(1.1 * np.eye(4)), EVERY),
    Fault(
        "keep the spectrum",
        lambda s: twin(s, spectrum=lambda m, F, w: F.at(w)),
        ("spectrum",),
    ),
    Fault(
        "multiply the spectra",
        lambda s: twin(s, spectrum=lambda m, F, w: F.at(w) * m.factor.spectrum().at(w)),
        ("spectrum",),
    ),
    Fault(
        "shift the wrong way",
        lambda s: twin(s, spectrum=lambda m, F, w: Multiply.spectrum(m, F, w).conj()),
        ("spectrum",),
    ),
)
