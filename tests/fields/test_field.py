import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.fields import (
    Affine,
    BoxProfile,
    Constant,
    Edge,
    Field,
    Function,
    Gaussian,
    Grid,
    Harmonics,
    Sum,
    autodiff_jet,
    gaussian,
)
from firstorder.laws import Integrate, Warp
from firstorder.laws.warp import Map
from firstorder.transport import Wave


def two():
    return gaussian((0.2, -0.1), (0.5, 0.4), 0.3), gaussian((-0.3, 0.2), (0.3, 0.6), -0.2, 0.7)


@settings(max_examples=10)
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_superposition_in_every_portrait_that_is_linear(a, b):
    f, g = two()
    total, u = a * f + b * g, jnp.array([0.3, 0.1])
    for of in (lambda h: h.at(u), lambda h: h.jet(u).gradient, lambda h: h.jet(u).hessian,
               lambda h: h.spectrum()(0.3, -0.2)):  # fmt: skip
        expected = a * np.asarray(of(f)) + b * np.asarray(of(g))
        np.testing.assert_allclose(of(total), expected, rtol=0.0, atol=1e-13)


def test_a_sum_keeps_the_edges_of_its_terms():
    f, _ = two()
    box = 3.0 * BoxProfile(0.5, "theta", f.frame) + f
    assert len(box.edges()) == 2
    u = jnp.array([0.1, 0.2])
    assert [float(e.jump.at(u)) for e in box.edges()] == [3.0, -3.0]
    alone = (3.0 * BoxProfile(0.5, "theta", f.frame)).edges()  # not a sum of a sum
    assert [float(e.jump.at(u)) for e in alone] == [3.0, -3.0]
    ends = [[abs(float(e.level.at(u.at[1].set(t)))) for t in (-0.5, 0.5)] for e in alone]
    assert sorted(ends) == [[0.0, 1.0], [1.0, 0.0]]


def test_a_sums_series_is_the_sum_of_series():
    window = Grid.spanning((16, 15), (3.0, 3.0))
    f, g = two()
    series = (2.0 * f + g).series(window)
    u = np.array([0.3, 0.1])
    value = np.sum(series.coefficients * np.exp(2j * np.pi * np.asarray(series.frequencies) @ u))
    both = [np.sum(h.series(window).coefficients
                   * np.exp(2j * np.pi * np.asarray(h.series(window).frequencies) @ u))
            for h in (f, g)]  # fmt: skip
    assert complex(value) == pytest.approx(complex(2.0 * both[0] + both[1]))


def test_coordinates_broadcast():
    f, _ = two()
    assert f(np.zeros((3, 1)), np.zeros(4)).shape == (3, 4)
    jets = f.jets(np.zeros((2, 3)), 0.1)
    assert jets.value.shape == (2, 3)
    assert jets.gradient.shape == (2, 3, 2)
    assert jets.hessian.shape == (2, 3, 2, 2)
    with pytest.raises(ValueError, match="must be the 2 coordinates x, theta, but are 1"):
        f(0.0)
    with pytest.raises(ValueError, match="must share one frame, but has 2"):
        Sum((Constant(1.0, FLATLAND), Constant(1.0, FLATLAND_SLOPE)), jnp.ones(2))


def test_a_straight_edge_is_solved_exactly():
    edge = Edge(Affine([2.0, -0.5], 0.3), Constant(1.0))
    b = edge.crossing(jnp.array([0.4, 0.0]), 1, jnp.array(-9.0), jnp.array(9.0))
    assert float(b.value) == pytest.approx((2.0 * 0.4 + 0.3) / 0.5)
    np.testing.assert_allclose(b.gradient, [4.0, 0.0])
    np.testing.assert_allclose(b.hessian, np.zeros((2, 2)))


def test_a_bent_edge_as_a_function_of_the_other_coordinate():
    """`x^2 + t^2 / 4 = 1` on the side t > 0: t = 2 sqrt(1 - x^2), its slope and bend."""
    level = Function(lambda x, t: 1.0 - x**2 - 0.25 * t**2)
    b = jax.jit(
        lambda u: Edge(level, Constant(1.0)).crossing(u, 1, jnp.array(0.0), jnp.array(3.0))
    )(jnp.array([0.6, 0.0]))

    def exact(x):
        return 2.0 * jnp.sqrt(1.0 - x**2)

    assert float(b.value) == pytest.approx(float(exact(0.6)), abs=1e-13)
    assert float(b.gradient[0]) == pytest.approx(float(jax.grad(exact)(0.6)), abs=1e-12)
    assert float(b.hessian[0, 0]) == pytest.approx(float(jax.grad(jax.grad(exact))(0.6)), abs=1e-11)


def test_an_edge_that_is_not_met_has_no_slope():
    edge = Edge(Affine([1.0, 0.0], 0.3), Constant(1.0))  # runs along theta
    b = edge.crossing(jnp.array([0.4, 0.0]), 1, jnp.array(-1.0), jnp.array(1.0))
    assert np.all(np.isfinite(b.value))
    np.testing.assert_allclose(b.gradient, 0.0)
    np.testing.assert_allclose(b.hessian, 0.0)


class _Bend(Map):
    def __call__(self, u):
        return jnp.stack([u[0] + 0.2 * u[1] ** 2, u[1]])


def test_an_edge_bends_with_a_warped_field():
    f, _ = two()
    warped = Warp(_Bend())(BoxProfile(0.5, "x", f.frame))
    edge = warped.edges()[1]
    b = edge.crossing(jnp.array([0.0, 0.7]), 0, jnp.array(0.0), jnp.array(1.0))
    assert float(b.value) == pytest.approx(0.5 - 0.2 * 0.49)
    assert float(b.gradient[1]) == pytest.approx(-0.4 * 0.7)
    assert float(b.hessian[1, 1]) == pytest.approx(-0.4)


