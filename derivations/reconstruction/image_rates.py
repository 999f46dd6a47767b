"""R07 §9: the frequency metric it compares with, and how it cuts a Phong lobe.

Starts from the Legendre coefficients of `cos^s` over the hemisphere, which are known in closed form
and summed here by quadrature.
"""

from __future__ import annotations

import numpy as np
import sympy as sp
from scipy.special import eval_legendre, gammaln

from derivations.bandwidth._bandwidth_proofs import Omega, d, slopes_at_origin, theta
from firstorder.bandwidth import glossy_bandwidth, glossy_criterion
from firstorder.checks.tolerance import fitted_order
from firstorder.ledger import Check, Counterexample, Row, na

# --- the cut of a Phong lobe ---------------------------------------------------------------------


def exponent_at_the_cut():
    """`exp(-l^2 / (2 s))` at `l = sqrt(6 s)` is `exp(-3)`; exactly `l (l + 1)` stands for l^2.

    `cos^s = exp(-s g^2 / 2)` near the peak is a bell of variance 1 / s: heat that has flowed for
    the time 1 / (2 s) on the sphere, which damps order l by `exp(-l (l + 1) / (2 s))`.
    """
    s, g = sp.symbols("s g", positive=True)
    bell = sp.series(sp.log(sp.cos(g)), g, 0, 4).removeO() + g**2 / 2
    return [sp.sqrt(6 * s) ** 2 / (2 * s) - 3, bell]


def coefficient(s, order) -> float:
    """Legendre coefficient of `cos^s`, over that of order 0, by quadrature."""
    t, weight = np.polynomial.legendre.leggauss(128)
    x = 0.5 * (t + 1.0)
    lobe = weight * x**s
    return float(np.sum(lobe * eval_legendre(order, x)) / np.sum(lobe))


def coefficient_by_gamma(s, order) -> float:
    """The same by the gamma function, for any real order below s."""
    top = gammaln(s + 2.0) + 0.5 * np.log(np.pi) - (s + 1.0) * np.log(2.0)
    return float(np.exp(top - gammaln(0.5 * (s - order) + 1.0) - gammaln(0.5 * (s + order + 3.0))))


def gamma_against_quadrature() -> float:
    """Both routes at integer orders."""
    pairs = ((24.0, 12), (96.0, 24), (60.0, 7))
    return max(abs(coefficient(s, n) - coefficient_by_gamma(s, n)) for s, n in pairs)


def order_of_the_cut() -> float:
    """How the coefficient at the cut nears exp(-3): as `sqrt(1 / s)`, the l beside l^2."""
    sizes = np.array([1e3, 4e3, 16e3])
    errors = [abs(np.log(coefficient_by_gamma(s, np.sqrt(6.0 * s))) + 3.0) for s in sizes]
    return abs(fitted_order(1.0 / sizes, errors) - 0.5)


# --- the metric ----------------------------------------------------------------------------------


def rate_in_the_image():
    """Waves per unit of the image, about its middle, of a mirror under waves over the angle.

    On circles of either sign: the mirrored angle per angle of the eye, and that per u = gamma tan.
    """
    gamma, u = sp.symbols("gamma u", positive=True)
    angle = sp.diff(sp.atan(u / gamma), u).subs(u, 0)
    return [
        Omega * mirrored / eye * angle + Omega / gamma * (1 - 2 * bend * d / sp.cos(theta))
        for bend, eye, mirrored, _ in slopes_at_origin()
    ]


def metric(k, z, cos_view, cutoff=3.0, gamma=1.0) -> float:
    """As printed."""
    return 2.0 * k * z / cos_view * cutoff / gamma


def seen(k, z, cos_view, cutoff=3.0, gamma=1.0) -> float:
    """Frequency in the image of a mirror of waves, by two traced rays next to each other.

    A disc of curvature k under a distant environment that waves `cutoff` times per radian.
    """
    aslant, h, angles = np.arccos(cos_view), 1e-6, []
    eye = z * np.array([np.sin(aslant), np.cos(aslant)])
    for turn in (-h, h):
        c, s = np.cos(turn), np.sin(turn)
        d = np.array([[c, -s], [s, c]]) @ (-eye / z)
        if k == 0.0:
            q, n = eye - d * (eye[1] / d[1]), np.array([0.0, 1.0])
        else:
            m = eye - np.array([0.0, -1.0 / k])
            b = m @ d
            q = eye + (-b - np.sqrt(b * b - m @ m + k**-2.0)) * d
            n = (q - np.array([0.0, -1.0 / k])) * k
        r = d - 2.0 * (n @ d) * n
        angles.append(np.arctan2(r[0], r[1]))
    return float(abs(angles[1] - angles[0]) / (2.0 * h) * cutoff / gamma)


def order_of_the_metric() -> float:
    """Relative error against traced rays falls as `n.v / (2 k z)`."""
    far = np.array([20.0, 40.0, 80.0])
    errors = [abs(metric(1.0, z, 0.6) / seen(1.0, z, 0.6) - 1.0) for z in far]
    return abs(fitted_order(1.0 / far, errors) - 1.0)


def ours_against_rays() -> float:
    """The corrected bandwidth against traced rays, and the printed one against the library's."""
    worst = 0.0
    for k, z, c in ((0.0, 3.0, 0.5), (0.7, 2.0, 0.8), (2.0, 5.0, 0.4)):
        kappa, d, cos = np.array(-k), np.array(z), np.array(c)
        rays = seen(k, z, c)
        worst = max(worst, abs(float(glossy_bandwidth(3.0, d, kappa, cos)) / rays - 1.0))
        printed = float(glossy_criterion(3.0, d, kappa, cos))
        worst = max(worst, abs(printed - metric(k, z, c)) / (1.0 + printed))
    return worst


ROWS = [
    Row(
        "R07.s9.1a",
        "approximation",
        symbolic=exponent_at_the_cut,
        autodiff=na("no derivative"),
        fourier=Check(gamma_against_quadrature, 1e-12),
        brute_force=Check(order_of_the_cut, 0.1),
        note="Order 1/2 in 1/s: the coefficient there is exp(-3) within 12 % for s > 100. It is an "
        "order of harmonics, in radians; as a cutoff in cycles per radian (D05's unit) divide by "
        "2 pi. The paper's formula names an over-all scale alone.",
    ),
    Row(
        "R07.s9.1b",
        "over-claim",
        "firstorder.bandwidth.curved_mirror.glossy_criterion",
        rate_in_the_image,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(
            lambda: max(ours_against_rays() / 1e-6, order_of_the_metric() / 0.1), 1.0
        ),
        corrected="I = (1 / gamma) |1 + 2 k z / (n_0 . v)| Omega_rho for a bump k > 0",
        counterexample=Counterexample({"k": 0.3, "z": 1.0, "cos_view": 0.8}, metric, seen),
        note="D05 (20) with a focal length, and wrong as that is: too small by Omega_rho / gamma, "
        "a relative error of first order in n_0 . v / (2 k z). Error: the larger of what is off "
        "traced rays over 1e-6 and what that order is off 1 over 0.1. As an importance, which only "
        "ranks, it still calls every flat mirror worthless.",
    ),
]
