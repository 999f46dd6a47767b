"""Convolve light that has an edge: the integral splits there, and the edge is smoothed away."""

import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.cases.laws.convolve import OFFSET, WIDTH, Leaning, lobe, with_kernel
from firstorder.checks.cases.laws.integrate_edge import DARK, MASK, Unbroken
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.laws import Convolve


def brute(u):
    """Adaptive quadrature, told where the edge is."""
    x, t = u
    edge, low, high = 0.8 * x + 0.1, t - OFFSET - 3.0, t - OFFSET + 3.0

    def product(s):
        return bell(x, s) * (1.0 if s < edge else DARK) * lobe(t - s)

    return quad(product, low, high, points=[np.clip(edge, low, high)], epsabs=1e-13)[0]


CASES = (
    Case(
        "convolve, an edge",
        Convolve(Leaning(WIDTH, OFFSET), nodes=48),
        MASK(light()),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        expected={"covariance": "refused", "wavelet": "refused"},
    ),
)


def tampered(change):
    """The law applied to a field that has been tampered with."""
    return lambda s: twin(
        s,
        value=lambda m, f, u: Convolve.value(m, change(f), u),
        jet=lambda m, f, u: Convolve.jet(m, change(f), u),
    )


JETS = ("gradient", "hessian")
EVERY = ("value", *JETS, "spectrum")
FAULTS = (
    Fault("forget the edge", tampered(Unbroken), ("value", *JETS)),
    Fault("split beside the edge", tampered(lambda f: Unbroken(f, 0.1)), JETS),
    Fault("correlate", with_kernel(lambda g: Leaning(g.sigma, -g.offset)), EVERY),
    Fault(
        "a lobe wider by a tenth", with_kernel(lambda g: Leaning(1.1 * g.sigma, g.offset)), EVERY
    ),
    Fault(
        "forget the mask in the spectrum",
        lambda s: twin(s, spectrum=lambda m, F, w: Convolve.spectrum(m, F.operand, w)),
        ("spectrum",),
    ),
)
