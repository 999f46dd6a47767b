"""Warps, and what it costs to replace one by the move that touches it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.cases.laws.warp import Bend
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.errors import Refused
from firstorder.fields import Grid, covariance_of, discrete_transform, gaussian
from firstorder.laws import Map, Warp
from firstorder.transport import Travel

WARP = Warp(Bend(0.4, 0.3))
AT = jnp.array([0.2, -0.3])


def test_the_move_touches_the_warp_to_first_order():
    lin = WARP.linearise(AT)
    f = gaussian((0.3, -0.2), (0.6, 0.5), 0.3)
    moved, warped = lin.move(f).jet(AT), WARP(f).jet(AT)
    np.testing.assert_allclose(moved.value, warped.value, rtol=1e-13)
    np.testing.assert_allclose(moved.gradient, warped.gradient, rtol=0.0, atol=1e-13)
    assert np.max(np.abs(moved.hessian - warped.hessian)) > 0.01


@pytest.mark.parametrize("warp", [WARP, Travel(1.3).law(gaussian((0, 0), (1, 1)).frame)])
def test_the_displacement_falls_as_the_radius_squared(warp):
    radii = np.array([0.1, 0.05, 0.025, 0.0125])
    found = [warp.linearise(AT, r).displacement for r in radii]
    np.testing.assert_allclose(fitted_order(radii, found), 2.0, rtol=0.0, atol=0.1)


class Bowl(Map):
    """The second coordinate rises by the square of a linear form."""

    form: jax.Array

    def __call__(self, u):
        return u.at[1].add(jnp.sum(self.form * u) ** 2)


@pytest.mark.parametrize("form", [(1.0, 0.0), (0.0, 1.0), (0.6, 0.6), (0.6, -0.6)])
def test_the_displacement_is_the_largest_of_all_directions(form):
    """A radius r away along the form it is `|form|^2 r^2`."""
    found = Warp(Bowl(jnp.array(form))).linearise(AT, 0.2).displacement
    np.testing.assert_allclose(found, 0.04 * np.sum(np.square(form)), rtol=1e-12)


def _images(size: float):
    """A bell of this size about T(AT): its warped samples, and the linearised law's portraits."""
    f = gaussian(WARP.map(AT), (size, 0.8 * size), 0.3)
    move = WARP.linearise(AT).move
    grid = Grid.spanning((64, 64), (9.0 * size, 9.0 * size), (0.2, -0.3))
    Omega = np.array([-0.15, 0.1]) / size
    warped = WARP(f)
    found = discrete_transform(eqx.filter_jit(grid.sample)(warped), grid, Omega, Omega)
    sigma = eqx.filter_jit(lambda g: covariance_of(g, grid).matrix)(warped)
    ours = move(f.spectrum())(Omega[:, None], Omega)
    return normwise(ours, found), normwise(move(f.covariance()).matrix, sigma)


def test_spectrum_and_covariance_pass_through_the_linearised_warp():
    """Their error falls with the size of the light: to first order the spectrum's, to second the
    covariance's, in which odd errors cancel."""
    sizes = np.array([0.04, 0.02, 0.01])
    spectra, covariances = np.array([_images(float(s)) for s in sizes]).T
    assert spectra[-1] < 0.01
    np.testing.assert_allclose(fitted_order(sizes, spectra), 1.0, rtol=0.0, atol=0.15)
    np.testing.assert_allclose(fitted_order(sizes, covariances), 2.0, rtol=0.0, atol=0.15)


def test_what_has_no_formula_says_so():
    f = gaussian((0.0, 0.0), (1.0, 1.0))
    for portrait in (f.spectrum(), f.covariance()):
        with pytest.raises(Refused, match="warp has no") as caught:
            WARP(portrait)
        assert "`event.linearised(ray)`" in caught.value.__notes__[0]


def test_the_edge_of_a_warped_mask_warps():
    from firstorder.fields import half_plane

    (edge,) = WARP(half_plane(0.1)).edges()
    crossing = edge.crossing(jnp.array([0.0, 0.0]), 0, jnp.array(-2.0), jnp.array(2.0))
    np.testing.assert_allclose(crossing.value, 0.1, rtol=0.0, atol=1e-12)  # x + a sin(0) = 0.1
    slope = jax.jit(jax.grad(lambda t: edge.crossing(
        jnp.stack([0.0, t]), 0, jnp.array(-2.0), jnp.array(2.0)).value))(0.0)  # fmt: skip
    np.testing.assert_allclose(crossing.gradient, [0.0, -0.4], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(slope, -0.4, rtol=0.0, atol=1e-12)


def test_a_radius_that_is_none_is_refused():
    with pytest.raises(ValueError, match="Argument `radius` must be positive"):
        WARP.linearise(AT, 0.0)


def test_a_plain_function_is_no_map():
    with pytest.raises(
        TypeError, match=r"`map` must be a `Map`, .* but is a function|violates type hint"
    ):
        Warp(lambda u: u)  # pyright: ignore[reportArgumentType]
