"""What laws do to formulas.

A law's rules for one ray and one frequency are read as they stand (`_reading`), with the formula of
the operand put in. Three rules are not formulas but ways to compute one: two quadratures and a
Fourier series on a window. For these the integral is written down that they compute. A fourth, the
spectrum after a move, is written with the inverse of its matrix, for whose numbers a program
chooses pivots. The Fourier kernel is read out of `conventions` wherever it stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import sympy

from firstorder._symbols import SymbolicArray
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame, fourier_kernel
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Field, Sum
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Spectrum
from firstorder.laws import Convolve, Integrate, Law, Move, Multiply
from firstorder.laws.base import FieldImage
from firstorder.laws.convolve import Circle, Hemisphere, Line
from firstorder.symbolic._exact import Expr
from firstorder.symbolic._formula import Formula, coordinates_of, frequencies_of
from firstorder.symbolic._functions import Unknown, unknown_function
from firstorder.symbolic._reading import array, expression, inserted, matrix, read
from firstorder.typing import Frequency, Ray, Scalar

# Light of flatland, in the order in which an event is tried that does not say what it takes; last
# that of a line in time, for what names t.
IN_TIME = Frame(("x", "t"))
FRAMES = (FLATLAND, FLATLAND.turned(), FLATLAND_SLOPE, FLATLAND_SLOPE.turned(), IN_TIME)
LARGE = 200  # operations of an expression that is not simplified: SymPy takes minutes


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


class FormulaSpectrum(Spectrum):
    """A spectrum that is given by a formula, inside a program that is read."""

    formula: Formula = eqx.field(static=True)

    @property
    def frame(self) -> Frame:
        """Frame of the formula."""
        return self.formula.frame

    def at(self, Omega: Frequency):
        """The formula."""
        return inserted(self.formula, Omega, complex)


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


# --- value ---------------------------------------------------------------------------------------


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


# --- spectrum and covariance ---------------------------------------------------------------------


def _kernel(Omega: Sequence[Expr], u: Sequence[Expr]) -> Expr:
    """The Fourier kernel, as `conventions` has it."""
    return expression(read(fourier_kernel, array(*Omega), array(*u)))


def of_spectrum(F: Spectrum) -> Formula:
    """A spectrum as a formula of the frequencies."""
    names = frequencies_of(F.frame)
    found = read(lambda F, Omega: F.at(Omega), F, array(*names))
    return Formula(expression(found), names, F.frame)


def spectrum_after(law: Law, F: Formula) -> Formula:
    """The spectrum after a law, from that before it."""
    frame = law.frame(F.frame)
    names = frequencies_of(frame)
    if isinstance(law, Multiply):
        return Formula(_blurred(law, F), names, frame)
    if type(law) is Move and law.M.shape[0] == law.M.shape[1]:
        return Formula(_pulled_back(law, F, names), names, frame)
    found = read(lambda law, Omega: law.spectrum(FormulaSpectrum(F), Omega), law, array(*names))
    return Formula(expression(found), names, frame)


def _pulled_back(law: Move, F: Formula, names: tuple[sympy.Symbol, ...]) -> Expr:
    """`exp(2 pi i Omega . M^-1 c) F(M^-T Omega) / |det M|`.

    Numbers choose pivots for the inverse and the determinant, which expressions need not.
    """
    M, c, Omega = matrix(law.M), matrix(law.c), sympy.Matrix(names)
    inverse = M.inv().applyfunc(sympy.cancel)
    turn = _kernel(names, list(-inverse * c))
    return turn * F(*(inverse.T * Omega)) / sympy.Abs(M.det())


def _blurred(law: Multiply, F: Formula) -> Expr:
    """`int F(Omega - s a) hat g(s) ds` for a factor `g(a . u + b)` of one linear form."""
    g = of_field(law.factor.in_frame(F.frame, "factor"))
    form = _linear_form(g)
    if form is None:
        return _blurred_everywhere(law, F)
    a, b = form
    s, t = sympy.Dummy("s", real=True), sympy.Dummy("t", real=True)
    profile = _along(g, a, b, t)
    if not _agree(g, profile, a, b, t):
        return _blurred_everywhere(law, F)
    phase = _kernel([s], [-b])
    waves, rest = _transform(profile, t, s)
    shifted = F(*(Omega - s * ai for Omega, ai in zip(F.coordinates, a, strict=True)))
    sharp = sympy.Add(*((c * shifted * phase).subs(s, place) for place, c in waves))
    if rest == 0:
        return sharp
    return sharp + sympy.Integral(shifted * phase * rest, (s, -sympy.oo, sympy.oo))


def _blurred_everywhere(law: Multiply, F: Formula) -> Expr:
    """`int F(Omega - s) G(s) ds` over all frequencies, for a factor that has a spectrum."""
    G = of_spectrum(law.factor.in_frame(F.frame, "factor").spectrum())
    shifts = [sympy.Dummy(f"s_{c.name}", real=True) for c in F.coordinates]
    shifted = F(*(Omega - s for Omega, s in zip(F.coordinates, shifts, strict=True)))
    ends = [(s, -sympy.oo, sympy.oo) for s in shifts]
    return sympy.Integral(shifted * G(*shifts), *ends)


def _linear_form(g: Formula) -> tuple[list[Expr], sympy.Expr] | None:
    """`a` and `b` such that the factor is a function of `a . u + b`; None if there are none.

    The form is the argument of an unknown function, or has 1 for its first entry that is not zero.
    """
    calls = [part for part in g.expression.atoms(Unknown) if part.free_symbols & set(g.coordinates)]
    if len(calls) == 1 and len(calls[0].args) == 1:
        rest = g.expression.xreplace({calls[0]: sympy.Dummy()})
        if rest.free_symbols & set(g.coordinates):
            return None
        form = sympy.expand(calls[0].args[0])
        slopes = [sympy.diff(form, c) for c in g.coordinates]
    else:
        if sympy.count_ops(g.expression) > LARGE:
            return None
        form = None
        rates = [sympy.diff(g.expression, c) for c in g.coordinates]
        lead = next((r for r in rates if r != 0), None)
        if lead is None:
            return [sympy.Integer(0)] * len(rates), sympy.Integer(0)
        slopes = [_share(r, lead, g.coordinates) for r in rates]
    if any(slope is None or slope.free_symbols & set(g.coordinates) for slope in slopes):
        return None
    b = sympy.Integer(0) if form is None else form.subs({c: 0 for c in g.coordinates})
    return slopes, b


def _share(rate: Expr, lead: Expr, coordinates: tuple[sympy.Symbol, ...]) -> Expr | None:
    """The quotient of two rates, if it is the same at all rays; None if it is not.

    It is compared at two rays with numbers for all symbols: SymPy takes minutes to simplify what
    a program computes.
    """
    if rate in (0, lead):
        return sympy.Integer(int(rate == lead))
    share = rate / lead
    rays = (
        {c: sympy.Rational(k + i, 7 + 4 * k) for i, c in enumerate(coordinates)} for k in (1, 2)
    )
    first, second = (share.subs(ray) for ray in rays)
    others = (first - second).free_symbols
    trial = {s: sympy.Rational(5 + i, 9) for i, s in enumerate(sorted(others, key=str))}
    gap = sympy.N((first - second).subs(trial))
    return sympy.cancel(first) if gap.is_finite and abs(gap) < 1e-12 else None


def _along(g: Formula, a: list[Expr], b: Expr, t: sympy.Symbol) -> Expr:
    """The profile p(t) with `g(u) = p(a . u + b)`."""
    lead = next((i for i, slope in enumerate(a) if slope != 0), None)
    if lead is None:
        return g.expression
    place = [(t - b) / a[i] if i == lead else sympy.Integer(0) for i in range(len(a))]
    return sympy.piecewise_fold(g(*place))


def _agree(g: Formula, profile: Expr, a: list[Expr], b: Expr, t: sympy.Symbol) -> bool:
    """Whether the profile is the factor, at rays far and near; an unknown one is so by its form."""
    if g.expression.has(Unknown):
        return True
    others = sorted(g.expression.free_symbols - set(g.coordinates), key=str)
    trial = {s: sympy.Rational(5 + i, 9) for i, s in enumerate(others)}
    for k in range(-3, 4):
        ray = [sympy.Rational(k * (3 + 2 * i) + 1, 4 + i) for i in range(len(a))]
        form = sum((x * y for x, y in zip(a, ray, strict=True)), b)
        gap = sympy.N((g(*ray) - profile.subs(t, form)).subs(trial))
        if not gap.is_finite or abs(gap) > 1e-9:
            return False
    return True


Waves = list[tuple[Expr, Expr]]


def _transform(p: Expr, t: sympy.Symbol, s: sympy.Symbol) -> tuple[Waves, sympy.Expr]:
    """`int p(t) exp(-2 pi i s t) dt`: sharp frequencies with their weights, and the smooth rest.

    Waves and constants have sharp ones; an unknown profile has a transform by name; any other is
    what SymPy finds.
    """
    waves, rest = [], sympy.Integer(0)
    for term in sympy.Add.make_args(sympy.expand(p)):
        found = _sharp(term, t)
        if found is None:
            rest += _smooth(term, t, s)
        else:
            waves += found
    return waves, rest


def _sharp(term: Expr, t: sympy.Symbol) -> Waves | None:
    """Frequencies of a constant or of one cosine or sine; None for what is neither."""
    if not term.has(t):
        return [(sympy.Integer(0), term)]
    weight, wave = term.as_independent(t)
    if wave.func not in (sympy.cos, sympy.sin):
        return None
    rate = sympy.diff(wave.args[0], t)
    if rate.has(t):
        return None
    turn = sympy.exp(sympy.I * wave.args[0].subs(t, 0))
    cycle = -sympy.diff(_kernel([sympy.Integer(1)], [t]).args[0], t) / sympy.I
    there, back = (turn, 1 / turn) if wave.func is sympy.cos else (-sympy.I * turn, sympy.I / turn)
    place = rate / cycle
    return [(place, weight * there / 2), (-place, weight * back / 2)]


def _smooth(p: Expr, t: sympy.Symbol, s: sympy.Symbol) -> Expr:
    """The transform of a profile that dies out."""
    weight, part = p.as_independent(t)
    if isinstance(part, Unknown) and part.args == (t,):
        return weight * unknown_function(f"{part.base}_hat", (f"Omega_{part.names[0]}",))(s)
    inside, lower, upper = _support(part, t)
    if not lower.is_infinite:
        waves = inside.atoms(sympy.Function)
        known = all(w.func in (sympy.sin, sympy.cos, sympy.exp) for w in waves)
        if not known or not inside.is_polynomial(t, *waves) or any(_bends(w, t) for w in waves):
            raise Refused("no transform of the factor is known here: take the numeric spectrum")
        wave = _kernel([s], [t]).rewrite(sympy.cos)
        return weight * sympy.integrate(sympy.expand(inside * wave), (t, lower, upper))
    return weight * _bell_transform(inside, t, s)


def _bends(wave: Expr, t: sympy.Symbol) -> bool:
    """Whether the argument of a function is not linear."""
    return sympy.diff(wave.args[0], t, 2) != 0


def _bell_transform(p: Expr, t: sympy.Symbol, s: sympy.Symbol) -> Expr:
    """`sqrt(pi / a) exp((b - 2 pi i s)^2 / (4 a) + c)` of `exp(-a t^2 + b t + c)`."""
    exponent = sympy.expand(p.args[0]) if p.func is sympy.exp else t
    if not exponent.is_polynomial(t) or sympy.degree(exponent, t) != 2:
        raise Refused("no transform of the factor is known here: take the numeric spectrum")
    c, b, square = sympy.Poly(exponent, t).all_coeffs()[::-1]
    a = -square
    rate = b + sympy.diff(_kernel([s], [t]).args[0], t)
    return sympy.sqrt(sympy.pi / a) * sympy.exp(rate**2 / (4 * a) + c)


def _support(profile: Expr, t: sympy.Symbol) -> tuple[Expr, Expr, Expr]:
    """A profile that is zero outside `|t| < c`, and those ends; all of the line for any other."""
    if isinstance(profile, sympy.Piecewise) and len(profile.args) == 2:
        (inside, near), (rest, _) = (pair.args for pair in profile.args)
        ends: Any = near.args
        if rest == 0 and isinstance(near, sympy.StrictLessThan) and ends[0] == sympy.Abs(t):
            return inside, -ends[1], ends[1]
    return profile, -sympy.oo, sympy.oo


def covariance_after(law: Law, S: Expr, frame: Frame) -> Expr:
    """The covariance after a law, from that before it."""
    held = SymbolicArray(S.tolist())
    return matrix(read(lambda law, S: law.covariance(Covariance(S, frame)).matrix, law, held))
