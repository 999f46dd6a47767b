"""Travel in free space: a straight line in the plane, and the Fourier integral.

D05 §3.1 and Table 1. D05 labels light by where it goes and measures slopes towards +x; the
library's angles turn the other way (conventions, Flatland), so that (2) and (3) have for outgoing
light the other sign of d, and for incoming light the printed one.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.squares import square_error
from firstorder.ledger import Check, Counterexample, Row, na

x, v, d, t, a = sp.symbols("x v d t a", real=True)
Ox, Ov = sp.symbols("Omega_x Omega_v", real=True)


def along_the_ray():
    """Where the ray that passes (x, d) left the line y = 0: three parametrisations of one line.

    In the library's angles for outgoing and for incoming light, and in D05's.
    """
    start = sp.Symbol("x0")

    def left(direction, height):
        step = sp.solve(height - t * direction[1], t)[0]
        return sp.solve(sp.Eq(start + step * direction[0], x), start)[0]

    slope = {a: sp.atan(v)}
    ours = left((-sp.sin(a), sp.cos(a)), d).subs(slope) - (x + v * d)
    # Incoming light labelled v runs along -(-sin a, cos a), from y = d down to y = 0.
    coming = left((sp.sin(a), -sp.cos(a)), -d).subs(slope) - (x - v * d)
    theirs = left((sp.sin(a), sp.cos(a)), d).subs(slope) - (x - v * d)
    return [sp.simplify(e) for e in (ours, coming, theirs)]


def sheared_phase():
    """The substitution x = x' + v d in the Fourier integral, for every l."""
    before = sp.Symbol("x'", real=True)
    exponent = (Ox * x + Ov * v).subs(x, before + v * d)
    jacobian = sp.Matrix([before + v * d, v]).jacobian([before, v]).det() - 1
    return sp.expand(exponent - (Ox * before + (Ov + d * Ox) * v)), jacobian


def energy_and_argument():
    """A point of energy W of l is met by the argument where Omega = (W_x, W_v - d W_x)."""
    Wx, Wv = sp.symbols("W_x W_v")
    return sp.Matrix([Ox - Wx, Ov + d * Ox - Wv]).subs({Ox: Wx, Ov: Wv - d * Wx})


def traced_transform() -> float:
    """The square "travel, incoming light" again, by sampling light traced along straight lines."""
    from firstorder.checks.cases.moves.travel import coming
    from firstorder.checks.registry import all_cases

    axis = np.linspace(-6.5, 6.5, 131)
    X, V = np.meshgrid(axis, axis, indexing="ij")
    light = np.vectorize(lambda x, v: coming((x, v)))(X, V)
    case, worst = all_cases()["travel, incoming light"], 0.0
    F = case.step(case.field.spectrum())
    for Omega in ((0.31, -0.27), (-0.2, 0.4), (0.0, 0.0)):
        wave = np.exp(-2j * np.pi * (Omega[0] * X + Omega[1] * V))
        truth = np.sum(light * wave) * (axis[1] - axis[0]) ** 2
        worst = max(worst, abs(complex(F(*Omega)) - truth))
    return worst


def bell(x, v):
    """Light before travel, for the counterexamples."""
    return float(np.exp(-((x - 0.2) ** 2) - (v - 0.1) ** 2))


def followed(x, v, d):
    """The light at (x, v) after the distance d, D05's slopes: walk back down the ray."""
    direction = np.array([np.sin(np.arctan(v)), np.cos(np.arctan(v))])
    start = np.array([x, d]) - d / direction[1] * direction
    return bell(start[0], v)


def spectrum_sampled(Omega_x, Omega_v, d):
    """Transform of the light after travel, from traced samples; its real part."""
    axis = np.linspace(-8.0, 8.0, 321)
    X, V = np.meshgrid(axis, axis, indexing="ij")
    light = np.exp(-((X - d * np.tan(np.arctan(V)) - 0.2) ** 2) - (V - 0.1) ** 2)
    wave = np.exp(-2j * np.pi * (Omega_x * X + Omega_v * V))
    return float(np.sum(light * wave).real * (axis[1] - axis[0]) ** 2)


def spectrum_before(Omega_x, Omega_v, d):
    """Transform of the light before travel, which s3.1a equates with its own shear."""
    return spectrum_sampled(Omega_x, Omega_v, 0.0)


VALUE = {
    "implements": "firstorder.transport.events.travel.Travel",
    "symbolic": along_the_ray,
    "autodiff": Check(lambda: square_error("travel, incoming light", "gradient"), 1e-10),
    "fourier": na("no spectrum"),
    "brute_force": Check(lambda: square_error("travel, incoming light", "value"), 1e-10),
}
SPECTRUM = {
    "implements": "firstorder.transport.events.travel.Travel",
    "symbolic": lambda: [*sheared_phase(), *energy_and_argument()],
    "autodiff": na("spectral"),
    "brute_force": Check(traced_transform, 1e-9),
}

ROWS = [
    Row(
        "D05.2",
        "misprint",
        **VALUE,
        corrected="l_R'(x, v) = l_R(x - v d, v): R' is the ray after travel, as in (3)",
        counterexample=Counterexample(
            {"x": 0.5, "v": 0.4, "d": 1.5},
            # Printed, the light after travel is read off at x + v d.
            printed=lambda x, v, d: bell(x + v * d, v),
            true=followed,
        ),
        note="D05's slopes grow towards +x. Library: + for outgoing, - for incoming light.",
    ),
    Row(
        "D05.s3.1a",
        "misprint",
        **SPECTRUM,
        fourier=Check(lambda: square_error("travel", "spectrum"), 1e-9),
        corrected="the left-hand side is lhat_R', the spectrum after travel",
        counterexample=Counterexample(
            {"Omega_x": 0.2, "Omega_v": -0.1, "d": 1.5},
            printed=spectrum_before,
            true=spectrum_sampled,
        ),
    ),
    Row(
        "D05.3",
        "identity",
        **SPECTRUM,
        fourier=Check(lambda: square_error("travel, incoming light", "spectrum"), 1e-9),
        note="The argument is sheared by +d; a point of energy moves to (W_x, W_v - d W_x).",
    ),
    Row(
        "D05.T1.1",
        "identity",
        **SPECTRUM,
        fourier=Check(lambda: square_error("travel, in space", "spectrum"), 1e-9),
        note="Judged in space, on light with four correlated coordinates.",
    ),
]
