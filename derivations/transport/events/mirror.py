"""The mirror step: R07 (12)-(13), D05 (14), from the reflection of a vector about a normal."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.squares import square_error
from firstorder.checks.cases import bell
from firstorder.conventions import mirror_direction
from firstorder.ledger import Check, Counterexample, Row, na

x, t, n, o1, o2, s = sp.symbols("x theta n Omega_x Omega_theta s", real=True)

MIRROR = "firstorder.transport.events.mirror.Mirror"


def reflected_vector():
    """`2 (N . d) N - d` for d at angle theta and N at angle n points to 2 n - theta."""

    def direction(a):
        return sp.Matrix([-sp.sin(a), sp.cos(a)])

    N, d = direction(n), direction(t)
    return (2 * N.dot(d) * N - d - direction(2 * n - t)).applyfunc(sp.trigsimp)


def gradient_of_the_mirror():
    """Chain rule on a generic cubic."""
    a = sp.symbols("a0:10")
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    L = sum(c * x**i * t**j for c, (i, j) in zip(a, powers, strict=True))
    M = L.subs(t, -t)
    return [
        sp.expand(M.diff(x) - L.diff(x).subs(t, -t)),
        sp.expand(M.diff(t) + L.diff(t).subs(t, -t)),
        *reflected_vector().subs(n, 0).applyfunc(sp.trigsimp),
    ]


def exponent_of_the_mirror():
    """Fourier integral of L(x, -theta), with s = -theta."""
    return sp.expand((o1 * x + o2 * t).subs(t, -s) - (o1 * x - o2 * s))


def traced(x, theta) -> float:
    """Light that leaves a flat mirror at theta, found by reflecting the vector."""
    leaving = np.array([-np.sin(theta), np.cos(theta)])
    arriving = 2.0 * leaving[1] * np.array([0.0, 1.0]) - leaving
    return bell(x, float(np.arctan2(-arriving[0], arriving[1])))


def mirror_ball() -> float:
    """Parallel view of a disc: reflected angles from one rim to the other span a full turn.

    A ray at the fraction b of the radius meets the normal at arcsin(b). The library's angles, and
    those of the mirrored vectors.
    """
    angles, ours = [], []
    for b in (-1.0 + 1e-12, 1.0 - 1e-12):
        normal = np.array([b, np.sqrt(1.0 - b * b)])
        to_eye = np.array([0.0, 1.0])
        away = 2.0 * (normal @ to_eye) * normal - to_eye
        angles.append(np.arctan2(-away[0], away[1]))
        ours.append(mirror_direction(0.0, np.arctan2(-normal[0], normal[1])))
    turns = angles[0] - angles[1], ours[0] - ours[1]
    return max(abs(float(turn) - 2.0 * np.pi) for turn in turns)


_ROUTES = {
    "autodiff": Check(
        lambda: max(square_error("mirror", p) for p in ("gradient", "hessian")), 1e-10
    ),
    "fourier": Check(lambda: square_error("mirror", "spectrum"), 1e-9),
    "brute_force": Check(
        lambda: max(square_error("mirror", "value"), abs(traced(0.3, 0.4) - bell(0.3, -0.4))), 1e-10
    ),
}

ROWS = [
    Row("R07.12", "identity", MIRROR, gradient_of_the_mirror, **_ROUTES),
    Row("R07.13", "identity", MIRROR, gradient_of_the_mirror, **_ROUTES),
    Row(
        "R07.s4.1g",
        "misprint",
        MIRROR,
        gradient_of_the_mirror,
        **_ROUTES,
        corrected="Reflected in the x-axis, the line theta = 0: L_m(x, theta) = L(x, -theta).",
        counterexample=Counterexample(
            {"x": 0.3, "theta": 0.4}, lambda x, theta: bell(-x, theta), traced
        ),
    ),
    Row("D05.14", "identity", MIRROR, exponent_of_the_mirror, **_ROUTES),
    Row(
        "D05.s4.1e",
        "misprint",
        MIRROR,
        reflected_vector,
        **_ROUTES,
        corrected="dE_r'(theta_r') = dE'(theta_i') at theta_i' = -theta_r'",
        counterexample=Counterexample(
            {"x": 0.3, "theta": 0.4}, lambda x, theta: bell(x, theta), traced
        ),
        note="As printed, with theta_r' = -theta_i' the mirror would do nothing.",
    ),
    Row(
        "D05.s4.1h",
        "identity",
        "firstorder.conventions.mirror_direction",
        reflected_vector,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(mirror_ball, 1e-5),
        note="For a parallel view. The rim is met to 1e-12 of the radius, the turn to 6e-6.",
    ),
]
