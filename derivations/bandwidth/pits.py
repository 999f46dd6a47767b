"""What BRDFs in the place of pits err by, however deep the pits, whatever they are of (D05 §7).

What an eye sees of a pit is a mean of the light that comes in by the same opening, of weights that
are not negative and add up to no more than the albedo. Numbers come from rays between mirrors.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.bandwidth import _pit_rays as rays
from firstorder.ledger import Check, Row, na

# --- proofs ------------------------------------------------------------------------------------


def weights_add_up_to_the_albedo():
    """Under light of 1 no wall sends more than its albedo, of any number of patches: here three.

    Patch i sends rho times what it gets, from patches F and through the opening 1 - F 1, for every
    ray that leaves it ends at one of these. So `(1 - rho F) (rho - L) = rho (1 - rho) F 1`, which
    is not negative, and neither is the inverse, the sum of all `(rho F)^n`.
    """
    rho = sp.Symbol("rho", positive=True)
    F = sp.Matrix(3, 3, sp.symbols("F_1:4(1:4)", positive=True))
    one = sp.ones(3, 1)
    balance = rho * (one - F * one)  # (1 - rho F) L
    short = (sp.eye(3) - rho * F) * rho * one - balance
    return [sp.expand(entry) for entry in short - rho * (1 - rho) * F * one]


def phases_are_a_chord_apart():
    """`|exp(i t) - 1|^2 = 4 sin(t / 2)^2`."""
    t = sp.Symbol("t", real=True)
    apart = sp.exp(sp.I * t) - 1
    return [sp.simplify(sp.expand(apart * sp.conjugate(apart)).rewrite(sp.cos)
                        - 4 * sp.sin(t / 2) ** 2)]  # fmt: skip


def a_corner_reaches_it():
    """Two mirrors at a right angle turn a ray about the line where they meet: u goes to -u."""
    n = sp.Symbol("n", real=True)
    one = sp.Matrix([sp.cos(n), sp.sin(n)])
    two = sp.Matrix([-sp.sin(n), sp.cos(n)])
    mirrors = [sp.eye(2) - 2 * m * m.T for m in (one, two)]
    return list((mirrors[0] * mirrors[1] + sp.eye(2)).applyfunc(sp.simplify))


# --- numbers -----------------------------------------------------------------------------------


def corner(opening):
    """A right-angled groove of mirrors."""
    half = 0.5 * opening
    return np.array([[-half, 0.0], [0.0, -half], [half, 0.0]])


def trough(opening, view):
    """Upright walls, and a floor off which rays from one rim leave at the other."""
    half, depth = 0.5 * opening, (0.5 - 1e-6) * opening / np.tan(view)
    return np.array([[-half, 0.0], [-half, -depth], [half, -depth], [half, 0.0]])


def texture_by_rays() -> float:
    """`pit_texture_error` against rays near the rims of grooves of mirrors.

    Two bounces in a right-angled one that takes nothing, one in a trough that does.
    """
    from firstorder.bandwidth import pit_texture_error

    worst = 0.0
    for opening, Bx, albedo in ((0.01, 2.0, 1.0), (0.3, 1.0, 0.9), (2.0, 0.2, 0.5)):
        u = 0.5 * opening * np.linspace(-1.0 + 1e-6, 1.0 - 1e-6, 2000)
        view = 0.0 if albedo == 1.0 else 0.6
        walls = corner(opening) if albedo == 1.0 else trough(opening, view)
        x, _, weight = rays.followed(u, view, walls, albedo)
        true = np.abs(weight * (np.exp(2j * np.pi * Bx * (x - u)) - 1.0)).max()
        ours = float(pit_texture_error(opening, Bx, albedo=albedo))
        worst = max(worst, abs(ours - true) / true)
    return worst


# --- rows --------------------------------------------------------------------------------------

ROWS = [
    Row(
        "C.relief.pits",
        "identity",
        implements="firstorder.bandwidth.pits.pit_texture_error",
        symbolic=lambda: [
            *weights_add_up_to_the_albedo(),
            *phases_are_a_chord_apart(),
            *a_corner_reaches_it(),
        ],
        autodiff=na("no derivative"),
        fourier=na("one route"),
        brute_force=Check(texture_by_rays, 1e-5),
        note="A bound for any shape below a plane; grooves of mirrors reach it.",
    ),
]
