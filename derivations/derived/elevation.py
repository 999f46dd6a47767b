"""R07 §7.1 and Appendix D: the edge angle of a blocker in space, at one azimuth.

The receiver is at the origin with its normal along z; the slice is that of x and z, so that u is
the x-axis and v the y-axis. Angles grow towards u.
"""

from __future__ import annotations

import functools

import sympy as sp

from derivations.derived.compare import Equation
from firstorder.symbolic._programs.reading import array, expression, read
from firstorder.visibility import contour_elevation, crease_elevation

p_x, p_z = sp.symbols("p_x p_z", positive=True)
n, k = sp.Matrix(sp.symbols("n_x n_y n_z", real=True)), sp.Matrix(sp.symbols("k_1:4", real=True))
D = sp.sqrt(p_x**2 + p_z**2)
sine, cosine = p_x / D, p_z / D
u, v, c = sp.Matrix([1, 0, 0]), sp.Matrix([0, 1, 0]), sp.Matrix([cosine, 0, -sine])


def _rates(elevation, across):
    """The angle's rates along u and across, along v."""
    found = read(
        lambda p, a: (lambda e: (e.alpha_u, e.alpha_v))(elevation(p, a, phi=0.0)),
        array(p_x, 0, p_z),
        array(*across),
    )
    return [expression(e) for e in found]


@functools.cache
def contour():
    return _rates(contour_elevation, n)


@functools.cache
def crease():
    return _rates(crease_elevation, k)


def touched(expression):
    """For a ray that touches: `w . n = 0`."""
    return expression.subs(n[2], -n[0] * sine / cosine)


def motion(m):
    """R07 (44) for a step along m."""
    return -m.dot(n) / (D * c.dot(n))


DERIVED = {
    "R07.44": Equation(contour, lambda: [motion(u), motion(v)]),
    "R07.45": Equation(
        lambda: [touched(contour()[0]), crease()[0]], lambda: 2 * [-cosine / D]
    ),
    "R07.46": Equation(lambda: contour()[1], lambda: -v.dot(n) / (D * c.dot(n))),
    "R07.72": Equation(lambda: crease()[1], lambda: k.dot(c) / k.dot(v) / D),
}  # fmt: skip
