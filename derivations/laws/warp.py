"""Nonlinear change of coordinates: the chain rule to second order (R07 §3.1, eq. 8, Fig. 2)."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.laws.jets import gradient, hessian, taylor
from derivations.squares import difference_error, refusal, square_error
from firstorder.ledger import Check, Row, na

x, t, p, q = sp.symbols("x theta p q", real=True)
u, v = (x, t), (p, q)


def _pieces():
    """A generic light about T(0), and a generic map about 0, both to second order."""
    f = taylor("f", v)
    T = sp.Matrix([taylor(name, u) for name in ("S", "R")])
    start = T.subs({x: 0, t: 0})
    T = T - start  # the light's jet is taken where the map sends the origin
    return f, T, f.subs({p: T[0], q: T[1]}, simultaneous=True)


def chain_rule():
    """The linear part of f(T(u))."""
    f, T, h = _pieces()
    J = T.jacobian(u).subs({x: 0, t: 0})
    return gradient(sp.expand(h), u) - J.T * gradient(f, v)


def chain_rule_of_second_order():
    """Its quadratic part: `J^T Hess f J + sum_k f_k Hess T_k`."""
    f, T, h = _pieces()
    J = T.jacobian(u).subs({x: 0, t: 0})
    grad = gradient(f, v)
    bend = sum((grad[k] * hessian(T[k], u) for k in range(2)), sp.zeros(2, 2))
    return hessian(sp.expand(h), u) - J.T * hessian(f, v) * J - bend


def turning_normal_in_semi_fourier_space():
    """The one warp with a formula: `(x, theta + n(x))` is a phase after transforming theta alone.

    The exponent of int f(x, theta + n) exp(-2 pi i O theta) dtheta with theta = s - n.
    """
    Om, n, s = sp.symbols("Omega_theta n s", real=True)
    shifted = -2 * sp.pi * sp.I * Om * (s - n)
    return sp.expand(shifted - (-2 * sp.pi * sp.I * Om * s + 2 * sp.pi * sp.I * Om * n))


def spectrum_of_a_bump() -> float:
    """That special case, measured: `sum_k c_k(O_theta) F(O_x - k / P, O_theta)` for a wavy n(x).

    c_k are the Fourier coefficients of the phase exp(2 pi i O_theta n(x)) over a period P.
    """
    from firstorder.checks.cases import FREQUENCIES, bell, light
    from firstorder.checks.tolerance import normwise

    P, size = 12.0, 96
    n = lambda s: 0.3 * np.sin(2 * np.pi * s / P * 2 + 0.4)  # noqa: E731
    F = light().spectrum()
    s = -0.5 * P + P * np.arange(size) / size
    k = np.arange(-size // 2, size // 2)
    Ox, Ot = FREQUENCIES
    found = np.zeros((Ox.size, Ot.size), complex)
    for j, Om in enumerate(Ot):
        phase = np.exp(2j * np.pi * Om * n(s))
        c = np.exp(-2j * np.pi * np.outer(k / P, s)) @ phase / size
        found[:, j] = np.asarray(F(Ox[:, None] - k / P, np.full((1, size), Om))) @ c
    a = np.linspace(-5.5, 5.5, 89)
    values = np.array([[bell(xx, tt + n(xx)) for tt in a] for xx in a]) * (a[1] - a[0]) ** 2
    kernel = [np.exp(-2j * np.pi * np.outer(Om, a)) for Om in (Ox, Ot)]
    return normwise(found, kernel[0] @ values @ kernel[1].T)


def order_of_linearisation() -> float:
    """How far the fitted order of the displacement is from 2."""
    import jax.numpy as jnp

    from firstorder.checks.registry import all_cases
    from firstorder.checks.tolerance import fitted_order

    radii = np.array([0.2, 0.1, 0.05, 0.025])
    warp, at = all_cases()["warp"].step, jnp.array([0.3, -0.4])
    found = [float(warp.linearise(at, r).displacement) for r in radii]
    return abs(fitted_order(radii, found) - 2.0)


ROWS = [
    Row(
        "R07.8",
        "identity",
        implements="firstorder.laws.warp.Warp.push",
        symbolic=chain_rule,
        autodiff=Check(lambda: square_error("warp", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("warp", "gradient"), 1e-8),
        note="The first part writes components inside f and h; it means h(u) = f(T(u)). The map "
        "need not be invertible.",
    ),
    Row(
        "R07.fig2.warp.primal",
        "definition",
        implements="firstorder.laws.warp.Warp.value",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: square_error("warp", "value"), 1e-10),
    ),
    Row(
        "R07.fig2.warp.gradient",
        "identity",
        implements="firstorder.laws.warp.Warp.jet",
        symbolic=chain_rule,
        autodiff=Check(lambda: square_error("warp", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("warp", "gradient"), 1e-8),
    ),
    Row(
        "R07.fig2.warp.fourier",
        "definition",
        implements="firstorder.laws.warp.Warp",
        symbolic=turning_normal_in_semi_fourier_space,
        autodiff=na("spectral"),
        fourier=Check(spectrum_of_a_bump, 1e-9),
        brute_force=Check(lambda: refusal("warp", "spectrum"), 0.0),
        note="Refused in general, and tested. A special case has a formula, proved and measured "
        "here: a bump (x, theta + n(x)) multiplies by exp(2 pi i Omega_theta n(x)) once theta "
        "alone is transformed, so its spectrum is a convolution over Omega_x.",
    ),
    Row(
        "R07.fig2.warp.wavelet",
        "definition",
        implements="firstorder.laws.warp.Warp",
        symbolic=na("refusal"),
        autodiff=na("refusal"),
        fourier=na("refusal"),
        brute_force=Check(lambda: refusal("warp", "wavelet"), 0.0),
    ),
    Row(
        "C.warp.hessian",
        "identity",
        implements="firstorder.laws.warp.Warp.push",
        symbolic=chain_rule_of_second_order,
        autodiff=Check(lambda: square_error("warp", "hessian"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("warp", "hessian"), 1e-8),
    ),
    Row(
        "C.warp.linearise",
        "approximation",
        implements="firstorder.laws.warp.Warp.linearise",
        symbolic=na("measured"),
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(order_of_linearisation, 0.05),
        note="Fitted order 2 in the distance from the ray, on [0.025, 0.2]; the error given is how "
        "far the fitted order is from 2.",
    ),
]
