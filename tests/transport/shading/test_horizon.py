"""Light from above the line: what is below is zero, and no NaN comes through."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Affine, Constant, Function, HalfPlane, gaussian
from firstorder.laws import Integrate
from firstorder.transport.events.slopes import ToAngle
from firstorder.transport.shading._horizon import AboveLine

BELOW = jnp.array([[0.2, 1.6], [0.0, -2.0], [0.1, 4.0]])
LIGHT = gaussian((0.2, -0.1), (1.0, 0.5), 0.3)
HALF = Function(lambda x, theta: jnp.exp(x) * jnp.sqrt(0.5 * np.pi - jnp.abs(theta)))


def test_above_it_is_the_light_and_below_it_is_none():
    u = jnp.array([0.3, 0.4])
    here, there = AboveLine(LIGHT).jet(u), LIGHT.jet(u)
    for ours, plain in zip(jax.tree.leaves(here), jax.tree.leaves(there), strict=True):
        assert np.array_equal(ours, plain)
    for u in BELOW:
        assert not any(np.any(a) for a in jax.tree.leaves(AboveLine(LIGHT).jet(u)))


def test_nan_below_the_line_reaches_neither_values_nor_derivatives():
    assert np.isnan(HALF.at(BELOW[0]))
    lit = AboveLine(HALF)
    for u in BELOW:
        assert lit.at(u) == 0.0
        assert np.array_equal(jax.grad(lit.at)(u), [0.0, 0.0])


def test_the_horizons_are_edges_and_the_lights_own_are_kept():
    assert len(AboveLine(LIGHT).edges()) == 2
    cut = HalfPlane(Affine(jnp.array([1.0, 0.5]), 0.1), 0.0, 1.0)
    kept, *horizons = AboveLine(cut).edges()
    assert len(horizons) == 2
    assert isinstance(kept.jump, AboveLine)
    for edge, theta in zip(horizons, (0.5 * np.pi, -0.5 * np.pi), strict=True):
        assert edge.level.at(jnp.array([0.7, theta])) == pytest.approx(0.0, abs=1e-14)


def test_an_edge_that_came_through_slopes_is_met_by_an_integral_over_all_directions():
    """A blocker one metre up leaves the sky from the horizon to `arctan(x)`."""
    shadowed = ToAngle()(HalfPlane(Affine([1.0, -1.0], 0.0, FLATLAND_SLOPE), 0.0, 1.0))
    lit = Integrate("theta", -3.0, 3.0, 8)(AboveLine(shadowed)).jet(jnp.array([0.3]))
    assert lit.value == pytest.approx(0.5 * np.pi + np.arctan(0.3), rel=1e-12)
    assert lit.gradient[0] == pytest.approx(1.0 / (1.0 + 0.3**2), rel=1e-6)


def test_other_coordinates_are_refused():
    with pytest.raises(ValueError, match="`light` must be over"):
        AboveLine(Constant(1.0, FLATLAND_SLOPE))
