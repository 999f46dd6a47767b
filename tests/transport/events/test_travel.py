import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.checks.cases import light
from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE_SLOPE, Frame, direction
from firstorder.errors import Refused
from firstorder.fields import (
    Constant,
    Gaussian,
    SampledSpectrum,
    autodiff_jet,
    covariance_of_samples,
)
from firstorder.fields.spectrum import Grid
from firstorder.transport import Occlusion, Travel, line_light
from firstorder.transport.events.travel import Arrival

SENSES = ("incoming", "outgoing")
U = jnp.array([0.4, -0.3])
DISTANCES = np.array([1.0, 2.0])


@pytest.mark.parametrize("sense", SENSES)
@pytest.mark.parametrize("names", [("x", "v"), ("x", "theta")])
def test_zero_distance_is_the_identity(sense, names):
    L = light(Frame(names, sense))
    for ours, same in zip(
        jax.tree.leaves(Travel(0.0)(L).jet(U)), jax.tree.leaves(L.jet(U)), strict=True
    ):
        np.testing.assert_array_equal(ours, same)


@pytest.mark.smoke
@given(st.floats(0.0, 5.0), st.floats(0.0, 5.0), st.sampled_from(SENSES))
def test_distances_add(a, b, sense):
    for names in (("x", "v"), ("x", "theta")):
        L = light(Frame(names, sense))
        steps, whole = (Travel(a) >> Travel(b))(L), Travel(a + b)(L)
        assert abs(steps(*U) - whole(*U)) < 1e-14


def test_distances_add_in_every_portrait():
    L = light(FLATLAND_SLOPE)
    path, whole = L >> Travel(0.7) >> Travel(1.1), Travel(1.8)
    W = (jnp.array([0.2, -0.4]), jnp.array([0.1, 0.3]))
    np.testing.assert_allclose(path.spectra[-1](*W), whole(L.spectrum())(*W), rtol=1e-13)
    np.testing.assert_allclose(
        path.covariances[-1].matrix, whole(L.covariance()).matrix, rtol=1e-13
    )
    np.testing.assert_allclose(path.jets(U)[-1].hessian, whole(L).jet(U).hessian, rtol=1e-12)


@pytest.mark.parametrize("names", [("x", "v"), ("x", "theta")])
def test_radiance_is_constant_along_a_ray(names):
    """One straight line through a stack of planes; its crossings found without the events."""
    incoming, outgoing = (light(Frame(names, s)) for s in SENSES)
    for angle in (-0.8, 0.1, 0.6):
        start, along = np.array([0.3, 0.0]), np.asarray(direction(jnp.array(angle)))
        name = angle if names[1] == "theta" else np.tan(angle)
        for d in (0.5, 2.0):
            point = start + d / along[1] * along  # on the line y = d
            np.testing.assert_allclose(
                Travel(d)(outgoing)(point[0], name), outgoing(start[0], name), rtol=1e-12
            )
            # Light that comes from the direction `along`, known at y = d, and now seen at y = 0.
            np.testing.assert_allclose(
                Travel(d)(incoming)(start[0], name), incoming(point[0], name), rtol=1e-12
            )


@pytest.mark.parametrize(("sense", "sign"), [("incoming", -1.0), ("outgoing", 1.0)])
def test_derivatives_in_angles_are_those_of_the_light_where_the_ray_was(sense, sign):
    """Far from the line's normal, where `tan` bends much."""
    frame = Frame(("x", "theta"), sense)
    L, rays = light(frame), np.array([[0.4, -0.3], [0.1, 0.9], [-0.6, -1.1]])

    def before(u):
        return L.at(jnp.stack([u[0] + sign * 1.3 * jnp.tan(u[1]), u[1]]))

    for u in rays:
        found, true = Travel(1.3)(L).jet(jnp.asarray(u)), autodiff_jet(before, u, frame)
        np.testing.assert_allclose(found.gradient, true.gradient, rtol=1e-10)
        np.testing.assert_allclose(found.hessian, true.hessian, rtol=1e-10)


def test_opposite_senses_shear_opposite_ways():
    there, back = (Travel(1.3).law(Frame(("x", "v"), s)).M[0, 1] for s in SENSES)
    assert there == -1.3
    assert back == 1.3


def test_travelling_commutes_with_arriving():
    L = light(Frame(("x", "v"), "outgoing"))
    first, last = (Travel(0.9) >> Arrival())(L), (Arrival() >> Travel(0.9))(L)
    np.testing.assert_allclose(first(*U), last(*U), rtol=1e-14)
    assert first.frame == last.frame == FLATLAND_SLOPE


def test_arrival_is_what_the_facing_surface_sees():
    """Two facing lines, y = 0 and y = d: a ray is followed in the plane, no event is used."""
    d, L = 1.4, light(Frame(("x", "theta"), "outgoing"))
    seen = (Travel(d) >> Arrival())(L)
    for x0, angle in ((0.2, 0.5), (-0.3, -0.7)):
        along = np.array([-np.sin(angle), np.cos(angle)])
        hit = np.array([x0, 0.0]) + d / along[1] * along
        # The upper line's axes are (-1, 0) and (0, -1); what arrives there comes from -along.
        x = -hit[0]
        local = np.array([along[0], along[1]])  # -along in those axes
        np.testing.assert_allclose(seen(x, np.arctan2(-local[0], local[1])), L(x0, angle))


