import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND_SLOPE, SPACE
from firstorder.fields import Constant, GaussianProfile, Grid, autodiff_jet, gaussian
from firstorder.fields._series import Series
from firstorder.laws import Circle, Convolve, Integrate
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.transport import ClampedCosine, Cosine, Curvature, clamped_cosine_transform


def synthesis(series: Series, theta):
    phases = np.exp(2j * np.pi * np.asarray(series.frequencies)[:, 1] * theta)
    return np.sum(np.asarray(series.coefficients) * phases)


def test_transform_is_smooth_through_its_removable_pole():
    pole = 0.5 / np.pi
    assert float(clamped_cosine_transform(pole)) == pytest.approx(0.5 * np.pi, rel=1e-15)
    beside = jax.vmap(jax.grad(clamped_cosine_transform))(pole + jnp.array([-1e-7, 0.0, 1e-7]))
    assert np.all(np.isfinite(beside))
    assert np.ptp(np.asarray(beside)) < 1e-5
    assert clamped_cosine_transform(jnp.float32(pole)).dtype == jnp.float32


def test_series_on_a_window_gives_the_cosine_back():
    series = ClampedCosine().series(Grid.spanning((4, 4096), (1.0, 3.0), (0.0, 0.4)))
    for theta in (0.0, 1.2, -0.9, 2.0):
        assert synthesis(series, theta) == pytest.approx(max(np.cos(theta), 0.0), abs=1e-5)


def test_a_window_that_cuts_the_hump_is_integrated_piece_by_piece():
    window = Grid.spanning((4, 64), (1.0, 0.8), (0.0, 1.1))  # from 0.3 to 1.9
    series = ClampedCosine().series(window)
    true = quad(lambda t: np.cos(t) * np.cos(2 * np.pi * t / 1.6), 0.3, np.pi / 2)[0] / 1.6
    one = np.isclose(np.asarray(series.frequencies)[:, 1], 1 / 1.6)
    assert np.asarray(series.coefficients)[one][0].real == pytest.approx(true, abs=1e-12)


@pytest.mark.parametrize("angle", [2.0, -3.0])
def test_it_is_zero_with_its_derivatives_behind_the_surface(angle):
    assert [float(a) for a in ClampedCosine().derivatives(jnp.array(angle))] == [0.0, 0.0, 0.0]


def test_on_the_circle_it_repeats_and_has_the_fourier_coefficients_of_the_transform():
    circle = ClampedCosine(periodic=True)
    turned = circle(0.0, jnp.array([0.3, 2.0]) + 4 * jnp.pi)
    np.testing.assert_allclose(turned, [np.cos(0.3), 0.0], rtol=0.0, atol=1e-14)
    series = circle.series(Grid.spanning((2, 16), (1.0, np.pi)))
    m = np.asarray(series.frequencies)[:, 1] * 2 * np.pi
    wanted = np.asarray(clamped_cosine_transform(m / (2 * np.pi))) / (2 * np.pi)
    np.testing.assert_allclose(series.coefficients, wanted, rtol=0.0, atol=1e-14)


class VonMises(GaussianProfile):
    """A lobe of period 2 pi."""

    def derivatives(self, t):
        p = jnp.exp(2.0 * (jnp.cos(t) - 1.0))
        return p, -2.0 * jnp.sin(t) * p, (4.0 * jnp.sin(t) ** 2 - 2.0 * jnp.cos(t)) * p


def test_blur_over_the_circle_splits_at_both_horizons_wherever_the_turn_begins():
    blur = Convolve(VonMises(1.0), Circle(), nodes=24)(ClampedCosine(periodic=True))
    angles = np.array([0.2, 2.9, -1.5, 7.0])
    nodes, weights = gauss_legendre(48)
    s = 0.5 * np.pi * nodes
    lobe = np.exp(2.0 * (np.cos(angles[:, None] - s) - 1.0))
    true = (lobe * np.cos(s)) @ weights * 0.5 * np.pi
    assert normwise(blur(0.0, angles), true) < 1e-11


def test_hessian_of_irradiance_knows_the_kink():
    """Second derivative of E(x) = int e(theta + k x) cos+(theta): the horizons' slopes count."""
    kappa = 0.7
    L = gaussian((0.2, 0.9), (0.8, 0.5), 0.3)
    E = Integrate("theta", -3.0, 3.0, 48)(
        (Curvature(kappa) >> Cosine() >> Curvature(kappa, back=True))(L)
    )
    u = jnp.array([0.4])
    closed = eqx.filter_jit(lambda f: f.jet(u))(E)
    oracle = eqx.filter_jit(lambda f: autodiff_jet(f.at, u, f.frame))(E)
    assert float(closed.hessian[0, 0]) == pytest.approx(float(oracle.hessian[0, 0]), rel=1e-10)

    def by_quadrature(x):
        n = kappa * x
        nodes, weights = gauss_legendre(64)
        lower, upper = n - np.pi / 2, min(3.0, n + np.pi / 2)
        a = lower + 0.5 * (upper - lower) * (nodes + 1.0)
        inside = np.asarray(L(x, a)) * np.cos(a - n) * weights
        return float(np.sum(inside)) * 0.5 * (upper - lower)

    h = 1e-2
    second = (by_quadrature(0.4 + h) - 2 * by_quadrature(0.4) + by_quadrature(0.4 - h)) / h**2
    assert float(closed.hessian[0, 0]) == pytest.approx(second, rel=1e-3)


def test_in_space_it_depends_on_the_angle_in_the_plane_of_incidence():
    assert Cosine()(Constant(2.0, SPACE))(
        0.0, 0.0, 1.0471975511965976, 0.5
    ).item() == pytest.approx(1.0)


def test_slopes_are_refused():
    with pytest.raises(ValueError, match="needs the angle theta"):
        Cosine()(gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE))


@pytest.mark.smoke
def test_cosine_runs_without_windows_and_on_the_horizon():
    jet = Cosine()(gaussian((0.0, 0.0), (1.0, 1.0))).jet(jnp.array([0.0, 0.5 * np.pi]))
    assert np.all(np.isfinite(jet.hessian))


@pytest.mark.smoke
@pytest.mark.parametrize("axis", [1j, None, ("theta",)])
def test_an_axis_is_a_name(axis):
    with pytest.raises(TypeError, match=r"`axis` must be the name of an angle, but is|type hint"):
        Cosine(axis=axis)
