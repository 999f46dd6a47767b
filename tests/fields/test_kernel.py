import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from firstorder.conventions import FLATLAND
from firstorder.fields import GaussianProfile


def test_transform_is_the_integral_of_the_profile():
    p = GaussianProfile(0.3, weight=0.8)
    assert float(p(5.0, 0.3)) == pytest.approx(0.8 * np.exp(-0.5) / (0.3 * np.sqrt(2 * np.pi)))
    value = quad(
        lambda t: (
            0.8
            * np.exp(-0.5 * (t / 0.3) ** 2)
            / (0.3 * np.sqrt(2 * np.pi))
            * np.cos(2 * np.pi * 0.7 * t)
        ),
        -3,
        3,
        limit=50,
    )[0]
    assert float(p.transform(jnp.array(0.7))) == pytest.approx(value, abs=1e-9)


def test_its_derivatives_are_those_of_its_value():
    p = GaussianProfile(0.3, "x", weight=0.8)
    for x in jnp.array([(0.2, 5.0), (-0.7, 0.1), (0.0, 0.0)]):
        j = p.jet(x)
        np.testing.assert_allclose(j.gradient, jax.grad(lambda x: p(*x))(x), rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(j.hessian, jax.hessian(lambda x: p(*x))(x), rtol=0.0, atol=1e-13)


@pytest.mark.parametrize(("precision", "far"), [("float32", 1e20), ("float64", 1e160)])
def test_far_away_its_derivatives_are_zero(precision, far):
    """The second one was NaN."""
    t = jnp.asarray(far, precision)
    np.testing.assert_array_equal(GaussianProfile(0.3).derivatives(t), 0.0)


def test_it_varies_along_its_axis_alone():
    j = GaussianProfile(0.3, "x").jet(jnp.array([0.2, 5.0]))
    assert np.count_nonzero(j.gradient) == 1
    assert np.count_nonzero(j.hessian) == 1


def test_spread_is_the_second_moment_of_the_power():
    p, w = GaussianProfile(0.3), np.linspace(-6.0, 6.0, 4001)
    power = np.asarray(jax.vmap(p.transform)(jnp.asarray(w))) ** 2
    assert float(p.spread()) == pytest.approx(np.sum(w**2 * power) / np.sum(power))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: GaussianProfile(0.0), "`sigma` must be positive, but is 0.0"),
        (lambda: GaussianProfile(np.nan), "`sigma` must be positive, but is nan"),
        (lambda: GaussianProfile(1.0, "v", FLATLAND), "`axis` must be one of x, theta, but is 'v'"),
    ],
)
def test_bad_input(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("look", [lambda p: p(0.0, 0.1), lambda p: p.transform(jnp.array(0.1)).real,
                                  lambda p: p.spread()])  # fmt: skip
def test_a_traced_width_that_is_none_gives_nan(look):
    look = jax.jit(lambda sigma, look=look: look(GaussianProfile(sigma)))
    assert np.isnan(look(-0.3))
    assert np.isnan(look(0.0))
    assert np.isfinite(look(0.3))
