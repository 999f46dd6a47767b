"""Integrands of a slice: closed forms against quadrature, and against each other."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import polar
from firstorder.space import receiver
from firstorder.space.azimuthal._integrands import Cosine, Uniform, Varying

LOW, HIGH = jnp.array([-1.3, 0.2, 0.4]), jnp.array([-0.9, 0.5, 0.8])  # the last two overlap
PHI = jnp.array(0.7)


def varying(transport):
    at = receiver((0.1, 0.2, 0.0))
    return Varying(transport, at, 24)


@pytest.mark.parametrize(
    ("closed", "transport"),
    [(Uniform(), lambda at, w: jnp.ones_like(w[2])), (Cosine(), lambda at, w: w[2])],
)
def test_closed_forms_are_what_quadrature_finds(closed, transport):
    found = varying(transport).inside(LOW, HIGH, PHI)
    np.testing.assert_allclose(closed.inside(LOW, HIGH, PHI)[0], found[0], rtol=1e-13)
    assert not np.any(found[1])
    w = polar(LOW, PHI)
    np.testing.assert_allclose(closed.edge(w), varying(transport).edge(w), rtol=1e-14)


@pytest.mark.parametrize("closed", [Uniform(), Cosine()])
def test_primitives_are_primitives(closed):
    theta = jnp.array([-1.4, -0.3, 0.2, 1.1])
    slope = jax.vmap(jax.grad(closed.primitive))(theta)
    light = closed.edge(polar(theta, PHI))
    np.testing.assert_allclose(slope, light * np.abs(np.sin(theta)), rtol=1e-13)


def test_what_the_place_changes_is_inside():
    """T = x: the derivative by x is the integral of |sin| over what is visible, by y none."""
    value, rate = varying(lambda at, w: at.position[0]).inside(LOW, HIGH, PHI)
    seen = Uniform().inside(LOW, HIGH, PHI)[0]
    np.testing.assert_allclose(value, 0.1 * seen, rtol=1e-13)
    np.testing.assert_allclose(rate, [seen, 0.0], rtol=1e-13, atol=1e-15)
