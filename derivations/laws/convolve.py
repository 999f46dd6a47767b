"""Convolution over the angle: gradients, horizons, the theorem of spectra (R07 §3.1, Fig. 2)."""

from __future__ import annotations

import sympy as sp

from derivations.laws.jets import taylor
from derivations.squares import (
    difference_error,
    parseval_error,
    refusal,
    square_error,
    transform_error,
)
from firstorder.ledger import Check, Row, na

x, t, s, a, b = sp.symbols("x theta s a b", real=True)
low, high = sp.symbols("low high", real=True)


def derivatives_pass_to_the_light():
    """Coefficients of `int f(x + a, theta + b - s) g(s) ds` in a and b, to second order.

    f_jk stands for the derivatives of f at (x, theta - s), any functions of s; so does g.
    """
    g = sp.Function("g")(s)
    light = {(j, k): sp.Function(f"f_{j}{k}")(s) for j in range(3) for k in range(3 - j)}
    shifted = sum(
        f * a**j * b**k / (sp.factorial(j) * sp.factorial(k)) for (j, k), f in light.items()
    )
    product = sp.Poly(sp.expand(shifted * g), a, b)
    results = []
    for (j, k), f in light.items():
        found = product.coeff_monomial(a**j * b**k) * sp.factorial(j) * sp.factorial(k)
        results.append(sp.Integral(found, (s, low, high)) - sp.Integral(f * g, (s, low, high)))
    return [r.doit() if r == 0 else sp.simplify(r) for r in results]


def derivatives_pass_to_the_kernel():
    """`f_theta g - f g_theta` is a derivative along s: it integrates to the ends' values alone.

    With f at theta - s and g at s: on the circle and on the line there are no ends.
    """
    f, g = sp.Function("f"), sp.Function("g")
    on_light = sp.diff(f(x, t - s), t) * g(s)
    on_kernel = f(x, t - s) * sp.diff(g(s), s)
    end = -sp.diff(f(x, t - s) * g(s), s)
    return sp.simplify((on_light - on_kernel - end).doit())


def convolution_theorem():
    """The exponent of `int int f(x, w) g(theta - w) dw exp(-2 pi i O . u)`, with theta = w + s."""
    Ox, Ot, w = sp.symbols("Omega_x Omega_theta w", real=True)
    whole = -2 * sp.pi * sp.I * (Ox * x + Ot * (w + s))
    light, kernel = -2 * sp.pi * sp.I * (Ox * x + Ot * w), -2 * sp.pi * sp.I * Ot * s
    return sp.expand(whole - light - kernel)


def horizon_terms():
    """int_{n(x) - q}^{n(x) + q} of a generic product, differentiated once in x."""
    q = sp.symbols("q", positive=True)
    n = taylor("n", (x,))
    n0 = n.subs(x, 0)
    f = taylor("f", (x, s), 3)
    F = sp.integrate(f, s)
    whole = F.subs(s, n + q) - F.subs(s, n - q)
    interior = sp.integrate(sp.diff(f, x).subs(x, 0), (s, n0 - q, n0 + q))
    slope = sp.diff(n, x).subs(x, 0)
    ends = slope * (f.subs({x: 0, s: n0 + q}) - f.subs({x: 0, s: n0 - q}))
    return sp.expand(sp.diff(whole, x).subs(x, 0) - interior - ends)


def inverse_covariances_add():
    """|F|^2 |G|^2 for Gaussian powers: exponents -O.Sigma^-1 O / 2 and -O_t^2 / (2 s) add."""
    c = sp.symbols("A_xx A_xt A_tt", real=True)
    Ox, Ot = sp.symbols("Omega_x Omega_theta", real=True)
    spread = sp.symbols("s", positive=True)
    A, W = sp.Matrix([[c[0], c[1]], [c[1], c[2]]]), sp.Matrix([Ox, Ot])
    exponent = -(W.T * A * W)[0] / 2 - Ot**2 / (2 * spread)
    e = sp.Matrix([0, 1])
    added = A + e * e.T / spread
    found = -sp.hessian(exponent, (Ox, Ot)) - added
    # Woodbury's form, which the code uses because Sigma may be singular
    S = A.inv()
    woodbury = S - S * e * e.T * S / (S[1, 1] + spread) - added.inv()
    return list(found), [sp.simplify(v) for v in woodbury]


CONVOLUTION = {
    "implements": "firstorder.laws.convolve.Convolve.jet",
    "symbolic": lambda: (derivatives_pass_to_the_light(), derivatives_pass_to_the_kernel()),
    "fourier": na("no spectrum"),
}

ROWS = [
    Row(
        "R07.4",
        "identity",
        **CONVOLUTION,
        autodiff=Check(lambda: square_error("convolve", "gradient"), 1e-10),
        brute_force=Check(lambda: difference_error("convolve", "gradient"), 1e-8),
        note="On the line or the full circle. Above a horizon there are end terms "
        "(C.convolve.horizon); a kernel that varies in x brings f (x) g_x.",
    ),
    Row(
        "R07.fig2.convolve.primal",
        "definition",
        implements="firstorder.laws.convolve.Convolve.value",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: square_error("convolve", "value"), 1e-10),
    ),
    Row(
        "R07.fig2.convolve.gradient",
        "identity",
        **CONVOLUTION,
        autodiff=Check(lambda: square_error("convolve, circle", "gradient"), 1e-10),
        brute_force=Check(lambda: difference_error("convolve, circle", "gradient"), 1e-8),
    ),
    Row(
        "R07.fig2.convolve.fourier",
        "identity",
        implements="firstorder.laws.convolve.Convolve.spectrum",
        symbolic=convolution_theorem,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("convolve", "spectrum"), 1e-9),
        brute_force=Check(lambda: transform_error("convolve"), 1e-9),
        note="G is the kernel's one-dimensional spectrum: H(O_x, O_theta) = F(O_x, O_theta) "
        "G(O_theta). On the circle it holds at whole multiples of 1 / (2 pi).",
    ),
    Row(
        "R07.fig2.convolve.wavelet",
        "definition",
        implements="firstorder.laws.convolve.Convolve",
        symbolic=na("refusal"),
        autodiff=na("refusal"),
        fourier=na("refusal"),
        brute_force=Check(lambda: refusal("convolve", "wavelet"), 0.0),
    ),
    Row(
        "C.convolve.hessian",
        "identity",
        **CONVOLUTION,
        autodiff=Check(
            lambda: max(square_error(c, "hessian") for c in ("convolve", "convolve, an edge")),
            1e-10,
        ),
        brute_force=Check(lambda: difference_error("convolve", "hessian"), 1e-8),
    ),
    Row(
        "C.convolve.horizon",
        "identity",
        implements="firstorder.laws.convolve.Hemisphere",
        symbolic=horizon_terms,
        autodiff=Check(
            lambda: max(square_error("convolve, hemisphere", p) for p in ("gradient", "hessian")),
            1e-10,
        ),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("convolve, hemisphere", "gradient"), 1e-8),
        note="The Hessian's end terms are those of C.integrate.boundary.",
    ),
    Row(
        "C.convolve.covariance",
        "identity",
        implements="firstorder.laws.convolve.Convolve.covariance",
        symbolic=inverse_covariances_add,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("convolve", "covariance"), 1e-9),
        brute_force=Check(lambda: parseval_error("convolve", 41), 1e-8),
        note="For Gaussians; s is the second moment of the kernel's own power spectrum.",
    ),
]
