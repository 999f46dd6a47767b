import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE, Frame
from firstorder.errors import Refused
from firstorder.fields import GaussianProfile, gaussian
from firstorder.symbolic import UnknownField, UnknownLobe, UnknownVaryingLobe, derive
from firstorder.symbolic._programs.functions import unknown_function
from firstorder.transport import Mirror, Reflection, Texture, VaryingGaussian, wave


def test_derivatives_have_names():
    L = unknown_function("L", ("x", "theta"))
    x, theta = sympy.symbols("x theta", real=True)
    mixed = sympy.diff(L(2 * x, theta), x, theta)
    assert str(mixed) == "2*L_xtheta(2*x, theta)"
    assert mixed == sympy.diff(L(2 * x, theta), theta, x)
    assert sympy.latex(mixed) == "2 L_{x \\theta}\\left(2 x, \\theta\\right)"
    assert sympy.latex(L(x, theta) ** 2) == "L^{2}\\left(x, \\theta\\right)"
    assert L(x, theta).is_extended_real
    assert unknown_function("L_hat", ("x",))(x).is_extended_real is None  # a transform is complex


def test_it_takes_the_frame_of_the_light_that_it_meets():
    T = UnknownField("T", ("x",))
    assert str(derive(Texture(T), FLATLAND_SLOPE).value) == "L(x, v)*T(x)"
    assert UnknownField("V", ("v",)).frame.coordinates == ("x", "v")
    assert UnknownField("L", frame=SPACE).names == SPACE.coordinates


def test_its_jet_is_made_of_its_derivatives():
    """The library's own rules for jets, read: the same as SymPy's derivatives of the value."""
    from firstorder.symbolic._programs.reading import array, matrix, read

    L = UnknownField("L", frame=FLATLAND)
    x, theta = sympy.symbols("x theta", real=True)
    for law in (Mirror().law(FLATLAND), Texture(UnknownField("T", ("x",))).law(FLATLAND)):
        found = read(lambda law, u: law.jet(L, u), law, array(x, theta))
        true = derive(law)
        assert sympy.simplify(matrix(found.gradient) - sympy.Matrix(true.gradient.expression)) == (
            sympy.zeros(2, 1)
        )
        assert sympy.simplify(matrix(found.hessian) - true.hessian.expression) == sympy.zeros(2)


def test_a_function_of_some_coordinates_has_no_transform_of_all():
    with pytest.raises(Refused, match="T does not depend on all coordinates"):
        UnknownField("T", ("x",), FLATLAND).spectrum()


def test_a_function_of_some_coordinates_varies_along_these_alone():
    for names, zero in ((("x",), [[0, 1], [1, 1]]), (("x", "theta"), [[0, 0], [0, 0]])):
        light = UnknownField("T", names, FLATLAND)
        Sigma = derive(light).covariance.expression
        assert [[entry == 0 for entry in row] for row in Sigma.tolist()] == zero


def test_it_has_no_numbers():
    assert jnp.isnan(UnknownField("L")(0.0, 0.0))


def test_a_lobe_is_given_later():
    light = gaussian((0.2, 0.1), (0.5, 0.3), 0.3, frame=Frame(sense="outgoing"))
    found = derive(light >> Reflection(UnknownLobe("rho")))
    bell = GaussianProfile(0.2)
    np.testing.assert_allclose(
        found.value.at(0.3, 0.1, rho=lambda t: bell.derivatives(t)[0]),
        Reflection(bell)(light)(0.3, 0.1),
        rtol=1e-11,
    )
    hat = found.spectrum.at(0.3, 0.1, rho_hat=bell.transform)
    np.testing.assert_allclose(hat, Reflection(bell)(light.spectrum())(0.3, 0.1), rtol=1e-12)
    s = sympy.Symbol("s_rho", positive=True)
    numbers = found.covariance.lower()(0.0, 0.0, s_rho=bell.spread())
    assert found.covariance.parameters == (s,)
    true = Reflection(bell)(light.covariance()).matrix
    np.testing.assert_allclose(numbers, true, rtol=1e-12)


def test_a_lobe_that_varies_is_given_later():
    light = gaussian((0.2, 0.1), (0.5, 0.3), 0.3, frame=Frame(sense="outgoing"))
    lobe = VaryingGaussian(wave(0.5, 0.1, mean=0.3), widest=0.4)
    found = derive(light >> Reflection(UnknownVaryingLobe("rho")))
    true = Reflection(lobe, nodes=96)(light).jets(0.3, 0.1)
    np.testing.assert_allclose(found.value.at(0.3, 0.1, rho=lobe), true.value, rtol=1e-10)
    np.testing.assert_allclose(found.gradient.at(0.3, 0.1, rho=lobe), true.gradient, rtol=1e-9)
    with pytest.raises(Refused, match="rho is unknown and has no Fourier series"):
        Reflection(UnknownVaryingLobe("rho"))(light.spectrum())(0.0, 0.0)


def test_one_function_is_one_class_however_it_is_asked_for():
    names = ("x", "theta")
    assert unknown_function("L", names) is unknown_function("L", names, (0, 0))
