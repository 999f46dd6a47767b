"""Equations of the papers come out of paths, with nothing typed in."""

import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import GaussianProfile, gaussian
from firstorder.laws import Integrate, Multiply
from firstorder.symbolic import UnknownField, UnknownLobe, derive
from firstorder.symbolic._functions import unknown_function
from firstorder.transport import (
    Bump,
    Cosine,
    Curvature,
    Mirror,
    Occlusion,
    Reflection,
    Texture,
    Travel,
)
from firstorder.transport.events.incidence import Incidence, Outgoing
from firstorder.transport.events.travel import Arrival

x, theta, v, t = sympy.symbols("x theta v t", real=True)
Ox, Ot, Ov = sympy.symbols("Omega_x Omega_theta Omega_v", real=True)
d = sympy.Symbol("d", positive=True)
k = sympy.Symbol("kappa", real=True)
LEAVING = Frame(sense="outgoing")


def L(*u, orders=(0, 0), names=("x", "theta")):
    return unknown_function("L", names, orders)(*u)


def hat(*Omega, name="L", names=("x", "theta")):
    return unknown_function(f"{name}_hat", tuple(f"Omega_{n}" for n in names))(*Omega)


def of_one(name, u, order=0, axis="x"):
    return unknown_function(name, (axis,), (order,))(u)


def same(found, printed):
    """Whether two expressions are one, whatever their integrals call their variables."""
    return sympy.simplify(named(found) - named(printed)) == 0


def named(expression):
    expression = sympy.expand(sympy.sympify(expression))
    dummies = sorted(expression.atoms(sympy.Dummy), key=str)
    expression = expression.xreplace({s: t for s in dummies})
    # One integral for each term, constants in front.
    return expression.replace(sympy.Integral, _taken_apart)


def _taken_apart(integrand, limits):
    terms = sympy.Add.make_args(sympy.expand(integrand))
    pairs = [term.as_independent(limits[0]) for term in terms]
    return sympy.Add(*(c * sympy.Integral(rest, limits) for c, rest in pairs))


def convolved(orders, n):
    """`(L_.. (x) rho)(x, 2 n - theta)` with the lobe at fixed offsets."""
    lobe = of_one("rho", t, axis="theta")
    return sympy.Integral(L(x, t + 2 * n - theta, orders=orders) * lobe, (t, -sympy.oo, sympy.oo))


@pytest.fixture(scope="module")
def reflected():
    """R07's four steps on a surface whose normal is n(x)."""
    n = UnknownField("n", ("x",))
    lobe = Reflection(UnknownLobe("rho"))
    light = UnknownField("L", frame=FLATLAND)
    return derive(light >> Bump(n) >> Mirror() >> lobe >> Bump(n, back=True))


def test_r07_24_25_the_gradient_of_reflected_light(reflected):
    n, n_x = of_one("n", x), of_one("n", x, 1)
    B_x, B_theta = reflected.gradient.expression
    assert same(B_x, convolved((1, 0), n) + 2 * n_x * convolved((0, 1), n))
    assert same(B_theta, -convolved((0, 1), n))
    assert not same(B_x, convolved((1, 0), n) + n_x * convolved((0, 1), n))


def test_r07_29_its_hessian(reflected):
    n, n_x, n_xx = (of_one("n", x, i) for i in range(3))
    H = reflected.hessian.expression
    first = convolved((2, 0), n) + 4 * n_x * convolved((1, 1), n)
    assert same(
        H[0, 0], first + 4 * n_x**2 * convolved((0, 2), n) + 2 * n_xx * convolved((0, 1), n)
    )
    assert same(H[0, 1], -convolved((1, 1), n) - 2 * n_x * convolved((0, 2), n))
    assert H[0, 1] == H[1, 0] or same(H[0, 1], H[1, 0])
    assert same(H[1, 1], convolved((0, 2), n))


