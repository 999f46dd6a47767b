"""Band limits on the way over a curved glossy mirror, from its geometry (D05 §6.2, Fig. 15).

Ours: kappa = dn/dx > 0 is a valley, angles counter-clockwise; D05: k = -kappa > 0 is a bump and
angles the other way, so our point (a, b) of energy is its (-a, b), or (a, -b), which is the same.
The proofs (`_bandwidth_proofs`) start from a circle, an eye and the law of reflection. The numeric
routes trace exact rays off that circle (`tracer`), over |kappa| d from 1e-4 to 1e4 and angles up to
85 degrees, step by step (`_bandwidth_steps`) and as measured spectra (`_bandwidth_spectra`).
"""

from __future__ import annotations

import numpy as np

from derivations.bandwidth._bandwidth_proofs import (
    after_curvature,
    after_mirror,
    cosine_moves_the_end,
    leaving,
    scale_of_an_environment,
)
from derivations.bandwidth._bandwidth_steps import predicted_bands, spectrum_error, step_error
from firstorder.checks.tolerance import fitted_order
from firstorder.ledger import Check, Row, na


def cosine_order() -> float:
    """Order in 1 / cutoff of the relative error that leaving out the cosine makes; it is 1."""
    cutoffs = np.array([2.0, 4.0, 8.0, 16.0])
    errors = []
    for cutoff in cutoffs:
        plain, shaded = (
            predicted_bands(1.3, 0.8, 0.5, cutoff, 100.0, factor)["outwards"].extent("x")
            for factor in (None, 0.5 / np.pi)
        )
        errors.append(float(shaded / plain) - 1.0)
    return abs(fitted_order(1.0 / cutoffs, errors) - 1.0)


# --- rows --------------------------------------------------------------------------------------

ROWS = [
    Row(
        "D05.s6.2a",
        "identity",
        implements="firstorder.transport.events.incidence.Incidence",
        symbolic=scale_of_an_environment,
        autodiff=na("spectral"),
        fourier=na("one route"),
        brute_force=Check(lambda: step_error("environment"), 1e-9),
        note="No effect of the scale; the incidence is row 3 of Table 1, not row 1. Behind a "
        "blocker it does act: D05.s6.2g.",
    ),
    Row(
        "D05.s6.2b",
        "identity",
        implements="firstorder.bandwidth.band_limits.band_limit_after",
        symbolic=after_curvature,
        autodiff=na("spectral"),
        fourier=Check(lambda: spectrum_error("curvature"), 1e-9),
        brute_force=Check(lambda: step_error("curvature"), 1e-8),
        note="Slope means Omega_x per Omega_theta.",
    ),
    Row(
        "D05.s6.2c",
        "approximation",
        implements="firstorder.bandwidth.band_limits.BandLimit.cut",
        symbolic=lambda: [*after_mirror(), *cosine_moves_the_end()],
        autodiff=na("spectral"),
        fourier=Check(lambda: spectrum_error("mirror"), 1e-9),
        brute_force=Check(lambda: max(step_error("cutoff") / 1e-8, cosine_order() / 0.02), 1.0),
        note="Exact for an ideal cut. Leaving out the cosine loses |k| / (2 pi) of Omega_x, a "
        "relative error 1 / (2 pi Omega_rho), of order 1 in 1 / Omega_rho (fitted); domain: lobes "
        "of less than about half a radian.",
    ),
    Row(
        "D05.s6.2d",
        "identity",
        implements="firstorder.bandwidth.band_limits.band_limit_after",
        symbolic=leaving,
        autodiff=na("spectral"),
        fourier=Check(lambda: spectrum_error("outwards"), 1e-9),
        brute_force=Check(lambda: step_error("outwards", "leaving"), 1e-7),
    ),
]
