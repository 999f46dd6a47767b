import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.imaging import bumps as derived
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.imaging import surface_point
from firstorder.imaging._bumps import (
    NormalMap,
    bumped,
    chart,
    displaced,
    normal_mapped,
    shading_shape_operator,
    solid_tilted,
)

BOUND = 1e-9


def floor(uv):
    return jnp.append(uv, 0.0)


def ball(uv):
    u, v = uv
    return 2.0 * jnp.stack([jnp.cos(v) * jnp.cos(u), jnp.cos(v) * jnp.sin(u), jnp.sin(v)])


def test_bumps_turn_the_normal_as_the_traced_surface_does():
    assert derived.bump_differences() < BOUND
    assert derived.autodiff_error(0) < 1e-10


def test_a_normal_map_turns_as_the_traced_frame_does():
    assert derived.map_differences() < BOUND
    assert derived.autodiff_error(1) < 1e-10


@pytest.mark.parametrize("fault", ["flip", "forget the twist", "transpose", "forget the bumps"])
def test_a_fault_is_seen(fault):
    bump, mapped, dn, dm = derived.points()
    at = derived._chart(jnp.asarray(derived.PLACE))
    if fault == "forget the twist":
        m = np.asarray(derived.map_of(derived.PLACE))
        twist = np.stack([-m[1] * at.twist, m[0] * at.twist])
        wrong, true = dm - at.axes[:, :2] @ twist / np.linalg.norm(m), mapped.turning
    else:
        true = bump.turning
        wrong = {
            "flip": -dn,
            "transpose": bump.tangents @ (bump.tangents.T @ dn).T,
            "forget the bumps": at.point().turning,
        }[fault]
    error = normwise(wrong, true)
    assert np.isfinite(error)
    assert error > 1e-3


@pytest.mark.smoke
def test_waves_on_a_floor_are_flatlands():
    """n = arctan h', dn/dx = h'' / (1 + h'^2)."""
    place = jnp.array([0.3, -0.2])
    point = bumped(chart(floor, place), lambda uv: 0.2 * jnp.sin(3.0 * uv[0]), place)
    slope, second = 0.6 * np.cos(0.9), -1.8 * np.sin(0.9)
    np.testing.assert_allclose(-point.normal[0] / point.normal[2], slope, rtol=1e-5)
    kappa = shading_shape_operator(point)
    np.testing.assert_allclose(kappa[0, 0], second / (1.0 + slope**2), rtol=1e-5)
    np.testing.assert_allclose(kappa[1], 0.0, rtol=0.0, atol=1e-6)


