"""Normal maps: R07 §4.2, from the chain rule and from the normal of a displaced curve."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.squares import refusal, square_error
from firstorder.checks.cases import bell
from firstorder.fields import gaussian
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport import Bump, wave

x, t = sp.symbols("x theta", real=True)
BUMP = "firstorder.transport.events.bump.Bump"


def gradient_of_the_bump():
    """Chain rule for a generic n(x), on a generic cubic light field; and the Hessian's n_xx."""
    n = sp.Function("n")(x)
    a = sp.symbols("a0:10")
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    L = sum(c * x**i * t**j for c, (i, j) in zip(a, powers, strict=True))
    there = {t: t + n}
    local = L.subs(there)

    def at(*by):
        return L.diff(*by).subs(there)

    n1, n2 = n.diff(x), n.diff(x, 2)
    bent = at(x, x) + 2 * n1 * at(x, t) + n1**2 * at(t, t) + n2 * at(t)
    return [
        sp.expand(local.diff(x) - (at(x) + n1 * at(t))),
        sp.expand(local.diff(t) - at(t)),
        sp.expand(local.diff(x, 2) - bent),
    ]


def displaced_curve():
    """Tangent of a curve with the normal's angle n_0, and first slope of it lifted by h(x)."""
    base, h = sp.Function("n_0")(x), sp.Function("h")(x)
    tangent, normal = (
        sp.Matrix([sp.cos(base), sp.sin(base)]),
        sp.Matrix([-sp.sin(base), sp.cos(base)]),
    )
    slope = tangent + (h * normal).diff(x)  # of p + h n, where p' is the tangent
    bump = sp.atan(h.diff(x) / (1 - h * base.diff(x)))  # of the bump, against the base
    return base, bump, slope


def angle_of_a_sum():
    """The lifted curve points along the base's angle and the bump's, added."""
    base, bump, (dx, dy) = displaced_curve()
    return sp.expand_trig(dx * sp.sin(base + bump) - dy * sp.cos(base + bump))


def curvature_of_a_sum():
    """The rate at which the lifted curve turns, per metre of the base, is the sum of both rates."""
    base, bump, (dx, dy) = displaced_curve()
    rate = (dx * dy.diff(x) - dy * dx.diff(x)) / (dx**2 + dy**2)
    return rate - base.diff(x) - bump.diff(x)


def shading_curvature(k_0, height, W, x) -> float:
    """dn/dx of the normal of `n_0 = k_0 x` turned by the bump `height sin(W x)`, from vectors."""

    def angle(at):
        base, bump = k_0 * at, height * np.sin(W * at)
        c, s = np.cos(bump), np.sin(bump)
        normal = np.array([[c, -s], [s, c]]) @ np.array([-np.sin(base), np.cos(base)])
        return np.arctan2(-normal[0], normal[1])

    h = 1e-4
    return float((angle(x + h) - angle(x - h)) / (2.0 * h))


def semi_convolution() -> float:
    """A bump does have a Fourier formula: a product with `exp(2 pi i Omega_theta n(x))`.

    In (x, Omega_theta) the warp is a phase, so in full frequency space it is a convolution along
    Omega_x whose kernel depends on Omega_theta (for ripples: Bessel functions). By sums over x.
    """
    L = gaussian((0.2, -0.1), (0.5, 0.4), 0.3)
    local = Bump(wave(0.4, amplitude=0.25, phase=0.6))(L)
    h = 0.05
    a = np.arange(-5.0, 5.0, h)
    Ox, Ot = 0.3, 0.35
    n = 0.25 * np.cos(0.8 * np.pi * a + 0.6)

    def transform(field, phase):
        over_angle = np.asarray(field(a[:, None], a)) @ np.exp(-2j * np.pi * Ot * a) * h
        return np.sum(over_angle * phase * np.exp(-2j * np.pi * Ox * a)) * h

    both = transform(local, 1.0), transform(L, np.exp(2j * np.pi * Ot * n))
    return float(abs(both[0] - both[1]))


def _bumpy_error(place, angle) -> float:
    """Light in the frame of a base curvature with ripples, against plain NumPy."""
    from firstorder.checks.cases.moves.bump import n  # not before 64 bits are on
    from firstorder.checks.registry import all_cases

    case = all_cases()["bump"]
    ours = float(case.step(case.field)(place, angle))
    return abs(bell(place, angle + n(place)) - ours)


_ROUTES = {
    "autodiff": Check(
        lambda: max(
            square_error(c, p) for c in ("bump", "bump back") for p in ("gradient", "hessian")
        ),
        1e-10,
    ),
    "fourier": Check(lambda: max(refusal("bump", "spectrum"), semi_convolution()), 1e-12),
    "brute_force": Check(lambda: square_error("bump", "value"), 1e-10),
}

ROWS = [
    Row(
        "R07.21",
        "identity",
        BUMP,
        gradient_of_the_bump,
        **_ROUTES,
        note="Its spectrum is refused as a law of its own, but is a semi-convolution (D05 §4.5): a "
        "product with exp(2 pi i Omega_theta n(x)) in (x, Omega_theta), measured here.",
    ),
    Row("R07.s4.2a", "definition", BUMP, gradient_of_the_bump, **_ROUTES),
    Row(
        "R07.s4.2b",
        "definition",
        BUMP,
        angle_of_a_sum,
        autodiff=Check(lambda: square_error("bump", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: _bumpy_error(0.3, 0.1), 1e-12),
    ),
    Row(
        "R07.s4.2c",
        "over-claim",
        BUMP,
        curvature_of_a_sum,
        autodiff=Check(lambda: square_error("bump", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(
            lambda: max(
                abs(shading_curvature(0.5, 0.01, 40.0, 0.3) - (0.5 + 0.4 * np.cos(40.0 * 0.3))),
                square_error("bump", "value"),
            ),
            1e-4,
        ),
        corrected="k = dn_0/dx + dnhat/dx; the bump dominates where |dnhat/dx| >> |dn_0/dx|.",
        counterexample=Counterexample(
            {"k_0": 0.5, "height": 0.01, "W": 40.0, "x": 0.04},
            lambda k_0, height, W, x: float(height * W * np.cos(W * x)),
            shading_curvature,
        ),
        note="High frequency is not enough: a bump of 0.01 rad at 40 rad/m has at most 0.4 / m.",
    ),
]
