"""Formulas of spectra after laws, against sums over samples and mpmath."""

import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
import sympy

from firstorder._symbols import SymbolicArray
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.errors import Refused
from firstorder.fields import gaussian
from firstorder.laws import Convolve, Move, Multiply
from firstorder.symbolic import UnknownVaryingLobe
from firstorder.symbolic import _spectra as spectra
from firstorder.symbolic._formula import Formula, coordinates_of, frequencies_of
from firstorder.symbolic._programs.functions import unknown_function
from firstorder.symbolic._programs.numeric import ExpressionField, Expressions

FRAME = FLATLAND_SLOPE
x, v = coordinates_of(FRAME)
Ox, Ov = frequencies_of(FRAME)
t, s, a = sympy.symbols("t s a", real=True)
# A bell of widths 0.5 and 0.8 beside the origin, and its spectrum.
BELL = sympy.exp(-2 * (x - sympy.Rational(1, 5)) ** 2 - sympy.Rational(25, 32) * v**2)
HAT = (
    sympy.pi
    * sympy.Rational(4, 5)
    * sympy.exp(
        -(sympy.pi**2) * Ox**2 / 2
        - sympy.Rational(32, 25) * sympy.pi**2 * Ov**2
        - 2 * sympy.pi * sympy.I * Ox / 5
    )
)
F = Formula(HAT, (Ox, Ov), FRAME)
PLACES = [(0.1, -0.2), (0.35, 0.15), (-0.4, 0.3)]
GRID = np.linspace(-9.0, 9.0, 361)


def summed(light):
    """The transform of samples far beyond where the light has died out."""
    u, w = np.meshgrid(GRID, GRID, indexing="ij")
    values = light(u, w) * (GRID[1] - GRID[0]) ** 2
    return [np.sum(values * np.exp(-2j * np.pi * (p * u + q * w))) for p, q in PLACES]


def numbers(expression):
    names = dict(zip((Ox, Ov), PLACES[0], strict=True))
    assert expression.free_symbols <= set(names)
    found = [expression.subs({Ox: sympy.Float(p, 20), Ov: sympy.Float(q, 20)}) for p, q in PLACES]
    return [complex(one.doit().evalf()) for one in found]


bell = sympy.lambdify((x, v), BELL, "numpy")


def test_the_bell_has_its_spectrum():
    np.testing.assert_allclose(numbers(HAT), summed(bell), rtol=1e-9)
    found = spectra.of_spectrum(gaussian((0.0, 0.0), (0.5, 0.8), frame=FRAME).spectrum())
    np.testing.assert_allclose(
        numbers(found.expression), summed(lambda u, w: bell(u + 0.2, w)), rtol=1e-9
    )


def test_a_move_pulls_frequencies_back():
    M, c = np.array([[0.8, -0.5], [0.3, 0.9]]), np.array([0.1, -0.3])
    after = spectra.spectrum_after(Move(M, c), F)
    assert after.coordinates == (Ox, Ov)
    true = summed(lambda u, w: bell(*(np.einsum("ij,j...->i...", M, [u, w]) + c[:, None, None])))
    np.testing.assert_allclose(numbers(after.expression), true, rtol=1e-9)


FACTORS = {
    "a wave": (1 + sympy.cos(3 * x + 1) / 2, lambda u, w: 1.0 + np.cos(3.0 * u + 1.0) / 2.0),
    "a slanted wave": (sympy.sin(x - 2 * v + 1), lambda u, w: np.sin(u - 2.0 * w + 1.0)),
    "a bell": (sympy.exp(-((x + v / 2) ** 2)), lambda u, w: np.exp(-((u + 0.5 * w) ** 2))),
    "a constant": (sympy.Rational(3, 2) + 0 * x, lambda u, w: 1.5 + 0.0 * u),
}


@pytest.mark.parametrize("name", FACTORS)
def test_a_factor_of_one_linear_form_blurs_along_it(name):
    factor, function = FACTORS[name]
    law = Multiply(_field(factor))
    after = spectra.spectrum_after(law, F)
    true = summed(lambda u, w: bell(u, w) * function(u, w))
    found = after.lower()(*np.array(PLACES).T)
    np.testing.assert_allclose(found, true, rtol=1e-6, atol=1e-9)


def _field(expression):
    return ExpressionField(Expressions((expression,), (x, v), (), ()), FRAME)


def test_a_move_of_covariance_takes_the_matrix_on_both_sides():
    """Gradients of `f(M u)` are `M^T f'`."""
    M, S = np.array([[1.0, -2.0], [0.5, 1.0]]), sympy.Matrix([[2, 1], [1, 3]])
    found = spectra.covariance_after(Move(M, np.zeros(2)), S, FRAME)
    np.testing.assert_allclose(
        np.array(found.tolist(), float), M.T @ np.array(S.tolist(), float) @ M
    )
    held = sympy.Matrix([[a, 0], [0, 2 * a]])
    assert spectra.covariance_after(Move(np.eye(2), np.zeros(2)), held, FRAME) == held
    assert SymbolicArray(held.tolist()).shape == (2, 2)


# --- one linear form -----------------------------------------------------------------------------

g = unknown_function("g", ("x",))
FORMS = {
    "a wave": (sympy.cos(2 * x + 3 * v + 1), (1, sympy.Rational(3, 2)), 0),
    "of v alone": (sympy.exp(-(v**2)) * v, (0, 1), 0),
    "an unknown": (2 + 3 * g(2 * x + 3 * v + 1), (2, 3), 1),
    "a constant": (sympy.Integer(4), (0, 0), 0),
    "with a parameter": (sympy.exp(-((x - a * v) ** 2)), (1, -a), 0),
}
NO_FORM = {
    "a product": x * v,
    "two forms": sympy.cos(x) + sympy.cos(v),
    "a bent one": sympy.exp(-(x**2) - v),
    "an unknown and more": g(x) * v,
    "a bent unknown": g(x * v),
    "too long": sum(sympy.cos(k * x + k * v) * sympy.exp(-k * (x + v) ** 2) for k in range(1, 40)),
}


