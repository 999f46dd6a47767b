import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from firstorder import symbolic
from firstorder.conventions import FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import Gaussian, Grid, gaussian
from firstorder.laws import Move, Warp
from firstorder.symbolic import UnknownField, derive, event
from firstorder.transport import Curvature, Texture, Travel, wave

x, theta, v, t, d, k, n = sympy.symbols("x theta v t d kappa n")
LIGHT = gaussian((0.2, 0.1), (0.5, 0.3), 0.3)
SLOPES = gaussian((0.2, 0.1), (0.5, 0.3), 0.3, frame=FLATLAND_SLOPE)
RAYS = np.random.default_rng(0).uniform(-0.6, 0.6, (2, 20))

TWINS = {
    # an event of the library, the same from an expression, and its light
    "curvature": (Curvature(0.4), event({theta: theta - k * x}, parameters={k: 0.4}), LIGHT),
    "travel": (Travel(0.7), event({x: x + v * d}, parameters={d: 0.7}), SLOPES),
    "travel in angles": (
        Travel(0.7),
        event({x: x + d * sympy.tan(theta)}, parameters={d: 0.7}),
        LIGHT,
    ),
    "texture": (
        Texture(wave(0.5, 0.2, mean=0.7)),
        event(factor=0.7 + 0.2 * sympy.cos(sympy.pi * x), window=Grid((64, 1), (0.2, 1.0))),
        LIGHT,
    ),
}


@pytest.mark.parametrize("name", TWINS)
def test_it_is_the_event_that_somebody_wrote_by_hand(name):
    hand, mine, light = TWINS[name]
    np.testing.assert_allclose(mine(light)(*RAYS), hand(light)(*RAYS), rtol=1e-12)
    jets, true = mine(light).jets(*RAYS), hand(light).jets(*RAYS)
    np.testing.assert_allclose(jets.gradient, true.gradient, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(jets.hessian, true.hessian, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("name", ["curvature", "travel", "texture"])
def test_it_has_the_same_spectrum(name):
    hand, mine, light = TWINS[name]
    found, true = (e(light.spectrum())(*RAYS) for e in (mine, hand))
    np.testing.assert_allclose(found, true, rtol=0.0, atol=1e-9)


def test_an_affine_map_is_a_move_and_any_other_a_warp():
    frame = LIGHT.frame
    assert isinstance(TWINS["curvature"][1].law(frame), Move)
    assert isinstance(TWINS["travel in angles"][1].law(frame), Warp)


def test_a_map_may_name_time():
    """What moves at k metres a second is seen at x where it was at x - k t at first."""
    moving = event({x: x + k * t}, parameters={k: 1.3})
    light = gaussian((0.2, 0.1), (0.5, 0.3), 0.3, frame=Frame(("x", "t")))
    true = light(RAYS[0] - 1.3 * RAYS[1], RAYS[1])
    np.testing.assert_allclose(moving(light)(*RAYS), true, rtol=1e-12)
    np.testing.assert_allclose(moving.law(light.frame).M, [[1.0, -1.3], [0.0, 1.0]], rtol=1e-15)
    slanted = Gaussian(jnp.zeros(3), jnp.eye(3), frame=Frame(("x", "v", "t"))) >> Travel(2.0)
    np.testing.assert_allclose(slanted.light(2.0, 1.0, 0.3), np.exp(-0.545), rtol=1e-12)


def test_parameters_are_leaves():
    def after(make):
        return lambda k: make(k)(LIGHT)(0.3, 0.1)

    mine = after(lambda value: event({theta: theta - k * x}, parameters={k: value}))
    np.testing.assert_allclose(jax.grad(mine)(0.4), jax.grad(after(Curvature))(0.4), rtol=1e-13)
    lens = TWINS["curvature"][1]
    slope = jax.grad(lambda e: e(LIGHT).at(jnp.array([0.3, 0.1])))(lens)
    np.testing.assert_allclose(slope.parameters["kappa"], jax.grad(mine)(0.4), rtol=1e-13)


def test_a_map_and_a_factor_are_a_chain():
    both = event({theta: theta - k * x}, factor=sympy.exp(-(x**2)), parameters={k: 0.4})
    true = np.exp(-(RAYS[0] ** 2)) * Curvature(0.4)(LIGHT)(*RAYS)
    np.testing.assert_allclose(both(LIGHT)(*RAYS), true, rtol=1e-13)


def test_where_light_comes_from_may_be_given():
    given = event(source={theta: sympy.asin(n * sympy.sin(theta))}, parameters={n: 1.5})
    solved = event({theta: sympy.asin(sympy.sin(theta) / n)}, parameters={n: 1.5})
    np.testing.assert_allclose(given(LIGHT)(*RAYS), solved(LIGHT)(*RAYS), rtol=1e-13)


def test_its_formula_keeps_its_symbols():
    lens = event({theta: theta - k * x}, parameters={k: k})
    found = derive(UnknownField("L", frame=LIGHT.frame) >> lens)
    assert str(found.value) == "L(x, kappa*x + theta)"
    assert str(found.spectrum) == "L_hat(-Omega_theta*kappa + Omega_x, Omega_theta)"


REFUSED = {
    "a fold": (lambda: event({x: x**2, theta: theta}), r"folds near x = -?0\.[0-3]"),
    "a projection": (lambda: event({x: x + theta, theta: x + theta}), "folds near every ray"),
    "no inverse": (
        lambda: event({x: x + sympy.sin(x) * sympy.exp(x) / 9}),
        "has no inverse in closed form: give `source`",
    ),
    "no number": (lambda: event({x: k * x})(LIGHT), "must give a number for kappa"),
    "time in light without it": (
        lambda: event({x: x + t})(LIGHT),
        "must give a number for t, which is no coordinate of the light",
    ),
    "a number for a coordinate": (
        lambda: event({x: 2 * x}, parameters={theta: 1.0})(LIGHT),
        "a number for theta, which is a coordinate",
    ),
    "both ways": (lambda: event({x: x}, source={x: x}), "`rays` and `source` say the same"),
    "nothing": (lambda: event(), "all left out"),
    "other coordinates": (lambda: event({v: 2 * v})(LIGHT), "RayEvent needs the coordinates v"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_event_is_refused_in_one_sentence(name):
    make, words = REFUSED[name]
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("factor", [sympy.Abs(x), sympy.sign(x), sympy.Heaviside(x)])
def test_an_expression_with_a_kink_has_values_and_refuses_derivatives(factor):
    seen = event(factor=factor)(LIGHT)
    np.testing.assert_allclose(seen(0.3, 0.1), float(factor.subs(x, 0.3)) * LIGHT(0.3, 0.1))
    with pytest.raises(Refused, match="has a kink"):
        seen.jet(jnp.array([0.3, 0.1]))


@pytest.mark.parametrize("given", [{"rays": {}}, {"source": {}}, {}])
def test_a_map_of_nothing_is_left_out(given):
    with pytest.raises(ValueError, match="are all left out: give one"):
        symbolic.event(**given)
