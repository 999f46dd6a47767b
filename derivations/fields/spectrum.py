"""The spectrum of a light field: its definition, the convolution theorem, how edges make it fall.

D05 §2.1, footnote 1. Proofs start from the Fourier integral.
"""

from __future__ import annotations

import functools

import jax.numpy as jnp
import numpy as np
import sympy as sp
from scipy.integrate import dblquad, quad

from firstorder.checks.cases import FREQUENCIES, GRID, bell, light
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import Frame
from firstorder.fields import BoxProfile, Grid, Spline, discrete_transform, gaussian
from firstorder.laws import Multiply
from firstorder.ledger import Check, Row, na

# Definition ------------------------------------------------------------------------------------


def gaussian_against_samples() -> float:
    """The closed form of a Gaussian's spectrum against the transform of its samples."""
    ours = light().spectrum()(*np.meshgrid(*FREQUENCIES, indexing="ij"))
    return normwise(ours, discrete_transform(GRID.sample(light()), GRID, *FREQUENCIES))


def gaussian_against_quadrature() -> float:
    """The same against adaptive quadrature of the integral as it is written."""
    Omega = np.array([0.31, -0.27])

    def part(wave):
        return dblquad(
            lambda v, x: bell(x, v) * wave(2.0 * np.pi * (Omega[0] * x + Omega[1] * v)),
            -5.0, 5.5, -5.0, 4.5, epsabs=1e-11, epsrel=1e-11,
        )[0]  # fmt: skip

    return abs(complex(light().spectrum()(*Omega)) - (part(np.cos) - 1j * part(np.sin)))


# The convolution theorem -----------------------------------------------------------------------


def convolution_theorem():
    """Both directions, from the integrals.

    Convolution: with t = s + r the double integral of f(s) g(t - s) exp(-2 pi i Omega t) factors,
    for any f and g. Product: by the Fourier integrals of two generic Gaussians (any width, any
    centre), whose products span, by superposition, all square-integrable pairs.
    """
    s, r, Omega, sigma = sp.symbols("s r Omega sigma", real=True)
    kernel = lambda o, t: -2 * sp.pi * sp.I * o * t  # noqa: E731
    t = s + r
    factors = sp.expand(kernel(Omega, t) - kernel(Omega, s) - kernel(Omega, r))
    jacobian = sp.Matrix([s, t]).jacobian([s, r]).det() - 1
    a, b = sp.symbols("a b", positive=True)
    p, q = sp.symbols("p q", real=True)
    f, g = sp.exp(-a * (s - p) ** 2), sp.exp(-b * (s - q) ** 2)
    F = _gaussian_integral(-a * (s - p) ** 2 + kernel(Omega, s), s)
    G = _gaussian_integral(-b * (s - q) ** 2 + kernel(Omega, s), s)
    product = _gaussian_integral(sp.log(f * g, evaluate=False), s, kernel(Omega, s))
    shifted = F.subs(Omega, sigma), G.subs(Omega, Omega - sigma)
    both = sp.expand(_exponent(shifted[0]) + _exponent(shifted[1]))
    folded = _gaussian_integral(both, sigma) * _scale(shifted[0]) * _scale(shifted[1])
    return factors, jacobian, _vanishing_ratio(product, folded)


def _gaussian_integral(exponent, variable, more=0):
    """`int exp(A t^2 + B t + C) dt = sqrt(-pi / A) exp(C - B^2 / (4 A))` for Re A < 0."""
    exponent = sp.expand(sp.expand_log(exponent, force=True) + more)
    A, B, C = (exponent.coeff(variable, k) for k in (2, 1, 0))
    return sp.sqrt(-sp.pi / A) * sp.exp(C - B**2 / (4 * A))


def _exponent(e):
    """The argument of the exponential in `scale * exp(...)`."""
    return sum(factor.args[0] for factor in sp.Mul.make_args(e) if isinstance(factor, sp.exp))


def _scale(e):
    return sp.Mul(*(f for f in sp.Mul.make_args(e) if not isinstance(f, sp.exp)))


def _vanishing_ratio(left, right):
    """Difference of exponents and of squared scales: both zero if left = right."""
    exponents = sp.simplify(_exponent(left) - _exponent(right))
    return [exponents, sp.simplify(_scale(left) ** 2 - _scale(right) ** 2)]


def product_by_series() -> float:
    """F (*) G as the library convolves it, against the transform of the samples of the product."""
    factor = gaussian((-0.1, 0.2), (0.5, 0.6), -0.25)
    h = Multiply(factor, Grid.spanning((48, 47), (5.0, 4.5)))
    ours = h(light().spectrum())(*np.meshgrid(*FREQUENCIES, indexing="ij"))
    return normwise(ours, discrete_transform(GRID.sample(h(light())), GRID, *FREQUENCIES))


