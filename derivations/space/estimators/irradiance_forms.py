"""Irradiance gathered over a hemisphere, and its gradient: J12 (56), (57), (59), (60), (62)-(65).

Angles as in the paper; sums over phi are taken around the circle. Three statements of the
stratified form are misprinted: indices of differences are exchanged, (62) is no identity, and (64)
lacks a half. References are the irradiances of `_lights`, differenced with 40 digits.
"""

from __future__ import annotations

import functools

import sympy as sp

from derivations.space.estimators._measured import (
    constant_per_cell,
    frozen_error,
    gradient_error,
    printed_gradient,
    printed_sum,
    split_autodiff,
    split_numbers,
    summed_autodiff,
    summed_by_parts,
    true_gradient,
    true_sum,
    walls_moved,
)
from firstorder.ledger import Check, Counterexample, Row, na

theta, phi, h, r = sp.symbols("theta phi h r", positive=True)
a, b, c, d = sp.symbols("a b c d", real=True)


# --- proofs ---------------------------------------------------------------------------------------


def measure():
    """(56): on a plane at the height h, `G da` is `cos dw`; and the height drops out."""
    point = sp.Matrix([h * sp.tan(theta) * sp.cos(phi), h * sp.tan(theta) * sp.sin(phi)])
    area = point.jacobian([theta, phi]).det()
    distance = h / sp.cos(theta)
    return sp.simplify(area * sp.cos(theta) ** 2 / distance**2 - sp.sin(theta) * sp.cos(theta))


def split():
    """(59), for a light that varies with both angles."""
    light = theta**2 + sp.cos(phi) * theta + 2

    def part(low, high, left, right):
        inner = sp.integrate(light * sp.sin(2 * theta) / 2, (theta, low, high))
        return sp.integrate(inner, (phi, left, right))

    middle, across = sp.Rational(1, 2), sp.Integer(2)
    parts = sum(
        part(low, high, left, right)
        for low, high in ((0, middle), (middle, sp.pi / 2))
        for left, right in ((0, across), (across, 2 * sp.pi))
    )
    return sp.simplify(parts - part(0, sp.pi / 2, 0, 2 * sp.pi))


ROWS_OF_CELLS, COLUMNS = 3, 4


@functools.cache
def _cells():
    """Radiances, meridians around the circle, and circles from the pole to the horizon."""
    L = [[sp.Symbol(f"L{i}{j}") for j in range(ROWS_OF_CELLS)] for i in range(COLUMNS)]
    meridians = [*sp.symbols(f"f0:{COLUMNS}"), sp.Symbol("f0") + 2 * sp.pi]
    s = [sp.Integer(0), *sp.symbols(f"s1:{ROWS_OF_CELLS}"), sp.Integer(1)]  # sin^2 theta
    return L, meridians, s


def _sum():
    L, f, s = _cells()
    return sum(
        L[i][j] * (f[i + 1] - f[i]) * (s[j + 1] - s[j]) / 2
        for i in range(COLUMNS)
        for j in range(ROWS_OF_CELLS)
    )


def by_parts():
    """(62) put right: either sum alone, with its end terms, is E."""
    L, f, s = _cells()
    columns, rows = range(COLUMNS), range(ROWS_OF_CELLS)
    circles = sum(
        (L[i][j - 1] - L[i][j]) * (f[i + 1] - f[i]) * s[j] / 2 for i in columns for j in rows[1:]
    ) + sum(L[i][-1] * (f[i + 1] - f[i]) / 2 for i in columns)
    meridians = sum(
        (L[i - 1][j] - L[i][j]) * (s[j + 1] - s[j]) * f[i] / 2 for i in columns for j in rows
    ) + sum(L[-1][j] * (s[j + 1] - s[j]) * sp.pi for j in rows)
    return sp.expand(circles - _sum()), sp.expand(meridians - _sum())


def every_wall():
    """(63) put right: each wall of each cell moved on its own, `dE` is the sum over all walls.

    A circle's wall in column i by `ds_ij`, a meridian's in row j by `df_ij`.
    """
    L, f, s = _cells()
    ds = [
        [0, *[sp.Symbol(f"ds{i}{j}") for j in range(1, ROWS_OF_CELLS)], 0] for i in range(COLUMNS)
    ]
    df = [[sp.Symbol(f"df{i}{j}") for j in range(ROWS_OF_CELLS)] for i in range(COLUMNS)]
    t = sp.Symbol("t")
    moved = first = 0
    for i in range(COLUMNS):
        for j in range(ROWS_OF_CELLS):
            wide = f[i + 1] - f[i] + t * (df[(i + 1) % COLUMNS][j] - df[i][j])
            high = s[j + 1] - s[j] + t * (ds[i][j + 1] - ds[i][j])
            moved += L[i][j] * wide * high / 2
            first += (L[i - 1][j] - L[i][j]) * (s[j + 1] - s[j]) * df[i][j] / 2
            if j:
                first += (L[i][j - 1] - L[i][j]) * (f[i + 1] - f[i]) * ds[i][j] / 2
    return sp.expand(sp.diff(moved, t).subs(t, 0) - first)


