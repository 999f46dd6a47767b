"""Formulas of paths, with nothing typed in; those of the papers are in `derivations.derived`."""

import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from derivations.derived.compare import (
    Ov,
    Ox,
    S,
    S_hat,
    d,
    hat,
    integral,
    k,
    normal,
    t,
    unknown,
    v,
    x,
)
from firstorder import symbolic
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import BoxProfile, GaussianProfile, Separable, gaussian
from firstorder.laws import Integrate, Multiply
from firstorder.symbolic import UnknownField, UnknownLobe, derive, event
from firstorder.transport import (
    Bump,
    Cosine,
    Curvature,
    Mirror,
    Occlusion,
    Path,
    Reflection,
    Travel,
)
from firstorder.transport.events.travel import Arrival


@pytest.fixture(scope="module")
def reflected():
    """R07's four steps on a surface whose normal is n(x)."""
    n = UnknownField("n", ("x",))
    lobe = Reflection(UnknownLobe("rho"))
    light = UnknownField("L", frame=FLATLAND)
    return derive(light >> Bump(n) >> Mirror() >> lobe >> Bump(n, back=True))


def same(found, written):
    """Whether two expressions are one, whatever their integrals call their variables."""
    return sympy.simplify(normal(found) - normal(written)) == 0


def test_the_hessian_is_symmetric(reflected):
    H = reflected.hessian.expression
    assert same(H[0, 1], H[1, 0])
    assert not same(H[0, 1], 2 * H[1, 0])


def test_light_that_leaves_one_surface_arrives_at_another():
    """The flip before D05 (9), which the paper does not number."""
    found = derive(Arrival(), Frame(("x", "v"), "outgoing"))
    assert same(found.value.expression, S(-x, v))
    assert same(found.spectrum.expression, S_hat(-Ox, Ov))


def test_a_blocker_at_a_depth_has_its_energy_on_one_line():
    """E11's wedge and D05 §3.2: `(Omega_x, Omega_v) = s (1, -z)`."""
    shadow = derive(Occlusion(UnknownField("V", ("x",)), depth=d), FLATLAND_SLOPE)
    assert shadow.value.expression == unknown("V", "x")(x - d * v) * S(x, v)
    moved = integral(S_hat(Ox - t, Ov + t * d) * hat("V", "x")(t))
    assert same(shadow.spectrum.expression, moved)


def test_laws_applied_to_a_field_are_a_path():
    """Their rules are read, and not what the field would answer itself."""
    (law,) = derive(Travel(d), FLATLAND_SLOPE).laws
    field = law(UnknownField("L", frame=FLATLAND_SLOPE))
    assert same(derive(field).spectrum.expression, S_hat(Ox, Ov + d * Ox))
    assert len(derive(field).values) == 2
    further = derive(Path(field) >> Travel(d))
    assert same(further.spectrum.expression, S_hat(Ox, Ov + 2 * d * Ox))


def test_a_power_has_a_transform_that_its_numbers_agree_with():
    """D05 §3.3's weight of slopes, and one without a Bessel function."""
    s = np.array([0.0, 0.2, -0.7])
    light = gaussian((0.2, 0.1), (0.5, 0.3), 0.3, frame=FLATLAND_SLOPE)
    for power in (1.0, 1.5):
        factor = Multiply(lambda x, v, p=power: (2.0 + 3.0 * v**2) ** -p)
        found = derive(Integrate("v", -9.0, 9.0)(factor(light))).spectrum
        places = np.linspace(-6.0, 6.0, 1201)
        slopes = np.linspace(-5.0, 5.0, 1201)
        values = light(places[:, None], slopes) * (2.0 + 3.0 * slopes**2) ** -power
        along = np.trapezoid(values, slopes, axis=1)
        true = np.trapezoid(along * np.exp(-2j * np.pi * s[:, None] * places), places, axis=1)
        np.testing.assert_allclose(found.at(s), true, rtol=0.0, atol=1e-9)


def test_a_wave_moves_the_light_to_both_sides_with_its_phase():
    """`sin(2 pi f x + p)` is two waves, that of the frequency f before that of -f."""
    light = gaussian((0.2, 0.1), (0.5, 0.3), 0.3, frame=FLATLAND_SLOPE)
    found = derive(Multiply(lambda x, v: jnp.sin(2.0 * x - v + 0.3))(light)).spectrum
    F, f = light.spectrum(), np.array([2.0, -1.0]) / (2.0 * np.pi)
    at, turn = np.array([0.2, -0.4]), np.exp(0.3j)
    true = (turn * F(*(at - f)) - F(*(at + f)) / turn) / 2j
    np.testing.assert_allclose(found.at(*at), true, rtol=1e-12)


def test_a_bell_in_two_coordinates_convolves_over_both_frequencies():
    """Held to the bell that the product of two bells is."""
    light = gaussian((0.2, 0.1), (0.5, 0.3), 0.3, frame=FLATLAND_SLOPE)
    bell = gaussian((-0.1, 0.3), (0.4, 0.6), -0.2, frame=FLATLAND_SLOPE)
    found = derive(Multiply(bell)(light)).spectrum.expression
    at = dict(zip((Ox, Ov), (sympy.Rational(1, 3), sympy.Rational(-1, 5)), strict=True))
    # Bells at even places sum to their integral; SymPy's own would take longer than the suite.
    integrand = sympy.lambdify(found.variables, found.function.subs(at), "numpy")
    frequencies = np.linspace(-3.0, 3.0, 601)
    value = integrand(frequencies[:, None], frequencies).sum() * 0.01**2
    places = np.linspace(-4.0, 4.0, 801)
    waves = [np.exp(-2j * np.pi * float(Omega) * places) for Omega in at.values()]
    product = np.asarray(light(places[:, None], places) * bell(places[:, None], places))
    true = waves[0] @ product @ waves[1] * (places[1] - places[0]) ** 2
    assert abs(value - true) < 1e-9


