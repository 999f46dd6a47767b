import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.errors import Refused
from firstorder.fields import (
    Affine,
    BoxProfile,
    Constant,
    GaussianProfile,
    HalfPlane,
    Separable,
    UniformProfile,
    gaussian,
)
from firstorder.laws import Integrate, Multiply
from firstorder.symbolic import UnknownField, coordinates_of, derive, formula, frequencies_of
from firstorder.transport import Travel

d = sympy.Symbol("d", positive=True)
LIGHT = gaussian((0.2, -0.1), (0.8, 0.5), 0.4, frame=FLATLAND_SLOPE)


def test_it_says_what_it_is_a_function_of():
    far = derive(LIGHT >> Travel(d)).value
    assert far.coordinates == coordinates_of(FLATLAND_SLOPE)
    assert far.parameters == (d,)
    assert [s.name for s in frequencies_of(FLATLAND)] == ["Omega_x", "Omega_theta"]
    assert far(0, 0).free_symbols == set()
    assert "e^{" in far.latex
    assert far._repr_markdown_() == f"$${far.latex}$$"
    assert str(far) == str(far.expression)


def test_lowered_it_is_a_jitted_function_that_broadcasts_and_has_derivatives():
    far = derive(LIGHT >> Travel(d)).value.lower()
    x = jnp.linspace(-1.0, 1.0, 5)
    np.testing.assert_allclose(far(x, 0.3, d=2.0), Travel(2.0)(LIGHT)(x, 0.3), rtol=1e-14)
    assert far(x[:, None], x, d=2.0).shape == (5, 5)
    slope = jax.grad(lambda d: far(0.1, 0.3, d=d))(2.0)
    true = jax.grad(lambda d: Travel(d)(LIGHT)(0.1, 0.3))(2.0)
    np.testing.assert_allclose(slope, true, rtol=1e-13)


def test_a_gradient_and_a_hessian_have_axes_of_their_own():
    found = derive(LIGHT)
    x = jnp.linspace(-1.0, 1.0, 3)
    assert found.gradient.at(x, 0.0).shape == (3, 2)
    assert found.hessian.at(x, 0.0).shape == (3, 2, 2)
    np.testing.assert_allclose(found.hessian.at(x, 0.0), LIGHT.jets(x, 0.0).hessian, rtol=1e-12)


def test_unknown_functions_are_given_as_fields_or_functions():
    far = derive(Travel(d), FLATLAND_SLOPE)
    true = Travel(2.0)(LIGHT).jet(jnp.array([0.1, 0.3]))
    np.testing.assert_allclose(far.hessian.at(0.1, 0.3, d=2.0, L=LIGHT), true.hessian, rtol=1e-12)
    plain = far.gradient.at(0.1, 0.3, d=2.0, L=lambda x, v: LIGHT.at(jnp.stack([x, v])))
    np.testing.assert_allclose(plain, true.gradient, rtol=1e-12)
    with pytest.raises(Refused, match="L is unknown, so its formula has no numbers: give it"):
        far.value.at(0.1, 0.3, d=2.0)


def test_what_is_missing_is_named():
    far = derive(LIGHT >> Travel(d)).value.lower()
    with pytest.raises(TypeError, match="Argument `d` is missing"):
        far(0.1, 0.3)
    with pytest.raises(TypeError, match="The coordinates x, v are asked, but 1 are given"):
        far(0.1, d=2.0)


def test_integrals_are_split_where_their_integrand_jumps():
    """The mass of a bell beyond an edge that moves with x, with the edge's terms in derivatives."""
    light = gaussian((0.2, -0.1), (0.8, 0.5), 0.4)
    cut = HalfPlane(Affine([0.5, 1.0], -0.3), 0.1, 0.9)
    for ends in ((-5.0, 5.0), (-sympy.oo, sympy.oo)):
        found = derive(Integrate("theta", *ends)(Multiply(cut)(light)))
        true = Integrate("theta", -5.0, 5.0)(Multiply(cut)(light)).jet(jnp.array([0.4]))
        np.testing.assert_allclose(found.value.at(0.4), true.value, rtol=1e-12)
        np.testing.assert_allclose(found.gradient.at(0.4), true.gradient, rtol=1e-12)


