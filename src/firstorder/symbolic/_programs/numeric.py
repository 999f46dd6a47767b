"""Expressions with parameters as fields and maps, with derivatives in closed form."""

from __future__ import annotations

import functools
from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import sympy

from firstorder._display import Module
from firstorder.conventions import UNSTATED, Frame
from firstorder.errors import Refused
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.laws.warp import Map
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.lowering import SPECIAL, as_function
from firstorder.typing import Array, Ray, Scalar, as_float

Symbols = tuple[sympy.Symbol, ...]


@functools.lru_cache(maxsize=256)
def compiled_expressions(entries: tuple, symbols: Symbols) -> Callable:
    """Several expressions as one function of numbers; common parts are computed once."""
    return as_function(symbols, [sympy.sympify(e) for e in entries], SPECIAL)


class Expressions(Module):
    """Expressions in coordinates and parameters, the parameters with numbers that are leaves.

    Attributes:
        entries: what is computed.
        coordinates: the symbols of a ray.
        symbols: the parameters.
        values: their numbers.
    """

    entries: tuple = eqx.field(static=True)
    coordinates: Symbols = eqx.field(static=True)
    symbols: Symbols = eqx.field(static=True)
    values: tuple[Array, ...]

    def __call__(self, u: Ray) -> list[Array]:
        """The numbers at a ray."""
        return self.of(self.entries, u)

    def of(self, entries: tuple, u: Ray) -> list[Array]:
        """Numbers of other expressions in the same symbols."""
        run = compiled_expressions(entries, (*self.coordinates, *self.symbols))
        found = run(*u, *self.values)
        return [as_float(a) + 0.0 * u[0] for a in found]

    def derivatives(self, u: Ray) -> tuple[list[Array], Array, Array]:
        """Values, Jacobian and second derivatives, in closed form and in one pass."""
        n, m = len(self.coordinates), len(self.entries)
        first, second = _differentiated(self.entries, self.coordinates)
        found = self.of((*self.entries, *first, *second), u)
        jacobian = jnp.stack(found[m : m + m * n]).reshape(m, n)
        return found[:m], jacobian, jnp.stack(found[m + m * n :]).reshape(m, n, n)


@functools.lru_cache(maxsize=256)
def _differentiated(entries: tuple, coordinates: Symbols) -> tuple[tuple, tuple]:
    first = tuple(sympy.diff(e, a) for e in entries for a in coordinates)
    second = tuple(sympy.diff(e, a) for e in first for a in coordinates)
    if any(e.has(sympy.DiracDelta) for e in (*first, *second)):
        raise Refused(
            "an expression that jumps or has a kink has Diracs for derivatives: it has values only"
        )
    return first, second


class ExpressionField(Field):
    """An expression in all coordinates of a frame as a field, with its jet in closed form."""

    expressions: Expressions
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def at(self, u: Ray) -> Scalar:
        """The expression."""
        return self.expressions(u)[0]

    def jet(self, u: Ray) -> Jet:
        """The expression and its derivatives."""
        (value,), gradient, hessian = self.expressions.derivatives(u)
        return Jet(value, gradient[0], hessian[0], self.frame)


class ExpressionMap(Map):
    """Expressions as a map of rays."""

    expressions: Expressions

    def __call__(self, u: Ray) -> Ray:
        """The ray."""
        return jnp.stack(self.expressions(u))

    def derivatives(self, u: Ray):
        """The ray, its Jacobian and second derivatives."""
        found, jacobian, second = self.expressions.derivatives(u)
        return jnp.stack(found), jacobian, second


def free_of(entries: tuple, coordinates: Symbols) -> set[Expr]:
    """The symbols of expressions that are no coordinates."""
    return set().union(*(sympy.sympify(e).free_symbols for e in entries)) - set(coordinates)
