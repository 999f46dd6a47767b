"""What laws do to the formulas of spectra and covariances.

A law's rules are read as they stand (`_programs.reading`). One is not a formula but a way to
compute one, a Fourier series on a window: for it the convolution is written down that it computes.
The spectrum after a move is written with the inverse of its matrix, for whose numbers a program
chooses pivots.
The Fourier kernel is read out of `conventions` wherever it stands.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import equinox as eqx
import sympy

from firstorder._symbols import SymbolicArray
from firstorder.conventions import Frame, fourier_kernel
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.spectrum import Spectrum
from firstorder.laws import Convolve, Law, Move, Multiply
from firstorder.symbolic._formula import Formula, frequencies_of
from firstorder.symbolic._laws import of_field
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.functions import Unknown, unknown_function
from firstorder.symbolic._programs.reading import array, expression, inserted, matrix, read
from firstorder.symbolic.unknown import UnknownVaryingLobe
from firstorder.typing import Frequency

UNKNOWN = "no transform of the factor is known here: take the numeric spectrum"
LARGE = 200  # operations of an expression that is not simplified: SymPy takes minutes


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
    if isinstance(law, Convolve) and isinstance(law.kernel, UnknownVaryingLobe):
        return Formula(_semi_convolved(law, F), names, frame)
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


def _semi_convolved(law: Convolve, F: Formula) -> Expr:
    """`int F(Omega - s) G(s, Omega_axis) ds`, s over all frequencies but that of the axis."""
    kernel = law.kernel.in_frame(F.frame, "kernel")
    G, axis = of_spectrum(kernel.spectrum()), F.frame.axis(law.kernel.axis)
    shifts = [sympy.Dummy(f"s_{c.name}", real=True) for c in F.coordinates]
    shifts[axis] = sympy.Integer(0)
    shifted = F(*(Omega - s for Omega, s in zip(F.coordinates, shifts, strict=True)))
    ends = [(s, -sympy.oo, sympy.oo) for s in shifts if s != 0]
    shifts[axis] = F.coordinates[axis]
    return sympy.Integral(shifted * G(*shifts), *ends)


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
    gap = sympy.N((first - second).subs(_trial((first - second).free_symbols)))
    known = gap.is_finite and abs(gap).is_comparable  # a ray on an edge has an infinite rate
    return sympy.cancel(first) if known and abs(gap) < 1e-12 else None


def _trial(symbols: Iterable[Any]) -> dict[Any, Any]:
    """A number for each symbol, no two alike."""
    return {s: sympy.Rational(5 + i, 9) for i, s in enumerate(sorted(symbols, key=str))}


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
    trial = _trial(g.expression.free_symbols - set(g.coordinates))
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
    for term in sympy.Add.make_args(sympy.expand_mul(p)):
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
            raise Refused(UNKNOWN)
        wave = _kernel([s], [t]).rewrite(sympy.cos)
        return weight * sympy.integrate(sympy.expand(inside * wave), (t, lower, upper))
    if inside.is_Pow and inside.exp.is_Rational and inside.base.is_polynomial(t):
        return weight * _power_transform(inside, t, s)
    return weight * _bell_transform(inside, t, s)


def _bends(wave: Expr, t: sympy.Symbol) -> bool:
    """Whether the argument of a function is not linear."""
    return sympy.diff(wave.args[0], t, 2) != 0


def _bell_transform(p: Expr, t: sympy.Symbol, s: sympy.Symbol) -> Expr:
    """`sqrt(pi / a) exp((b - 2 pi i s)^2 / (4 a) + c)` of `exp(-a t^2 + b t + c)`."""
    exponent = sympy.expand(p.args[0]) if p.func is sympy.exp else t
    if not exponent.is_polynomial(t) or sympy.degree(exponent, t) != 2:
        raise Refused(UNKNOWN)
    c, b, square = sympy.Poly(exponent, t).all_coeffs()[::-1]
    a = -square
    rate = b + sympy.diff(_kernel([s], [t]).args[0], t)
    return sympy.sqrt(sympy.pi / a) * sympy.exp(rate**2 / (4 * a) + c)


def _power_transform(part: Expr, t: sympy.Symbol, s: sympy.Symbol) -> Expr:
    """`2 c pi^p |c s|^(p - 1/2) K_(p - 1/2)(2 pi |c s|) / (Gamma(p) a^p)` of `(a + b t^2)^-p`.

    Here `c = (a / b)^(1/2)`, and K is the modified Bessel function of the second kind. D05 §3.3 has
    the one of slopes, p = 3/2 and a = b = 1.
    """
    coefficients = sympy.Poly(part.base, t).all_coeffs()[::-1]
    p = -part.exp
    if len(coefficients) != 3 or coefficients[1] != 0 or not p.is_positive:
        raise Refused(UNKNOWN)
    a, _, b = coefficients
    c, half = sympy.sqrt(a / b), sympy.Rational(1, 2)
    z = c * sympy.Abs(sympy.diff(_kernel([s], [t]).args[0], t))
    bessel = sympy.besselk(p - half, z)
    if p == 1:
        bessel = sympy.sqrt(sympy.pi / (2 * z)) * sympy.exp(-z)
    return 2 * c * sympy.pi**p * (c * sympy.Abs(s)) ** (p - half) * bessel / sympy.gamma(p) / a**p


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
