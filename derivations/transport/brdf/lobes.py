"""Lobes: normalisation, transform and spread, from their integrals.

The papers print no lobe but the names, so there are no rows: `PROOFS` are run by
tests/transport/brdf/test_lobes.py. Each proof returns what must vanish.
"""

from __future__ import annotations

import sympy as sp

t, u, a = sp.symbols("t u a", real=True)
s = sp.symbols("s", positive=True)
_HALF = (t, -sp.pi / 2, sp.pi / 2)


def _power(s):
    """`int cos^s` over a half-turn: `p = sin^2` makes it the Beta function B(1/2, (s + 1)/2)."""
    return sp.gamma(sp.Rational(1, 2)) * sp.gamma((s + 1) / 2) / sp.gamma(s / 2 + 1)


def normalisation():
    """The Beta integral, against plain integration for whole s, and by its recursion for all.

    Integrating by parts, `I_(s+2) = (s + 1) / (s + 2) I_s`; the closed form obeys it, and agrees at
    s = 0 and s = 1.
    """
    parts = sp.diff(sp.sin(t) * sp.cos(t) ** (s + 1), t) - (
        (s + 2) * sp.cos(t) ** (s + 2) - (s + 1) * sp.cos(t) ** s
    )
    whole = [sp.integrate(sp.cos(t) ** k, _HALF) - _power(sp.Integer(k)) for k in (0, 1)]
    ratio = _power(s + 2) / _power(s) - (s + 1) / (s + 2)
    return _in_cosines(parts, s), _gammas(ratio), *whole


def _gammas(e):
    """Simplified by `Gamma(z + 1) = z Gamma(z)`."""
    half = sp.symbols("half", positive=True)
    return sp.simplify(sp.expand_func(sp.gammasimp(e).subs(s, 2 * half)).subs(half, s / 2))


def _in_cosines(e, power):
    """An expression in sin and cos over `cos^power`, as a polynomial in the cosine."""
    c = sp.symbols("c", positive=True)
    e = e.subs(sp.cos(t), c).subs(sp.sin(t), sp.sqrt(1 - c**2))
    return sp.simplify(sp.powsimp(sp.expand(e / c**power)))


def transform():
    """`int cos^s t e^(-i a t) dt = F(s, a)`, a ratio of Gamma functions.

    `F = pi Gamma(s + 1) / (2^s Gamma(1 + (s + a)/2) Gamma(1 + (s - a)/2))`. Integrating by parts
    twice, `(s^2 - a^2) F(s) = s (s - 1) F(s - 2)`; the closed form obeys it and agrees at s = 0 and
    s = 1 (by Gamma's reflection; shown for a = 3/7, a value like any other).

    Divided by F(s, 0) it is Gamma(1+s/2)^2 over the two others.
    """
    F = lambda s, a: (  # noqa: E731
        sp.pi * sp.gamma(s + 1) / 2**s / sp.gamma(1 + (s + a) / 2) / sp.gamma(1 + (s - a) / 2)
    )
    # (cos^s)'' = s (s - 1) cos^(s-2) - s^2 cos^s, and '' becomes -a^2 (ends vanish for s > 1)
    second = sp.diff(sp.cos(t) ** s, t, 2) - (
        s * (s - 1) * sp.cos(t) ** (s - 2) - s**2 * sp.cos(t) ** s
    )
    recursion = sp.gammasimp((s**2 - a**2) * F(s, a) / F(s - 2, a) - s * (s - 1))
    # with Gamma(1 + z) Gamma(1 - z) = pi z / sin(pi z) and Gamma(1/2 + z) Gamma(1/2 - z) = pi / cos
    z = a / 2
    zero = sp.pi / (sp.pi * z / sp.sin(sp.pi * z)) - sp.integrate(sp.exp(-sp.I * a * t), _HALF)
    product = (sp.Rational(1, 4) - z**2) * sp.pi / sp.cos(sp.pi * z)
    wave = sp.cos(t) * sp.cos(a * t)
    one = sp.pi / 2 / product - sp.integrate(wave, _HALF, conds="none")
    ratio = sp.gamma(1 + s / 2) ** 2 / sp.gamma(1 + (s + a) / 2) / sp.gamma(1 + (s - a) / 2)
    return (
        _in_cosines(second, s - 2),
        sp.simplify(recursion),
        *[sp.simplify(e.subs(a, sp.Rational(3, 7)).rewrite(sp.cos)) for e in (zero, one)],
        sp.simplify(sp.gammasimp(F(s, a) / F(s, 0) / ratio) - 1),
    )


def spread():
    """`int p'^2 / int p^2 = s^2 / (2 s - 1)`: p' = -s cos^(s-1) sin."""
    slope = s**2 * (_power(2 * s - 2) - _power(2 * s))
    return (_gammas(slope / _power(2 * s) - s**2 / (2 * s - 1)),)


def b_spline():
    """The pieces join with two derivatives, add up to one, and are four boxes convolved."""
    inner, outer = sp.Rational(2, 3) - u**2 + u**3 / 2, (2 - u) ** 3 / 6
    joins = [(sp.diff(inner, u, k) - sp.diff(outer, u, k)).subs(u, 1) for k in range(3)]
    ends = [sp.diff(outer, u, k).subs(u, 2) for k in range(3)]
    slope = sp.diff(inner, u).subs(u, 0)
    total = sum(
        f.subs(u, v) for f, v in ((inner, u), (inner, 1 - u), (outer, 1 + u), (outer, 2 - u))
    )
    # the transform of a box is a sinc; its fourth power against the integral of the even pieces
    w = sp.symbols("w", positive=True)
    F = 2 * sp.integrate(sp.expand(inner) * sp.cos(w * u), (u, 0, 1))
    F = F + 2 * sp.integrate(sp.expand(outer) * sp.cos(w * u), (u, 1, 2))
    four = 16 * ((1 - sp.cos(w)) / 2) ** 2 / w**4  # sin^2(w / 2) = (1 - cos w) / 2
    boxes = sp.simplify(sp.expand(sp.expand_trig(sp.expand(F - four))))
    return *joins, *ends, slope, sp.expand(total - 1), boxes


def rigid_rotation():
    """`turn n + look theta - omega` is unchanged by turning all three angles: look = 1 - turn."""
    turn, n, theta, omega, angle = sp.symbols("turn n theta omega angle", real=True)
    argument = lambda n, theta, omega: turn * n + (1 - turn) * theta - omega  # noqa: E731
    turned = argument(n + angle, theta + angle, omega + angle)
    return (sp.expand(turned - argument(n, theta, omega)),)


PROOFS = (normalisation, transform, spread, b_spline, rigid_rotation)
