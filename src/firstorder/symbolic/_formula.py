"""The formula portrait: light, its derivatives or its spectrum as an expression."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import sympy

from firstorder._display import in_notebook
from firstorder.conventions import Frame
from firstorder.symbolic._programs.lowering import lowered


def coordinates_of(frame: Frame) -> tuple[sympy.Symbol, ...]:
    """The coordinates of a frame as real symbols.

    Example:
        >>> from firstorder.conventions import FLATLAND
        >>> from firstorder.symbolic import coordinates_of
        >>> coordinates_of(FLATLAND)
        (x, theta)
    """
    return tuple(sympy.Symbol(name, real=True) for name in frame.coordinates)


def frequencies_of(frame: Frame) -> tuple[sympy.Symbol, ...]:
    """The frequencies that belong to the coordinates, in cycles per unit, as real symbols.

    Args:
        frame: whose coordinates these are.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.symbolic import frequencies_of
        >>> frequencies_of(FLATLAND_SLOPE)
        (Omega_x, Omega_v)
    """
    return tuple(sympy.Symbol(f"Omega_{name}", real=True) for name in frame.coordinates)


@dataclasses.dataclass(frozen=True)
class Formula:
    """An expression in the coordinates of a frame, or in their frequencies.

    Attributes:
        expression: a SymPy expression, or a matrix of them.
        coordinates: the symbols that it is a function of; all others are parameters.
        frame: names and sense of the coordinates.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.symbolic import formula
        >>> formula(gaussian((0.0, 0.0), (1.0, 1.0))).expression
        exp(-theta**2/2 - x**2/2)
    """

    expression: Any
    coordinates: tuple[sympy.Symbol, ...]
    frame: Frame

    def __call__(self, *values: Any) -> Any:
        """The expression at other expressions, or at numbers, in place of the coordinates.

        Example:
            >>> import sympy
            >>> from firstorder.fields import gaussian
            >>> from firstorder.symbolic import formula
            >>> formula(gaussian((0.0, 0.0), (1.0, 1.0)))(0, sympy.Symbol("t"))
            exp(-t**2/2)
        """
        pairs = dict(zip(self.coordinates, map(sympy.sympify, values), strict=True))
        return self.expression.subs(pairs, simultaneous=True)

    @property
    def parameters(self) -> tuple[sympy.Symbol, ...]:
        """The symbols that are not coordinates, by name."""
        others = self.expression.free_symbols - set(self.coordinates)
        return tuple(sorted(others, key=lambda s: s.name))

    @property
    def latex(self) -> str:
        """LaTeX of the expression."""
        return sympy.latex(self.expression)

    _repr_markdown_ = in_notebook

    def __str__(self) -> str:
        """The expression as SymPy writes it."""
        return str(self.expression)

    def mapped(self, change: Callable) -> Formula:
        """The formula with its expression changed: `mapped(sympy.simplify)`."""
        return dataclasses.replace(self, expression=change(self.expression))

    def evaluated(self) -> Formula:
        """The formula with its integrals carried out, where SymPy finds them."""
        return self.mapped(lambda e: e.doit())

    def lower(self, **unknowns: Any) -> Callable:
        """A jitted function of arrays: of the coordinates in order, and the parameters by name.

        Common parts are computed once. An integral that is left becomes a quadrature, split where
        its integrand jumps.

        Args:
            unknowns: a field, or a function of the coordinates, for each unknown function that the
                formula names; derivatives of it are taken from the field's jet.

        Raises:
            Refused: if an unknown function is not given, or an integral has no quadrature here.

        Example:
            >>> import sympy
            >>> from firstorder.conventions import FLATLAND_SLOPE
            >>> from firstorder.fields import gaussian
            >>> from firstorder.symbolic import derive
            >>> from firstorder.transport import Travel
            >>> d = sympy.Symbol("d", positive=True)
            >>> path = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE) >> Travel(d)
            >>> round(derive(path).value.lower()(2.0, 1.0, d=2.0).item(), 12)  # exp(-1/2)
            0.606530659713
        """
        return lowered(self.expression, self.coordinates, self.parameters, unknowns)

    def at(self, *values: Any, **more: Any) -> Any:
        """Numbers at numbers: `lower`, and the call, in one.

        Args:
            values: of the coordinates, in order; they broadcast.
            more: parameters by name, and fields for unknown functions.
        """
        names = {s.name for s in self.parameters}
        unknowns = {k: v for k, v in more.items() if k not in names}
        numbers = {k: jnp.asarray(v) for k, v in more.items() if k in names}
        return self.lower(**unknowns)(*values, **numbers)


def in_cell(formula: Formula) -> str:
    """LaTeX for a cell of a table, which a bar would end."""
    bar = r"\vert "
    return f"${formula.latex.replace('|', bar)}$"
