"""Reflection by composed laws, against sums over the directions by NumPy."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.fields import Function
from firstorder.transport import glossy
from firstorder.transport.brdf.general import Brdf
from firstorder.transport.brdf.lobes import Lobe
from firstorder.transport.shading import _law_images as module

NODES = 48


def n_of(x):
    return 0.3 * np.sin(2.0 * x) + 0.1


def light_of(x, theta):
    return 1.5 + np.cos(theta - 0.4 * x) + 0.5 * np.sin(2.0 * theta) * x


LIGHT = Function(lambda x, t: 1.5 + jnp.cos(t - 0.4 * x) + 0.5 * jnp.sin(2.0 * t) * x)
NORMAL = Function(lambda x, t: 0.3 * jnp.sin(2.0 * x) + 0.1)
X, THETA = 0.7, -0.5


def summed(f, low, high, breaks=(), count=200):
    """The integral over pieces, by many nodes of Gauss and Legendre."""
    ends = np.array(sorted({low, high, *(b for b in breaks if low < b < high)}))
    t, w = np.polynomial.legendre.leggauss(count)
    half, middle = 0.5 * np.diff(ends)[:, None], 0.5 * (ends[1:] + ends[:-1])[:, None]
    return np.sum(half * w * f(middle + half * t))


def field(make):
    """Value and jet of an image at one place, compiled once."""
    return jax.jit(lambda u: make().jet(u))(jnp.array([X, THETA]))


@pytest.mark.parametrize("name", ["with a cosine", "without"])
def test_light_is_convolved_with_a_lobe_times_its_own_cosine(name):
    lobe = Lobe(glossy(0.3).kernel, cosine=name == "with a cosine")
    jet = field(lambda: module.convolved(lobe, LIGHT, NORMAL, NODES))

    def value(x, theta):
        def integrand(t):
            cosine = np.maximum(np.cos(t - n_of(x)), 0.0) if lobe.cosine else 1.0
            bell = np.exp(-0.5 * (theta - t) ** 2 / 0.09) / (0.3 * np.sqrt(2.0 * np.pi))
            return light_of(x, t) * cosine * bell

        quarter = 0.5 * np.pi
        breaks = (n_of(x) - quarter, n_of(x) + quarter, theta)
        return summed(integrand, theta - 2.7, theta + 2.7, breaks)

    check(jet, value, 1e-9)


def check(jet, value, tolerance):
    """Value and both derivatives, by differences of fourth order."""
    assert jet.value == pytest.approx(value(X, THETA), rel=tolerance)
    h = 1e-3

    def slope(f):
        return (8.0 * (f(h) - f(-h)) - f(2.0 * h) + f(-2.0 * h)) / (12.0 * h)

    by = [slope(lambda s: value(X + s, THETA)), slope(lambda s: value(X, THETA + s))]
    np.testing.assert_allclose(jet.gradient, by, rtol=1e-7, atol=1e-7)


class Bent(Brdf):
    """`(1 + o / 5) |w - o / 2| + |w + 0.3|`, with a kink at each of two incoming angles."""

    split: bool = eqx.field(static=True, default=True)

    def derivatives(self, w, o):
        rise = jnp.abs(w - 0.5 * o)
        turn = -0.5 * jnp.sign(w - 0.5 * o)
        return (
            (1 + 0.2 * o) * rise + jnp.abs(w + 0.3),
            0.2 * rise + (1 + 0.2 * o) * turn,
            0.4 * turn,
        )

    def peaks(self, o):
        return [0.5 * o, -0.3 + 0.0 * o] if self.split else []


def reflected(x, theta):
    n = n_of(x)
    o = theta - n

    def integrand(w):
        rho = (1 + 0.2 * o) * np.abs(w - 0.5 * o) + np.abs(w + 0.3)
        return light_of(x, n + w) * rho * np.cos(w)

    return summed(integrand, -0.5 * np.pi, 0.5 * np.pi, (0.5 * o, -0.3))


def test_a_general_brdf_is_integrated_over_the_local_hemisphere_and_split_at_its_peaks():
    jet = field(lambda: module.over_hemisphere(Bent(), LIGHT, NORMAL, NODES))
    check(jet, reflected, 1e-12)
    loose = field(lambda: module.over_hemisphere(Bent(False), LIGHT, NORMAL, NODES))
    assert 1e-8 < abs(float(loose.value) / reflected(X, THETA) - 1.0) < 1e-2


def test_a_peak_is_a_field_of_the_outgoing_angle_that_stands_still():
    for index, true in ((0, 0.4), (1, -0.3)):
        peak = module._Peak(Bent(), index)
        u = jnp.array([9.0, 0.8, 7.0])
        assert peak.at(u) == pytest.approx(true)
        jet = peak.jet(u)
        assert jet.value == pytest.approx(true)
        np.testing.assert_array_equal(jet.gradient, np.zeros(3))
        np.testing.assert_array_equal(jet.hessian, np.zeros((3, 3)))
        np.testing.assert_array_equal(jax.grad(peak.at)(u), np.zeros(3))
