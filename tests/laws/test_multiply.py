import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import erf

from firstorder.checks.cases import light
from firstorder.conventions import FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import (
    Constant,
    Function,
    Grid,
    SampledSpectrum,
    Spectrum,
    Wavelet,
    gaussian,
    half_plane,
)
from firstorder.laws import Multiply

WINDOW = Grid.spanning((256, 256), (6.0, 6.0))


class Dim(Spectrum):
    """Half of another spectrum, by somebody who does not say where the light lies."""

    whole: Spectrum

    @property
    def frame(self):
        return self.whole.frame

    def at(self, Omega):
        return 0.5 * self.whole.at(Omega)


@pytest.mark.parametrize("far", [0.0, 7.0])
@pytest.mark.parametrize("windowed", [False, True])
def test_the_spectrum_behind_an_edge_is_that_of_the_error_function(far, windowed):
    """At Omega = (0, 0): what a half-plane leaves of a bell. Sharper than samples can tell."""
    f = gaussian((0.21 + far, -0.13), (0.55, 0.4), 0.35, 1.3)
    dark, edge = 0.3, 0.25 + far
    window = Grid.spanning((256, 256), (6.0, 6.0), (far, 0.0)) if windowed else None
    total = f.spectrum().at(jnp.zeros(2)).real
    behind = Multiply(half_plane(edge, dark), window)(f.spectrum()).at(jnp.zeros(2))
    below = 0.5 * (1.0 + erf((0.25 - 0.21) / (0.55 * np.sqrt(2.0))))
    np.testing.assert_allclose(behind, total * (dark * below + 1.0 - below), rtol=1e-11)


def test_a_window_of_eight_keeps_four_waves_of_an_edge_on_each_side():
    """Of a step the k-th is `1 / (i pi k)`, k odd."""
    F = gaussian((0.2, -0.1), (0.5, 0.4), 0.3).spectrum()
    k = np.array([-3, -1, 1, 3])
    waves, shifted = np.append(1.0 / (1j * np.pi * k), 0.5), 0.4 - np.append(k, 0) / 12.0
    behind = Multiply(half_plane(0.0), Grid.spanning((8, 1), (6.0, 6.0)))
    found, parts = jax.jit(lambda: (behind(F)(0.4, -0.2), F(shifted, -0.2)))()
    np.testing.assert_allclose(found, waves @ parts, rtol=1e-12)


def test_factors_commute():
    f, g = light(), gaussian((-0.3, 0.2), (0.7, 0.9), -0.4)
    u = jnp.array([0.2, 0.1])
    jax.tree.map(
        lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-14),
        Multiply(g)(f).jet(u),
        Multiply(f)(g).jet(u),
    )


def test_the_jump_of_a_product_with_two_edges_on_one_curve():
    mask = half_plane(0.1, 0.2, 1.0)
    twice = Multiply(mask)(Multiply(mask)(light()))
    jump = sum(e.jump.at(jnp.array([0.1, 0.0])) for e in twice.edges())
    np.testing.assert_allclose(jump, (1.0 - 0.04) * light().at(jnp.array([0.1, 0.0])), rtol=1e-12)


def test_without_a_window_a_spectrum_takes_one_that_holds_the_light():
    F, mask = light().spectrum(), half_plane(0.2, 0.3)
    ours, wide = (Multiply(mask, w)(F)(0.4, -0.2) for w in (None, WINDOW))
    assert abs(ours - wide) < 1e-14


def test_a_factor_of_all_coordinates_needs_a_window_of_its_own():
    with pytest.raises(Refused, match=r"^multiply convolves .* 65536 waves .*: give it one$"):
        Multiply(Function(lambda x, theta: x * theta))(light().spectrum())


def test_light_of_unknown_extent_needs_a_window():
    with pytest.raises(Refused, match="the extent of this light is not known: give it one"):
        Multiply(half_plane(0.0))(Dim(light().spectrum()))


def test_on_a_window_light_of_unknown_extent_is_multiplied_too():
    F, g = light().spectrum(), gaussian((-0.3, 0.2), (0.7, 0.9), -0.4)
    window = Grid.spanning((96, 96), (6.0, 6.0))
    dim, whole = (Multiply(g, window)(f)(0.4, -0.2) for f in (Dim(F), F))
    np.testing.assert_allclose(dim, 0.5 * whole, rtol=1e-13)
    truth = SampledSpectrum.of(Multiply(g)(light()), window)(0.4, -0.2)
    np.testing.assert_allclose(whole, truth, rtol=1e-10)


def test_the_waves_of_a_product_add_up_to_it():
    f = Function(lambda x, theta: 1.0 + jnp.cos(0.5 * np.pi * x))
    g = Function(lambda x, theta: jnp.sin(0.5 * np.pi * theta) - 0.5 * jnp.sin(np.pi * x))
    series = jax.jit(lambda: Multiply(g)(f).series(Grid((8, 8), (0.5, 0.5))))()
    u = jnp.array([0.3, -0.7])
    waves = jnp.exp(2j * np.pi * series.frequencies @ u)
    np.testing.assert_allclose(waves @ series.coefficients, f.at(u) * g.at(u), rtol=0.0, atol=1e-12)


def test_an_edge_has_no_covariance():
    with pytest.raises(Refused, match="an edge has no finite covariance"):
        Multiply(half_plane(0.0))(light().covariance())


@pytest.mark.parametrize("size", [(4, 8), (8, 4)])
def test_wavelets_of_a_product_are_those_of_the_product_of_samples(size):
    f, g, grid = light(), gaussian((-0.3, 0.2), (0.7, 0.9), -0.4), Grid.spanning(size, (1.5, 1.0))
    product = Multiply(g).wavelet(Wavelet.of(f, grid))
    true = np.asarray(grid.sample(f)) * np.asarray(grid.sample(g))
    np.testing.assert_allclose(product.samples(), true, rtol=0.0, atol=1e-12)


def test_covariances_add():
    """Second moments of power spectra: precisions of bells add, over 8 pi^2."""
    f, g = light(), gaussian((-0.3, 0.2), (0.7, 0.9), -0.4)

    def precision(h):
        return -jax.hessian(lambda u: jnp.log(h.at(u)))(jnp.zeros(2)) / (8.0 * jnp.pi**2)

    S = Multiply(g).covariance(f.covariance())
    np.testing.assert_allclose(S.matrix, precision(Multiply(g)(f)), rtol=1e-12)


@pytest.mark.parametrize("names", [("theta", "x"), ("x", "v"), ("x",)])
def test_a_factor_over_other_coordinates_is_refused(names):
    """It once was read in the order in which its coordinates stand."""
    light = gaussian((0.0, 0.0), (1.0, 1.0))
    factor = Constant(2.0, Frame(names))
    with pytest.raises(ValueError, match=r"^Argument `factor` of multiply must be over \('x', 't"):
        Multiply(factor)(light)
    with pytest.raises(ValueError, match=r"^Argument `factor` of multiply must be over \('x', 't"):
        Multiply(factor, Grid.spanning((4, 4), (9.0, 9.0)))(light.spectrum())


def test_a_factor_without_a_stated_frame_takes_that_of_the_light():
    light = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
    dimmed = Multiply(lambda x, v: 0.5 + 0.0 * v)(light)
    assert dimmed.law.factor.frame == FLATLAND_SLOPE
    assert dimmed(0.0, 0.0).item() == 0.5
