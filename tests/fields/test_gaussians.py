import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.checks.tolerance import normwise
from firstorder.conventions import Frame
from firstorder.fields import Gaussian, Grid, discrete_transform, gaussian

GRID = Grid.spanning((72, 73), (5.0, 4.5))


@jax.jit
def spectra(center, sigma, correlation):
    """Closed form and transform of samples, and the covariance of its sampled power."""
    f = gaussian(center, sigma, correlation)
    Omega = jnp.array([-0.3, 0.2]), jnp.array([0.1, 0.5])
    ours = f.spectrum()(*jnp.meshgrid(*Omega, indexing="ij"))
    return ours, discrete_transform(GRID.sample(f), GRID, *Omega)


@given(
    st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
    st.tuples(st.floats(0.4, 0.6), st.floats(0.4, 0.6)),
    st.floats(-0.6, 0.6),
)
def test_the_spectrum_holds_for_any_place_and_tilt(center, sigma, correlation):
    ours, truth = spectra(jnp.array(center), jnp.array(sigma), correlation)
    assert normwise(ours, truth) < 1e-9


def test_derivatives_are_those_of_the_bell_about_its_centre():
    P, c, u = np.array([[3.0, 0.8], [0.8, 2.0]]), np.array([0.4, -0.7]), np.array([0.1, 0.2])
    jet = Gaussian(c, P, 1.7).jet(jnp.asarray(u))
    slope = P @ (c - u)
    value = 1.7 * np.exp(-0.5 * (u - c) @ P @ (u - c))
    np.testing.assert_allclose(jet.value, value, rtol=1e-14)
    np.testing.assert_allclose(jet.gradient, value * slope, rtol=1e-14)
    np.testing.assert_allclose(jet.hessian, value * (np.outer(slope, slope) - P), rtol=1e-14)


@pytest.mark.parametrize(
    ("precision", "far"), [("float32", 3e19), ("float32", 1e30), ("float64", 1e160)]
)
def test_far_away_there_is_no_light_and_no_slope(precision, far):
    """The Hessian was NaN there."""
    with jax.enable_x64(precision == "float64"):
        L = gaussian((0.1, -0.05), (0.5, 0.3))
        assert L.precision.dtype == precision
        for u in far * jnp.array([[1.0, 0.0], [1.0, 1.0], [-0.5, 1.0], [1e-10, -1.0]]):
            found = L.at(u), L.jet(u), jax.grad(L.at)(u), jax.hessian(L.at)(u)
            for part in jax.tree.leaves(found):
                np.testing.assert_array_equal(part, 0.0)


def of_unit(metre, precision, order):
    """A bell over two positions and two angles, and its spectrum per area, at the same places."""
    P = np.diag([2.0, 1.0, 1.5, 0.8])
    P[np.triu_indices(4, 1)] = 0.3, 0.9, 0.2, -0.1, 0.5, 0.4
    P = np.triu(P) + np.triu(P, 1).T
    units = np.array([metre, metre, 1.0, 1.0])[order]
    frame = Frame(tuple(np.array(["x", "y", "theta", "phi"])[order].tolist()))
    L = Gaussian(
        jnp.zeros(4, precision), jnp.asarray(P / units / units[:, None], precision), 1.0, frame
    )
    value = L(*(0.3 * units).astype(precision))
    return value, L.spectrum()(*(0.1 / units).astype(precision)) / metre**2


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("order", [[0, 1, 2, 3], [2, 3, 0, 1]])
def test_a_bell_may_be_of_any_unit_of_length(precision, order):
    """A wide one was refused."""
    with jax.enable_x64(precision == "float64"):
        truth = of_unit(1.0, precision, order)
        far = 30 if precision == "float64" else 15  # determinants must stay within the range
        for metre in (2.0**-far, 2.0**far):
            found = of_unit(metre, precision, order)
            eps = jnp.finfo(precision).eps
            np.testing.assert_allclose(found[0], truth[0], rtol=16 * eps)
            # The spectrum is made of an inverse, whose rows have other units.
            np.testing.assert_allclose(found[1], truth[1], rtol=64 * eps)


