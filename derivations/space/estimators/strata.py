"""Cells of a hemisphere: their cosine-weighted size, J12 (61)."""

from __future__ import annotations

import sympy as sp

from derivations.space.estimators._measured import cell_autodiff, cell_numbers
from firstorder.ledger import Check, Row, na

theta, phi = sp.symbols("theta phi", positive=True)
a, b, c, d = sp.symbols("a b c d", real=True)


def cell():
    """(61): `int cos sin dtheta dphi` over a cell."""
    whole = sp.integrate(sp.cos(theta) * sp.sin(theta), (theta, c, d), (phi, a, b))
    return sp.simplify(whole - (b - a) * (sp.sin(d) ** 2 - sp.sin(c) ** 2) / 2)


ROWS = [
    Row(
        "J12.61",
        "identity",
        implements="firstorder.space.estimators.strata.Strata.projected",
        symbolic=cell,
        autodiff=Check(cell_autodiff, 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(cell_numbers, 1e-14),
    ),
]
