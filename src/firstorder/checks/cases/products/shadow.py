"""Shadows: a sharp edge, travelled and gathered by a diffuse receiver, is smooth again.

Here the edges' own rules (travel of the edge, boundary terms of the integral, spectrum of the
travelled product) meet converters of spectral accuracy: 1e-9.
"""

import itertools

import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import bell, light
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Grid
from firstorder.fields.mask import half_plane
from firstorder.transport.events.diffuse import Gather, diffuse
from firstorder.transport.events.occlusion import Occlusion, comb_blocker
from firstorder.transport.events.travel import Travel

FRAME = FLATLAND_SLOPE
D, RHO, LET_THROUGH = 1.3, 0.4, 0.25
WINDOW = Grid.spanning((160, 128), (8.0, 5.0))
GRID = Grid.spanning((160,), (8.0,))
FREQUENCIES = (np.array([-0.45, -0.1, 0.0, 0.2, 0.33]),)
RAYS = np.array([[0.3], [-0.6], [1.1]])
RECEIVER = diffuse(RHO, 5.0, WINDOW, nodes=48)


def gathered(dims, places):
    """Adaptive quadrature over the angle of straight rays, cut at the blocker's ends."""

    def irradiance(u):
        def ray(theta):
            along = np.array([-np.sin(theta), np.cos(theta)])
            x = u[0] + D / along[1] * along[0]
            share = LET_THROUGH if dims(x) else 1.0
            return RHO * np.cos(theta) * share * bell(x, np.tan(theta))

        # The edges as angles: x - D tan(theta) = place.
        ends = sorted(np.arctan((u[0] - place) / D) for place in places)
        panels = [np.arctan(-5.0), *ends, np.arctan(5.0)]
        pieces = itertools.pairwise(panels)
        return sum(quad(ray, a, b, epsabs=1e-13, epsrel=1e-13)[0] for a, b in pieces)

    return irradiance


def left(x):
    """Whether the half-plane stands in the way."""
    return x < 0.1


def bars(x):
    """Whether one of the three bars does."""
    return any(abs(x - c) < 0.18 for c in (-0.6, 0.0, 0.6))


PLACES = [c + s * 0.18 for c in (-0.6, 0.0, 0.6) for s in (-1, 1)]

EDGE = Occlusion(half_plane(0.1, LET_THROUGH, 1.0, "x", FRAME), 0.0, WINDOW)
COMB = comb_blocker(0.6, 3, FRAME, 0.4, LET_THROUGH, 0.0, WINDOW)
CASES = tuple(
    Case(
        name,
        blocker >> Travel(D) >> RECEIVER,
        light(FRAME),
        GRID,
        FREQUENCIES,
        RAYS,
        gathered(dims, places),
        expected={"covariance": "refused", "wavelet": "refused"},
    )
    for name, blocker, dims, places in (
        ("shadow of a half-plane", EDGE, left, [0.1]),
        ("shadow of a comb", COMB, bars, PLACES),
    )
)


def twin_law_of(chain, change):
    """The chain with the law of its blocker changed."""
    return twin_law(chain.events[0], change) >> Travel(D) >> RECEIVER


EVERY = ("value", "gradient", "hessian", "spectrum")
FAULTS = (
    Fault(
        "the blocker on the receiver",
        lambda s: Travel(D) >> s.events[0] >> RECEIVER,
        EVERY,
    ),
    Fault(
        "half the distance",
        lambda s: s.events[0] >> Travel(0.5 * D) >> RECEIVER,
        EVERY,
    ),
    Fault(
        "forget the cosine and the Jacobian",
        lambda s: s.events[0] >> Travel(D) >> Gather(reach=5.0, nodes=48),
        EVERY,
    ),
    Fault(
        "forget the jump",
        lambda s: twin_law_of(s, lambda m: twin(m, edges=lambda m, f: ())),
        ("gradient", "hessian"),
    ),
)
