"""Derivatives of irradiance in arc-length and stratified form: J12 (35)-(48), (50) and (51).

Proofs are in the paper's angles, towards +x, with the receiver at (x, 0) and its normal along +y;
the library's angles turn the other way, so that its differences across borders have the other sign.
References are the irradiances of `_scenes`, differenced with 30 digits.
"""

from __future__ import annotations

import functools
import itertools

import sympy as sp

from derivations.flatland.estimators._measured import (
    angular,
    constant_per_sector,
    frozen_autodiff,
    frozen_error,
    gradient_error,
    mended_sum,
    points_moved,
    printed_gradient,
    printed_hessian,
    sector_sums,
    true_first,
    true_second,
    with_boundary,
)
from derivations.scene.geometry_term import subtended
from firstorder.ledger import Check, Counterexample, Row, na

x, y, a, b, e1, A = sp.symbols("x y a b e1 A", real=True)
h, e2, R = sp.symbols("h e2 R", positive=True)
c0, c1 = sp.symbols("c0 c1", real=True)


def distance(p, height):
    return sp.sqrt((p - x) ** 2 + height**2)


def sine(p, height):
    return (p - x) / distance(p, height)


def cosine(p, height):
    return height / distance(p, height)


# --- arc length -----------------------------------------------------------------------------------


def product_rule():
    """(36): V is a step at the shadow edge s(x), so that the middle term is `-L G ds/dx` there.

    The light runs from the edge, which a blocker's end (e1, e2) throws onto the height h, to A.
    """
    edge = x + (e1 - x) * h / e2
    G = h**2 / distance(y, h) ** 3
    antiderivative = sine(y, h)
    moved = sp.diff(antiderivative, x)  # of int dG/dx dy: the integral of G is the sine
    interior = moved.subs(y, A) - moved.subs(y, edge)
    boundary = -G.subs(y, edge) * sp.diff(edge, x)
    whole = sp.diff(antiderivative.subs(y, A) - antiderivative.subs(y, edge), x)
    return sp.simplify(sp.diff(antiderivative, y) - G), sp.simplify(whole - interior - boundary)


def frozen(order):
    """(37), (48) without shadows: a light with fixed ends, `int d^k G / dx^k dy`, by its sine."""
    G = h**2 / distance(y, h) ** 3
    E = sine(b, h) - sine(a, h)
    inside = sp.diff(sine(y, h), x, order)
    rests = (
        sp.diff(inside, y) - sp.diff(G, x, order),
        sp.diff(E, x, order) - inside.subs(y, b) + inside.subs(y, a),
    )
    return [sp.simplify(rest.subs(x, 0)) for rest in rests]  # x = 0: only differences count


# --- strata ---------------------------------------------------------------------------------------


@functools.cache
def summed_by_parts():
    """(43) to (44) for five sectors, L being zero outside them; and (41) for an unknown light."""
    L = [0, *sp.symbols("L1:6"), 0]
    s = sp.symbols("s1:7")
    by_sector = sum(L[i] * (s[i] - s[i - 1]) for i in range(1, 6))
    by_border = sum((L[i - 1] - L[i]) * s[i - 1] for i in range(1, 7))
    t = sp.symbols("t", real=True)
    light = sp.sin(3 * t) + t**2
    ends = [-sp.pi / 2, -1, sp.Rational(1, 3), sp.pi / 2]
    parts = sum(sp.integrate(light * sp.cos(t), (t, p, q)) for p, q in itertools.pairwise(ends))
    whole = sp.integrate(light * sp.cos(t), (t, ends[0], ends[-1]))
    sector = sp.integrate(sp.cos(t), (t, a, b)) - (sp.sin(b) - sp.sin(a))
    return sp.expand(by_sector - by_border), sp.simplify(parts - whole), sector


def borders():
    """(46) and (51) for a fixed point: `-cos^2 / r` and `-3 cos^2 sin / r^2`."""
    s, c, r = sine(a, h), cosine(a, h), distance(a, h)
    return [
        sp.simplify(sp.diff(s, x) + c**2 / r),
        sp.simplify(sp.diff(s, x, 2) + 3 * c**2 * s / r**2),
    ]


def uncovered():
    """First and second derivative of a shadowed wall of linear radiance, against (46) and (51).

    A black blocker ends at (e1, e2) and hides the wall y = h to its left; the wall ends at A. The
    sum of (46) over all borders becomes `int cos^2 / r dL` plus the jumps, and is E'. That of (51)
    lacks `-dL/dtheta cos^3 (1/r_f - 1/r_b)^2` at the edge.
    """
    edge = x + (e1 - x) * h / e2

    def L(p):
        return c0 + c1 * p

    E = (
        L(A) * sine(A, h)
        - L(edge) * sine(edge, h)
        - c1 * (distance(A, h) - distance(edge, h))  # by parts: the integral of the sine is r
    )
    s, c, r_f = sine(e1, e2), cosine(e1, e2), distance(e1, e2)
    r_b = r_f * h / e2
    first = (
        c1 * (sine(A, h) - s)  # int c1 h^2 / r^3
        + L(edge) * c**2 / r_f
        - L(A) * cosine(A, h) ** 2 / distance(A, h)
    )
    smooth = -(h**2) * c1 * (1 / distance(A, h) ** 3 - 1 / r_b**3)  # int c1 3 h^2 (y - x) / r^5
    jumps = (
        L(edge) * 3 * c**2 * s / r_f**2
        - L(A) * 3 * cosine(A, h) ** 2 * sine(A, h) / distance(A, h) ** 2
    )
    lacking = -(c1 * r_b / c) * c**3 * (1 / r_f - 1 / r_b) ** 2  # dL/dtheta = c1 r_b / cos
    values = {h: sp.Rational(7, 5), e2: sp.Rational(4, 5)}  # heights; x, e1, A and L stay free
    below = {e1: x + sp.Symbol("u", real=True), A: x + sp.Symbol("w", real=True)}

    def rest(expression):
        return sp.simplify(expression.subs(values).subs(below))

    return rest(sp.diff(E, x) - first), rest(sp.diff(E, x, 2) - smooth - jumps - lacking)


