"""Proofs of J12 §8.2-8.4: integrals of a quadratic form's modulus over discs and ellipses."""

from __future__ import annotations

import sympy as sp

R, eps, r, l1, l2, A, B = sp.symbols("R epsilon r lambda_1 lambda_2 A B", positive=True)
phi, s, d, x, y = sp.symbols("phi s d x y", real=True)


def over_an_ellipse(form, a, b):
    """Integral of a form of (x, y) over an ellipse with semi-axes a, b along the coordinates."""
    polar = form.subs({x: a * r * sp.cos(phi), y: b * r * sp.sin(phi)}, simultaneous=True)
    inner = sp.integrate(sp.expand(polar * a * b * r), (r, 0, 1))
    return sp.integrate(sp.expand(inner), (phi, 0, 2 * sp.pi))


def disc_of_one_sign():
    """(68) over a disc for curvatures of one sign: their mean takes the largest's place."""
    total = over_an_ellipse((l1 * x**2 + l2 * y**2) / 2, R, R)
    return sp.expand(total - sp.pi / 4 * (l1 + l2) / 2 * R**4)


def disc_of_both_signs():
    """The mean of |s + d cos 2 phi|, |s| < d: the integral between its roots, and its limits.

    With `s = d sin a` the form is negative for `2 phi` from `pi / 2 + a` to `3 pi / 2 - a`.
    """
    a = sp.Symbol("a", real=True)
    psi = sp.Symbol("psi", real=True)
    form = sp.sin(a) + sp.cos(psi)
    edge = sp.pi / 2 + a
    plus = sp.integrate(form, (psi, -edge, edge))
    minus = sp.integrate(-form, (psi, edge, 2 * sp.pi - edge))
    mean = (plus + minus) / (2 * sp.pi)
    closed = 2 / sp.pi * (sp.sin(a) * a + sp.cos(a))
    return [
        sp.simplify(sp.expand_trig(mean - closed)),
        closed.subs(a, sp.pi / 2) - 1,  # joins the mean of one sign, s = d
        closed.subs(a, 0) - 2 / sp.pi,
        # Over s + d = |lambda_1| it is least, `2 a / pi`, where a = cos a.
        sp.simplify(
            sp.diff(closed / (1 + sp.sin(a)), a) * (1 + sp.sin(a)) ** 2
            - 2 / sp.pi * sp.cos(a) * (a - sp.cos(a))
        ),
        sp.simplify((closed / (1 + sp.sin(a)) - 2 / sp.pi * a).subs(sp.cos(a), a)),
    ]


def printed_bound():
    """(69): pi int |l| r^3 dr is pi/4 |l| R^4, from `|x^T H x| <= |l_1| r^2`."""
    below = over_an_ellipse((l1 * (x**2 + y**2)) / 2, R, R)
    return [
        *(
            sp.integrate(sp.pi * abs(k) * r**3, (r, 0, R)) - sp.pi / 4 * l1 * R**4
            for k in (l1, -l1)
        ),
        sp.simplify(below - sp.pi / 4 * l1 * R**4),
    ]


def printed_radius():
    """(70) from the bound, by solving for R."""
    bound = over_an_ellipse(l1 * (x**2 + y**2) / 2, R, R)
    root = (4 * eps / (sp.pi * l1)) ** sp.Rational(1, 4)
    found = [z for z in sp.solve(sp.Eq(bound, eps), R) if z.is_positive]
    return [sp.simplify(bound.subs(R, root) - eps), *(sp.simplify(z - root) for z in found)]


def leading_order():
    """(67) against (68): terms of third order cancel over a disc, those of fourth are O(R^2).

    For H = l I and l > 0 the miss is positive near the record: the modulus may be dropped.
    """
    c = sp.symbols("c0:4", real=True)
    q = sp.symbols("q0:5", real=True)
    cubic = sum(k * x**i * y ** (3 - i) for i, k in enumerate(c))
    quartic = sum(k * x**i * y ** (4 - i) for i, k in enumerate(q))
    total = over_an_ellipse(l1 * (x**2 + y**2) / 2 + cubic + quartic, R, R)
    ratio = sp.expand(total / (sp.pi / 4 * l1 * R**4) - 1)
    return [
        sp.simplify(ratio - ratio.coeff(R, 2) * R**2),
        *(sp.simplify(sp.diff(ratio, k)) for k in c),
    ]


