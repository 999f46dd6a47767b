"""Expressions as functions of arrays, against mpmath and closed forms."""

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
import sympy

from firstorder.conventions import FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import Affine, Function, GaussianProfile, HalfPlane, gaussian
from firstorder.laws import Convolve
from firstorder.symbolic import derive
from firstorder.symbolic._programs.functions import Moment, unknown_function
from firstorder.symbolic._programs.lowering import lowered
from firstorder.transport import Travel

x, y, a, b, t, s = sympy.symbols("x y a b t s", real=True)


def run(expression, *values, symbols=(x, y), unknowns=None, **given):
    parameters = [p for p in (a, b) if p.name in given]
    function = lowered(expression, symbols[: len(values)], parameters, unknowns or {})
    return np.asarray(function(*values, **given))


# --- arrays and parameters -----------------------------------------------------------------------


def test_numbers_broadcast_and_parameters_go_by_name():
    u, v = np.array([[0.1], [0.7]]), np.array([1.0, 2.0, 3.0])
    found = run(x - 2 * y + a / b, u, v, b=4.0, a=2.0)
    np.testing.assert_allclose(found, u - 2.0 * v + 0.5)


@pytest.mark.parametrize("x64", [False, True])
def test_whole_numbers_may_have_any_size(x64):
    """JAX's have 32 or 64 bits; half the inverse square of a width of an angstrom has 66."""
    with jax.enable_x64(x64):
        found = run(sympy.exp(-(x**2) * 10**20 / 2) - 2**31 * y, 1e-10, 2.0**-31)
        alone = run(sympy.Matrix([10**21]), 1e-10)
    np.testing.assert_allclose(found, np.exp(-0.5) - 1.0, rtol=1e-12 if x64 else 1e-6)
    np.testing.assert_allclose(alone, [[1e21]], rtol=1e-15 if x64 else 1e-6)


@pytest.mark.parametrize("sigma", [1e-10, 1e10])
def test_formulas_of_light_of_any_width_have_numbers(sigma):
    light = gaussian((0.0, 0.0), (sigma, 0.5), frame=FLATLAND_SLOPE)
    portraits = derive(light >> Travel(sigma))
    value = portraits.value.lower()(sigma, 0.5)
    np.testing.assert_allclose(value, np.exp(-0.125 - 0.5), rtol=1e-14)
    spectrum = portraits.spectrum.lower()(0.25 / sigma, 0.1)
    wanted = np.pi * sigma * np.exp(-2.0 * np.pi**2 * (0.25**2 + 0.25 * 0.35**2))
    np.testing.assert_allclose(spectrum, wanted, rtol=1e-13)


def test_a_matrix_has_its_axes_last():
    entries = sympy.Matrix([[x, 1], [y, x * y], [2, x + y]])
    u, v = np.array([0.5, 2.0]), np.array([3.0, 5.0])
    found = run(entries, u, v)
    assert found.shape == (2, 3, 2)
    np.testing.assert_allclose(found[1], [[2.0, 1.0], [5.0, 10.0], [2.0, 7.0]])
    assert run(entries, 0.5, 3.0).shape == (3, 2)


def test_what_is_missing_is_told():
    function = lowered(a * x, [x], [a], {})
    with pytest.raises(TypeError, match="`a` is missing"):
        function(1.0)
    with pytest.raises(TypeError, match="coordinates x are asked, but 2"):
        function(1.0, 2.0, a=1.0)


SPECIAL = {
    "erf": (sympy.erf(x), lambda u: mpmath.erf(u)),
    "erfc": (sympy.erfc(x), lambda u: mpmath.erfc(u)),
    "K_1": (sympy.besselk(1, x), lambda u: mpmath.besselk(1, u)),
    "a moment": (Moment(2, x), lambda u: mpmath.quad(lambda s: s**2 * mpmath.exp(u * s), [0, 1])),
}


@pytest.mark.parametrize("name", SPECIAL)
def test_special_functions_have_their_numbers(name):
    expression, true = SPECIAL[name]
    u = np.array([0.3, 1.7])
    np.testing.assert_allclose(run(expression, u), [float(true(z)) for z in u], rtol=1e-10)


def test_other_bessel_functions_are_refused():
    with pytest.raises(Refused, match="K_2"):
        run(sympy.besselk(2, x), 1.0)


# --- unknown functions ---------------------------------------------------------------------------

f = unknown_function("f", ("x", "y"))


def test_a_callable_stands_for_an_unknown_function_and_its_derivatives():
    unknowns = {"f": lambda u, v: u**3 * v**2}
    expression = sympy.Matrix([f(x, y), f(x, 2 * y).diff(y), f(x, y).diff(x, x, y)])
    u, v = np.array([0.5, 2.0]), np.array([3.0, -1.0])
    found = run(expression, u, v, unknowns=unknowns)
    true = [u**3 * v**2, 8.0 * u**3 * v, 12.0 * u * v]
    np.testing.assert_allclose(found[..., 0], np.stack(true, -1), rtol=1e-12)


