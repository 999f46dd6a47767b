"""Proofs for diffuse reflection in slopes: areas, and transforms of the weight."""

from __future__ import annotations

import sympy as sp

u, v = sp.symbols("u v", real=True)
w = sp.Symbol("w", positive=True)
G_SPACE = (1 + u**2 + v**2) ** -2
g_FLAT = (1 + v**2) ** sp.Rational(-3, 2)


def projected_area():
    """The cosine of the angle arctan(v), times the length of d(unit vector) / dv."""
    ray = sp.Matrix([-v, 1]) / sp.sqrt(1 + v**2)
    length = sp.sqrt(sp.simplify(ray.diff(v).dot(ray.diff(v))))
    return sp.simplify(ray[1] * length - g_FLAT), sp.integrate(g_FLAT, (v, -sp.oo, sp.oo)) - 2


def projected_area_in_space():
    """The same with the area |w_u x w_v| of the unit vector w = (-u, -v, 1) / sqrt(...)."""
    s = 1 + u**2 + v**2
    ray = sp.Matrix([-u, -v, 1]) / sp.sqrt(s)
    normal = ray.diff(u).cross(ray.diff(v))
    area = sp.sqrt(sp.simplify(normal.dot(normal)))
    radial = sp.Symbol("r", positive=True)
    total = sp.integrate(2 * sp.pi * radial / (1 + radial**2) ** 2, (radial, 0, sp.oo))
    return sp.simplify(ray[2] * area - G_SPACE), total - sp.pi


def bessel():
    """The transform y(w) = int g exp(-i w v) dv, w = 2 pi Omega, is 2 w K_1(w).

    g solves (1 + v^2) g' + 3 v g = 0. Under the transform g' -> i w y, v f -> i dy_f/dw, so
    w y'' - y' - w y = 0 follows; of its solutions w K_1(w) and w I_1(w) only the first decays, and
    y(0) = int g = 2 fixes the factor.
    """
    weight = sp.simplify((1 + v**2) * sp.diff(g_FLAT, v) + 3 * v * g_FLAT)
    y = sp.Function("y")
    derivative = sp.I * w * y(w)  # transform of g'
    equation = derivative - sp.diff(derivative, w, 2) + 3 * sp.I * sp.diff(y(w), w)
    rearranged = sp.expand(equation / sp.I + w * y(w).diff(w, 2) - y(w).diff(w) - w * y(w))
    decaying, growing = 2 * w * sp.besselk(1, w), 2 * w * sp.besseli(1, w)

    def solves(f):
        return sp.simplify(w * f.diff(w, 2) - f.diff(w) - w * f)

    total = sp.integrate(g_FLAT, (v, -sp.oo, sp.oo))
    return [weight, rearranged, solves(decaying), solves(growing), sp.limit(decaying, w, 0) - total]


def bessel_in_space():
    """Slice theorem: G integrated over one slope is pi / 2 times g of the other; G is radial."""
    slice_ = 2 * sp.integrate(G_SPACE, (v, 0, sp.oo))
    radius, angle = sp.symbols("r phi", positive=True)
    turned = G_SPACE.subs({u: radius * sp.cos(angle), v: radius * sp.sin(angle)}, simultaneous=True)
    return [
        sp.simplify(slice_ - sp.pi / 2 * g_FLAT.subs(v, u)),
        sp.simplify(turned.diff(angle)),
        *bessel(),
    ]


def convolved_along_the_slope():
    """F(l g) at Omega: insert g as the integral of its waves; the x coordinate is not touched."""
    Ox, Ov, s, x = sp.symbols("Omega_x Omega_v s x", real=True)
    wave = -(Ox * x + Ov * v) + s * v
    shifted = -(Ox * x + (Ov - s) * v)
    a, b = sp.symbols("a b", positive=True)
    # and on Gaussians, where every integral is known
    f, g = sp.exp(-sp.pi * a * v**2), sp.exp(-sp.pi * b * v**2)
    F, G = (sp.exp(-sp.pi * Ov**2 / k) / sp.sqrt(k) for k in (a, b))
    left = sp.integrate(f * g, (v, -sp.oo, sp.oo))
    right = sp.integrate(sp.expand((F * G).subs(Ov, s)), (s, -sp.oo, sp.oo))
    return sp.expand(wave - shifted), sp.simplify(left - right)


def slice_at_zero():
    """The Fourier kernel over (x, v) at Omega_v = 0 is that over x: the sum over v comes first."""
    Ox, Ov, x = sp.symbols("Omega_x Omega_v x", real=True)
    kernel = sp.exp(-2 * sp.pi * sp.I * (Ox * x + Ov * v)).subs(Ov, 0)
    return sp.simplify(kernel - sp.exp(-2 * sp.pi * sp.I * Ox * x)), sp.diff(kernel, v)