def upper_bound():
    """(72) is above (68) by the triangle inequality, and equal for one sign."""
    both = (l1 * x**2 + l2 * y**2) / 2
    mixed = sp.simplify(over_an_ellipse(both, A, B) - sp.pi / 8 * A * B * (l1 * A**2 + l2 * B**2))
    # On its positive sector |l1 x^2 - l2 y^2| is less by 2 l2 y^2, elsewhere by 2 l1 x^2.
    gaps = [
        sp.expand(l1 * x**2 + l2 * y**2 - (l1 * x**2 - l2 * y**2) - 2 * l2 * y**2),
        sp.expand(l1 * x**2 + l2 * y**2 - (l2 * y**2 - l1 * x**2) - 2 * l1 * x**2),
    ]
    return [mixed, *gaps]


def right_axes():
    """Semi-axes of the largest ellipse, as corrected."""
    scale = (4 * eps / sp.pi) ** sp.Rational(1, 4)
    eighth = sp.Rational(1, 8)
    return scale * (l2 / l1**3) ** eighth, scale * (l1 / l2**3) ** eighth


def largest_ellipse():
    """The corrected axes meet the tolerance, are stationary, and a level set; the printed miss it.

    Area is stationary at a given error if their gradients in the axes are parallel. Of all sets the
    largest collects the places of least integrand, and so is a level set: `l1 a^2 = l2 b^2`.
    """
    error = over_an_ellipse((l1 * x**2 + l2 * y**2) / 2, A, B)
    at = dict(zip((A, B), right_axes(), strict=True))
    parallel = sp.diff(error, A) * A - sp.diff(error, B) * B
    scale = (4 * eps / sp.pi) ** sp.Rational(1, 4)
    printed = {A: scale * l1 ** -sp.Rational(1, 4), B: scale * l2 ** -sp.Rational(1, 4)}
    q = (l1 / l2) ** sp.Rational(1, 4)
    return [
        sp.simplify(error.subs(at) - eps),
        sp.simplify(parallel.subs(at)),
        sp.simplify((l1 * A**2 - l2 * B**2).subs(at)),
        sp.simplify((A * B).subs(at) - (A * B).subs(printed)),  # the same area ...
        sp.simplify(error.subs(printed) - eps / 2 * (q + 1 / q)),  # ... and more error
    ]


def stretched_to_a_saddle():
    """Of eigenvalues of both signs the error at a given area is least where they are balanced.

    After a stretch they are `p e^t` and `-p e^-t`: s = p sinh t, d = p cosh t, and the mean is
    `(2 p / pi) (sinh t asin(tanh t) + 1)`, whose derivative has the sign of t.
    """
    t = sp.Symbol("t", real=True)
    ratio, root = sp.tanh(t), sp.sqrt(sp.cosh(t) ** 2 - sp.sinh(t) ** 2)
    mean = sp.sinh(t) * sp.asin(ratio) + sp.simplify(root)
    # asin(tanh t) has the derivative sech t, so the derivative is cosh t asin(tanh t) + tanh t.
    slope = sp.diff(mean, t).subs(sp.sqrt(1 - ratio**2), 1 / sp.cosh(t))
    return [
        sp.simplify(slope - sp.cosh(t) * sp.asin(ratio) - sp.tanh(t)),
        slope.subs(t, 0),
        sp.simplify(root - 1),
    ]


def bound_by_parts():
    """B - P and B - N are |P - N| -+ (P - N) halved; P - l H is (1 - l) H_+ + l H_-.

    Both are sums of matrices without negative eigenvalues for 0 <= l <= 1. In the frame in which
    P - N is diagonal, entry by entry.
    """
    p, n = sp.symbols("P N", real=True)
    plus, minus, light = sp.symbols("H_+ H_- l", nonnegative=True)
    middle = (p + n + sp.Abs(p - n)) / 2
    return [
        sp.simplify(middle - sp.Max(p, n).rewrite(sp.Abs)),
        sp.expand(plus - light * (plus - minus) - ((1 - light) * plus + light * minus)),
        sp.expand(minus + light * (plus - minus) - ((1 - light) * minus + light * plus)),
    ]
