"""Proofs for the clamped cosine and for what it does to spectra."""

from __future__ import annotations

import sympy as sp

x, t, o1, o2, s, w = sp.symbols("x theta Omega_x Omega_theta s w", real=True)
k = sp.symbols("k", positive=True)


def transform_of_the_cosine():
    """The Fourier integral of one hump of the cosine, and its value at the removable pole."""
    W = sp.symbols("W", positive=True)
    integral = sp.integrate(sp.cos(t) * sp.cos(W * t), (t, -sp.pi / 2, sp.pi / 2))
    formula = 2 * sp.cos(sp.pi * W / 2) / (1 - W**2)
    generic = integral.args[0][0] if isinstance(integral, sp.Piecewise) else integral
    pole = sp.limit(formula, W, 1) - sp.integrate(sp.cos(t) ** 2, (t, -sp.pi / 2, sp.pi / 2))
    odd = sp.integrate(sp.cos(t) * sp.sin(3 * t), (t, -sp.pi / 2, sp.pi / 2))
    sinc = sp.pi / 2 * sum(sp.sin(sp.pi * a / 2) / (sp.pi * a / 2) for a in (1 - W, 1 + W))
    return [sp.simplify(generic - formula), pole, odd, sp.simplify(sp.expand_trig(sinc - formula))]


def convolution_over_angle():
    """`int F(Omega - w) C(w) dw` is the transform of f cos, since each w turns f by a phase.

    Insert `C(w) = int c(s) e^(-2 pi i w s) ds`: the integral over w of
    `F(Omega - w) e^(-2 pi i w s)` is `f(s) e^(-2 pi i Omega s)`, shown for a generic Gaussian,
    and the one over s is left.
    """
    a, m = sp.symbols("a m", positive=True)
    f = sp.exp(-sp.pi * a * (s - m) ** 2)
    F = sp.exp(-sp.pi * w**2 / a) * sp.exp(-2 * sp.pi * sp.I * w * m) / sp.sqrt(a)
    # int F(o2 - w) exp(-2 pi i w s) dw with p = o2 - w
    inner = sp.integrate(sp.expand(F * sp.exp(2 * sp.pi * sp.I * w * s)), (w, -sp.oo, sp.oo))
    phase = sp.exp(-2 * sp.pi * sp.I * o2 * s)
    return sp.simplify((inner - f) * phase)


def product_at_each_point():
    """The cosine is a product in ray space: Leibniz's rule on a generic cubic."""
    a = sp.symbols("a0:6")
    powers = [(i, j) for i in range(3) for j in range(2)]
    L = sum(c * x**i * t**j for c, (i, j) in zip(a, powers, strict=True))
    E = L * sp.cos(t)
    return [
        sp.expand(E.diff(t) - (L.diff(t) * sp.cos(t) - L * sp.sin(t))),
        sp.expand(E.diff(x) - L.diff(x) * sp.cos(t)),
    ]


def outer_product():
    """Distant light e(theta + k x) times c(theta): with s = theta + k x, dx = ds / k.

    The Fourier exponent splits into `(Omega_x / k) s + (Omega_theta - Omega_x / k) theta`, so the
    spectrum is the product of the two one-dimensional ones over |k|.
    """
    exponent = (o1 * x + o2 * t).subs(x, (s - t) / k)
    split = o1 / k * s + (o2 - o1 / k) * t
    return [sp.expand(exponent - split), sp.diff((s - t) / k, s) - 1 / k]


def line_of_distant_light():
    """Energy of distant light, at (0, W), moves by M^T to (k W, W): on k Omega_theta = Omega_x."""
    W = sp.symbols("W", real=True)
    energy = sp.Matrix([[1, 0], [k, 1]]).T * sp.Matrix([0, W])
    return sp.expand(k * energy[1] - energy[0])


def soft_shadow():
    """`E(x) = int s(x - v D) b(x - v d2) dv`, D = d1 + d2, is a convolution of magnified images.

    With p' = (D / d1) (x - v d2) the emitter is met at -(d2 ... ): linear in x - p' alone.
    """
    d1, d2, v, p = sp.symbols("d1 d2 v p", positive=True)
    D = d1 + d2
    slope = sp.solve(sp.Eq(p, D / d1 * (x - v * d2)), v)[0]
    emitter = sp.expand((x - slope * D) + (x - p) * d1 / d2)
    blocker = sp.expand((x - slope * d2) - p * d1 / D)
    jacobian = slope.diff(p) + d1 / (d2 * D)
    return [sp.simplify(e) for e in (emitter, blocker, jacobian)]


def with_the_cosine_inside():
    """The gradient of reflected light with its cosine, against R07 (25) that leaves it out.

    d/dx of `f rho(2 n - theta - w)` with `f = L(x, w) cos(w - n)` differs from the right integrand
    by a total derivative in w, which integrates to nothing.
    """
    n, L, rho = sp.Function("n")(x), sp.Function("L"), sp.Function("rho")
    f = L(x, w) * sp.cos(w - n)
    u = 2 * n - t - w
    n_x = n.diff(x)
    cosine, sine = sp.cos(w - n), sp.sin(w - n)
    right = (
        L(x, w).diff(x) * cosine + 2 * n_x * L(x, w).diff(w) * cosine - n_x * L(x, w) * sine
    ) * rho(u)
    total = sp.diff(-2 * n_x * f * rho(u), w)
    return sp.simplify((sp.diff(f * rho(u), x) - right - total).doit())
