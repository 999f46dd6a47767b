import math

import numpy as np
import pytest
import sympy

from firstorder.symbolic._programs.exact import exact, exact_array


@pytest.mark.parametrize(
    ("number", "true"),
    [
        (0.3, sympy.Rational(3, 10)),
        (-20.0 / 21.0, sympy.Rational(-20, 21)),
        (2.0 * math.pi, 2 * sympy.pi),
        (-0.5 * math.pi, -sympy.pi / 2),
        (1.0 / math.sqrt(2.0 * math.pi), 1 / sympy.sqrt(2 * sympy.pi)),
        (math.pi**2, sympy.pi**2),
        (np.float64(0.0), sympy.Integer(0)),
        (3, sympy.Integer(3)),
        (np.True_, sympy.true),
        (0.5 - 2j * math.pi, sympy.Rational(1, 2) - 2 * sympy.I * sympy.pi),
        (math.inf, sympy.oo),
        (-math.inf, -sympy.oo),
        (0.1234, sympy.Rational(617, 5000)),
        (0.1 + 0.2, sympy.Rational(3, 10)),
        (5.0 / 64.0 * math.sqrt(math.pi), sympy.Rational(5, 64) * sympy.sqrt(sympy.pi)),
    ],
)
def test_numbers_that_have_a_name(number, true):
    assert exact(number) == true


def test_other_numbers_stay_as_they_are():
    number = 0.123456789012345
    assert isinstance(exact(number), sympy.Float)
    assert float(exact(number)) == number
    assert exact(math.nan) is sympy.nan


def test_only_roundings_away_from_a_fraction_is_a_fraction():
    """A few of them from a plain fraction, none from one that only somebody types."""
    spacing = np.spacing(0.3)
    assert exact(0.3 + 4.0 * spacing) == sympy.Rational(3, 10)
    assert isinstance(exact(0.3 + 6.0 * spacing), sympy.Float)
    assert isinstance(exact(0.1234 + 2.0 * np.spacing(0.1234)), sympy.Float)
    assert isinstance(exact(math.pi / 100.0), sympy.Float)


def test_arrays_and_expressions():
    x = sympy.Symbol("x")
    found = exact_array(np.array([[0.5, 1.0], [2.0, 0.0]]))
    assert found.shape == (2, 2)
    assert found[0, 0] == sympy.Rational(1, 2)
    assert exact_array(np.array([x, 2], dtype=object))[0] is x