@pytest.mark.parametrize("edge", [0.3, 0.2])
def test_a_bell_cut_by_a_box_convolves_over_both_frequencies(edge):
    """Off the edges of the box the factor is a function of x alone; 0.2 is a ray that is tried."""
    light = gaussian((0.2, 0.1), (0.5, 0.3), 0.3, frame=FLATLAND_SLOPE)
    cut = Separable([-0.2, edge - 0.4], (GaussianProfile(0.5, "x"), BoxProfile(0.4, "v")))
    found = derive(Multiply(cut)(light)).spectrum.expression
    at = dict(zip((Ox, Ov), (sympy.Rational(1, 3), sympy.Rational(-1, 5)), strict=True))
    integrand = sympy.lambdify(found.variables, found.function.subs(at), "numpy")
    frequencies = 0.02 * (np.arange(-200, 200) + 0.5)
    value = integrand(frequencies[:, None], frequencies).sum() * 0.02**2
    nodes, weights = np.polynomial.legendre.leggauss(40)
    places, slopes = np.linspace(-4.0, 4.0, 401), edge - 0.4 + 0.4 * nodes
    wave = np.exp(-2j * np.pi * (places[:, None] / 3.0 - slopes / 5.0))
    product = light(places[:, None], slopes) * cut(places, edge - 0.4)[:, None] * wave
    true = product.sum(axis=0) @ weights * 0.4 * (places[1] - places[0])
    assert abs(value - true) < 1e-9


def test_a_factor_of_two_coordinates_has_no_line_of_frequencies():
    """`theta T(x)` and `x theta`: neither is a function of one linear form."""
    T = UnknownField("T", ("x",))
    for factor in (Multiply(lambda x, theta: theta)(T), lambda x, theta: x * theta):
        with pytest.raises(Refused):
            _ = derive(Multiply(factor)).spectrum


def test_a_factor_has_a_line_of_frequencies_only_if_it_has_for_all_numbers():
    """`cos(x + theta + (a - b) x theta)` is a function of one linear form where a is b."""
    place, angle, a, b = sympy.symbols("x theta a b")
    factor = sympy.cos(place + angle + (a - b) * place * angle)
    with pytest.raises(Refused):
        _ = derive(event(factor=factor, parameters={a: a, b: b}), FLATLAND).spectrum


def test_covariances_of_unknown_light():
    xx, xv, vv = (sympy.Symbol(f"Sigma_L_{n}", real=True) for n in ("xx", "xv", "vv"))
    found = derive(Travel(d), FLATLAND_SLOPE).covariance.expression
    M = sympy.Matrix([[1, -d], [0, 1]])
    assert sympy.simplify(found - M.T * sympy.Matrix([[xx, xv], [xv, vv]]) * M) == sympy.zeros(2)


def test_a_path_in_space():
    far = derive(Travel(d), SPACE_SLOPE)
    assert str(far.value) == "L(-d*v + x, -d*w + y, v, w)"
    assert str(far.spectrum) == "L_hat(Omega_x, Omega_y, Omega_v + Omega_x*d, Omega_w + Omega_y*d)"


def test_numbers_of_a_path_with_symbols_are_those_of_the_path():
    light, lobe = gaussian((0.2, 0.1), (0.5, 0.3), 0.3), Reflection(GaussianProfile(0.2))

    def path(curvature):
        return light >> Curvature(curvature) >> Mirror() >> lobe >> Curvature(curvature, back=True)

    found, true = derive(path(k)), path(0.4).light
    at = 0.3, -0.1
    jet = true.jet(jnp.array(at))
    np.testing.assert_allclose(found.value.at(*at, kappa=0.4), true(*at), rtol=1e-13)
    np.testing.assert_allclose(found.gradient.at(*at, kappa=0.4), jet.gradient, rtol=1e-11)
    np.testing.assert_allclose(found.hessian.at(*at, kappa=0.4), jet.hessian, rtol=1e-10)
    np.testing.assert_allclose(found.spectrum.at(*at, kappa=0.4), true.spectrum()(*at), rtol=1e-13)
    np.testing.assert_allclose(
        found.covariance.at(*at, kappa=0.4), true.covariance().matrix, rtol=1e-12
    )


def test_refusals_keep_their_reasons(reflected):
    with pytest.raises(Refused, match="warp has no simple Fourier formula"):
        _ = reflected.spectrum
    assert isinstance(reflected.portrait("covariance"), Refused)
    with pytest.raises(TypeError, match="must be a path, events, a law or a field, but is float"):
        derive(1.0)


def test_the_kink_of_a_clamped_cosine_bends_what_a_lobe_makes_of_it():
    """Second differences of the integral between the horizons, by another quadrature."""
    lit = gaussian((0.0, 0.3), (1.0, 1.0), frame=FLATLAND.turned()) >> Cosine()
    found = derive(lit >> Reflection(GaussianProfile(0.48)))
    nodes, w = np.polynomial.legendre.leggauss(200)
    b = 0.5 * np.pi * nodes
    shone = 0.5 * np.pi * w * np.exp(-0.5 * 0.2**2 - 0.5 * (b - 0.3) ** 2) * np.cos(b)

    def lobe(theta):
        a = (theta - b) / 0.48
        return shone @ ((a * a - 1.0) * np.exp(-0.5 * a * a)) / (0.48**3 * np.sqrt(2.0 * np.pi))

    np.testing.assert_allclose(found.hessian.at(0.2, 0.7)[1, 1], lobe(0.7), rtol=1e-9)


def test_a_formula_is_that_of_a_field():
    with pytest.raises(TypeError):
        symbolic.formula(3)
