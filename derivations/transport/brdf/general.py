"""GGX in flatland, from the normals of an ellipse.

The papers name such BRDFs only, so there are no rows: `PROOFS` are run by
tests/transport/brdf/test_general.py. Each proof returns what must vanish.
"""

from __future__ import annotations

import sympy as sp

alpha = sp.symbols("alpha", positive=True)
h, w, o, m = sp.symbols("h w o m", real=True)


def distribution():
    """Slopes of an ellipse with axes 1 and alpha: `P(m) = alpha^2 / (2 (alpha^2 + m^2)^(3/2))`.

    At x = s the slope is `m = -alpha s / sqrt(1 - s^2)`, hence `s = -m / sqrt(alpha^2 + m^2)`; x is
    uniform on (-1, 1). `D(h) cos h dh = P dm` with `m = -tan h` makes it D, whose integral against
    the cosine is then one.
    """
    s = m / sp.sqrt(alpha**2 + m**2)
    P = sp.diff(s, m) / 2
    printed = alpha**2 / (2 * (alpha**2 + m**2) ** sp.Rational(3, 2))
    c, t = sp.symbols("c t", positive=True)  # cos h and tan h
    D = alpha**2 / (2 * (alpha**2 * c**2 + t**2 * c**2) ** sp.Rational(3, 2))
    whole = sp.limit(s / 2, m, sp.oo) - sp.limit(s / 2, m, -sp.oo)
    return sp.simplify(P - printed), sp.simplify(D * c - printed.subs(m, t) / c**2), whole - 1


def half_angle():
    """`h = (w + o) / 2` halves the facets' angles: dw = 2 dh at fixed o."""
    return (sp.diff((w + o) / 2, w) - sp.Rational(1, 2),)


def masking():
    """The facets seen from o are the visible part of the ellipse: `(cos o + a(o)) / 2` wide.

    All facets that face o, `int D <o.h>+ dh`, show the half of the ellipse that faces o: an outline
    of half-width `a(o) = sqrt(cos^2 o + alpha^2 sin^2 o)`, cut at the ellipse's waist, whose point
    (1, 0) lies `cos o` from the centre across the view. For a unit length of base, half of both.
    """
    x, y = sp.cos(h), alpha * sp.sin(h)
    across = x * sp.cos(o) + y * sp.sin(o)  # across the view (-sin o, cos o)
    a2 = sp.cos(o) ** 2 + alpha**2 * sp.sin(o) ** 2
    top = sp.atan2(alpha * sp.sin(o), sp.cos(o))  # where the outline turns back
    extreme = across.subs(h, top) ** 2
    waist = across.subs(h, 0)
    Lambda = (sp.sqrt(1 + alpha**2 * sp.tan(o) ** 2) - 1) / 2
    c = sp.symbols("c", positive=True)
    t = sp.symbols("t", real=True)
    shown = (c + c * sp.sqrt(1 + alpha**2 * t**2)) / 2
    smith = c * (1 + Lambda.subs(sp.tan(o), t))
    return sp.simplify(extreme - a2), waist - sp.cos(o), sp.simplify(shown - smith)


def cancelled():
    """The height-correlated G over `2 cos w cos o` is `1 / (a(w) cos o + a(o) cos w)`."""
    cw, co, aw, ao = sp.symbols("cw co aw ao", positive=True)
    G = 1 / (1 + (aw / cw - 1) / 2 + (ao / co - 1) / 2)
    return (sp.simplify(G / (2 * cw * co) - 1 / (aw * co + ao * cw)),)


PROOFS = (distribution, half_angle, masking, cancelled)
