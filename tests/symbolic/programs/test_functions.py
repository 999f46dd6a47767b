"""Unknown functions and moments as SymPy's: what they differentiate to, and how they read."""

from typing import Any

import pytest
import sympy

from firstorder.symbolic._programs import functions
from firstorder.symbolic._programs.functions import unknown_function

x, theta, w = sympy.symbols("x theta w", real=True)
L = unknown_function("L", ("x", "theta"))
Moment: Any = functions.Moment


def test_derivatives_are_named_by_their_coordinates():
    rate = sympy.diff(L(2 * x, theta), x)
    assert rate == 2 * unknown_function("L", ("x", "theta"), (1, 0))(2 * x, theta)
    mixed = sympy.diff(L(x, theta), theta, x, x)
    assert str(mixed) == "L_xxtheta(x, theta)"
    assert type(mixed).orders == (2, 1)
    assert str(L(x, theta)) == "L(x, theta)"


def test_one_class_stands_for_a_function_and_takes_its_arguments():
    assert unknown_function("L", ("x", "theta"), (0, 0)) is L
    assert unknown_function("L", ("x", "theta"), (0, 1)) is not L
    assert unknown_function("M", ("x", "theta")) is not L
    with pytest.raises(TypeError, match="2"):
        L(x)


def test_light_is_real_and_a_spectrum_is_not():
    assert L(x, theta).is_extended_real
    assert unknown_function("L_hat", ("x", "theta"))(x, theta).is_extended_real is None


def test_functions_read_as_papers_print_them():
    assert sympy.latex(L(x, theta)) == r"L\left(x, \theta\right)"
    mixed = sympy.diff(L(x, theta), x, x, theta)
    assert sympy.latex(mixed**2) == r"L_{x x \theta}^{2}\left(x, \theta\right)"
    hat = unknown_function("L_hat", ("x",))
    assert sympy.latex(hat(x)) == r"\hat{L}\left(x\right)"


def test_a_moment_differentiates_to_the_next():
    assert sympy.diff(Moment(2, 3 * w), w) == 3 * Moment(3, 3 * w)
    assert sympy.latex(Moment(0, w)) == r"\int_0^1 e^{s \left(w\right)}\,ds"
    assert (
        sympy.latex(Moment(2, w) ** 3)
        == r"\left(\int_0^1 s^{2} e^{s \left(w\right)}\,ds\right)^{3}"
    )