def turned():
    """Rotation: `E_n = int L sin a`, `E_nn = -E + L(pi/2) + L(-pi/2)`, and the strata give both.

    Counter-clockwise; the light L(theta) stands still, the hemicircle turns by n.
    """
    n, t = sp.symbols("n t", real=True)
    light = sp.sin(2 * t) + t**2 + 3
    E = sp.integrate(sp.expand(light * sp.cos(t - n)), (t, n - sp.pi / 2, n + sp.pi / 2))
    ends = light.subs(t, n + sp.pi / 2) + light.subs(t, n - sp.pi / 2)
    inner = sp.integrate(sp.expand(light * sp.sin(t - n)), (t, n - sp.pi / 2, n + sp.pi / 2))
    return sp.simplify(sp.diff(E, n) - inner), sp.simplify(sp.diff(E, n, 2) + E - ends)


ARC = {
    "implements": "firstorder.flatland.estimators._irradiance_forms.arc_length_estimate",
    "fourier": na("no spectrum"),
}
STRATA = {
    "implements": "firstorder.flatland.estimators._irradiance_forms.stratified_estimate",
    "fourier": na("no spectrum"),
}
MOVED = {
    "implements": "firstorder.flatland.estimators._irradiance_forms.border_derivatives",
    "fourier": na("no spectrum"),
}

ROWS = [
    Row(
        "J12.35",
        "definition",
        **ARC,
        symbolic=subtended,
        autodiff=na("definition"),
        brute_force=Check(angular, 1e-12),
        note="With dl(y) as its measure the domain Omega does no harm: V leaves out the rest of L.",
    ),
    Row(
        "J12.36",
        "identity",
        **ARC,
        symbolic=product_rule,
        autodiff=na("one route"),
        brute_force=Check(with_boundary, 1e-10),
        note="grad V is a distribution on the shadow edges: a sum over edges, not an integral.",
    ),
    Row(
        "J12.37",
        "misprint",
        **ARC,
        symbolic=lambda: frozen(1),
        autodiff=Check(lambda: frozen_autodiff(1), 1e-12),
        brute_force=Check(lambda: frozen_error(1), 1e-10),
        corrected="grad E ~ int_L L V grad_x G dl(y): measure dl(y); equal only without shadows",
        counterexample=Counterexample({"x": 0.35}, printed=printed_gradient, true=true_first),
        note="Judged in scene A. In a penumbra the form is wrong by its edges (36).",
    ),
    *(
        Row(
            f"J12.{k}",
            "identity",
            **MOVED,
            symbolic=lambda part=part: summed_by_parts()[part],
            autodiff=na("no derivative"),
            brute_force=Check(sector_sums, 1e-13),
        )
        for k, part in ((41, 1), (43, 2), (44, 0))
    ),
    Row(
        "J12.42",
        "approximation",
        **MOVED,
        symbolic=na("measured"),
        autodiff=na("no derivative"),
        brute_force=Check(constant_per_sector, 0.05),
        note="Order 2 in the width for midpoints and a smooth light, 3/2 for jittered, 1 at jumps.",
    ),
    Row(
        "J12.45",
        "approximation",
        **MOVED,
        symbolic=lambda: [uncovered()[0], *turned()],
        autodiff=Check(lambda: points_moved(1), 1e-12),
        brute_force=Check(lambda: gradient_error("B"), 2e-3),
        note="When turning, borders at the horizon stay: left out, or E_nn is wrong by L there.",
    ),
    Row(
        "J12.46",
        "identity",
        **MOVED,
        symbolic=lambda: borders()[0],
        autodiff=Check(lambda: points_moved(1), 1e-12),
        brute_force=Check(lambda: gradient_error("B"), 2e-3),
    ),
    Row(
        "J12.47",
        "approximation",
        **STRATA,
        symbolic=lambda: uncovered()[0],
        autodiff=na("measured"),
        brute_force=Check(lambda: max(map(gradient_error, ("B", "disc"))), 2e-2),
        note="Tends to the truth: order 1 in the width, 1/2 before curved limbs. No bias is left.",
    ),
    Row(
        "J12.48",
        "approximation",
        **ARC,
        symbolic=lambda: frozen(2),
        autodiff=Check(lambda: frozen_autodiff(2), 1e-12),
        brute_force=Check(lambda: frozen_error(2), 1e-8),
        note="Exact without shadow edges (judged in scene A); wrong by them in a penumbra.",
    ),
    Row(
        "J12.50",
        "misprint",
        **MOVED,
        symbolic=lambda: borders()[1],
        autodiff=Check(lambda: points_moved(2), 1e-12),
        brute_force=Check(mended_sum, 1e-5),
        corrected="sum of (L_{i-1} - L_i) H(sin theta_i-), as in (45)",
        counterexample=Counterexample({"x": 0.35}, printed=printed_hessian, true=true_second),
    ),
]
