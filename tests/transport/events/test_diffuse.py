import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import k1

from firstorder.checks.cases import bell, light
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE_SLOPE
from firstorder.fields import (
    Constant,
    Gaussian,
    Grid,
    autodiff_jet,
    covariance_of,
    discrete_transform,
)
from firstorder.transport import Travel, half_plane_blocker
from firstorder.transport.events.diffuse import (
    DifferentialIrradiance,
    Gather,
    SlopeWeight,
    bessel_zk1,
    diffuse,
)

WINDOW = Grid.spanning((96, 128), (6.0, 4.0))


@pytest.mark.smoke
@given(st.floats(1e-9, 100.0))
def test_bessel_agrees_with_scipy(z):
    assert abs(bessel_zk1(jnp.array(z**2)) / (z * k1(z)) - 1.0) < 1e-12


def test_bessel_at_zero():
    assert abs(bessel_zk1(jnp.array(0.0)) - 1.0) < 1e-15
    assert jax.grad(lambda z: bessel_zk1(z**2))(0.0) == 0.0
    assert np.isfinite(jax.grad(bessel_zk1)(0.0))  # diverges as log(z): large, not infinite
    single = bessel_zk1(jnp.array(1.0, jnp.float32))
    assert single.dtype == jnp.float32
    assert abs(float(single) - k1(1.0)) < 1e-6


