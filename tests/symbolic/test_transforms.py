"""Transforms in closed form, against mpmath's integrals."""

from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

from firstorder.symbolic._programs import functions
from firstorder.symbolic._transforms import closed_transform, with_moments_at_once

Moment: Any = functions.Moment
t, a = sympy.symbols("t a", real=True)
END, RATES = 1.7, (0.0, 0.3, -0.8)
third = sympy.Rational(1, 3)
DYING = {  # profiles that have died out at the end, and what is left of them there
    "a bell": sympy.exp(-4 * t**2),
    "a bell beside 0": 3 * sympy.exp(-5 * t**2 + t / 2 - third),
    "a polynomial of a bell": (1 + t - 2 * t**3) ** 2 * sympy.exp(-9 * t**2),
    "a wave of a bell": sympy.cos(3 * t + 1) * sympy.exp(-6 * t**2),
    "two bells": sympy.exp(-6 * t**2) - t * sympy.exp(-7 * (t - third) ** 2),
}
CUT = {  # profiles that are cut off
    "a constant": sympy.Integer(2),
    "a polynomial": 1 - 2 * t + t**4 / 3,
    "a wave": sympy.cos(2 * t + 1) - sympy.sin(3 * t),
    "a square of a wave": (1 + sympy.cos(t)) ** 3,
    "an exponential": sympy.exp(2 * t - 1) * t**2,
    "a hyperbola": sympy.cosh(t) - 2 * sympy.sinh(3 * t),
    "a wave that grows": t**8 * sympy.exp(t) * sympy.sin(2 * t),
}


def transformed(profile, end, rate):
    """`int_-end^end p(t) exp(-2 pi i Omega t) dt`."""
    p = sympy.lambdify(t, profile, "mpmath")
    grid = mpmath.linspace(-end, end, 9)
    return complex(mpmath.quad(lambda x: p(x) * mpmath.expjpi(-2 * rate * x), grid))


@pytest.mark.parametrize("name", CUT)
def test_a_profile_that_is_cut_off_has_the_transform_between_its_ends(name):
    found: Any = closed_transform(CUT[name], t, False)
    assert not found.endless
    run = with_moments_at_once(found.expression, (found.Omega, found.end))
    for rate in RATES:
        true = transformed(CUT[name], END, rate)
        np.testing.assert_allclose(complex(run(rate, END)), true, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", DYING)
def test_a_profile_that_has_died_out_has_that_of_the_whole_line(name):
    found: Any = closed_transform(DYING[name], t, True)
    assert found.endless
    for rate in RATES:
        value = complex(found.expression.subs(found.Omega, sympy.Float(rate, 20)).evalf())
        np.testing.assert_allclose(value, transformed(DYING[name], 6.0, rate), rtol=1e-10)


def test_a_bell_that_is_cut_off_has_none():
    assert closed_transform(DYING["a bell"], t, False) is None
    assert closed_transform(1 + DYING["a bell"], t, False) is None


def test_parameters_stay_in_the_transform():
    found: Any = closed_transform(a * sympy.cos(a * t), t, False)
    run = with_moments_at_once(found.expression, (found.Omega, found.end, a))
    true = transformed(1.3 * sympy.cos(1.3 * t), END, 0.3)
    np.testing.assert_allclose(complex(run(0.3, END, 1.3)), true, rtol=1e-12)


WITHOUT = {
    "a kink": sympy.Abs(t),
    "a quotient": 1 / (1 + t**2),
    "a high power": t**9,
    "a root": sympy.sqrt(1 + t**2),
    "a steep bell": sympy.exp(-(t**4)),
    "a steep power": sympy.cos(t) ** 17,
    "too many operations": sum((t + k) ** 3 * sympy.cos(k * t) for k in range(1, 12)),
    "too many terms": (1 + t + sympy.cos(t)) ** 11,
    "one term of two": t + sympy.Abs(t),
}


@pytest.mark.parametrize("name", WITHOUT)
def test_other_profiles_have_none(name):
    assert closed_transform(WITHOUT[name], t, True) is None


@pytest.mark.parametrize("power", [8, 16])
def test_powers_up_to_the_highest_have_one(power):
    profile = t**8 if power == 8 else sympy.cos(t) ** 16
    assert closed_transform(profile, t, False) is not None


def test_moments_of_one_order_are_found_in_one_call():
    x, y = sympy.symbols("x y")
    expression = Moment(0, x) + 2 * Moment(1, x * y) - Moment(1, y) * sympy.sinc(x) + y
    u, v = np.array([0.3, 2.0]), np.array([1.1, 0.7])
    found = with_moments_at_once(expression, (x, y))(u, v)

    def moment(m, w):
        return [float(mpmath.quad(lambda s, w=w: s**m * mpmath.exp(w * s), [0, 1])) for w in w]

    true = moment(0, u) + 2.0 * np.array(moment(1, u * v)) - np.array(moment(1, v)) * np.sin(u) / u
    np.testing.assert_allclose(found, true + v, rtol=1e-12)
