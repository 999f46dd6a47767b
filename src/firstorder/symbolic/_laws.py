"""What laws do to the formula of light.

A law's rule for one ray is read as it stands (`_programs.reading`), with the formula of the operand
put in. Two rules are not formulas but quadratures: for these the integral is written down that they
compute.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import sympy

from firstorder._symbols import SymbolicArray
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields.field import Field, Sum
from firstorder.fields.jet import Jet
from firstorder.laws import Convolve, Integrate, Law
from firstorder.laws.base import FieldImage
from firstorder.laws.convolve import Circle, Hemisphere, Line
from firstorder.symbolic._formula import Formula, coordinates_of
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.reading import array, expression, inserted, matrix, read
from firstorder.typing import Ray, Scalar

# Light of flatland, in the order in which an event is tried that does not say what it takes; last
# that of a line in time, for what names t.
IN_TIME = Frame(("x", "t"))
FRAMES = (FLATLAND, FLATLAND.turned(), FLATLAND_SLOPE, FLATLAND_SLOPE.turned(), IN_TIME)


class FormulaField(Field):
    """Light that is given by a formula, inside a program that is read."""

    formula: Formula = eqx.field(static=True)

    @property
    def frame(self) -> Frame:
        """Frame of the formula."""
        return self.formula.frame

    def at(self, u: Ray) -> Scalar:
        """The formula."""
        return inserted(self.formula, u)

    def jet(self, u: Ray) -> Jet:
        """The formula, differentiated."""
        f, names = self.formula, self.formula.coordinates
        first = [f.mapped(lambda e, a=a: sympy.diff(e, a)) for a in names]
        second = [[g.mapped(lambda e, b=b: sympy.diff(e, b)) for b in names] for g in first]
        hessian = jnp.stack([jnp.stack([inserted(h, u) for h in row]) for row in second])
        return Jet(self.at(u), jnp.stack([inserted(g, u) for g in first]), hessian, self.frame)


def has_symbols(tree: Any) -> bool:
    """Whether some leaf is a symbol."""
    return any(isinstance(leaf, SymbolicArray) for leaf in jax.tree.leaves(tree))


def law_of(event: Any, frame: Frame) -> Law:
    """The law of an event for light in a frame, whose numbers may be symbols."""
    if isinstance(event, Law):
        return event
    return read(lambda e: e.law(frame), event) if has_symbols(event) else event.law(frame)


def laws_of(events: Sequence[Any], frame: Frame) -> tuple[Law, ...]:
    """The law of each event, in the frame of the light that it meets."""
    found = []
    for event in events:
        found.append(law_of(event, frame))
        frame = found[-1].frame(frame)
    return tuple(found)


def fitting_frame(events: Sequence[Any]) -> Frame:
    """The first of the frames of flatland that events take.

    Raises:
        ValueError: if they take none, with the reason of the first.
    """
    refusals = []
    for frame in FRAMES:
        try:
            laws_of(events, frame)
        except ValueError as error:
            refusals.append(error)
        else:
            return frame
    raise ValueError(f"The event takes no light of flatland: {refusals[0]}")


def of_field(field: Field) -> Formula:
    """Radiance of a field as a formula."""
    if isinstance(field, FormulaField):
        return field.formula
    if isinstance(field, FieldImage):
        return of_law(field.law, of_field(field.operand))
    names = coordinates_of(field.frame)
    if isinstance(field, Sum):
        weights = read(lambda w: w, field.weights)
        terms = [of_field(f).expression for f in field.fields]
        pairs = zip(_row(weights), terms, strict=True)
        return Formula(sympy.Add(*(w * term for w, term in pairs)), names, field.frame)
    found = read(lambda f, u: f.at(u), field, array(*names))
    return Formula(expression(found), names, field.frame)


def _row(a) -> list:
    return list(matrix(a))


def of_law(law: Law, f: Formula) -> Formula:
    """Radiance after a law, from that before it."""
    frame = law.frame(f.frame)
    if isinstance(law, Integrate):
        return Formula(_integral(law, f), coordinates_of(frame), frame)
    if isinstance(law, Convolve):
        return Formula(_convolution(law, f), f.coordinates, frame)
    names = coordinates_of(frame)
    found = read(lambda law, u: law.value(FormulaField(f), u), law, array(*names))
    return Formula(expression(found), names, frame)


def _integral(law: Integrate, f: Formula) -> Expr:
    """`int_lower^upper f`, over a variable of its own."""
    axis = f.coordinates[f.frame.axis(law.axis)]
    t = sympy.Dummy(axis.name, real=True)
    ends = [
        of_field(end).expression if isinstance(end, Field) else expression(end)
        for end in (law.lower, law.upper)
    ]
    return sympy.Integral(f.expression.xreplace({axis: t}), (t, *ends))


def _convolution(law: Convolve, f: Formula) -> Expr:
    """`int f(axis - t) g(t) dt`: derivatives of the result fall on the light and on no lobe.

    Over a hemisphere, whose ends stand still in the light's own angle, `int f(s) g(axis - s) ds`.
    """
    kernel = of_field(law.kernel.in_frame(f.frame, "kernel"))
    axis = f.coordinates[f.frame.axis(law.kernel.axis)]
    t = sympy.Dummy("t", real=True)

    def product(source, difference):
        return f.expression.xreplace({axis: source}) * kernel.expression.xreplace(
            {axis: difference}
        )

    if isinstance(law.domain, Hemisphere):
        n = of_field(law.domain.normal.in_frame(f.frame, "normal")).expression
        return sympy.Integral(product(t, axis - t), (t, n - sympy.pi / 2, n + sympy.pi / 2))
    ends = {Line: sympy.oo, Circle: sympy.pi}
    if type(law.domain) not in ends:
        raise Refused(f"a convolution over {type(law.domain).__name__} has no formula here")
    end = ends[type(law.domain)]
    return sympy.Integral(product(axis - t, t), (t, -end, end))
