import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.transport.chain4d import _space_tracer as tracer
from derivations.transport.chain4d import chain as derived
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import SPACE_SLOPE
from firstorder.errors import Refused
from firstorder.fields import Gaussian, Grid, covariance_of_samples, discrete_transform
from firstorder.transport import GlossyPatch
from firstorder.transport.chain4d._equator import ComposedMove, ToEquator

S = np.array([[-0.5, 0.13], [0.13, 0.3]])
CENTER = np.array([0.02, -0.03, 0.01, 0.02])
SPREAD = np.diag([0.1, 0.12, 0.08, 0.1]) ** 2
ROUNDED = GlossyPatch(jnp.asarray(S), 0.7, 0.06, -0.62, 0.1, 0.4)


def light():
    return Gaussian(CENTER, np.linalg.inv(SPREAD), 1.0, SPACE_SLOPE)


def test_the_mirror_matrix_is_that_of_traced_rays():
    assert derived.by_tracing() < 1e-10


def test_misses_are_of_second_order_and_less_with_exact_steps():
    """Against rays off the paraboloid: the exact steps miss only how the surface sags."""
    patch = GlossyPatch(jnp.asarray(S), 0.7, roll=0.4)
    exact, M = jax.jit(derived.exact_map(patch)), np.asarray(patch.mirror_matrix())
    sizes, first, whole = np.array([0.02, 0.04, 0.08]), [], []
    for h in sizes:
        u = h * np.array([0.5, -0.6, 0.4, 0.3])
        traced = tracer.reflected_ray(S, 0.7, -0.7, 0.0, 0.4, u)
        first.append(np.max(np.abs(M @ u - traced)))
        whole.append(np.max(np.abs(np.asarray(exact(jnp.asarray(u))) - traced)))
    assert abs(fitted_order(sizes, first) - 2.0) < 0.1
    assert max(np.array(whole) / first) < 0.5


def test_a_finite_azimuth_is_that_of_traced_rays():
    """Leaving out of the plane of incidence: exact off a plane, of second order off a bowl."""
    sizes, direction = np.array([0.02, 0.04, 0.08]), np.array([0.5, -0.6, 0.4, 0.3])
    for bowl in (0.0 * S, S):
        patch = GlossyPatch(jnp.asarray(bowl), 0.7, theta1=-0.5, azimuth=0.5)
        exact = jax.jit(derived.exact_map(patch))
        central = np.asarray(exact(jnp.zeros(4)))
        assert np.linalg.norm(central[2:]) > 0.1  # it is no mirror image of the central ray
        misses = []
        for h in sizes:
            traced = tracer.reflected_ray(bowl, 0.7, -0.5, 0.5, 0.0, h * direction)
            misses.append(np.max(np.abs(np.asarray(exact(jnp.asarray(h * direction))) - traced)))
        if np.any(bowl):
            assert abs(fitted_order(sizes, misses) - 2.0) < 0.1
        else:
            assert max(misses) < 1e-13


@functools.cache
def sampled():
    """The reflected light on 24^4 samples: every step written as sums over plain arrays.

    Rays are mapped by the matrices before and after the lobe, and its two angles are integrated by
    Gauss-Hermite quadrature.
    """
    first, *_, last = ROUNDED.chain().events
    before, after = (np.asarray(a) for a in (first.law(SPACE_SLOPE).M, last.law(_angles()).M))
    c0, c1 = (np.asarray(a) for a in (first.law(SPACE_SLOPE).c, last.law(_angles()).c))
    back = np.linalg.inv(before @ after)
    blur = np.linalg.inv(after) @ np.diag([0, 0, 0.06**2, 0.06**2]) @ np.linalg.inv(after).T
    spread = back @ SPREAD @ back.T + blur
    center = np.linalg.solve(after, np.linalg.solve(before, CENTER - c0) - c1)
    sides = tuple((5.5 * np.sqrt(np.diag(spread))).tolist())
    grid = Grid.spanning((24,) * 4, sides, tuple(center.tolist()))
    u = np.asarray(grid.points()).reshape(-1, 4) @ after.T + c1
    t, w = np.polynomial.hermite_e.hermegauss(9)
    total = np.zeros(len(u))
    root = np.linalg.cholesky(np.linalg.inv(SPREAD)).T
    mapped = (u @ before.T + c0 - CENTER) @ root.T
    for a, wa in zip(t, w, strict=True):
        for b, wb in zip(t, w, strict=True):
            h = mapped - root @ before @ [0.0, 0.0, 0.06 * a, 0.06 * b]
            total += wa * wb / (2.0 * np.pi) * np.exp(-0.5 * np.einsum("ni,ni->n", h, h))
    return total.reshape(grid.size), grid


