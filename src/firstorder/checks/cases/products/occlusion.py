"""Occlusion by soft blockers at a depth, one and two: smooth, so that every portrait exists.

The covariance rule (sums add) is exact for Gaussians only: measured, approximate.
"""

import math

import numpy as np

from firstorder.checks.cases import FREQUENCIES, RAYS, bell, light
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Affine, Grid
from firstorder.fields.apertures import SoftSlit
from firstorder.laws import Move
from firstorder.transport.events.occlusion import Occlusion, PlanarBlockers

GRID = Grid.spanning((128, 129), (6.0, 5.5))
WINDOW = Grid.spanning((128, 128), (6.0, 5.5))
DEPTHS, EDGE, WIDTH, BLUR = (0.7, 1.6), -0.15, 1.1, 0.35
SLIT = SoftSlit(Affine([1.0, 0.0], -EDGE, FLATLAND_SLOPE), WIDTH, BLUR)


def open_share(x: float) -> float:
    """Transmittance of a slit whose points are each blurred by a normal distribution."""
    t = np.array([x - EDGE + 0.5 * WIDTH, x - EDGE - 0.5 * WIDTH]) / BLUR
    return 0.5 * (math.erf(t[0] / math.sqrt(2.0)) - math.erf(t[1] / math.sqrt(2.0)))


def met(u, depth: float) -> float:
    """Point on the blocker's line, `depth` above, that the ray from the receiver crosses."""
    x, v = u
    along = np.array([-np.sin(np.arctan(v)), np.cos(np.arctan(v))])
    return x + depth / along[1] * along[0]


def one(u):
    """The light, times the share open where the ray passes."""
    return bell(*u) * open_share(met(u, DEPTHS[0]))


def both(u):
    """Light behind both blockers."""
    return one(u) * open_share(met(u, DEPTHS[1]))


CASES = (
    Case(
        "occlusion",
        Occlusion(SLIT, DEPTHS[0], WINDOW),
        light(FLATLAND_SLOPE),
        GRID,
        FREQUENCIES,
        RAYS,
        one,
        Grid.spanning((16, 16), (3.0, 3.0)),
        bounds={"covariance": 5e-3},
        expected={"covariance": "approximate"},
    ),
    Case(
        "occlusion at two depths",
        PlanarBlockers((SLIT, SLIT), DEPTHS, WINDOW),
        light(FLATLAND_SLOPE),
        GRID,
        FREQUENCIES,
        RAYS,
        both,
        Grid.spanning((16, 16), (3.0, 3.0)),
        bounds={"covariance": 5e-2},
        expected={"covariance": "approximate"},
    ),
)

EVERY = ("value", "gradient", "hessian", "spectrum", "wavelet")


def shifted(by):
    """The blocker elsewhere."""
    slit = SoftSlit(Affine([1.0, 0.0], -EDGE - by, FLATLAND_SLOPE), WIDTH, BLUR)
    return lambda s: Occlusion(slit, DEPTHS[0], WINDOW)


def upwards(V):
    """The blocker sheared the wrong way."""
    return Move(np.array([[1.0, DEPTHS[0]], [0.0, 1.0]]))(V)


def without(portrait):
    """The blocker forgotten in one portrait."""
    return lambda s: twin_law(s, lambda m: twin(m, **{portrait: lambda m, S: S}))


FAULTS = (
    Fault(
        "do not shear the blocker", lambda s: Occlusion(SLIT, 0.0, WINDOW), (*EVERY, "covariance")
    ),
    Fault(
        "shear it the other way",
        lambda s: Occlusion(upwards(SLIT), 0.0, WINDOW),
        (*EVERY, "covariance"),
    ),
    Fault("shift the blocker", shifted(0.2), EVERY),
    Fault("forget the blocker", without("covariance"), ("covariance",)),
)
