"""Fresnel's term in a separable BRDF: D05 §4.3's claim about Fig. 12(b), measured."""

from __future__ import annotations

import numpy as np

from firstorder.ledger import Check, Row, na
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.transport import ClampedCosine, Fresnel

INDICES = (1.33, 1.5, 2.4)


def low_energy(eta: float, cutoff: float) -> float:
    """Fraction of the energy of `cos+ F` below a frequency in cycles per radian."""
    nodes, weights = gauss_legendre(400)
    a, b = 0.5 * np.pi * nodes, 0.5 * np.pi * weights
    values = np.asarray(ClampedCosine()(0.0, a) * Fresnel(eta)(0.0, a))
    W = np.linspace(-cutoff, cutoff, 401)
    spectrum = np.exp(-2j * np.pi * W[:, None] * a) @ (values * b)
    return float(np.trapezoid(np.abs(spectrum) ** 2, W) / np.sum(values**2 * b))


def matched_energy(eta: float) -> float:
    """Parseval: all energy up to 12 cycles per radian, less all energy in angle."""
    return abs(low_energy(eta, 12.0) - 1.0)


ROWS = [
    Row(
        "D05.s4.3c",
        "approximation",
        "firstorder.transport.events.interface.Fresnel",
        symbolic=na("measured"),
        autodiff=na("no derivative"),
        # "Mostly": more than half of the energy below 1 / pi, where the cosine alone has 97%.
        fourier=Check(lambda: 1.0 - min(low_energy(n, 1.0 / np.pi) for n in INDICES), 0.5),
        brute_force=Check(lambda: max(map(matched_energy, INDICES)), 0.01),
        note="Energy below 1 / pi cycles per radian: 62% (water), 79% (glass), 98% (diamond), "
        "below 1: 88%, 94%, 99%. Of a weak reflector two narrow humps near grazing are left.",
    ),
]