def test_heights_given_in_space_are_those_of_a_chart():
    """On a ball: the same heights read off through u and v."""

    def height(x):
        return 0.05 * jnp.sin(3.0 * x[0]) * jnp.cos(2.0 * x[1] + x[2])

    place = jnp.array([0.3, 0.4])
    at = chart(ball, place)
    by_chart = bumped(at, lambda uv: height(ball(uv)), place)
    solid = solid_tilted(surface_point(at.position, at.axes, at.S), jax.grad(height))
    np.testing.assert_allclose(solid.normal, by_chart.normal, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(solid.turning, by_chart.turning, rtol=0.0, atol=1e-13)
    assert np.linalg.norm(solid.normal - at.axes[:, 2]) > 0.05


def leaned(m, a):
    """A normal leaned by what of a slope is tangent to it."""
    v = m - (a - m * (m @ a))
    return v / np.linalg.norm(v)


def test_slopes_on_bumps_turn_the_normal_as_differences_along_a_ball_say():
    """Heights, and over them slopes that are no gradient; the point stays on the ball."""

    def height(x, sin=jnp.sin, cos=jnp.cos):
        return 0.05 * sin(3.0 * x[0]) * cos(2.0 * x[1] + x[2])

    def slopes(x, sin=jnp.sin):
        return 0.3 * sin(x @ np.array([[2.0, -1.0, 0.5], [1.0, 3.0, -2.0], [0.3, 0.7, 1.5]]))

    def normal(x):
        h, e = 1e-5, np.eye(3)
        grad = [(height(x + h * d, np.sin, np.cos) - height(x - h * d, np.sin, np.cos)) for d in e]
        up = x / np.linalg.norm(x)
        return leaned(leaned(up, np.array(grad) / (2.0 * h)), slopes(x, np.sin))

    at = chart(ball, jnp.array([0.3, 0.4]))
    base = solid_tilted(surface_point(at.position, at.axes, at.S), jax.grad(height))
    found = jax.jit(lambda base: solid_tilted(base, slopes))(base)
    x, tangents = np.asarray(at.position), np.asarray(at.axes[:, :2])
    np.testing.assert_array_equal(found.position, x)
    np.testing.assert_array_equal(found.tangents, tangents)
    np.testing.assert_allclose(found.normal, normal(x), rtol=0.0, atol=1e-9)
    for k, t in enumerate(tangents.T):
        ends = [x + s * 1e-3 * t for s in (-2, -1, 1, 2)]
        ends = [normal(2.0 * e / np.linalg.norm(e)) for e in ends]
        slope = (ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / 12e-3
        np.testing.assert_allclose(found.turning[:, k], slope, rtol=0.0, atol=1e-7)


def test_bumps_and_maps_leave_the_point_where_it_is():
    place = jnp.array([0.7, 0.4])
    at = chart(ball, place)
    waves, slanted = lambda uv: jnp.sin(uv[0]), lambda uv: jnp.array([0.1, 0.2, 1.0])
    for point in (bumped(at, waves, place), normal_mapped(at, slanted, place), at.point()):
        np.testing.assert_array_equal(point.position, ball(place))
        np.testing.assert_array_equal(point.tangents, at.axes[:, :2])
        np.testing.assert_allclose(point.base_normal, 0.5 * ball(place), rtol=0.0, atol=1e-15)


def test_a_map_made_of_the_heights_is_the_bump():
    """(-h_t, -h_b, 1) in the tangent frame is Blinn's normal, turning and all."""
    place = jnp.array([0.7, 0.4])

    def height(uv):
        return 0.05 * jnp.sin(3.0 * uv[0] + 2.0 * uv[1])

    def slopes(uv):
        return jnp.append(-chart(ball, uv).gradient(jax.grad(height)(uv)), 1.0)

    def both(uv):
        at = chart(ball, uv)
        return bumped(at, height, uv), normal_mapped(at, slopes, uv)

    bump, mapped = jax.jit(both)(place)
    np.testing.assert_allclose(bump.normal, mapped.normal, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(bump.turning, mapped.turning, rtol=0.0, atol=1e-5)


def test_blinns_normal_misses_the_displaced_surfaces_in_second_order_of_the_height():
    place = np.array([0.7, 0.4])

    def miss(size):
        def height(uv):
            return size * (1.0 + jnp.sin(3.0 * uv[0] + 2.0 * uv[1]))

        shown = bumped(chart(ball, place), height, place)
        return jnp.linalg.norm(shown.normal - displaced(ball, height, place).axes[:, 2])

    place = jnp.asarray(place)
    sizes = np.array([0.08, 0.04])
    errors = np.asarray(jax.jit(jax.vmap(miss))(jnp.asarray(sizes)))
    assert abs(fitted_order(sizes, errors) - 2.0) < 0.15


def test_a_normal_map_from_pixels_repeats_and_meets_its_pixels():
    random = np.random.default_rng(0)
    pixels = random.uniform(0.3, 0.7, size=(5, 4, 3))
    pixels[..., 2] = 0.95
    texture = NormalMap.of(pixels, (2.0, 1.0))
    at = jax.jit(lambda uv: texture(uv))
    middle = jnp.array([0.6, 0.375])  # of cell (1, 1)
    np.testing.assert_allclose(at(middle), 2.0 * pixels[1, 1] - 1.0, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(at(middle + jnp.array([2.0, -1.0])), at(middle), rtol=0.0, atol=1e-5)


def test_bad_pixels_are_one_sentence():
    with pytest.raises(ValueError, match="`pixels` must have shape"):
        NormalMap.of(np.zeros((4, 4)))
    with pytest.raises(ValueError, match="`extent` must be positive"):
        NormalMap.of(np.full((4, 4, 3), 0.5), (1.0, 0.0))
    words = r"`extent` must have shape \(2,\)|parameter extent="
    with pytest.raises((ValueError, TypeError), match=words):
        NormalMap.of(np.full((4, 4, 3), 0.5), 2.0)
    with pytest.raises(ValueError, match="`pixels` must be finite"):
        NormalMap.of(np.full((4, 4, 3), np.nan))
