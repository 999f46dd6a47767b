"""Derivatives of expressions that jump, with the terms of the edges inside integrals."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import sympy
from scipy.optimize import brentq
from sympy.core.relational import Relational

from firstorder.errors import Refused
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.functions import Unknown
from firstorder.symbolic._programs.primitives import Choice

NOT_STRAIGHT = "an edge that is not straight along the integral has no closed form here"
TWO_JUMPS = "two jumps at one edge, or one inside a function, have no closed form here"
TRIES, FAR, STEPS = 12, 6.0, 6001  # where a level is looked for
ZERO = 1e-5  # share of a factor's size: constants of programs may have single precision


def differentiated(expression: Expr, symbol: sympy.Symbol, meant: dict | None = None) -> Expr:
    """The derivative between edges.

    The derivative of a jump is a Dirac: nothing between edges, and inside an integral the boundary
    term of the edge that sweeps through it.

    Args:
        expression: with integrals in it, or none.
        symbol: along which.
        meant: what symbols stand for, that keep their place apart until it is differentiated.

    Raises:
        Refused: if an edge inside an integral moves and has no closed form.
    """
    stepped = expression.replace(sympy.Mod, lambda a, b: a - b * sympy.floor(a / b))
    stepped = stepped.replace(lambda e: isinstance(e, (sympy.floor, sympy.ceiling)), _Step)
    swept = stepped.replace(sympy.Integral, _Swept.of)
    rate = between_edges(sifted(_rate(swept, symbol).xreplace(meant or {})))
    if any(not isinstance(left.expr, Unknown) for left in rate.atoms(sympy.Derivative)):
        raise Refused("an edge that SymPy cannot differentiate has no closed form here")
    rate = rate.replace(_Swept, sympy.Integral).replace(_Case, _Case.settled)
    return rate.replace(_Step, lambda step: step)


def _rate(expression: Expr, symbol: sympy.Symbol) -> Expr:
    """The derivative, carried out."""
    rate = sympy.diff(expression, symbol)
    return rate.replace(lambda e: isinstance(e, sympy.Derivative), lambda e: e.doit())


class _Step(sympy.Function):
    """`Step(floor(u))`: it does not change between its steps, for which SymPy has no derivative."""

    nargs = 1

    def _eval_derivative(self, s):
        return sympy.Integer(0)


class _Swept(sympy.Integral):
    """An integral whose choices jump, and whose variable stays real when it is differentiated."""

    @classmethod
    def of(cls, function, *limits) -> Expr:
        """A swept integral from the arguments of a `sympy.Integral`."""
        return cls(function.replace(sympy.Piecewise, _cases), *limits)

    def _eval_derivative(self, sym):
        if any(step.has(sym) for step in self.function.atoms(_Step)):
            raise Refused("a floor that moves inside an integral has no closed form here")
        *inner, (t, *ends) = cast(Any, self.limits)
        f = cast(Any, self.func(self.function, *inner) if inner else self.function)
        rate = self.func(sympy.diff(f, sym), (t, *ends))
        for sign, end in zip((-1, 1), ends, strict=True):
            speed = cast(Any, sympy.diff(end, sym))
            rate += sign * _at_edge(f, t, end) * speed if speed != 0 else 0
        return rate


class _Case(Choice):
    """`Case(yes, no, condition)`: a choice that jumps, which `Piecewise` does not for SymPy."""

    nargs = 3

    @classmethod
    def eval(cls, *args):
        """The value if both cases are alike or the condition is decided, else nothing."""
        return args[0] if args[0] == args[1] else super().eval(*args)

    @classmethod
    def settled(cls, yes, no, condition) -> Expr:
        """The choice as SymPy has it."""
        return sympy.Piecewise((yes, condition), (no, True), evaluate=False)

    def _eval_derivative(self, s):
        yes, no, condition = cast(Any, self.args)
        edges = [
            on * sympy.DiracDelta(level) * sympy.diff(level, s)
            for level, on in (_levels(condition) if condition.has(s) else ())
        ]
        rates = _rate(yes, s), _rate(no, s)
        within = [_Case(*map(between_edges, rates), condition)]
        # Each Dirac of a case with what it is multiplied by, as a case: products would grow.
        within += [delta * _Case(c, 0, condition) for delta, c in _factors(rates[0]).items()]
        within += [delta * _Case(0, c, condition) for delta, c in _factors(rates[1]).items()]
        return sympy.Add(*within) + (yes - no) * sympy.Add(*edges)


def _cases(*pairs: Any) -> Expr:
    """A `Piecewise` as choices, one inside the other, that each ask one relation."""
    (yes, condition), *rest = pairs
    if not rest:
        return _chosen(yes, sympy.nan, condition)
    return _chosen(yes, _cases(*rest), condition)


def _chosen(yes: Expr, no: Expr, condition: Any) -> Expr:
    """A choice; by a condition that joins others, choices of which each asks one."""
    if isinstance(condition, sympy.Not):
        return _chosen(no, yes, condition.args[0])
    if isinstance(condition, (sympy.And, sympy.Or)):
        first, *more = condition.args
        inner = _chosen(yes, no, condition.func(*more))
        both = isinstance(condition, sympy.And)
        return _chosen(inner, no, first) if both else _chosen(yes, inner, first)
    return _Case(yes, no, condition)


def _levels(condition: Any) -> list[tuple[Expr, Expr]]:
    """Levels that are positive where a relation holds: of `|u| < a` both `a - u` and `a + u`.

    Each comes with a factor that is 1 where it is the one that counts (`u > 0`, `u < 0`), else 0.
    """
    if isinstance(condition, (sympy.Eq, sympy.Ne)):
        return []  # it holds, or fails, at single places
    if not isinstance(condition, (sympy.Lt, sympy.Le, sympy.Gt, sympy.Ge)):
        raise Refused(f"the edge of {condition} inside an integral has no closed form here")
    return _sides(cast(Any, condition.gts) - cast(Any, condition.lts))


def _sides(level: Expr) -> list[tuple[Expr, Expr]]:
    """Levels without `|..|` that a level with them is made of, each with its factor as above."""
    innermost = [size for size in level.atoms(sympy.Abs) if not size.args[0].has(sympy.Abs)]
    if not innermost:
        return [(level, sympy.Integer(1))]
    size, found = innermost[0], []
    for side in (size.args[0], -size.args[0]):
        on = (1 + sympy.sign(side)) / 2
        found += [(one, on * more) for one, more in _sides(level.xreplace({size: side}))]
    return found


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


def _sift(integral: Any) -> Expr:
    """`int g(t) delta(a t + b) dt = g(-b / a) / |a|` if that lies between the ends."""
    limits, *outer = integral.limits
    t, lower, upper = limits
    function = sifted(integral.function)
    smooth, total = between_edges(function), sympy.Integer(0)
    for delta, factor in _factors(function).items():
        level: Expr = delta.args[0]
        slope = sympy.diff(level, t)
        if any(step.has(t) for step in level.atoms(_Step)):
            raise Refused(NOT_STRAIGHT)
        if slope == 0:  # it runs along the integral, and is an edge of the result
            total += delta * sympy.Integral(factor, limits)
        elif not slope.has(t):
            place = -level.subs(t, 0) / slope
            total += _between(place, lower, upper) * _at_edge(factor, t, place) / sympy.Abs(slope)
        elif not _vanishes(factor, level, t):
            raise Refused(NOT_STRAIGHT)
    total += sympy.Integral(smooth, limits) if smooth != 0 else 0
    return sifted(sympy.Integral(total, *outer)) if outer else total


def _factors(integrand: Expr) -> dict[Any, Expr]:
    """Diracs of a sum, each with the factor that it has there."""
    found: dict[Any, Expr] = {}
    for term in sympy.Add.make_args(sympy.expand_mul(integrand)):
        deltas = list(term.atoms(sympy.DiracDelta))
        if len(deltas) > 1 or any(len(delta.args) > 1 for delta in deltas):
            raise Refused(NOT_STRAIGHT)
        for delta in deltas:
            found[delta] = found.get(delta, 0) + term / delta
    return found


def _vanishes(factor: Expr, level: Expr, t: sympy.Symbol) -> bool:
    """Whether a factor is zero where a level is: there light is continuous, and no edge sweeps.

    One of the things that it is a product of is then zero there, and not everywhere. They are asked
    at numbers, with some function in the place of each unknown one.
    """
    parts = sympy.Mul.make_args(sympy.factor_terms(factor))
    parts = [part for part in parts if part.has(t) and not part.has(sympy.Integral)]
    try:
        return any(_is_zero_on(part, level, t) for part in parts)
    except (TypeError, NameError, ValueError, NotImplementedError):  # it cannot be asked
        return False


@np.errstate(all="ignore")
def _is_zero_on(factor: Expr, level: Expr, t: sympy.Symbol) -> bool:
    """Whether a factor is zero at all roots of a level that are found, and not everywhere."""
    pair = sympy.Tuple(level, factor).replace(_Step, lambda step: step)
    calls = sorted({c.func for c in pair.atoms(Unknown)}, key=str)
    for k, call in enumerate(calls, 1):
        pair = pair.replace(call, lambda *u, k=k: sympy.cos(sympy.Add(k, *u) + u[0] / (k + 1)))
    symbols = sorted(pair.free_symbols - {t}, key=str)
    run = sympy.lambdify((t, *symbols), pair.replace(_Case, _Case.settled), ["scipy", "numpy"])
    values = np.random.default_rng(0).uniform(-2.0, 2.0, (TRIES, len(symbols)))
    across, seen = np.linspace(-FAR, FAR, STEPS), False
    for given in values:
        levels, factors = (np.broadcast_to(a, across.shape) for a in run(across, *given))
        scale = np.max(np.abs(factors[np.isfinite(factors)]), initial=0.0)
        for i in np.flatnonzero(levels[:-1] * levels[1:] < 0.0):
            root = brentq(lambda u, given=given: run(u, *given)[0], across[i], across[i + 1])
            seen = True
            if not abs(run(root, *given)[1]) < ZERO * scale:
                return False
    return seen


def _at_edge(factor: Expr, t: sympy.Symbol, place: Expr) -> Expr:
    """A factor of a Dirac at its place; of what jumps there too, the mean of both sides."""
    means = {}
    for jump in factor.atoms(sympy.sign, sympy.Heaviside, _Case):
        level = _level_of(jump)
        sides = _sides(level) if level is not None else []
        if any(sympy.simplify(side.subs(t, place)) == 0 for side, _ in sides):
            if len(sides) > 1:  # the edge of a size may be there, or on its other side
                raise Refused(TWO_JUMPS)
            means[jump] = sympy.Dummy(), _mean(jump)
    marked = factor.xreplace({jump: mark for jump, (mark, _) in means.items()}).subs(t, place)
    marks = {mark for mark, _ in means.values()}
    nested = any(arg.has(*means) for jump in means for arg in jump.args)
    if nested or any(sympy.diff(marked, mark).free_symbols & marks for mark in marks):
        raise Refused(TWO_JUMPS)
    return marked.xreplace({mark: mean.subs(t, place) for mark, mean in means.values()})


def _level_of(jump: Any) -> Expr | None:
    """The level of a jump."""
    if not isinstance(jump, _Case):
        return jump.args[0]
    condition: Any = jump.args[2]
    return cast(Any, condition.lhs) - condition.rhs if isinstance(condition, Relational) else None


def _mean(jump: Any) -> Expr:
    """Half of the values on both sides of a jump."""
    if isinstance(jump, _Case):
        yes, no, _ = cast(Any, jump.args)
        return (yes + no) / 2
    return sympy.Integer(0) if isinstance(jump, sympy.sign) else sympy.Rational(1, 2)


def _between(place, lower, upper) -> Expr:
    """1 between the ends, -1 between them where the upper is the lower one, 0 outside."""
    above = sympy.sign(place - lower) if lower.is_finite is not False else sympy.sign(-lower)
    below = sympy.sign(upper - place) if upper.is_finite is not False else sympy.sign(upper)
    return (above + below) / 2
