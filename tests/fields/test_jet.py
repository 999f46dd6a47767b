import operator

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.fields import autodiff_jet, gaussian

FRAMES = FLATLAND, FLATLAND_SLOPE


def light():
    return gaussian((0.21, -0.13), (0.5, 0.4), 0.35, 1.3)


def test_a_jet_is_a_taylor_expansion_of_third_order():
    u, h = jnp.array([0.3, 0.1]), jnp.array([0.6, -0.4])
    j, sizes = light().jet(u), 0.1 * 0.5 ** np.arange(4)

    def miss(s):
        step = s * h
        taylor = j.value + j.gradient @ step + 0.5 * step @ j.hessian @ step
        return abs(float(light().at(u + step) - taylor))

    assert abs(fitted_order(sizes, [miss(s) for s in sizes]) - 3.0) < 0.1


def test_jets_are_linear():
    u = jnp.array([0.3, 0.1])
    j = light().jet(u)
    total = j + j.scaled(2.0)
    for part in ("value", "gradient", "hessian"):
        np.testing.assert_allclose(getattr(total, part), 3.0 * getattr(j, part), rtol=1e-14)
    assert total.frame == j.frame


def test_the_hessian_is_symmetric():
    H = light().jet(jnp.array([0.3, 0.1])).hessian
    np.testing.assert_array_equal(H, H.T)
    oracle = autodiff_jet(light().at, jnp.array([0.3, 0.1]), light().frame)
    np.testing.assert_allclose(H, oracle.hessian, rtol=0.0, atol=1e-13)


def test_jets_over_other_coordinates_do_not_add():
    one, other = (gaussian((0.0, 0.0), (1.0, 1.0), frame=f).jets(0.0, 0.0) for f in FRAMES)
    with pytest.raises(ValueError, match="`other` must be a jet over"):
        operator.add(one, other)
    with pytest.raises(TypeError):
        operator.add(one, 1.0)
    assert (one + one).value == 2.0
