"""The ratio of an angle to its sine, against 40 digits."""

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest

from firstorder.numerics import _arc_factor as arc_factor_module
from firstorder.numerics._arc_factor import SHORT, arc_factor

# Angles: none, short ones, on both sides of the switch, wide ones.
SWITCH = float(np.arccos(1.0 - SHORT))
ANGLES = (1e-9, 1e-4, 0.1, 0.999 * SWITCH, 1.001 * SWITCH, 1.0, 2.0, 3.1)


def exact(angle: float, derivatives: int = 2) -> list[float]:
    """A and its derivatives in the cosine."""
    with mp.workdps(60):
        k = mp.cos(mp.mpf(angle))
        return [
            float(mp.diff(lambda k: mp.acos(k) / mp.sqrt(1 - k * k), k, n, h=mp.mpf("1e-24")))
            for n in range(derivatives + 1)
        ]


@pytest.mark.parametrize("angle", ANGLES)
def test_values_and_derivatives(angle):
    found = arc_factor(jnp.sin(angle) ** 2, jnp.cos(angle), 2)
    np.testing.assert_allclose(found, exact(angle), rtol=3e-13)


@pytest.mark.parametrize("angle", [1.5, 2.0])
def test_four_derivatives(angle):
    found = arc_factor(jnp.sin(angle) ** 2, jnp.cos(angle), 4)
    np.testing.assert_allclose(found, exact(angle, 4), rtol=1e-9)


def test_of_no_angle():
    found = arc_factor(jnp.array(0.0), jnp.array(1.0), 2)
    np.testing.assert_allclose(found, [1.0, -1.0 / 3.0, 4.0 / 15.0], rtol=5e-15)


@pytest.mark.parametrize("angle", [0.01, 0.3, 1.5])
def test_the_rule_goes_on_to_the_next_derivative(angle):
    def factor(k):
        return arc_factor(1.0 - k * k, k, 0)[0]

    k = jnp.cos(angle)
    found = [f(k) for f in (factor, jax.grad(factor), jax.grad(jax.grad(factor)))]
    np.testing.assert_allclose(found, exact(angle), rtol=1e-9)


def test_single_precision():
    found = arc_factor(jnp.float32(0.01), jnp.sqrt(jnp.float32(0.99)), 1)
    assert all(a.dtype == jnp.float32 for a in found)
    np.testing.assert_allclose(found, exact(float(np.arcsin(0.1)))[:2], rtol=3e-6)


def test_too_few_nodes_are_seen(monkeypatch):
    angle = 0.99 * SWITCH
    x, w = np.polynomial.legendre.leggauss(4)
    monkeypatch.setattr(arc_factor_module, "PLACES", 0.5 * (1.0 - x[2:] ** 2))
    monkeypatch.setattr(arc_factor_module, "WEIGHTS", w[2:])
    found = arc_factor(jnp.sin(angle) ** 2, jnp.cos(angle), 2)
    assert np.max(np.abs(np.array(found) / exact(angle) - 1.0)) > 1e-6