STEPS = [
    # name, path, value, gradient, spectrum
    (
        "R07.10-11",
        derive(Curvature(k)),
        L(x, theta + k * x),
        [L(x, theta + k * x, orders=(1, 0)) + k * L(x, theta + k * x, orders=(0, 1)),
         L(x, theta + k * x, orders=(0, 1))],
        hat(Ox - k * Ot, Ot),
    ),
    (
        "R07.12-13, D05.14",
        derive(Mirror()),
        L(x, -theta),
        [L(x, -theta, orders=(1, 0)), -L(x, -theta, orders=(0, 1))],
        hat(Ox, -Ot),
    ),
    (
        "R07.14-16, D05.15-16",
        derive(Reflection(UnknownLobe("rho")), LEAVING),
        sympy.Integral(L(x, theta - t) * of_one("rho", t, axis="theta"), (t, -sympy.oo, sympy.oo)),
        None,
        hat(Ox, Ot) * hat(Ot, name="rho", names=("theta",)),
    ),
    (
        "R07.17",
        derive(Curvature(k, back=True), LEAVING),
        L(x, theta - k * x),
        [L(x, theta - k * x, orders=(1, 0)) - k * L(x, theta - k * x, orders=(0, 1)),
         L(x, theta - k * x, orders=(0, 1))],
        hat(Ox + k * Ot, Ot),
    ),
    (
        "R07.20, D05.18",
        derive(Texture(UnknownField("T", ("x",)))),
        of_one("T", x) * L(x, theta),
        [of_one("T", x, 1) * L(x, theta) + of_one("T", x) * L(x, theta, orders=(1, 0)),
         of_one("T", x) * L(x, theta, orders=(0, 1))],
        sympy.Integral(hat(Ox - t, Ot) * hat(t, name="T", names=("x",)), (t, -sympy.oo, sympy.oo)),
    ),
    (
        "D05.2-3",
        derive(Travel(d), FLATLAND_SLOPE),
        L(x - v * d, v, names=("x", "v")),
        None,
        hat(Ox, Ov + d * Ox, names=("x", "v")),
    ),
    (
        "D05.4-5",
        derive(Occlusion(UnknownField("V", ("x",))), FLATLAND_SLOPE),
        of_one("V", x) * L(x, v, names=("x", "v")),
        None,
        sympy.Integral(
            hat(Ox - t, Ov, names=("x", "v")) * hat(t, name="V", names=("x",)),
            (t, -sympy.oo, sympy.oo),
        ),
    ),
    (
        "D05.9",
        derive(Incidence(k)),
        L(x * sympy.cos(k), theta - k),
        None,
        sympy.exp(-2 * sympy.pi * sympy.I * k * Ot)
        * hat(Ox / sympy.cos(k), Ot) / sympy.Abs(sympy.cos(k)),
    ),
    (
        "D05.10",
        derive(Outgoing(k), LEAVING),
        L(x / sympy.cos(k), theta + k),
        None,
        sympy.exp(2 * sympy.pi * sympy.I * k * Ot)
        * hat(Ox * sympy.cos(k), Ot) * sympy.Abs(sympy.cos(k)),
    ),
    (
        "flip before D05.9",
        derive(Arrival(), Frame(("x", "v"), "outgoing")),
        L(-x, v, names=("x", "v")),
        None,
        hat(-Ox, Ov, names=("x", "v")),
    ),
    (
        "R07.fig2, slice",
        derive(Integrate("theta", -sympy.oo, sympy.oo)),
        sympy.Integral(L(x, t), (t, -sympy.oo, sympy.oo)),
        [sympy.Integral(L(x, t, orders=(1, 0)), (t, -sympy.oo, sympy.oo))],
        hat(Ox, 0),
    ),
]  # fmt: skip


@pytest.mark.parametrize(("name", "found", "value", "gradient", "spectrum"), STEPS)
def test_steps_of_the_papers(name, found, value, gradient, spectrum):
    assert same(found.value.expression, value)
    for entry, printed in zip(found.gradient.expression, gradient or (), strict=bool(gradient)):
        assert same(entry, printed)
    assert same(found.spectrum.expression, spectrum)


def test_d05_12_13_the_cosine_blurs_by_its_own_transform():
    (integral,) = derive(Cosine()).spectrum.expression.atoms(sympy.Integral)
    s = integral.limits[0][0]
    blur = integral.function.subs(s, sympy.Rational(1, 3)) / hat(Ox, Ot - sympy.Rational(1, 3))
    w = 2 * sympy.pi / 3
    assert (
        abs(complex(blur.simplify()) - complex(2 * sympy.cos(sympy.pi * w / 2) / (1 - w**2)))
        < 1e-12
    )


def test_a_blocker_at_a_depth_has_its_energy_on_one_line():
    """E11's wedge and D05 §3.2: `(Omega_x, Omega_v) = s (1, -z)`."""
    shadow = derive(Occlusion(UnknownField("V", ("x",)), depth=d), FLATLAND_SLOPE)
    assert shadow.value.expression == of_one("V", x - d * v) * L(x, v, names=("x", "v"))
    moved = hat(Ox - t, Ov + t * d, names=("x", "v")) * hat(t, name="V", names=("x",))
    assert same(shadow.spectrum.expression, sympy.Integral(moved, (t, -sympy.oo, sympy.oo)))


def test_a_factor_of_two_coordinates_has_no_line_of_frequencies():
    """`theta T(x)` and `x theta`: neither is a function of one linear form."""
    T = UnknownField("T", ("x",))
    for factor in (Multiply(lambda x, theta: theta)(T), lambda x, theta: x * theta):
        with pytest.raises(Refused):
            _ = derive(Multiply(factor)).spectrum


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
