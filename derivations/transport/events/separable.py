"""Separable BRDFs: D05 §4.3, from the shading integral."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.squares import square_error
from derivations.transport.events._cosine_proofs import convolution_over_angle
from derivations.transport.events.reflection import (
    LOCAL,
    convolution_theorem,
    local_angle_in_the_lobe,
    path_error,
)
from firstorder.checks.cases import bell
from firstorder.ledger import Check, Counterexample, Row, na

SEPARABLE = "firstorder.transport.events.separable.separable"
SIGMA = 0.3


def factor_after_the_mirror():
    """`f(theta_i) E(theta_i)` read at theta_i = -theta_r: f mirrored has the transform f_hat(-W).

    Fourier integral of f(-t) for a generic off-centre Gaussian f, against f_hat at -W.
    """
    t, W, m = sp.symbols("t W m", real=True)
    f = sp.exp(-sp.pi * (t - m) ** 2)
    kernel = sp.exp(-2 * sp.pi * sp.I * W * t)
    flipped = sp.integrate(sp.expand(f.subs(t, -t) * kernel), (t, -sp.oo, sp.oo))
    straight = sp.integrate(sp.expand(f * kernel), (t, -sp.oo, sp.oo))
    return sp.simplify(flipped - straight.subs(W, -W))


def convolve_then_multiply():
    """D05 (17): the product with f becomes a convolution, the lobe's convolution a product."""
    return [factor_after_the_mirror(), convolution_over_angle(), *convolution_theorem()]


def reflected_spectrum(omega_x, omega_theta, height) -> float:
    """Magnitude of the spectrum of `int (1 + height tanh(i)) l(x, i) rho(o + i) di`, plain sums."""
    h = 0.05
    axis = np.arange(-5.0, 5.0, h)
    values = np.array([[bell(a, i) for i in axis] for a in axis]) * (1.0 + height * np.tanh(axis))
    lobe = np.exp(-0.5 * ((axis[:, None] + axis) / SIGMA) ** 2) / (SIGMA * np.sqrt(2.0 * np.pi))
    out = values @ lobe * h
    phases = (np.exp(-2j * np.pi * W * axis) * h for W in (omega_x, omega_theta))
    left, right = phases
    return float(abs(left @ out @ right))


def chain_error() -> float:
    """The library's chain, made anew, against the trapezoid rule."""
    from firstorder.checks.cases import RAYS, light
    from firstorder.checks.cases.products.separable import _chain, brute

    reflected = _chain()(light())
    return max(abs(float(reflected(*ray)) - brute(ray)) for ray in np.asarray(RAYS))


_SQUARES = {
    "autodiff": Check(
        lambda: max(square_error("separable BRDF", p) for p in ("gradient", "hessian")), 1e-10
    ),
    "fourier": Check(lambda: square_error("separable BRDF", "spectrum"), 1e-9),
    "brute_force": Check(
        lambda: max(chain_error(), square_error("separable BRDF", "value")), 1e-10
    ),
}

ROWS = [
    Row(
        "D05.s4.3a",
        "misprint",
        SEPARABLE,
        local_angle_in_the_lobe,
        autodiff=na("no derivative"),
        fourier=Check(lambda: square_error("separable BRDF", "spectrum"), 1e-9),
        brute_force=Check(lambda: max(path_error(), chain_error()), 1e-10),
        corrected="rho(theta_i', theta_o') = f(theta_i') rho'(theta_o' - theta_r')",
        counterexample=LOCAL,
        note="theta_o lacks its prime, as in (15); the counterexample has f = 1.",
    ),
    Row("D05.17", "identity", SEPARABLE, convolve_then_multiply, **_SQUARES),
    Row("D05.s4.3b", "identity", SEPARABLE, convolve_then_multiply, **_SQUARES),
    Row(
        "D05.T1.9",
        "misprint",
        SEPARABLE,
        convolve_then_multiply,
        **_SQUARES,
        corrected="(dEhat_r' (x) fhat(-Omega_theta) delta(Omega_x)) rhohat'",
        counterexample=Counterexample(
            {"omega_x": 0.3, "omega_theta": 0.35, "height": 0.6},
            lambda omega_x, omega_theta, height: reflected_spectrum(omega_x, omega_theta, -height),
            reflected_spectrum,
        ),
        note="(17) has the flip. It only matters for an f that is not even; Fresnel's is.",
    ),
]
