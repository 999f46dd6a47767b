import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import (
    Affine,
    Constant,
    Environment,
    Function,
    Gaussian,
    Grid,
    Harmonics,
    NearLight,
    autodiff_jet,
    discrete_transform,
    gaussian,
)
from firstorder.fields.apertures import Bars
from firstorder.laws import Integrate, Multiply
from firstorder.transport import Curvature

ANGLE, OFFSET = Frame(("theta",)), Frame(("x",))


def disk(radius):
    return Bars(Affine([1.0], 0.0, OFFSET), [-radius, radius], [0.0, 1.0, 0.0])


def sky():
    return Environment(Harmonics([0.5, 0.3, -0.2, 0.1], [0.0, 0.4, 0.1, -0.3]))


@pytest.mark.parametrize("samples", [7, 8, 15])
def test_a_series_through_samples_is_exact_below_the_nyquist_limit(samples):
    f = Harmonics([0.5, 0.3, -0.2, 0.1], [0.0, 0.4, 0.1, -0.3])
    theta = np.linspace(-4.0, 4.0, 11)
    np.testing.assert_allclose(Harmonics.of(f, samples)(theta), f(theta), rtol=0.0, atol=1e-14)


def test_the_spectrum_of_one_period_is_its_integral():
    f = Harmonics([0.5, 0.3, -0.2, 0.1], [0.0, 0.4, 0.1, -0.3])
    x, weight = np.polynomial.legendre.leggauss(60)
    theta, weight = np.pi * x, np.pi * weight
    for Omega in (0.0, 0.5 / np.pi, -0.37, 1.2):
        truth = np.sum(weight * f(theta) * np.exp(-2j * np.pi * Omega * theta))
        np.testing.assert_allclose(f.spectrum()(Omega), truth, rtol=0.0, atol=1e-13)


def test_the_covariance_of_a_series_is_that_of_its_lines():
    """By Parseval: the mean square of the derivative over that of the light, over (2 pi)^2."""
    f = Harmonics([0.5, 0.3, -0.2, 0.1], [0.0, 0.4, 0.1, -0.3])
    theta = jnp.asarray(2.0 * np.pi * np.arange(32) / 32)
    steep = jax.vmap(jax.grad(lambda t: f(t)))(theta)
    truth = np.mean(steep**2) / np.mean(f(theta) ** 2) / (2.0 * np.pi) ** 2
    np.testing.assert_allclose(f.covariance().matrix, [[truth]], rtol=1e-12)


def test_smooth_light_converges_faster_than_any_power():
    f = Function(lambda t: jnp.exp(jnp.cos(t - 0.3)), ANGLE)
    theta = np.linspace(0.0, 6.0, 31)
    errors = [np.max(np.abs(Harmonics.of(f, n)(theta) - f(theta))) for n in (8, 16, 32)]
    assert errors[1] < 1e-4 * errors[0]
    assert errors[2] < 1e-13


def test_distant_light_has_a_spectrum_only_under_a_window():
    with pytest.raises(Refused, match="Dirac in Omega_x: window it"):
        sky().spectrum()
    window = gaussian((0.2, -0.3), (0.5, 0.4), 0.2)
    h = Multiply(sky(), Grid((8, 8), (1.0, 1.0)))
    grid = Grid.spanning((64, 65), (4.5, 4.0))
    Omega = np.array([-0.3, 0.4]), np.array([0.1, 0.6])
    truth = discrete_transform(grid.sample(h(window)), grid, *Omega)
    ours = h(window.spectrum())(*np.meshgrid(*Omega, indexing="ij"))
    assert normwise(ours, truth) < 1e-12


def test_curvature_turns_a_sky_into_variation_over_space():
    S = Curvature(0.7)(sky().covariance()).matrix
    own = float(sky().covariance().matrix[1, 1])
    np.testing.assert_allclose(S, own * np.array([[0.49, 0.7], [0.7, 1.0]]), rtol=1e-12)