@pytest.mark.parametrize("names", [("x", "y"), ("y", "x"), ("y", "t", "x"), ("v", "w")])
def test_a_field_stands_by_the_names_of_its_coordinates_and_else_in_order(names):
    """`x^3 y^2`, and another coordinate is zero, which its cosine does not see."""
    powers = {"x": 3, "v": 3, "y": 2, "w": 2}

    def program(*u):
        known = zip(u, names, strict=True)
        return jnp.prod(
            jnp.stack([c ** powers[n] if n in powers else jnp.cos(c) for c, n in known])
        )

    field = Function(program, Frame(names))
    rates = [f(x, y), f(x, y).diff(x), f(x, y).diff(x, y), f(x, y).diff(x, y, y)]
    found = run(sympy.Matrix(rates), 2.0, 3.0, unknowns={"f": field})
    np.testing.assert_allclose(found[:, 0], [72.0, 108.0, 72.0, 24.0], rtol=1e-12)


def test_a_field_of_other_coordinates_is_refused():
    field = Function(lambda x, v, w: x + v + w, Frame(("x", "v", "w")))
    with pytest.raises(ValueError, match="must be over x, y, but is over x, v, w"):
        run(f(x, y), 1.0, 2.0, unknowns={"f": field})
    with pytest.raises(Refused, match="f is unknown"):
        run(f(x, y), 1.0, 2.0)


# --- integrals -----------------------------------------------------------------------------------

EXACT = {
    "between ends": (
        sympy.Integral(sympy.exp(x * t), (t, 0, y)),
        lambda u, v: (np.exp(u * v) - 1) / u,
    ),
    "without ends": (
        sympy.Integral(sympy.exp(-y * (t - x) ** 2) * t, (t, -sympy.oo, sympy.oo)),
        lambda u, v: u * np.sqrt(np.pi / v),
    ),
    "a slow decay": (
        sympy.Integral(y / (1 + (t - x) ** 2), (t, -sympy.oo, sympy.oo)),
        lambda u, v: np.pi * v,
    ),
    "a jump": (
        sympy.Integral(sympy.Heaviside(2 * t - x) * t, (t, 0, y)),
        lambda u, v: (v**2 - u**2 / 4) / 2,
    ),
    "a kink": (sympy.Integral(sympy.Abs(t - x), (t, 0, y)), lambda u, v: (u**2 + (v - u) ** 2) / 2),
    "a sign": (
        sympy.Integral(sympy.sign(x - 3 * t) * t, (t, 0, y)),
        lambda u, v: u**2 / 9 - v**2 / 2,
    ),
    "a case": (
        sympy.Integral(sympy.Piecewise((t, t < x), (5, True)), (t, 0, y)),
        lambda u, v: u**2 / 2 + 5 * (v - u),
    ),
    "a strip": (
        sympy.Integral(
            sympy.Piecewise((t + 1, sympy.Abs(2 * t - x) < sympy.Rational(1, 5)), (0, True)),
            (t, -sympy.oo, sympy.oo),
        ),
        lambda u, v: 0.2 * (0.5 * u + 1.0),
    ),
    "the larger": (
        sympy.Integral(sympy.Max(t, x), (t, 0, y)),
        lambda u, v: u**2 + (v**2 - u**2) / 2,
    ),
    "the smallest": (
        sympy.Integral(sympy.Min(t, x, 2 - t), (t, 0, 2)),
        lambda u, v: 2 * u - u**2,
    ),
    "two variables": (
        sympy.Integral(x * t * sympy.exp(-s), (s, 0, 1), (t, 0, y)),
        lambda u, v: u * v**2 / 2 * (1 - np.exp(-1)),
    ),
    "one in another": (
        sympy.Integral(t * sympy.Integral(sympy.Heaviside(s - t), (s, 0, y)), (t, 0, x)),
        lambda u, v: v * u**2 / 2 - u**3 / 3,
    ),
    "K_1 at its break": (
        sympy.Integral(
            sympy.Abs(t - x) * sympy.besselk(1, sympy.Abs(t - x)), (t, -sympy.oo, sympy.oo)
        ),
        lambda u, v: np.pi + 0.0 * u,
    ),
}


@pytest.mark.parametrize("name", EXACT)
def test_integrals_have_their_values(name):
    expression, true = EXACT[name]
    u, v = np.array([0.7, 0.4]), np.array([1.3, 1.9])
    np.testing.assert_allclose(run(expression, u, v), true(u, v), rtol=1e-7)


def test_an_edge_that_is_blurred_twice_is_blurred_by_both_widths():
    edge = HalfPlane(Affine([1.0, 0.3], -0.1, FLATLAND_SLOPE), 0.0, 1.0)
    for sigma in (0.2, 0.3):
        edge = Convolve(GaussianProfile(sigma, "v", FLATLAND_SLOPE))(edge)
    found = derive(edge).value.lower()(0.1, 0.2)
    true = mpmath.ncdf((0.1 + 0.3 * 0.2 - 0.1) / (0.3 * np.hypot(0.2, 0.3)))
    np.testing.assert_allclose(found, float(true), rtol=1e-6)


def test_integrals_that_have_no_quadrature_are_refused():
    with pytest.raises(Refused, match="3 variables"):
        run(sympy.Integral(x * y * t, (x, 0, 1), (y, 0, 1), (t, 0, 1)))
    for limits in [(t, 0, sympy.oo), (t,), (t, 1)]:
        with pytest.raises(Refused, match="two ends, or none"):
            run(sympy.Integral(x * sympy.exp(-t), limits), 1.0)