def test_parameters_are_leaves():
    f, _ = two()
    leaves = jax.tree.leaves(f)
    assert len(leaves) == 3  # centre, precision, amplitude; the frame is static

    def value(f):
        return f.at(jnp.array([0.5, 0.1]))

    assert isinstance(jax.grad(value)(f), Gaussian)
    assert normwise(jax.grad(value)(f).amplitude, value(f)) < 1e-15


def test_the_jets_of_an_integral_of_few_nodes_are_off_by_less_than_they_say():
    E = Integrate("theta", -1.0, 1.0, nodes=3)(Wave([0.1, 0.3]))
    value, error = E.jets(0.4, with_error=True)
    k, total = 0.2 * np.pi, np.sin(0.6 * np.pi) / (0.3 * np.pi)
    c, s = total * np.cos(0.4 * k), total * np.sin(0.4 * k)
    truth = c, -k * s, -(k**2) * c
    for found, bound, true in zip(*map(jax.tree.leaves, (value, error)), truth, strict=True):
        off = np.abs(np.squeeze(found) - true)
        assert off > 1e-6
        assert off < np.squeeze(bound) < 10.0 * off


TWICE = {
    "from the left": lambda f: 2 * f,
    "from the right": lambda f: f * 2,
    "by a number of NumPy": lambda f: np.float64(2.0) * f,
    "by an array of one number": lambda f: f * np.array(2.0),
    "divided": lambda f: f / 0.5,
    "a difference": lambda f: f - -f,
}


@pytest.mark.parametrize("way", TWICE)
def test_a_field_is_scaled_by_a_number(way):
    field = gaussian((0.1, -0.2), (1.0, 0.5))
    twice = TWICE[way](field)
    assert twice(0.3, 0.1).item() == 2.0 * field(0.3, 0.1).item()


NO_LIGHT = {
    "a field times a field": (lambda f: f * f, TypeError, "by a field `laws.Multiply` does it"),
    "a field times numbers": (lambda f: np.ones(3) * f, ValueError, "must be one number"),
    "a field and a number": (lambda f: f + 1.0, TypeError, "has a float: .* is a `Constant`"),
    "a field and its spectrum": (lambda f: f + f.spectrum(), TypeError, "is a `Constant`"),
    "a list times a field": (lambda f: [1.0, 1.0] * f, ValueError, "must be one number"),
    "a field less a number": (lambda f: f - 1.0, TypeError, "has a float: .* is a `Constant`"),
}


@pytest.mark.parametrize("way", NO_LIGHT)
def test_what_is_no_light_is_not_added(way):
    ask, error, words = NO_LIGHT[way]
    with pytest.raises(error, match=f"{words}|violates type hint"):
        ask(gaussian((0.1, -0.2), (1.0, 0.5)))


WITHOUT_FRAME = {
    "constant": lambda frame: Constant(1.0, frame),
    "affine": lambda frame: Affine([1.0, 2.0], 0.0, frame),
    "function": lambda frame: Function(lambda x, theta: x, frame),
    "harmonics": lambda frame: Harmonics([1.0], [0.0], frame),
    "box": lambda frame: BoxProfile(1.0, frame=frame),
}


@pytest.mark.parametrize("name", WITHOUT_FRAME)
def test_the_name_of_a_coordinate_is_no_frame(name):
    words = "`frame` must be a `Frame`, such as FLATLAND, but is 'x'|violates type hint"
    with pytest.raises(TypeError, match=words):
        WITHOUT_FRAME[name]("x")


COMPLEX = {
    "height": lambda: Constant(1j),
    "normal": lambda: Affine([1j, 2.0], 0.0),
    "weights": lambda: Sum((Constant(1.0),), jnp.array([1j])),
    "weight": lambda: 1j * Constant(1.0),
    "amplitude": lambda: gaussian((0.0, 0.0), (1.0, 1.0), amplitude=1j),
    "lower": lambda: Integrate("x", 1j, 2.0),
}


@pytest.mark.parametrize("name", COMPLEX)
def test_light_is_real(name):
    words = f"`{name}` must be real, but is complex|violates type hint"
    with pytest.raises((ValueError, TypeError), match=words):
        COMPLEX[name]()


def test_a_level_has_a_slope_along_each_coordinate():
    with pytest.raises(ValueError, match=r"`normal` must have shape \(2,\), but has \(3,\)"):
        Affine([1.0, 2.0, 3.0], 0.0)
    with pytest.raises(ValueError, match="`offset` must be one number"):
        Affine([1.0, 2.0], [0.0, 1.0])


def test_a_sum_has_a_weight_for_each_field():
    with pytest.raises(ValueError, match="`weights` must be one number for each field"):
        Sum((Constant(1.0),), jnp.ones(2))
    with pytest.raises(ValueError, match="`fields` must hold a field, but is empty"):
        Sum((), jnp.ones(0))


class Lit(Field):
    """Light of a user's, kept by complex coefficients, and a key of random numbers."""

    waves: jax.Array
    key: jax.Array
    frame: Frame = FLATLAND

    def at(self, u):
        return jnp.real(jnp.sum(self.waves)) * u[0]

    def jet(self, u):
        return autodiff_jet(self.at, u, self.frame)


def test_a_field_of_ones_own_may_keep_what_is_no_light():
    light = Lit(jnp.array([1.0 + 2.0j, 2.0]), jax.random.key(0))
    assert light(0.5, 0.0).item() == 1.5
