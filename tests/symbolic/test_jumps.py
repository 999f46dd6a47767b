"""Expressions that are complex, no number, or broken inside, are refused."""

import numpy as np
import pytest
import sympy

from firstorder import symbolic

t, a, x, theta = sympy.symbols("t a x theta")


@pytest.mark.parametrize(
    ("profile", "words"),
    [
        (sympy.Piecewise((sympy.exp(-(t**2)), t > 0), (0, True)), "no jump, but has one near t = "),
        (sympy.Piecewise((1, t < 0.37), (2, True)), "no jump, but has one near t = 0.37"),
        (sympy.Piecewise((1 - t, t > 0), (1 + t, True)), "no kink, but has one near t = "),
        (sympy.floor(3 * t) + 5, "no jump, but is floor"),
        (2 + sympy.Mod(t, sympy.Rational(1, 2)), "no jump, but is Mod"),
        (sympy.Abs(t), "no kink: its second derivative is a Dirac"),
    ],
)
def test_a_lobe_that_is_broken_inside_is_refused(profile, words):
    with pytest.raises(ValueError, match=words):
        symbolic.lobe(profile, t, half_width=1.0)


@pytest.mark.parametrize(
    "profile",
    [
        sympy.Piecewise((sympy.cos(t) ** 2, sympy.Abs(t) < 1), (0, True)),  # broken at the end
        sympy.Piecewise((t**3, t > 0), (0, True)),
        sympy.Piecewise((sympy.exp(-(t**2) * 1e8), t > -0.5), (sympy.exp(-(t**2) * 1e8), True)),
        sympy.Piecewise((sympy.exp(-(t**2) * 1e10), t > 0), (sympy.exp(-(t**2) * 2e9), True)),
        sympy.Piecewise((sympy.exp(-1 / (1 - t**2)), t**2 < 1), (0, True)),  # divides by 0 beyond
    ],
)
def test_a_lobe_of_pieces_that_fit_is_taken(profile):
    assert symbolic.lobe(profile, t, half_width=1.0).half_width() == 1.0


def test_parameters_of_a_broken_lobe_are_put_in():
    tent = sympy.Piecewise((1 - a * t, t > 0), (1 + t, True))
    smooth = symbolic.lobe(tent, t, parameters={a: -1.0}, half_width=0.5)
    assert smooth.half_width() == 0.5
    with pytest.raises(ValueError, match="no kink"):
        symbolic.lobe(tent, t, parameters={a: 1.0}, half_width=0.5)


@pytest.mark.parametrize(
    "expression", [sympy.I * sympy.exp(-(t**2)), sympy.sqrt(-1), sympy.asin(2) * t, sympy.zoo * t]
)
def test_what_is_complex_or_no_number_is_refused(expression):
    for made in (
        lambda: symbolic.lobe(expression, t, half_width=1.0),
        lambda: symbolic.event(factor=expression.subs(t, x)),
        lambda: symbolic.event({theta: theta + expression.subs(t, x)}),
    ):
        with pytest.raises(ValueError, match=r"must be (real|finite), but is"):
            made()


@pytest.mark.parametrize(
    ("number", "words"),
    [(np.nan, "finite"), (np.inf, "finite"), (1j, "real"), (np.ones(3), "one number")],
)
def test_a_parameter_is_one_real_number(number, words):
    with pytest.raises(ValueError, match=rf"Argument `parameters\[a\]` must be {words}"):
        symbolic.lobe(sympy.exp(-a * t**2), t, parameters={a: number})
    with pytest.raises(ValueError, match=rf"Argument `parameters\[a\]` must be {words}"):
        symbolic.event({theta: theta - x / a}, parameters={a: number})


@pytest.mark.parametrize("profile", [sympy.exp(t**2), 1 / t])
def test_a_lobe_that_is_no_number_somewhere_is_not_called_zero(profile):
    with pytest.raises(ValueError, match="must be a finite number wherever the lobe is"):
        symbolic.lobe(profile, t, axis="v")