def motions():
    """(64): `sin^2` and phi of a fixed point by a step, and what an exact meridian sweeps."""
    x, y = sp.symbols("x y", real=True)
    p = sp.Matrix([r * sp.sin(theta) * sp.cos(phi) - x, r * sp.sin(theta) * sp.sin(phi) - y])
    z = r * sp.cos(theta)
    square = p.dot(p) / (p.dot(p) + z**2)
    u = sp.Matrix([sp.cos(phi), sp.sin(phi)])
    v = sp.Matrix([sp.sin(phi), -sp.cos(phi)])

    def slope(f):
        return sp.Matrix([sp.diff(f, x), sp.diff(f, y)]).subs({x: 0, y: 0})

    azimuth = sp.Matrix([-p[1], p[0]]) / p.dot(p)  # of atan2, by p
    steps = -azimuth.subs({x: 0, y: 0})
    circle = slope(square) + 2 * sp.sin(theta) * sp.cos(theta) ** 2 / r * u
    meridian = steps - v / (r * sp.sin(theta))
    # The weight of a whole meridian: int cos dtheta. The half of (64) agrees at the mean of sines.
    swept = sp.integrate(sp.cos(theta), (theta, c, d))
    mean = (sp.sin(c) + sp.sin(d)) / 2
    printed = (sp.sin(d) ** 2 - sp.sin(c) ** 2) / (2 * mean)
    return [sp.simplify(e) for e in (*circle, *meridian, swept - printed)]


CELLS = {
    "implements": "firstorder.space.estimators._irradiance_forms.stratified_estimate",
    "fourier": na("no spectrum"),
}
AREA = {
    "implements": "firstorder.space.estimators._irradiance_forms.surface_area_estimate",
    "fourier": na("no spectrum"),
}

ROWS = [
    Row(
        "J12.56",
        "definition",
        **AREA,
        symbolic=measure,
        autodiff=na("definition"),
        brute_force=Check(lambda: frozen_error(0), 1e-12),
    ),
    *(
        Row(
            f"J12.{number}",
            "approximation",
            **AREA,
            symbolic=na("measured"),
            autodiff=na("measured"),
            brute_force=Check(lambda order=order: frozen_error(order), 1e-10),
            note="Exact without shadow edges (judged there), the horizon being dark for E_zz; "
            "wrong by them in a penumbra.",
        )
        for number, order in ((57, 1), (65, 2))
    ),
    Row(
        "J12.59",
        "identity",
        **CELLS,
        symbolic=split,
        autodiff=Check(split_autodiff, 1e-12),
        brute_force=Check(split_numbers, 1e-12),
    ),
    Row(
        "J12.60",
        "approximation",
        **CELLS,
        symbolic=na("measured"),
        autodiff=na("no derivative"),
        brute_force=Check(constant_per_cell, 0.05),
        note="Order 2 in the width of cells for midpoints and a smooth light.",
    ),
    Row(
        "J12.62",
        "misprint",
        **CELLS,
        symbolic=by_parts,
        autodiff=Check(summed_autodiff, 1e-13),
        brute_force=Check(summed_by_parts, 1e-13),
        corrected="E = 1/2 sum_i sum_{j>1} (L_{i,j-1} - L_{i,j}) dphi_i sin^2(theta_j-) + 1/2 "
        "sum_i L_{i,M} dphi_i = 1/2 sum_ij (L_{i-1,j} - L_{i,j}) dsin^2_j phi_i- + pi sum_j "
        "L_{N,j} dsin^2_j, L_0 = L_N: either sum, not both",
        counterexample=Counterexample({"radiance": 1.0}, printed=printed_sum, true=true_sum),
        note="Both sums together count E twice; only in its differential do both appear.",
    ),
    Row(
        "J12.63",
        "misprint",
        **CELLS,
        symbolic=every_wall,
        autodiff=Check(walls_moved, 1e-12),
        brute_force=Check(lambda: gradient_error(True), 3e-2),
        corrected="grad E ~ 1/2 sum (L_{i,j-1} - L_{i,j}) dphi_i grad sin^2(theta_j-) + 1/2 sum "
        "(L_{i-1,j} - L_{i,j}) dsin^2_j grad phi_i-",
        counterexample=Counterexample(
            {"rows": 60.0}, printed=lambda rows: printed_gradient(rows, 0.5), true=true_gradient
        ),
        note="That walls move only along their normals costs nothing: only that motion sweeps. The "
        "gradient tends to the truth, shadow edges included.",
    ),
    Row(
        "J12.64",
        "misprint",
        **CELLS,
        symbolic=motions,
        autodiff=Check(walls_moved, 1e-12),
        brute_force=Check(lambda: gradient_error(False), 3e-2),
        corrected="sum_i u_i sum_{j>1} (L_{i,j} - L_{i,j-1}) dphi_i sin cos^2(theta_j-) / r_{i,j-} "
        "+ sum_i v_i sum_j (L_{i-1,j} - L_{i,j}) (sin theta_j+ - sin theta_j-) / r_{i-,j}",
        counterexample=Counterexample({"rows": 60.0}, printed=printed_gradient, true=true_gradient),
        note="The printed (sin^2+ - sin^2-) / sin theta_j lacks a half, and is then Ward and "
        "Heckbert's sin+ - sin- exactly if sin theta_j is the mean of both.",
    ),
]
