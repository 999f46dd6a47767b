"""Every sign, origin and scale of `conventions`, against geometry and against NumPy's FFT."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from firstorder.checks.tolerance import normwise, rounding
from firstorder.conventions import (
    FLATLAND,
    FLATLAND_SLOPE,
    SPACE,
    SPACE_SLOPE,
    UNSTATED,
    Frame,
    azimuth_axes,
    cylindrical,
    direction,
    fourier_kernel,
    frame_with,
    mirror_direction,
    normal_rate,
    polar,
    shape_operator,
    to_global,
    to_local,
    travel_sign,
)
from firstorder.fields import Grid, discrete_transform, gaussian


def test_angles_turn_counter_clockwise_from_the_normal():
    np.testing.assert_allclose(direction(jnp.array(0.0)), [0.0, 1.0], rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(direction(jnp.array(0.5 * np.pi)), [-1.0, 0.0], rtol=0.0, atol=1e-15)
    d = direction(jnp.linspace(-1.0, 1.0, 5))
    assert np.all(np.diff(np.arctan2(d[:, 1], d[:, 0])) > 0)


def test_an_axis_states_the_frame_that_nobody_stated():
    assert frame_with("theta", UNSTATED) == FLATLAND
    assert frame_with("v", UNSTATED) == FLATLAND_SLOPE
    assert frame_with("x", UNSTATED) == UNSTATED
    assert frame_with("v", FLATLAND) == FLATLAND
    assert frame_with("theta", SPACE) == SPACE


def test_directions_of_space_by_their_angles():
    up, x, y = np.eye(3)[[2, 0, 1]]
    np.testing.assert_allclose(polar(jnp.array(0.0), jnp.array(1.0)), up, rtol=0.0, atol=1e-15)
    for phi, axis in ((0.0, x), (0.5 * np.pi, y)):
        np.testing.assert_allclose(
            polar(jnp.array(0.5 * np.pi), jnp.array(phi)), axis, rtol=0.0, atol=1e-15
        )
        along, across = azimuth_axes(jnp.array(phi))
        np.testing.assert_allclose(along, axis, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(across, np.cross(up, axis), rtol=0.0, atol=1e-15)  # to the left
    found = cylindrical(jnp.array(2.0), jnp.array([0.0, np.pi]), jnp.array(3.0))
    np.testing.assert_allclose(found, [[2.0, 0.0, 3.0], [-2.0, 0.0, 3.0]], rtol=0.0, atol=1e-15)


def test_a_ball_with_outward_normals_has_a_negative_curvature():
    radius, step = 2.0, 1e-6
    turned = np.array([np.sin(step / radius), 0.0])  # the normal's tangents after a walk along x
    found = normal_rate(jnp.eye(2) * (-1.0 / radius), jnp.array([step, 0.0]))
    np.testing.assert_allclose(found, turned, rtol=1e-9)


def test_shape_operator_of_a_sphere_is_its_curvature():
    """The outward normal of a sphere is its point over the radius: S = -1/R."""
    R = 2.0
    tangents = jnp.eye(3)[:, :2]
    np.testing.assert_allclose(shape_operator(tangents, tangents / R), -np.eye(2) / R)


def test_incoming_light_was_upstream_where_its_direction_points():
    # A ray through x with the direction it comes from passes height d at x - d tan(theta).
    x, theta, d = 0.3, 0.4, 2.0
    toward = np.asarray(direction(jnp.array(theta)))
    there = x + toward[0] * d / toward[1]
    assert there == pytest.approx(x + travel_sign("incoming") * np.tan(theta) * d, abs=1e-14)
    # Outgoing light came from below: the place it left, a distance d before it reached x.
    left = x - toward[0] * d / toward[1]
    assert left == pytest.approx(x + travel_sign("outgoing") * np.tan(theta) * d, abs=1e-14)


def test_positive_curvature_is_a_valley():
    # Normals at n = kappa x on both sides of 0 meet above the surface.
    kappa, x = 0.5, np.array([-0.1, 0.1])
    a, b = np.asarray(direction(jnp.asarray(kappa * x)))
    t = np.linalg.solve(np.stack([a, -b], 1), [x[1] - x[0], 0.0])
    assert t[0] > 0
    assert t[1] > 0
    assert (a * t[0])[1] == pytest.approx(1.0 / kappa, rel=1e-2)


def test_local_and_mirrored_angles():
    theta, n = jnp.array(0.7), jnp.array(0.2)
    assert to_global(to_local(theta, n), n) == pytest.approx(0.7)
    mirrored = direction(mirror_direction(theta, n))
    normal, d = direction(n), direction(theta)
    np.testing.assert_allclose(
        mirrored, 2.0 * jnp.dot(d, normal) * normal - d, rtol=0.0, atol=1e-14
    )


def test_frames_name_their_coordinates():
    assert FLATLAND.positions == (0,)
    assert FLATLAND.directions == (1,)
    assert SPACE.directions == (2, 3)
    assert FLATLAND_SLOPE.uses_slopes
    assert SPACE_SLOPE.uses_slopes
    assert not FLATLAND.uses_slopes
    assert FLATLAND.without("x") == Frame(("theta",))
    assert FLATLAND.appended("omega").coordinates == ("x", "theta", "omega")
    assert FLATLAND.turned().sense == "outgoing"
    assert FLATLAND.turned().turned() == FLATLAND
    with pytest.raises(ValueError, match="must be one of x, theta, but is 'v'"):
        FLATLAND.axis("v")


def test_the_kernel_is_minus_two_pi_i():
    Omega, u = jnp.array([0.3, -0.2]), jnp.array([1.0, 0.5])
    assert complex(fourier_kernel(Omega, u)) == pytest.approx(np.exp(-2j * np.pi * (0.3 - 0.1)))


@pytest.mark.parametrize("size", [(8, 8), (9, 9), (8, 9), (15, 12)])
@pytest.mark.parametrize("center", [(0.0, 0.0), (0.4, -0.7)])
def test_transform_is_numpys_fft_with_its_phase_written_out(size, center):
    step = (0.3, 0.45)
    grid = Grid(size, step, center)
    samples = np.random.default_rng(1).normal(size=size)
    ours = discrete_transform(samples, grid, grid.frequencies(0), grid.frequencies(1))
    truth = np.fft.fftn(samples) * step[0] * step[1]
    for i in range(2):
        Omega = np.fft.fftfreq(size[i], step[i])
        first = center[i] - 0.5 * (size[i] - 1) * step[i]  # where sample 0 lies
        shape = [1, 1]
        shape[i] = size[i]
        truth = truth * np.exp(-2j * np.pi * Omega * first).reshape(shape)
    assert normwise(ours, np.fft.fftshift(truth)) < rounding(samples.size)


@pytest.mark.parametrize("size", [(64, 64), (65, 65), (64, 71)])
def test_transform_is_the_integral_at_any_frequency(size):
    grid = Grid.spanning(size, (4.0, 4.5), (0.1, -0.2))
    f = gaussian((0.21, -0.13), (0.5, 0.4), 0.0, 1.3)
    Omega = np.array([0.37]), np.array([-0.21])
    ours = complex(discrete_transform(grid.sample(f), grid, *Omega)[0, 0])
    truth = 1.3
    for w, c, s in zip((0.37, -0.21), (0.21, -0.13), (0.5, 0.4), strict=True):
        waves = [
            quad(lambda t, c=c, s=s, w=w, g=g: np.exp(-0.5 * ((t - c) / s) ** 2)
                 * g(2 * np.pi * w * t), c - 9 * s, c + 9 * s, epsabs=1e-13)[0]
            for g in (np.cos, np.sin)
        ]  # fmt: skip
        truth = truth * (waves[0] - 1j * waves[1])
    assert abs(ours - truth) < 1e-11


@pytest.mark.parametrize("size", [4, 5])
def test_the_origin_shifted_by_half_a_sample_is_noticed(size):
    # The fault that even grids invite: sample size // 2 at the origin.
    grid = Grid((size,), (0.5,))
    wrong = (np.arange(size) - size // 2) * 0.5
    same = np.allclose(grid.axis(0), wrong)
    assert same == (size % 2 == 1)
    assert np.mean(grid.axis(0)) == pytest.approx(0.0, abs=1e-15)


def test_a_name_is_no_frame():
    words = r"^Argument `frame` must be a `Frame`, such as FLATLAND, but is 'x'|violates type hint"
    with pytest.raises(TypeError, match=words):
        frame_with("theta", "x")
