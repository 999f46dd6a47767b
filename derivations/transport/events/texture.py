"""Texture mapping: D05 §4.4 and R07 (20)'s reading, from the product in ray space."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.squares import square_error
from firstorder.ledger import Check, Counterexample, Row, na

x, t, o1, o2 = sp.symbols("x theta Omega_x Omega_theta", real=True)
TEXTURE = "firstorder.transport.events.texture.Texture"


def stripes_shift_the_spectrum():
    """A harmonic `e^(2 pi i a x)` times l: the Fourier exponent moves to Omega_x - a.

    Nowhere else; and every texture is a sum of such harmonics: the convolution over Omega_x.
    """
    a = sp.symbols("a", real=True)
    exponent = -2 * sp.pi * sp.I * (o1 * x + o2 * t) + 2 * sp.pi * sp.I * a * x
    return sp.expand(exponent + 2 * sp.pi * sp.I * ((o1 - a) * x + o2 * t))


def miss_of_the_texture_alone():
    """What `E grad rho` leaves of grad B is to it as `E_x / E` is to `rho_x / rho`, each way.

    B = E rho is multiplied out one small step away, in x and in y; its slopes are read off.
    """
    E, E_x, E_y, rho, rho_x, rho_y, u, v = sp.symbols("E E_x E_y rho rho_x rho_y u v")
    B = sp.expand((E + E_x * u + E_y * v) * (rho + rho_x * u + rho_y * v))
    sides = ((B.coeff(u, 1).subs(v, 0), E_x, rho_x), (B.coeff(v, 1).subs(u, 0), E_y, rho_y))
    return [B_i / (E * r) - 1 - (e / E) / (r / rho) for B_i, e, r in sides]


def textured_slope(d, ripple, x) -> float:
    """d/dx of `E rho` by differences: a small light at height d over a striped plane."""

    def B(at):
        return d**3 / (d * d + at * at) ** 1.5 * (1.0 + ripple * np.cos(2.0 * np.pi * at))

    h = 1e-5
    return float((B(x + h) - B(x - h)) / (2.0 * h))


def texture_only(d, ripple, x) -> float:
    """R07's short form, `E rho_x`."""
    E = d**3 / (d * d + x * x) ** 1.5
    return float(-E * 2.0 * np.pi * ripple * np.sin(2.0 * np.pi * x))


def both_terms(d, ripple, x) -> float:
    """`E_x rho + E rho_x`."""
    E_x = -3.0 * d**3 * x / (d * d + x * x) ** 2.5
    return float(E_x * (1.0 + ripple * np.cos(2.0 * np.pi * x)) + texture_only(d, ripple, x))


_SQUARES = {
    "autodiff": Check(
        lambda: max(square_error("texture", p) for p in ("gradient", "hessian")), 1e-10
    ),
    "fourier": Check(lambda: square_error("texture", "spectrum"), 1e-9),
    "brute_force": Check(lambda: square_error("texture", "value"), 1e-10),
}

ROWS = [
    Row("D05.18", "identity", TEXTURE, stripes_shift_the_spectrum, **_SQUARES),
    Row("D05.s4.4a", "identity", TEXTURE, stripes_shift_the_spectrum, **_SQUARES),
    Row(
        "D05.T1.8",
        "identity",
        TEXTURE,
        stripes_shift_the_spectrum,
        **_SQUARES,
        note="With the Dirac in Omega_theta of (18), which the table leaves out.",
    ),
    Row(
        "R07.s4.1h",
        "over-claim",
        TEXTURE,
        miss_of_the_texture_alone,
        autodiff=Check(lambda: square_error("texture", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(
            lambda: max(
                abs(textured_slope(0.5, 0.1, 0.3) - both_terms(0.5, 0.1, 0.3)),
                square_error("texture", "value"),
            ),
            1e-8,
        ),
        corrected="B_x = E_x rho + E rho_x; the second dominates where |E_x / E| << |rho_x / rho|.",
        counterexample=Counterexample(
            {"d": 0.5, "ripple": 0.1, "x": 0.3}, texture_only, textured_slope
        ),
        note="A light half a metre above stripes of 10% contrast: the light's own slope is 4 times "
        "the texture's.",
    ),
]
