"""Product of two fields: Leibniz, the convolution theorem, triple products (R07 §3.1, Fig. 2)."""

from __future__ import annotations

import sympy as sp

from derivations.laws.jets import gradient, hessian, taylor
from derivations.squares import difference_error, parseval_error, square_error, transform_error
from firstorder.ledger import Check, Row, na

x, t = sp.symbols("x theta", real=True)
u = (x, t)
ZERO = dict.fromkeys(u, 0)


def leibniz():
    """The linear part of a product of two generic jets, expanded."""
    f, g = taylor("f", u), taylor("g", u)
    found = gradient(sp.expand(f * g), u)
    return found - (f.subs(ZERO) * gradient(g, u) + g.subs(ZERO) * gradient(f, u))


def leibniz_of_second_order():
    """Its quadratic part."""
    f, g = taylor("f", u), taylor("g", u)
    a, b = gradient(f, u), gradient(g, u)
    rule = f.subs(ZERO) * hessian(g, u) + g.subs(ZERO) * hessian(f, u) + a * b.T + b * a.T
    return hessian(sp.expand(f * g), u) - rule


def convolution_theorem():
    """Transform of f g with g = int G(s) exp(2 pi i s u) ds, on two Gaussians.

    The exponents say it for every f and g (order of integration exchanged): what stays under the
    inner integral is f's transform at Omega - s. The Gaussians then check the scale.
    """
    Om, s, y, a, b = sp.symbols("Omega s y a b", real=True)
    exponent = -2 * sp.pi * sp.I * Om * y + 2 * sp.pi * sp.I * s * y
    shifted = -2 * sp.pi * sp.I * (Om - s) * y
    # f = exp(-pi (y-a)^2), g = exp(-pi (y-b)^2) have F = exp(-pi O^2 - 2 pi i O a), G likewise.
    product = _gaussian(-2 * sp.pi, 2 * sp.pi * (a + b) - 2 * sp.pi * sp.I * Om,
                        -sp.pi * (a**2 + b**2))  # fmt: skip
    # F(Om - s) G(s) as a Gaussian integral over s
    spectra = _gaussian(-2 * sp.pi, 2 * sp.pi * Om + 2 * sp.pi * sp.I * (a - b),
                        -sp.pi * Om**2 - 2 * sp.pi * sp.I * Om * a)  # fmt: skip
    return (
        sp.expand(exponent - shifted),
        sp.expand(product[0] - spectra[0]),
        product[1] - spectra[1],
    )


def _gaussian(p, q, r):
    """Integral of exp(p y^2 + q y + r) for p < 0: its exponent, and the square of its factor."""
    return sp.expand(r - q**2 / (4 * p)), -sp.pi / p


def triple_products():
    """sum_t (f g)(t) psi_i(t) with f = sum F_j psi_j, g = sum G_k psi_k, on four cells of Haar."""
    W = haar(4)
    F, G = (sp.Matrix(sp.symbols(f"{name}:4", real=True)) for name in "FG")
    f, g = W.T * F, W.T * G
    direct = W * f.multiply_elementwise(g)
    C = lambda i, j, k: sum(W[i, n] * W[j, n] * W[k, n] for n in range(4))  # noqa: E731
    rule = [sum(C(i, j, k) * F[j] * G[k] for j in range(4) for k in range(4)) for i in range(4)]
    return [sp.expand(direct[i] - rule[i]) for i in range(4)], list(W * W.T - sp.eye(4))


def haar(n: int) -> sp.Matrix:
    """The orthonormal Haar basis on n cells by definition: mean, then differences of halves."""
    rows = [[1] * n]
    width = n
    while width > 1:
        for start in range(0, n, width):
            half = width // 2
            row = [0] * n
            row[start : start + half], row[start + half : start + width] = [1] * half, [-1] * half
            rows.append(row)
        width //= 2
    return sp.Matrix([[sp.Integer(e) / sp.sqrt(sum(map(abs, r))) for e in r] for r in rows])


def covariances_add():
    """Precisions of two Gaussians add in the product, wherever their centres are."""
    p = sp.symbols("p_xx p_xt p_tt", real=True)
    q = sp.symbols("q_xx q_xt q_tt", real=True)
    a, b = sp.symbols("a_x a_t", real=True), sp.symbols("b_x b_t", real=True)

    def exponent(m, c):
        P, h = sp.Matrix([[m[0], m[1]], [m[1], m[2]]]), sp.Matrix([x - c[0], t - c[1]])
        return -(h.T * P * h)[0] / 2, P

    (f, P), (g, Q) = exponent(p, a), exponent(q, b)
    return sp.hessian(sp.expand(f + g), u) + P + Q


ROWS = [
    Row(
        "R07.2",
        "identity",
        implements="firstorder.laws.multiply.Multiply.push",
        symbolic=leibniz,
        autodiff=Check(lambda: square_error("multiply", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("multiply", "gradient"), 1e-8),
    ),
    Row(
        "R07.fig2.multiply.primal",
        "definition",
        implements="firstorder.laws.multiply.Multiply.value",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: square_error("multiply", "value"), 1e-10),
    ),
    Row(
        "R07.fig2.multiply.gradient",
        "identity",
        implements="firstorder.laws.multiply.Multiply.jet",
        symbolic=leibniz,
        autodiff=Check(lambda: square_error("multiply, not a bell", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(
            lambda: difference_error("multiply, not a bell", "gradient", 0.005), 1e-8
        ),
        note="On an edge of a factor the gradient holds on either side; the jump is an edge's.",
    ),
    Row(
        "R07.fig2.multiply.fourier",
        "identity",
        implements="firstorder.laws.multiply.Multiply.spectrum",
        symbolic=convolution_theorem,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("multiply", "spectrum"), 1e-9),
        brute_force=Check(lambda: transform_error("multiply", 6.0, 61), 1e-9),
        note="Carried out as a sum over the factor's Fourier series on a window outside which the "
        "light vanishes; with an edge in the factor it agrees with samples to their grid error.",
    ),
    Row(
        "R07.fig2.multiply.wavelet",
        "identity",
        implements="firstorder.laws.multiply.Multiply.wavelet",
        symbolic=triple_products,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: square_error("multiply", "wavelet"), 1e-10),
        note="C_ijk = int psi_i psi_j psi_k, summed over j and k; for any orthonormal basis.",
    ),
    Row(
        "C.multiply.hessian",
        "identity",
        implements="firstorder.laws.multiply.Multiply.push",
        symbolic=leibniz_of_second_order,
        autodiff=Check(lambda: square_error("multiply", "hessian"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("multiply", "hessian"), 1e-8),
    ),
    Row(
        "C.multiply.covariance",
        "identity",
        implements="firstorder.laws.multiply.Multiply.covariance",
        symbolic=covariances_add,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("multiply", "covariance"), 1e-9),
        brute_force=Check(lambda: parseval_error("multiply", 61), 1e-9),
        note="Exact for Gaussians, wherever their centres are. For other factors an approximation: "
        "the square of 'multiply, not a bell' measures it.",
    ),
]
