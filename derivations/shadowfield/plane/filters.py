"""The sheared filter: the parallelogram about the wedge, and what it is in space.

E11 §4, eqs. 9 and 10.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

d1, near, far = sp.symbols("d1 d2_min d2_max", positive=True)
pix, high = sp.symbols("Omega_pix Omega_y_max", positive=True)


def corner(d2):
    """Where a wave on the plane at d2 stands when its Omega_y is the light's band limit."""
    x, y = sp.symbols("x y")
    u = y + d2 * (x - y) / d1  # met by the ray from y to x
    return sp.simplify(high * u.diff(x) / u.diff(y))


def footprint():
    """A takes the simple box's upper corners to those of the wedge; A^-T takes its footprint."""
    box = sp.Matrix([[pix, -pix], [high, high]])
    wedge = sp.Matrix([[corner(far), corner(near)], [high, high]])
    A = wedge * box.inv()
    return A.inv().T.applyfunc(sp.simplify)


def printed():
    inverse = [1 / (d1 / d - 1) for d in (far, near)]
    scale = 2 * pix / high / (inverse[0] - inverse[1])
    return scale, -(inverse[0] + inverse[1]) / 2


def scale():
    """(9), and no change of y."""
    B = footprint()
    return sp.simplify(B[0, 0] - printed()[0]), sp.simplify(B[0, 1]), sp.simplify(B[1, 1] - 1)


def shear():
    """(10): the footprint is scaled first; its y then grows by the shear for each x."""
    B = footprint()
    return sp.simplify(B[1, 0] / B[0, 0] - printed()[1])


# ---------------------------------------------------------------- numeric routes

SCENE = {"d1": 1.2, "d2_min": 0.25, "d2_max": 0.5, "Omega_y_max": 2.0, "Omega_pix": 16.0}


def _filter():
    from firstorder.shadowfield import sheared_filter

    return sheared_filter(**SCENE)


def _offsets() -> np.ndarray:
    """Omega_x of waves on planes in between, counted along lines of the picture of each wave."""
    found = []
    for d2 in np.linspace(SCENE["d2_min"], SCENE["d2_max"], 33):

        def u(x, y, d2=d2):
            return y + (x - y) * d2 / SCENE["d1"]

        across, up = u(1.0, 0.0) - u(0.0, 0.0), u(0.0, 1.0) - u(0.0, 0.0)
        found.append(SCENE["Omega_y_max"] * across / up)
    return np.array(found)


def scale_by_waves() -> float:
    """The pixel's width over the width of all offsets."""
    width = np.ptp(_offsets())
    return float(abs(_filter().primal_scale * width / (2 * SCENE["Omega_pix"]) - 1.0))


def shear_by_waves() -> float:
    """The middle of all offsets, for each unit of Omega_y, with the sign turned."""
    ends = _offsets()
    middle = 0.5 * (ends.min() + ends.max()) / SCENE["Omega_y_max"]
    return float(abs(_filter().primal_shear + middle))


def duality() -> float:
    """A bell over the footprint's coordinates: its transform, by sum, is a bell over A^-1 Omega."""
    k = _filter()
    B, A = np.asarray(k.primal_matrix), np.asarray(k.frequency_matrix)
    s = np.array([0.015, 0.2])
    x, y = np.linspace(-4.0, 4.0, 801), np.linspace(-4.0, 4.0, 801)
    U = np.stack(np.meshgrid(x, y, indexing="ij"), -1) @ np.linalg.inv(B).T
    bell = np.exp(-0.5 * np.sum((U / s) ** 2, -1)) / (2 * np.pi * s.prod() * np.linalg.det(B))
    worst = 0.0
    for w in ((0.5, 0.3), (-0.2, 0.8), (1.0, 1.0)):
        wave = np.exp(-2j * np.pi * (w[0] * x[:, None] + w[1] * y))
        truth = np.sum(bell * wave) * (x[1] - x[0]) * (y[1] - y[0])
        back = np.linalg.solve(A, w)
        worst = max(worst, abs(truth - np.exp(-2 * np.sum((np.pi * s * back) ** 2))))
    return float(worst)


ROWS = [
    Row(
        "E11.9",
        "identity",
        implements="firstorder.shadowfield.plane.filters.sheared_filter",
        symbolic=scale,
        autodiff=na("no derivative"),
        fourier=Check(duality, 1e-9),
        brute_force=Check(scale_by_waves, 1e-12),
        note="For d1 > d2_max. With d1 among the blockers the bracket changes sign: refused. At a "
        "single depth it diverges: a margin is asked for. Below 1 the filter gains nothing.",
    ),
    Row(
        "E11.10",
        "identity",
        implements="firstorder.shadowfield.plane.filters.RayFilter.primal_shear",
        symbolic=shear,
        autodiff=na("no derivative"),
        fourier=Check(duality, 1e-9),
        brute_force=Check(shear_by_waves, 1e-12),
        note="y per x, as printed. The shear in frequency that it is dual to is in Omega_x per "
        "Omega_y; the text before (10) has it the other way round.",
    ),
]
