"""Derivatives of expressions that jump, with the terms of the edges inside integrals."""

from __future__ import annotations

import sympy

from firstorder.errors import Refused
from firstorder.symbolic._programs.exact import Expr


def differentiated(expression: Expr, symbol: sympy.Symbol) -> Expr:
    """The derivative between edges.

    The derivative of a jump is a Dirac: nothing between edges, and inside an integral the boundary
    term of the edge that sweeps through it.
    """
    rate = sympy.diff(expression, symbol)
    rate = rate.replace(lambda e: isinstance(e, sympy.Derivative), lambda e: e.doit())
    return between_edges(sifted(rate))


def between_edges(expression: Expr) -> Expr:
    """The expression where it does not jump: without Diracs."""
    return expression.replace(sympy.DiracDelta, lambda *args: sympy.Integer(0))


def sifted(expression: Expr) -> Expr:
    """The expression with its integrals over Diracs carried out."""
    found = {
        integral: _sift(integral)
        for integral in expression.atoms(sympy.Integral)
        if integral.function.has(sympy.DiracDelta)
    }
    return expression.xreplace(found)


def _sift(integral: Expr) -> Expr:
    """`int g(t) delta(a t + b) dt = g(-b / a) / |a|` if that lies between the ends."""
    t, lower, upper = integral.limits[0]
    smooth, total = sympy.Integer(0), sympy.Integer(0)
    for term in sympy.Add.make_args(sympy.expand_mul(integral.function)):
        deltas = list(term.atoms(sympy.DiracDelta))
        if not deltas:
            smooth += term
            continue
        level: Expr = deltas[0].args[0]
        slope = sympy.diff(level, t)
        if len(deltas) > 1 or len(deltas[0].args) > 1 or slope.has(t):
            raise Refused("an edge that is not straight along the integral has no closed form here")
        if slope == 0:
            continue  # it runs along the integral, and is an edge of the result
        place = -level.subs(t, 0) / slope
        inside = _between(place, lower, upper)
        total += inside * (term / deltas[0]).subs(t, place) / sympy.Abs(slope)
    return total + sympy.Integral(smooth, integral.limits[0]) if smooth != 0 else total


def _between(place, lower, upper) -> Expr:
    """1 between the ends, 0 outside."""
    ends = [sympy.sign(place - lower) if lower.is_finite is not False else sympy.Integer(1)]
    ends.append(sympy.sign(upper - place) if upper.is_finite is not False else sympy.Integer(1))
    return (1 + ends[0]) * (1 + ends[1]) / 4