def test_what_has_no_quadrature_is_refused():
    x, t = sympy.symbols("x t", real=True)
    half = formula(LIGHT).mapped(lambda _: sympy.Integral(sympy.exp(-t * x), (t, 0, sympy.oo)))
    with pytest.raises(Refused, match="has no quadrature here: give it two ends, or none"):
        half.at(1.0, 0.0)
    many = half.mapped(lambda _: sympy.Integral(x * t, *[(sympy.Dummy(), 0, 1)] * 3))
    with pytest.raises(Refused, match="an integral over 3 variables has no quadrature"):
        many.at(1.0, 0.0)


def test_integrals_are_carried_out_where_sympy_finds_them():
    s = sympy.Symbol("sigma", positive=True)
    whole = derive(Integrate("theta", -sympy.oo, sympy.oo)(GaussianProfile(s)))
    assert whole.value.evaluated().expression == 1


def test_a_sum_and_a_weight_are_read():
    two = derive(2.0 * LIGHT + LIGHT).value
    np.testing.assert_allclose(two.at(0.1, 0.2), 3.0 * LIGHT(0.1, 0.2), rtol=1e-14)
    assert str(derive(UnknownField("L") + UnknownField("M")).value) == "L(x, theta) + M(x, theta)"


def test_a_field_is_read_at_the_coordinates_that_an_unknown_function_names():
    bell, at = GaussianProfile(0.3), jnp.array([0.7, 0.2])
    found = derive(UnknownField("f", ("theta",), frame=FLATLAND))
    np.testing.assert_allclose(found.value.lower(f=bell)(*at), bell.at(at), rtol=1e-14)
    np.testing.assert_allclose(found.gradient.lower(f=bell)(*at), bell.jet(at).gradient, rtol=1e-14)
    np.testing.assert_allclose(found.hessian.lower(f=bell)(*at), bell.jet(at).hessian, rtol=1e-14)


def test_a_third_derivative_is_that_of_the_field_along_the_named_coordinate():
    cubic = Affine([0.0, 1.0], 0.5, FLATLAND)
    product = Multiply(cubic)(Multiply(cubic)(cubic))
    third = derive(UnknownField("f", ("theta",), frame=FLATLAND)).hessian.mapped(
        lambda H: sympy.diff(H[1, 1], coordinates_of(FLATLAND)[1])
    )
    np.testing.assert_allclose(third.lower(f=product)(0.7, 0.2), 6.0, rtol=1e-12)


def test_a_field_over_other_coordinates_is_refused():
    found = derive(UnknownField("f", ("theta",), frame=FLATLAND)).value
    with pytest.raises(ValueError, match="must be over theta, but is over x, v"):
        found.lower(f=LIGHT)(0.7, 0.2)


def test_an_integral_is_split_at_both_ends_of_a_box_and_where_extremes_meet():
    source = Separable([0.0, 0.1], (UniformProfile("x"), BoxProfile(0.5, "theta")))
    over = derive(Integrate("theta", -1.0, 1.0)(source)).value
    np.testing.assert_allclose(over.lower()(0.15), 1.0, rtol=1e-12)
    x, s = sympy.symbols("x s", real=True)
    bent = over.mapped(lambda _: sympy.Integral(sympy.Max(s - x, 0), (s, 0, 1)))
    np.testing.assert_allclose(bent.lower()(0.3), 0.5 * 0.7**2, rtol=1e-12)


def test_an_integral_without_symbols_is_a_number():
    over = derive(Integrate("theta", -1.0, 1.0)(Constant(2.0, FLATLAND))).value
    np.testing.assert_allclose(over.lower()(0.3), 4.0, rtol=1e-12)
