import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.checks.cases import light
from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE_SLOPE
from firstorder.errors import Refused
from firstorder.fields import Constant, Gaussian, Grid, covariance_of_samples
from firstorder.transport import Travel
from firstorder.transport.events.slopes import ToAngle, ToSlope, theta_D_v, v_D_theta


@pytest.mark.smoke
@given(st.floats(-1.4, 1.4))
def test_jacobians_are_inverse_to_each_other(theta):
    assert abs(theta_D_v(jnp.tan(theta)) * v_D_theta(jnp.array(theta)) - 1.0) < 1e-12


@given(st.floats(-2.0, 2.0), st.floats(-1.3, 1.3))
def test_there_and_back_is_the_identity(x, theta):
    L = light(FLATLAND)
    assert abs((ToSlope() >> ToAngle())(L)(x, theta) - L(x, theta)) < 1e-13


def test_the_frame_keeps_its_sense():
    frame = dataclasses.replace(FLATLAND, sense="outgoing")
    assert ToSlope()(light(frame)).frame == dataclasses.replace(frame, coordinates=("x", "v"))


def test_travel_in_angles_is_travel_in_slopes():
    u, L = jnp.array([0.4, 0.7]), light(FLATLAND)
    by_slopes = (ToSlope() >> Travel(1.2) >> ToAngle())(L).jet(u)
    np.testing.assert_allclose(by_slopes.hessian, Travel(1.2)(L).jet(u).hessian, rtol=1e-11)


def test_the_hessian_needs_the_bend():
    L, u = light(FLATLAND), jnp.array([0.2, 0.9])
    linear = ToSlope().linearised(jnp.array([0.2, 0.9]))(L).jet(u)
    exact = ToSlope()(L).jet(u)
    np.testing.assert_allclose(linear.gradient, exact.gradient, rtol=1e-12)
    assert np.max(np.abs(linear.hessian - exact.hessian)) > 0.1


def test_a_spectrum_is_refused_until_linearised():
    L = light(FLATLAND)
    with pytest.raises(Refused):
        ToSlope()(L.spectrum())
    same = ToSlope().linearised(jnp.zeros(2))(L.spectrum())
    assert abs(same(0.2, 0.3) - L.spectrum()(0.2, 0.3)) < 1e-15


def test_only_flatland_light_has_one_slope():
    with pytest.raises(ValueError, match="ToAngle needs light in x and v"):
        ToAngle()(Constant(1.0, SPACE_SLOPE))


def test_bandwidth_changes_with_the_square_of_the_extent():
    """D05 §4's "no significant error": a bell of deviation sigma gains sigma^2, 1 % at 0.1."""
    errors = []
    for sigma in (0.05, 0.1, 0.2):
        L = Gaussian([0.0, 0.0], np.diag([4.0, sigma**-2]), 1.0, FLATLAND_SLOPE)
        grid = Grid.spanning((32, 256), (3.5, min(8.0 * sigma, 1.5)))
        S = covariance_of_samples(grid.sample(ToAngle()(L)), grid, FLATLAND)
        errors.append(np.sqrt(S.matrix[1, 1] / L.covariance().matrix[1, 1]) - 1.0)
    assert abs(fitted_order([0.05, 0.1, 0.2], errors) - 2.0) < 0.1
    np.testing.assert_allclose(errors[-1], 0.2**2, rtol=0.03)


def test_off_the_centre_it_stretches_by_the_jacobian():
    for v0 in (0.5, 1.0):
        L = Gaussian([0.0, v0], np.diag([4.0, 0.02**-2]), 1.0, FLATLAND_SLOPE)
        grid = Grid.spanning((32, 512), (3.5, 0.2), (0.0, float(np.arctan(v0))))
        S = covariance_of_samples(grid.sample(ToAngle()(L)), grid, FLATLAND)
        ratio = np.sqrt(S.matrix[1, 1] / L.covariance().matrix[1, 1])
        np.testing.assert_allclose(ratio, 1.0 + v0**2, rtol=3e-3)