def test_arrival_in_space_keeps_the_ray():
    """Half a turn about y: the same ray, traced to the plane z = d, in the facing frame."""
    d, rng = 0.8, np.random.default_rng(3)
    A = rng.normal(size=(4, 4))
    frame = Frame(SPACE_SLOPE.coordinates, "outgoing")
    L = Gaussian(np.array([0.1, -0.2, 0.05, 0.1]), A @ A.T + np.eye(4), 1.0, frame)
    start, along = np.array([0.2, -0.1, 0.0]), np.array([-0.3, 0.4, 1.0])
    hit = start + d * along
    turn = np.diag([-1.0, 1.0, -1.0])
    comes_from = turn @ -along
    x, y, _ = turn @ (hit - np.array([0.0, 0.0, d]))
    v, w = -comes_from[:2] / comes_from[2]
    seen = (Travel(d) >> Arrival())(L)
    np.testing.assert_allclose(seen(x, y, v, w), L(start[0], start[1], 0.3, -0.4), rtol=1e-12)


@pytest.mark.smoke
def test_a_bad_distance_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `d` must not be negative, but is -1.0.$"):
        Travel(-1.0)
    with pytest.raises(ValueError, match=r"^Argument `d` must not be negative, but is nan.$"):
        Travel(np.nan)


def test_a_traced_negative_distance_is_nan():
    L = light(FLATLAND_SLOPE)
    assert np.isnan(jax.jit(lambda d: Travel(d)(L).at(U))(-1.0))
    assert np.isfinite(jax.jit(lambda d: Travel(d)(L).at(U))(1.0))


def test_the_distance_is_differentiable():
    L = light(FLATLAND_SLOPE)
    slope = jax.grad(lambda d: Travel(d)(L).at(U))(0.7)
    assert abs(slope + U[1] * Travel(0.7)(L).jet(U).gradient[0]) < 1e-14  # dl/dd = -v dl/dx


def test_angles_refuse_spectra_until_linearised():
    L = light(FLATLAND)
    with pytest.raises(Refused):
        Travel(1.0)(L.spectrum())
    linear = Travel(1.0).linearised(jnp.zeros(2))
    np.testing.assert_allclose(
        linear.law(FLATLAND).M, [[1.0, -1.0], [0.0, 1.0]], rtol=0.0, atol=1e-15
    )
    linear(L.spectrum())


def test_the_linearised_angle_errs_in_third_order():
    d = 1.7
    radii = np.array([0.05, 0.1, 0.2])
    errors = [float(Travel(d).linearised(jnp.zeros(2), r).error(FLATLAND)) for r in radii]
    assert abs(fitted_order(radii, errors) - 3.0) < 0.05
    np.testing.assert_allclose(errors, d * (np.tan(radii) - radii), rtol=1e-6)


def test_the_linearised_spectrum_is_measured_against_the_warp():
    """Narrow light about 0.6 rad: the touching move there is right, the one at zero is not."""
    narrow = Gaussian([0.7, 0.6], jnp.diag(jnp.array([9.0, 400.0])), 1.0, FLATLAND)
    grid = Grid.spanning((192, 192), (4.0, 0.6), (1.4, 0.6))
    truth = SampledSpectrum.of(Travel(1.0)(narrow), grid)
    W = np.meshgrid([-0.4, 0.1], [-1.0, 0.5], indexing="ij")
    peak = np.max(np.abs(truth(*W)))

    def error(at):
        linear = Travel(1.0).linearised(jnp.array(at))
        return np.max(np.abs(linear(narrow.spectrum())(*W) - truth(*W))) / peak

    assert error([0.1, 0.6]) < 0.01
    assert error([0.0, 0.0]) > 0.1


def test_travel_in_angles_needs_flatland():
    with pytest.raises(ValueError, match="slopes in space"):
        Travel(1.0)(Constant(1.0, Frame(("x", "y", "theta", "phi"))))


def test_covariance_shears_with_the_energy():
    grid = Grid.spanning((128, 129), (7.0, 6.0))
    L = light(FLATLAND_SLOPE)
    sampled = covariance_of_samples(grid.sample(Travel(0.8)(L)), grid, L.frame)
    np.testing.assert_allclose(Travel(0.8)(L.covariance()).matrix, sampled.matrix, rtol=1e-9)


def test_single_precision_is_enough():
    L = Gaussian(jnp.zeros(2, jnp.float32), jnp.eye(2, dtype=jnp.float32), 1.0, FLATLAND_SLOPE)
    value = Travel(np.float32(1.0))(L).at(jnp.array([0.4, -0.3], jnp.float32))
    assert value.dtype == jnp.float32
    assert abs(float(value) - np.exp(-0.5 * (0.7**2 + 0.3**2))) < 1e-6


@pytest.mark.parametrize("sense", SENSES)
def test_zero_distance_in_angles_is_the_identity_below_the_line_too(sense):
    L, below = light(Frame(("x", "theta"), sense)), jnp.array([0.4, 1.9])
    np.testing.assert_array_equal(Travel(0.0)(L).jet(below).hessian, L.jet(below).hessian)


def test_many_distances_are_mapped_over():
    """Words of NumPy once said that shapes do not fit."""
    for act in (Travel(DISTANCES), lambda f: line_light(f, DISTANCES), Occlusion(0.5, DISTANCES)):
        with pytest.raises(ValueError, match=r"^Argument `\w+` must be one number, but has shape"):
            act(light(FLATLAND_SLOPE))
    found = jax.vmap(lambda event: event(light(FLATLAND_SLOPE)).at(U))(Travel(DISTANCES))
    assert found.shape == (2,)