@pytest.mark.parametrize("name", FORMS)
def test_a_function_of_one_linear_form_is_a_profile_along_it(name):
    expression, slopes, offset = FORMS[name]
    formula = Formula(expression, (x, v), FRAME)
    form = spectra._linear_form(formula)
    assert form is not None
    found, b = form
    assert [sympy.expand(p - q) for p, q in zip(found, slopes, strict=True)] == [0, 0]
    assert b == offset
    profile = spectra._along(formula, found, b, t)
    assert spectra._agree(formula, profile, found, b, t)
    form = found[0] * x + found[1] * v + b
    if not expression.has(g(2 * x + 3 * v + 1)):
        rays = {x: 0.3, v: -0.7, a: 0.6}
        assert abs((profile.subs(t, form) - expression).subs(rays).evalf()) < 1e-12


@pytest.mark.parametrize("name", NO_FORM)
def test_other_functions_have_no_form(name):
    assert spectra._linear_form(Formula(NO_FORM[name], (x, v), FRAME)) is None


def test_a_profile_that_is_another_function_does_not_agree():
    formula = Formula(sympy.Abs(x + v) + a, (x, v), FRAME)
    assert spectra._agree(formula, sympy.Abs(t) + a, [1, 1], 0, t)
    for other in (t + a, sympy.Abs(t) + 1, sympy.Abs(t) * (1 + sympy.Heaviside(t - 1) / 99) + a):
        assert not spectra._agree(formula, other, [1, 1], 0, t)


# --- profiles ------------------------------------------------------------------------------------


def test_waves_add_up_to_the_profile():
    profile = 2 - 3 * sympy.cos(5 * t + 1) + a * sympy.sin(2 * t - 1)
    waves, rest = spectra._transform(profile, t, s)
    assert rest == 0
    total = sum(c * sympy.exp(2 * sympy.pi * sympy.I * place * t) for place, c in waves)
    for at in (0.3, -1.7):
        gap = (total - profile).subs({t: at, a: 0.7}).evalf()
        assert abs(gap) < 1e-12


third = sympy.Rational(1, 3)
SMOOTH = {
    "a bell": (3 * sympy.exp(-2 * t**2 + t - third), 9),
    "a weight of slopes": (2 * (1 + t**2) ** sympy.Rational(-3, 2), None),
    "a hump of both": (1 / (2 + 3 * t**2), None),
    "a steeper one": ((2 + third * t**2) ** -2, None),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_smooth_profiles_have_their_transforms(name):
    profile, end = SMOOTH[name]
    waves, rest = spectra._transform(profile, t, s)
    assert waves == []
    inside = profile.args[0][0] if profile.func is sympy.Piecewise else profile
    p = sympy.lambdify(t, inside, "mpmath")
    for at in (0.3, -0.7):
        if end is None:  # even, and slow to die out
            true = 2 * mpmath.quadosc(
                lambda r, at=at: p(r) * mpmath.cospi(2 * at * r),
                [0, mpmath.inf],
                omega=2 * mpmath.pi * abs(at),
            )
        else:
            grid = mpmath.linspace(-float(end), float(end), 9)
            true = mpmath.quad(lambda r, at=at: p(r) * mpmath.expjpi(-2 * at * r), grid)
        found = complex(rest.subs(s, sympy.Float(at, 20)).evalf())
        np.testing.assert_allclose(found, complex(true), rtol=1e-8)


def test_an_unknown_profile_has_a_transform_by_name():
    waves, rest = spectra._transform(2 * g(t) + 1, t, s)
    assert waves == [(0, 1)]
    assert str(rest) == "2*g_hat(s)"


WITHOUT = {
    "a kink": sympy.Abs(t),
    "a steep bell": sympy.exp(-(t**4)),
    "a growing bell's power": (1 + t**2) ** 2,
    "a slanted power": 1 / (1 + t + t**2),
    "an exponential": sympy.exp(t),
    "a cut root": sympy.Piecewise((sympy.sqrt(1 - t**2), sympy.Abs(t) < 1), (0, True)),
    "a cut bent wave": sympy.Piecewise((sympy.cos(t**2), sympy.Abs(t) < 1), (0, True)),
    "a cut tangent": sympy.Piecewise((sympy.tan(t), sympy.Abs(t) < 1), (0, True)),
    "a bent wave": sympy.cos(t**2),
}


@pytest.mark.parametrize("name", WITHOUT)
def test_other_profiles_are_refused(name):
    with pytest.raises(Refused, match="numeric spectrum"):
        spectra._transform(WITHOUT[name], t, s)


def test_a_lobe_that_changes_is_folded_over_all_frequencies_but_its_own():
    """`int F(Omega_x - s, Omega_v) G(s, Omega_v) ds` of bells is a bell."""
    law = Convolve(UnknownVaryingLobe("rho", "v", FRAME))
    after = spectra.spectrum_after(law, F)

    def hat(p, q):
        return jnp.exp(-3.0 * p**2 - q**2)

    found = after.lower(rho_hat=hat)(*np.array(PLACES).T)
    node, w = np.polynomial.legendre.leggauss(200)
    node, w = 3.0 * node, 3.0 * w
    light = sympy.lambdify((Ox, Ov), HAT, "numpy")
    true = [w @ (light(p - node, q) * hat(node, q)) for p, q in PLACES]
    np.testing.assert_allclose(found, true, rtol=1e-6)
