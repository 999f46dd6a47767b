"""Hermite interpolation between two nodes: its basis, its error and its rms error.

From the definition alone: the polynomial of lowest degree whose value and first `data - 1`
derivatives are given at both ends of [0, 1]. No paper prints these; they are what R07 §6.3
interpolates with, and the measure of what a stored derivative is worth.
"""

from __future__ import annotations

import functools

import sympy as sp

t, x, h = sp.symbols("t x h", positive=True)


@functools.cache
def basis(data: int) -> list[list]:
    """Weights `w[end][k](t)` of the k-th derivative at t = 0 and at t = 1, by linear equations."""
    degree = 2 * data - 1
    unknown = sp.symbols(f"c0:{degree + 1}")
    p = sum(c * t**i for i, c in enumerate(unknown))
    found = []
    for end in (0, 1):
        row = []
        for k in range(data):
            conditions = [
                sp.diff(p, t, j).subs(t, at) - int(at == end and j == k)
                for at in (0, 1)
                for j in range(data)
            ]
            solution = sp.solve(conditions, unknown, dict=True)[0]
            row.append(sp.expand(p.subs(solution)))
        found.append(row)
    return found


def interpolated(function, data: int):
    """The interpolant of a function of x on [0, h], as a function of t = x / h."""
    total = sp.Integer(0)
    for end, row in zip((0, h), basis(data), strict=True):
        for k, weight in enumerate(row):
            total += weight * h**k * sp.diff(function, x, k).subs(x, end)
    return sp.expand(total)


def monomial_error(data: int):
    """What is missed of `x^(2 data) / (2 data)!`, whose derivative of that order is 1.

    By Rolle's theorem the error of any function is this one times its derivative of that order
    somewhere in the cell, so what holds of it bounds all of them.
    """
    f = x ** (2 * data) / sp.factorial(2 * data)
    return sp.factor(f.subs(x, t * h) - interpolated(f, data))


def largest(data: int):
    """The error's largest magnitude in units of `h^(2 data)`: all its critical points are tried."""
    e = sp.simplify(monomial_error(data) / h ** (2 * data))
    critical = [s for s in sp.solve(sp.diff(e, t), t) if s.is_real and 0 <= s <= 1]
    return max(abs(e.subs(t, s)) for s in critical)


def rms(data: int):
    """The root of its mean square over the cell in the same units, where the derivative is even."""
    e = sp.simplify(monomial_error(data) / h ** (2 * data))
    return sp.sqrt(sp.integrate(sp.expand(e**2), (t, 0, 1)))
