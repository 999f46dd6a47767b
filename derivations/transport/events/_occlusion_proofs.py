"""Proofs for blockers: products, lines of energy, corners and combs."""

from __future__ import annotations

import sympy as sp

x, v, z, s = sp.symbols("x v z s", real=True)
Ox, Ov = sp.symbols("Omega_x Omega_v", real=True)


def convolution_theorem():
    """A wave exp(2 pi i (s x + t v)) of the blocker moves l's transform to Omega - (s, t).

    The blocker is a sum of such waves; and, on Gaussians in one coordinate, the whole integral.
    """
    t = sp.Symbol("t", real=True)
    moved = -(Ox * x + Ov * v) + (s * x + t * v) + ((Ox - s) * x + (Ov - t) * v)
    a, b = sp.symbols("a b", positive=True)
    F = sp.exp(-sp.pi * (Ox - s) ** 2 / a) / sp.sqrt(a)
    G = sp.exp(-sp.pi * s**2 / b) / sp.sqrt(b)
    product = sp.exp(-sp.pi * Ox**2 / (a + b)) / sp.sqrt(a + b)
    convolved = sp.integrate(F * G, (s, -sp.oo, sp.oo))
    return sp.expand(moved), sp.simplify(convolved - product)


def planar_is_flat():
    """V(x) under a wide window in v: the transform in v is the window's, of mass one for any width.

    Its second moment falls as the square of the width: a Dirac in the limit.
    """
    width = sp.Symbol("width", positive=True)
    window = sp.exp(-(v**2) / (2 * width**2))
    hat = sp.sqrt(2 * sp.pi) * width * sp.exp(-2 * sp.pi**2 * width**2 * Ov**2)
    inverse = sp.integrate(hat * sp.cos(2 * sp.pi * Ov * v), (Ov, -sp.oo, sp.oo))
    mass = sp.integrate(hat, (Ov, -sp.oo, sp.oo))
    second = sp.integrate(Ov**2 * hat, (Ov, -sp.oo, sp.oo))
    return sp.simplify(inverse - window), mass - 1, sp.limit(second, width, sp.oo)


def line_of_a_layer():
    """A wave exp(2 pi i s x) of a planar blocker, met at x - z v: its frequency is s (1, -z)."""
    met = s * (x - z * v)
    return met.diff(x) - s, met.diff(v) + z * s


def out_of_the_wedge():
    """The product of two layers has the frequency (1, -z_1) - (1, -z_2) / 2.

    Its Omega_v / Omega_x is -(2 z_1 - z_2), as far outside the wedge [-z_2, -z_1] as the wedge is
    wide.
    """
    z1, z2 = sp.symbols("z_1 z_2", positive=True)
    point = sp.Matrix([1, -z1]) - sp.Matrix([1, -z2]) / 2
    return sp.simplify(point[1] / point[0] - (-z1 + (z2 - z1)))


def corner():
    """Transform of the corner H(p) H(q), p = x - z_1 v, q = x - z_2 v, damped: of first principles.

    With p, q for coordinates the plane wave is exp(-2 pi i (a p + b q)), Omega = a (1, -z_1) +
    b (1, -z_2): two half-line integrals and a Jacobian 1 / |z_1 - z_2|.
    """
    z1, z2, a, b = sp.symbols("z_1 z_2 a b", real=True)
    wave = a * (x - z1 * v) + b * (x - z2 * v)
    jacobian = sp.Matrix([x - z1 * v, x - z2 * v]).jacobian([x, v]).det() - (z1 - z2)
    return (
        sp.expand(wave - ((a + b) * x - (a * z1 + b * z2) * v)),
        sp.simplify(jacobian),
        out_of_the_wedge(),
        *line_of_a_layer(),
    )


def comb_coefficients():
    """Fourier coefficient n of a grating: the integral over one opening."""
    p, share = sp.symbols("p open", positive=True)
    n = sp.Symbol("n", integer=True, positive=True)
    wave = sp.cos(2 * sp.pi * n * x / p)
    c = sp.integrate(wave, (x, -share * p / 2, share * p / 2)) / p
    replica = sp.diff(n / p * x, x) - n / p
    return sp.simplify(c - sp.sin(sp.pi * n * share) / (sp.pi * n)), replica


def complementary():
    """H(x) H(-x) on either side of the edge, with H from the sign function."""
    H = (1 + sp.sign(x)) / 2
    both = sp.expand(H * H.subs(x, -x))
    return both.subs(x, sp.Rational(1, 3)), both.subs(x, -sp.Rational(1, 3))


def supports_add():
    """Product of two waves of frequencies a and b: frequencies a + b and a - b, no other."""
    a, b = sp.symbols("a b", positive=True)
    product = sp.cos(a * x) * sp.cos(b * x)
    return sp.simplify(product - (sp.cos((a + b) * x) + sp.cos((a - b) * x)) / 2)


def semi_transparent():
    """V = t on the blocker and 1 elsewhere is t + (1 - t) V_binary; the product is linear in V."""
    t, light = sp.symbols("t l")
    return [sp.expand(light * (t + (1 - t) * b) - light * (1 if b else t)) for b in (0, 1)]