def test_standard_deviations_and_correlation_are_those_of_the_bell():
    f = gaussian((0.21, -0.13), (0.55, 0.4), 0.35, 2.0)
    grid = Grid.spanning((101, 102), (4.5, 4.0))
    weight = np.asarray(grid.sample(f))
    weight, points = weight / weight.sum(), grid.points()
    mean = np.einsum("ij,ijk->k", weight, points)
    spread = np.einsum("ij,ijk,ijl->kl", weight, points - mean, points - mean)
    np.testing.assert_allclose(mean, [0.21, -0.13], rtol=0.0, atol=1e-12)
    off = 0.35 * 0.55 * 0.4
    np.testing.assert_allclose(spread, [[0.55**2, off], [off, 0.4**2]], rtol=0.0, atol=1e-12)
    assert float(f(0.21, -0.13)) == 2.0


def test_differentiable_in_its_parameters():
    def value(sigma, correlation):
        return gaussian((0.2, -0.1), sigma, correlation).at(jnp.array([0.5, 0.3]))

    sigma = jnp.array([0.5, 0.4])
    slopes = jax.grad(value, argnums=(0, 1))(sigma, 0.3)
    for k in range(2):
        h = jnp.zeros(2).at[k].set(1e-6)
        difference = (value(sigma + h, 0.3) - value(sigma - h, 0.3)) / 2e-6
        assert float(slopes[0][k]) == pytest.approx(float(difference), rel=1e-7)
    difference = (value(sigma, 0.3 + 1e-6) - value(sigma, 0.3 - 1e-6)) / 2e-6
    assert float(slopes[1]) == pytest.approx(float(difference), rel=1e-7)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gaussian((0, 0), (0.0, 1.0)), "`sigma` must be positive, but is 0.0"),
        (lambda: gaussian((0, 0), (1.0, -2.0)), "`sigma` must be positive, but is -2.0"),
        (lambda: gaussian((0, 0), (1.0, np.nan)), "`sigma` must be positive, but is nan"),
        (lambda: gaussian((0, 0), (1.0, 1.0), 1.0), "`correlation` must lie in"),
        (lambda: gaussian((0, 0), (1.0, 1.0), -1.5), "`correlation` must lie in"),
        (lambda: gaussian((np.nan, 0), (1.0, 1.0)), "`center` must be finite, but is nan"),
        (lambda: gaussian((0, 0), (1.0, 1.0), 0.0, np.inf), "`amplitude` must be finite"),
        (lambda: gaussian((0, 0, 0), (1.0, 1.0)), r"`center` must have shape \(2,\)"),
        (lambda: gaussian((0, 0), (1.0, 1.0, 1.0)), r"`sigma` must have shape \(2,\)"),
        (lambda: Gaussian([0, 0], [[1.0, 0.2], [0.1, 1.0]]), "`precision` must be symmetric"),
        (lambda: Gaussian([0, 0], [[1.0, 2.0], [2.0, 1.0]]), "`precision` must be symmetric"),
        (lambda: Gaussian([0, 0], [[1e-18, 9e-18], [0.0, 1e-18]]), "`precision` must be symmetric"),
        (lambda: Gaussian([0, 0], np.eye(3)), r"`precision` must have shape \(2, 2\)"),
        (lambda: Gaussian([0, 0], np.full((2, 2), np.nan)), "`precision` must be finite"),
    ],
)
def test_bad_input(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("bad", [[1.0, -0.5], [-1.0, -0.5], [0.0, 1.0]])
def test_a_traced_precision_that_is_not_positive_makes_no_bell(bad):
    value = jax.jit(lambda d: Gaussian(jnp.zeros(2), jnp.diag(d))(0.1, 0.2))
    assert np.isnan(value(jnp.array(bad)))
    assert value(jnp.ones(2)) > 0.9