def convolution_by_sums() -> float:
    """Convolve samples along both axes by plain sums, and transform: F G."""
    n, h = 61, 0.2
    grid, wide = Grid((n, n), (h, h)), Grid((2 * n - 1, 2 * n - 1), (h, h))
    factor = gaussian((-0.1, 0.2), (0.5, 0.6), -0.25)
    f, g = (np.asarray(grid.sample(a)) for a in (light(), factor))
    folded = np.zeros((2 * n - 1, 2 * n - 1))
    for i in range(n):
        for j in range(n):
            folded[i : i + n, j : j + n] += f[i, j] * g
    both = discrete_transform(jnp.asarray(folded * grid.cell), wide, *FREQUENCIES)
    mesh = np.meshgrid(*FREQUENCIES, indexing="ij")
    return normwise(both, light().spectrum()(*mesh) * factor.spectrum()(*mesh))


# How a spectrum falls --------------------------------------------------------------------------


def fall_of_a_broken_power():
    """`t^n exp(-a t)` for t > 0 has a jump n! in the n-th derivative; F (2 pi i Omega)^(n+1) -> n!.

    The integral from its definition for n = 0 ... 3; derivatives below the n-th do not jump.
    """
    t, a, Omega = sp.symbols("t a Omega", positive=True)
    w = 2 * sp.pi * sp.I * Omega
    found = []
    for n in range(4):
        f = t**n * sp.exp(-a * t)
        found += [sp.limit(f.diff(t, k), t, 0) for k in range(n)]
        found.append(sp.limit(f.diff(t, n), t, 0) - sp.factorial(n))
        F = sp.integrate(t**n * sp.exp(-(a + w) * t), (t, 0, sp.oo), conds="none")
        found.append(sp.limit(sp.simplify(F * w ** (n + 1)), Omega, sp.oo) - sp.factorial(n))
    found.append(
        sp.integrate(sp.DiracDelta(t - a) * sp.exp(-w * t), (t, -sp.oo, sp.oo)) - sp.exp(-w * a)
    )
    return found


def fitted_fall() -> float:
    """Fitted powers of quadratures of the same integrals, |slope + n + 1| at worst."""
    Omega, worst = np.array([4.0, 8.0, 16.0, 32.0]), 0.0
    for n in range(3):
        size = [abs(_one_sided(n, w)) for w in Omega]
        worst = max(worst, abs(fitted_order(Omega, size) + n + 1))
    return worst


@functools.cache
def _one_sided(n: int, Omega: float) -> complex:
    """`int_0^oo t^n exp(-t) exp(-2 pi i Omega t) dt` by adaptive Fourier quadrature."""
    parts = [
        quad(lambda t: t**n * np.exp(-t), 0, np.inf, weight=w, wvar=2 * np.pi * Omega, limlst=400)[
            0
        ]
        for w in ("cos", "sin")
    ]
    return complex(parts[0], -parts[1])


def fall_of_fields() -> float:
    """Envelopes of the library's spectra: a box (n = 0), a cubic spline (n = 3), and their fits.

    At Omega = (m + 1/2) / size every jump's wave adds up, so the envelope is met exactly.
    """
    Omega = np.array([4.5, 8.5, 16.5, 32.5, 64.5])
    box = np.array([abs(BoxProfile(0.5).transform(jnp.asarray(w))) for w in Omega])
    hat = np.zeros(9)
    hat[4] = 1.0
    spline = Spline(hat, Grid((9,), (1.0,)), Frame(("x",)))
    # One sample spreads over all coefficients; divide by their sum of waves, which does not fall.
    bell = np.abs(spline.spectrum()(Omega)) * (4.0 + 2.0 * np.cos(2 * np.pi * Omega)) / 6.0
    return max(abs(fitted_order(Omega, box) + 1), abs(fitted_order(Omega, bell) + 4))


ROWS = [
    Row(
        "D05.1",
        "definition",
        implements="firstorder.fields.spectrum.discrete_transform",
        symbolic=na("definition"),
        autodiff=na("spectral"),
        fourier=Check(gaussian_against_samples, 1e-9),
        brute_force=Check(gaussian_against_quadrature, 1e-9),
    ),
    Row(
        "D05.s2.1b",
        "identity",
        implements="firstorder.laws.multiply.Multiply.spectrum",
        symbolic=convolution_theorem,
        autodiff=na("spectral"),
        fourier=Check(product_by_series, 1e-9),
        brute_force=Check(convolution_by_sums, 1e-9),
    ),
]
