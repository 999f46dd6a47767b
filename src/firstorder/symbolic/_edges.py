"""Derivatives of expressions that jump, with the terms of the edges inside integrals."""

from __future__ import annotations

from typing import Any, cast

import sympy

from firstorder.errors import Refused
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.primitives import Choice


def differentiated(expression: Expr, symbol: sympy.Symbol) -> Expr:
    """The derivative between edges.

    The derivative of a jump is a Dirac: nothing between edges, and inside an integral the boundary
    term of the edge that sweeps through it.
    """
    cases = {integral: _cased(integral) for integral in expression.atoms(sympy.Integral)}
    rate = sympy.diff(expression.xreplace(cases), symbol)
    rate = rate.replace(lambda e: isinstance(e, sympy.Derivative), lambda e: e.doit())
    return between_edges(sifted(rate)).replace(_Case, _Case.settled)


class _Case(Choice):
    """`Case(yes, no, condition)`: a choice that jumps, which `Piecewise` does not for SymPy."""

    nargs = 3

    @classmethod
    def settled(cls, yes, no, condition) -> Expr:
        """The choice as SymPy has it."""
        return sympy.Piecewise((yes, condition), (no, True), evaluate=False)

    def _eval_derivative(self, s):
        yes, no, condition = cast(Any, self.args)
        levels = _levels(condition)
        edges = (on * sympy.DiracDelta(level) * sympy.diff(level, s) for level, on in levels)
        within = _Case(sympy.diff(yes, s), sympy.diff(no, s), condition)
        return within + (yes - no) * sympy.Add(*edges)


def _cased(integral: Any) -> Expr:
    """An integral whose choices jump where they do so at straight levels."""
    t = integral.limits[0][0]

    def straight(e: Any) -> bool:
        if e.func is not sympy.Piecewise or len(e.args) != 2 or e.args[1].cond != sympy.true:
            return False
        slopes = [sympy.diff(level, t) for level, _ in _levels(e.args[0].cond)]
        return any(slope != 0 for slope in slopes) and not any(slope.has(t) for slope in slopes)

    return integral.replace(straight, lambda e: _Case(*(a.expr for a in e.args), e.args[0].cond))


def _levels(condition: Any) -> list[tuple[Expr, Expr]]:
    """Levels, positive where a condition holds: two for one of a size, none if it is not known.

    With each goes 1 where it is the level, else 0: that of a side is so where the side is positive.
    """
    if condition.func not in (sympy.Lt, sympy.Le, sympy.Gt, sympy.Ge):
        return []
    level = condition.gts - condition.lts
    sizes = list(level.atoms(sympy.Abs))
    if len(sizes) > 1:
        return []
    sides = [(size, sign * size.args[0]) for size in sizes for sign in (1, -1)]
    found = [(level.xreplace({size: side}), (1 + sympy.sign(side)) / 2) for size, side in sides]
    return found or [(level, sympy.Integer(1))]


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
    smooth, total = between_edges(integral.function), sympy.Integer(0)
    for term in sympy.Add.make_args(sympy.expand_mul(integral.function)):
        deltas = list(term.atoms(sympy.DiracDelta))
        if not deltas:
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
