"""Linear change of coordinates, from the definitions of derivative and Fourier transform.

R07 §3.1 and App. A. The symbolic proofs start from a generic smooth f and from the Fourier integral
of a generic (correlated, off-centre) Gaussian, and never from the printed result.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.ledger import Check, Row, na
from derivations.squares import square_error

m11, m12, m21, m22, c1, c2, x, t = sp.symbols("m11 m12 m21 m22 c1 c2 x theta", real=True)
M = sp.Matrix([[m11, m12], [m21, m22]])
c = sp.Matrix([c1, c2])
u = sp.Matrix([x, t])
f = sp.Function("f")
p, q = sp.symbols("p q", real=True)


def gradient_of_the_composition():
    """D f(M u + c) / du by the limit that sympy calls diff, minus M^T grad f."""
    v = M * u + c
    h = f(v[0], v[1])
    left = sp.Matrix([h.diff(x), h.diff(t)]).doit()
    partial = sp.Matrix([f(p, q).diff(p), f(p, q).diff(q)])
    right = M.T * partial.subs({p: v[0], q: v[1]}, simultaneous=True)
    # sympy keeps the derivatives of f as Subs objects: compare on a generic analytic f instead too
    g = sp.exp(p * q) + p**3 * sp.sin(q)
    k = g.subs({p: v[0], q: v[1]}, simultaneous=True)
    grad = sp.Matrix([g.diff(p), g.diff(q)]).subs({p: v[0], q: v[1]}, simultaneous=True)
    analytic = sp.Matrix([k.diff(x), k.diff(t)]) - M.T * grad
    return list((left - right).applyfunc(lambda e: sp.simplify(e.doit()))), list(analytic)


def spectrum_of_the_composition():
    """The Fourier integral of f(M u + c) by the substitution v = M u + c, against R07 (54).

    The substitution turns `Omega . u` into `Omega . M^-1 (v - c)` and du into dv / |det M|; what is
    left is F at M^-T Omega times a phase, for every f.
    """
    o1, o2, v1, v2 = sp.symbols("Omega_1 Omega_2 v1 v2", real=True)
    Omega, v = sp.Matrix([o1, o2]), sp.Matrix([v1, v2])
    exponent = -2 * sp.pi * sp.I * (Omega.T * (M.inv() * (v - c)))[0]
    phase = 2 * sp.pi * sp.I * (Omega.T * M.inv() * c)[0]
    kernel = -2 * sp.pi * sp.I * ((M.inv().T * Omega).T * v)[0]
    jacobian = sp.Matrix(M.inv() * (v - c)).jacobian(v).det() * M.det() - 1
    return sp.simplify(exponent - phase - kernel), sp.simplify(jacobian)


ROWS = [
    Row(
        "R07.7",
        "identity",
        implements="firstorder.laws.move.Move.jet",
        symbolic=gradient_of_the_composition,
        autodiff=Check(lambda: square_error("move", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: square_error("move", "value"), 1e-10),
    ),
    Row(
        "R07.54",
        "identity",
        implements="firstorder.laws.move.Move.spectrum",
        symbolic=spectrum_of_the_composition,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("move", "spectrum"), 1e-9),
        brute_force=Check(lambda: _adaptive_integral(), 1e-9),
    ),
]


def _adaptive_integral() -> float:
    """R07 (54) against adaptive quadrature of the Fourier integral, a route of its own."""
    from scipy.integrate import dblquad

    from firstorder.checks.cases.law_move import brute
    from firstorder.checks.registry import cases

    Omega = np.array([0.31, -0.27])

    def part(function):
        return dblquad(
            lambda t, x: brute((x, t)) * function(2.0 * np.pi * (Omega[0] * x + Omega[1] * t)),
            -6.0, 6.0, -6.0, 6.0, epsabs=1e-11, epsrel=1e-11,
        )[0]  # fmt: skip

    case = cases()["move"]
    ours = complex(case.step(case.field.spectrum())(*Omega))
    return abs(ours - (part(np.cos) - 1j * part(np.sin)))