def _angles():
    from firstorder.conventions import SPACE

    return SPACE.turned()


def test_covariance_and_spectrum_of_the_whole_chain_are_those_of_its_samples():
    samples, grid = sampled()
    path = light() >> ROUNDED.chain()
    chain = path.covariances[-1]
    measured = eqx.filter_jit(covariance_of_samples)(jnp.asarray(samples), grid, chain.frame)
    assert normwise(chain.matrix, measured.matrix) < 1e-6
    Omega = ([0.0, 0.8], [-0.5], [0.4, -0.6], [0.3])
    F = discrete_transform(jnp.asarray(samples), grid, *map(jnp.asarray, Omega))
    ours = path.spectra[-1](*np.meshgrid(*Omega, indexing="ij"))
    assert normwise(ours, F) < 1e-6


def test_light_off_a_lobe_nears_traced_light_as_all_sizes_shrink():
    """Lobe, light and neighbourhood shrink together; what is left falls in proportion."""
    sizes, errors = np.array([0.02, 0.04, 0.08]), []
    shape, u = np.array([1.2, 1.0, 0.9, 1.1]), np.array([0.5, -0.4, 0.3, 0.4])
    for h in sizes:

        def bell(v, h=h):
            return float(np.exp(-0.5 * np.sum((v / (h * shape)) ** 2)))

        traced = tracer.reflected_light(bell, S, h, 0.7, -0.7 + h, 0.5 * h, 0.0, h * u, 14)
        patch = GlossyPatch(jnp.asarray(S), 0.7, h, -0.7 + h, 0.5 * h)
        L = Gaussian(np.zeros(4), np.diag((h * shape) ** -2.0), 1.0, SPACE_SLOPE)
        # a Gaussian after moves and Gaussian lobes: its closed form is in its spectrum
        errors.append(abs(_value(L, patch, h * u) - traced) / traced)
    assert errors[-1] < 0.15
    assert fitted_order(sizes, errors) > 0.8


def _value(L, patch, u) -> float:
    """Value of the reflected light from moments: Gaussians stay Gaussians."""
    first, *_, last = patch.chain().events
    m0, m1 = first.law(SPACE_SLOPE), last.law(_angles())
    A, B = np.asarray(m0.M), np.asarray(m1.M)
    sigma = float(patch.sigma) ** 2
    inside = np.linalg.inv(A) @ np.linalg.inv(np.asarray(L.precision)) @ np.linalg.inv(A).T
    blurred = inside + np.diag([0.0, 0.0, sigma, sigma])
    at = B @ u + np.asarray(m1.c) + np.linalg.solve(A, np.asarray(m0.c) - np.asarray(L.center))
    weight = np.sqrt(np.linalg.det(inside) / np.linalg.det(blurred))
    return float(weight * np.exp(-0.5 * at @ np.linalg.solve(blurred, at)))


@pytest.mark.smoke
def test_the_chain_is_jittable_and_differentiable():
    @jax.jit
    def band(sigma):
        patch = GlossyPatch(jnp.asarray(S), 0.7, sigma)
        return (light() >> patch.chain()).covariances[-1].matrix[2, 2]

    assert float(jax.grad(band)(0.06)) < 0.0 < float(band(0.06))  # a wider lobe blurs more


def test_an_outgoing_ray_in_the_mirror_direction_needs_no_turn():
    one = GlossyPatch(jnp.asarray(S), 0.7).mirror_matrix()
    two = GlossyPatch(jnp.asarray(S), 0.7, azimuth=0.0).mirror_matrix()
    np.testing.assert_allclose(one, two, rtol=0.0, atol=1e-14)


def test_what_is_no_patch_is_refused():
    with pytest.raises(ValueError, match="`sigma` must be positive"):
        GlossyPatch(jnp.eye(2), 0.1, sigma=-1.0)
    with pytest.raises(ValueError, match="`theta1` must lie above"):
        GlossyPatch(jnp.eye(2), 0.1, theta1=2.0)
    with pytest.raises(Refused, match="ToEquator is no move"):
        ComposedMove((ToEquator(),)).law(SPACE_SLOPE)


def test_a_mirror_takes_no_albedo():
    with pytest.raises(ValueError, match="`albedo` of a mirror must be 1"):
        GlossyPatch(-jnp.eye(2), 0.3, albedo=0.5)
