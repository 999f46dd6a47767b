"""The image gradient in space: R07 §5.3 with a camera that moves place and direction."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.imaging import _bumpy as bumpy
from firstorder.checks.tolerance import normwise
from firstorder.ledger import Check, Row, na

MODULE = "firstorder.imaging.camera"


def footprint():
    """Where the ray e + D d(p) meets the plane n.x = c, differentiated as it stands.

    The ray's vector is (px, py, -gamma); r, its length, is put in where only its square is left.
    """
    p, q, g, c, r = sp.symbols("p_x p_y gamma c r", positive=True)
    n, eye = sp.Matrix(sp.symbols("n_1:4", real=True)), sp.Matrix(sp.symbols("e_1:4", real=True))
    ray = sp.Matrix([p, q, -g])
    x = eye + (c - n.dot(eye)) / n.dot(ray) * ray
    d, D = ray / r, r * (c - n.dot(eye)) / n.dot(ray)
    plane = (sp.eye(3) - d * d.T)[:, :2] / r  # dd/dp, by the rule
    length = sp.sqrt(ray.dot(ray))
    vanishing = []
    for i, k in enumerate((p, q)):
        turn = plane[:, i]
        vanishing.append((ray / length).diff(k) - turn.subs(r, length))
        rule = D * (turn - d * n.dot(turn) / n.dot(d))
        vanishing.append((x.diff(k) - rule).subs(r, length))
    return [e.applyfunc(sp.cancel) for e in vanishing]


def flatland_is_a_slice():
    """In the plane py = 0 the footprint has R07 (27)'s length z^2 / (gamma r (n_0 . v))."""
    p, g, z, s, c, f = sp.symbols("p gamma z s c f", positive=True)  # f^2 = p^2 + gamma^2
    r = z * f / g  # with x_perp = z p / gamma
    d, turn = sp.Matrix([p, 0, -g]) / f, sp.Matrix([g**2, 0, p * g]) / f**3
    n, t = sp.Matrix([-s, 0, c]), sp.Matrix([c, 0, s])
    dx = r * (turn - d * n.dot(turn) / n.dot(d))
    printed = z**2 / (g * r * n.dot(-d))
    rest = sp.cancel((t.dot(dx) / printed - 1).subs(s, sp.sqrt(1 - c**2)))
    length = sp.sqrt(p**2 + g**2)
    check = (sp.Matrix([p, 0, -g]) / length).diff(p) - turn.subs(f, length)
    return sp.simplify(rest.subs(f, length)), check.applyfunc(sp.simplify)


def rendered(truth) -> float:
    """The bumpy ellipsoid, mirror and glossy in both lights, against the image's derivative."""
    return max(
        normwise(a[:, k], b[:, k])
        for a, b in zip(np.asarray(bumpy.ours()[1]), truth, strict=True)
        for k in (0, 1)
    )


ROWS = [
    Row(
        "C.space.image",
        "identity",
        implements=f"{MODULE}.image_gradient",
        symbolic=lambda: [*footprint(), *flatland_is_a_slice()],
        autodiff=Check(lambda: rendered(bumpy.by_autodiff()), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: rendered(bumpy.by_differences()), 1e-8),
        note="A bumpy ellipsoid: mirror and glossy, distant and near light.",
    ),
]