def test_a_disk_subtends_the_angle_it_should():
    """The integral over directions of an even disk, its gradient and its Hessian."""
    E = Integrate("theta", -0.5 * np.pi, 0.5 * np.pi, 24)(NearLight([0.3, 1.2], disk(0.3)))
    x = jnp.array([-0.5, 0.3, 0.9, 3.0])

    def angle(x):
        return 2.0 * jnp.arcsin(0.3 / jnp.sqrt(1.2**2 + (x - 0.3) ** 2))

    jets = jax.jit(lambda x: E.jets(x))(x)
    np.testing.assert_allclose(jets.value, angle(x), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(
        jets.gradient[:, 0], jax.vmap(jax.grad(angle))(x), rtol=0.0, atol=1e-11
    )
    bend = jax.vmap(jax.grad(jax.grad(angle)))(x)
    np.testing.assert_allclose(jets.hessian[:, 0, 0], bend, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("frame", [FLATLAND, FLATLAND_SLOPE])
def test_a_ray_sees_the_disk_that_it_hits(frame):
    """Against the distance from the centre to the half-line of the ray, in the plane."""
    rng = np.random.default_rng(0)
    x, theta = rng.uniform(-2, 2, 2000), rng.uniform(-3.1, 3.1, 2000)
    if frame.uses_slopes:
        theta = theta * 0.48  # a slope names a direction above the surface
    d = np.stack([-np.sin(theta), np.cos(theta)], -1)
    p = np.stack([0.3 - x, np.full_like(x, 1.2)], -1)
    t = np.sum(d * p, -1)
    hit = (np.linalg.norm(p - t[:, None] * d, axis=-1) < 0.4) & (t > 0)
    label = np.tan(theta) if frame.uses_slopes else theta
    assert np.array_equal(np.asarray(NearLight([0.3, 1.2], disk(0.4), frame)(x, label)), hit)
    assert 100 < np.sum(hit) < 1900


@pytest.mark.parametrize("frame", [FLATLAND, FLATLAND_SLOPE])
def test_jets_of_a_near_light_are_derivatives_of_its_value(frame):
    ball = NearLight([0.3, 1.2], Gaussian([0.1], [[2.0]], frame=OFFSET), frame)
    rays = jnp.array([[-0.5, 0.4], [0.9, -0.7], [0.2, 2.5]])  # away from it, the last angle
    found = jax.jit(jax.vmap(ball.jet))(rays)
    true = jax.jit(jax.vmap(lambda u: autodiff_jet(ball.at, u, frame)))(rays)
    np.testing.assert_allclose(found.gradient, true.gradient, rtol=1e-13)
    np.testing.assert_allclose(found.hessian, true.hessian, rtol=1e-12)


def test_a_ball_straight_behind_the_ray_does_not_shine():
    ball = NearLight([0.0, 1.0], Gaussian([0.0], [[100.0]], frame=OFFSET))
    x = np.sin(-np.pi) / np.cos(-np.pi)  # to the last bit on the line through the centre
    assert ball(x, -np.pi).item() < 1e-80


def test_a_near_light_far_away_is_an_environment():
    """A soft ball at distance D under the angle a, of width D s: error of first order in 1 / D."""
    a, s = 0.3, 0.2
    far = Environment(Function(lambda t: jnp.exp(-0.5 * (jnp.sin(t - a) / s) ** 2), ANGLE))
    x, theta = np.array([0.5, -0.7]), np.array([0.2, 0.5])
    errors = []
    for D in (100.0, 200.0, 400.0):
        ball = Gaussian([0.0], [[1.0 / (D * s) ** 2]], frame=OFFSET)
        near = NearLight([-D * np.sin(a), D * np.cos(a)], ball)
        errors.append(np.max(np.abs(near(x, theta) - far(x, theta))))
    assert errors[0] < 0.03
    np.testing.assert_allclose(
        np.log2(np.array(errors[:-1]) / errors[1:]), 1.0, rtol=0.0, atol=0.05
    )


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Harmonics([1.0, 2.0], [0.0]), r"`sines` must have shape \(2,\), but has \(1,\)"),
        (lambda: Harmonics([np.nan], [0.0]), "`cosines` must be finite, but is nan"),
        (lambda: Harmonics.of(Constant(1.0, ANGLE), 0), "`samples` must be positive, but is 0"),
        (lambda: Environment(Constant(1.0)), r"`light` must depend on one of \('theta',\)"),
        (lambda: Environment(Constant(1.0, OFFSET)), "`light` must depend on one of"),
        (lambda: NearLight([0.0, 0.0], disk(0.1)), r"`center\[1\]` must be positive, but is 0.0"),
        (lambda: NearLight([0.0, 1.0], Constant(1.0)), "`emission` must have one coordinate"),
        (lambda: NearLight([0.0, 1.0], disk(0.1), FLATLAND.turned()), "`frame` must be that of"),
    ],
)
def test_bad_input(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_series_is_over_one_coordinate():
    with pytest.raises(ValueError, match="`frame` must have one coordinate, but has x and theta"):
        Harmonics([1.0, 0.5], [0.0, 0.0], FLATLAND)
    for wrong in (1.0, [], [[1.0, 0.5]]):
        with pytest.raises(ValueError, match="`cosines` must be a row of coefficients"):
            Harmonics(wrong, wrong)