@pytest.mark.parametrize(("frame", "m"), [(FLATLAND_SLOPE, 1), (SPACE_SLOPE, 2)])
def test_the_weights_transform_is_the_integral_of_its_waves(frame, m):
    """In space the sum across the waves comes first, int (1 + v^2 + w^2)^-2 dw."""
    across, along = {1: (1.0, jnp.ones(1)), 2: (0.5 * np.pi, jnp.array([0.6, -0.8]))}[m]
    for f in (0.03, 0.3, 1.1):
        waves = {"weight": "cos", "wvar": 2.0 * np.pi * f, "epsabs": 1e-13}
        half = across * quad(lambda v: (1.0 + v * v) ** -1.5, 0.0, np.inf, **waves)[0]
        found = SlopeWeight(frame, 1.7).transform(f * along)
        np.testing.assert_allclose(found, 1.7 * 2.0 * half, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("frame", [FLATLAND_SLOPE, SPACE_SLOPE])
def test_the_weights_jet(frame):
    u = jnp.array([0.3, -0.2, 0.7, -1.1][: frame.dims])
    g = SlopeWeight(frame, 1.7)
    ours, true = g.jet(u), autodiff_jet(g.at, u, frame)
    np.testing.assert_allclose(ours.gradient, true.gradient, rtol=1e-14)
    np.testing.assert_allclose(ours.hessian, true.hessian, rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize(
    ("frame", "half"), [(FLATLAND_SLOPE, (0.5, 300.0)), (SPACE_SLOPE, (0.5, 0.5, 60.0, 60.0))]
)
def test_the_weights_covariance(frame, half):
    size = (1, 6000) if frame.dims == 2 else (1, 1, 600, 600)
    measured = covariance_of(SlopeWeight(frame), Grid.spanning(size, half))
    np.testing.assert_allclose(
        SlopeWeight(frame).covariance().matrix, measured.matrix, rtol=0.0, atol=1e-5
    )


def test_the_weights_series_is_exact_on_the_window():
    """It has a kink at the border, so it converges as 1 / k^2; inside, its sum is the weight."""
    window = Grid.spanning((8, 1000), (1.0, 3.0), (0.0, 0.5))
    series = SlopeWeight().series(window)
    v = np.linspace(-1.5, 2.5, 9)
    waves = np.exp(2j * np.pi * v[:, None] * np.asarray(series.frequencies)[:, 1])
    np.testing.assert_allclose(
        waves @ series.coefficients, SlopeWeight()(0.0, v), rtol=0.0, atol=1e-3
    )


def test_angles_need_no_slope_weight():
    with pytest.raises(ValueError, match="must name one or two slopes"):
        SlopeWeight(FLATLAND)
    with pytest.raises(TypeError, match=r"Argument `frame` must be a `Frame`|type hint"):
        SlopeWeight("v")


@pytest.mark.smoke
def test_a_white_furnace():
    """Albedo 1 is rho = 1 / 2 in flatland and 1 / pi in space: what comes in goes out."""
    reach = 10.0
    flat = diffuse(0.5, reach, nodes=300)(Constant(1.3, FLATLAND_SLOPE))
    inside = np.sin(np.arctan(reach))  # share of the irradiance from slopes below the reach
    assert abs(flat(0.2) - 1.3 * inside) < 1e-12
    step = diffuse(1.0 / np.pi, reach, nodes=200, axes=("v", "w"))
    space = eqx.filter_jit(step(Constant(1.3, SPACE_SLOPE)).at)(jnp.array([0.2, 0.1]))
    # A square of slopes holds the disc of radius `reach`, and lies in one of sqrt(2) reach.
    disc = [np.sin(np.arctan(r)) ** 2 for r in (reach, np.sqrt(2.0) * reach)]
    assert 1.3 * disc[0] < space < 1.3 * disc[1]


def test_it_is_the_sum_over_angles():
    seen = eqx.filter_jit(diffuse(0.7, 4.0)(light(FLATLAND_SLOPE)))
    for x in (-0.5, 0.4):
        truth = quad(lambda a, x=x: np.cos(a) * bell(x, np.tan(a)), -1.32, 1.32, epsabs=1e-12)[0]
        assert abs(seen(x) - 0.7 * truth) < 1e-9


def test_shadow_boundary_terms():
    """Half-plane, travel, diffuse: gradient and Hessian by differences of adaptive quadrature."""
    edge, d, h = 0.1, 1.3, 1e-3
    path = light(FLATLAND_SLOPE) >> half_plane_blocker(edge, FLATLAND_SLOPE) >> Travel(d)
    jet = eqx.filter_jit((path >> diffuse(1.0, 4.0)).light.jet)(jnp.array([0.3]))

    def irradiance(x):
        # Lit where x - d tan(a) > edge.
        last = np.arctan((x - edge) / d)
        return quad(
            lambda a: np.cos(a) * bell(x - d * np.tan(a), np.tan(a)),
            np.arctan(-4.0),
            last,
            epsabs=1e-14,
            epsrel=1e-14,
        )[0]

    E = [irradiance(0.3 + k * h) for k in (-2, -1, 0, 1, 2)]
    first = (E[0] - 8 * E[1] + 8 * E[3] - E[4]) / (12 * h)
    second = (-E[0] + 16 * E[1] - 30 * E[2] + 16 * E[3] - E[4]) / (12 * h**2)
    np.testing.assert_allclose(jet.gradient[0], first, rtol=1e-8)
    np.testing.assert_allclose(jet.hessian[0, 0], second, rtol=1e-6)


def test_in_space_spectrum_and_sum():
    P = np.array(
        [[3.0, 0.4, 0.7, -0.2], [0.4, 2.7, 0.2, 0.6], [0.7, 0.2, 9.0, 0.3], [-0.2, 0.6, 0.3, 8.0]]
    )
    L = Gaussian(np.array([0.1, -0.1, 0.2, 0.05]), P, 1.0, SPACE_SLOPE)
    window = Grid.spanning((8, 8, 30, 30), (4.0, 4.0, 2.8, 2.8))
    step = diffuse(0.3, 2.8, window, 40, ("v", "w"))
    grid = Grid.spanning((24, 25), (4.2, 4.2))
    samples = eqx.filter_jit(grid.sample)(step(L))
    W = (np.array([-0.2, 0.1]), np.array([0.0, 0.15, 0.3]))
    truth = discrete_transform(samples, grid, *W)
    ours = eqx.filter_jit(step(L.spectrum()))(*np.meshgrid(*W, indexing="ij"))
    np.testing.assert_allclose(ours, truth, rtol=0.0, atol=1e-9 * np.max(np.abs(truth)))


def test_a_dimmer_surface_reflects_less():
    with pytest.raises(ValueError, match="Argument `rho` must not be negative"):
        DifferentialIrradiance(-0.1)
    with pytest.raises(ValueError, match="Argument `reach` must be positive"):
        Gather(reach=0.0)
    L = light(FLATLAND_SLOPE)
    assert np.isnan(jax.jit(lambda r: DifferentialIrradiance(r)(L)(0.0, 0.0))(-1.0))
    with pytest.raises(ValueError, match="incoming light in slopes"):
        diffuse()(light(FLATLAND))


def test_without_a_window_the_spectrum_takes_one_that_holds_the_light():
    F, window = light(FLATLAND_SLOPE).spectrum(), Grid.spanning((8, 256), (6.0, 6.0))
    ours, wide = (DifferentialIrradiance(0.5, w)(F)(0.3, 0.2) for w in (None, window))
    assert abs(ours - wide) < 1e-13


def test_the_blur_is_small_only_for_wide_spectra():
    """D05 §3.3: the weight blurs by a fixed width, half height at 0.2 cycles per unit slope."""
    for sigma, share in ((0.1, 0.02), (1.0, 0.5)):
        L = Gaussian([0.0, 0.0], np.diag([4.0, sigma**-2]), 1.0, FLATLAND_SLOPE)
        window = Grid.spanning((8, 256), (2.0, max(8.0 * sigma, 2.0)))
        dE = DifferentialIrradiance(1.0, window)(L.covariance()).matrix[1, 1]
        change = dE / L.covariance().matrix[1, 1] - 1.0
        assert (change < share) if share < 0.1 else (change > share)


def test_traced_slopes_that_are_no_interval_give_nan():
    look = jax.jit(lambda reach: Gather(reach=reach)(light(FLATLAND_SLOPE))(0.1))
    assert np.isnan(look(-8.0))
    assert np.isnan(look(0.0))
    assert np.isfinite(look(8.0))
