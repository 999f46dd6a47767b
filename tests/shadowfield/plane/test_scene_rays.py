import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.fields import Affine, Bars, Grid
from firstorder.flatland import Circles, Scene, Segments, primitive
from firstorder.flatland.library._e11 import e11_fig07, e11_fig18b
from firstorder.shadowfield import (
    PLANE,
    depth_range,
    grid_visibility,
    planar_blocker,
    ray_visibility,
    ray_visibility_by_slope,
    to_two_planes,
    visible_lengths,
)

HEIGHT, D1 = 2.0, 1.25


def strip():
    """One strip 0.5 m below a light at 2 m, which has ends."""
    lamp = primitive(Segments((0.8, HEIGHT), (-0.8, HEIGHT)), name="light", emission=1.0)
    return Scene.of(primitive(Segments((-0.1, 1.5), (0.2, 1.5)), name="blocker"), lamp)


@pytest.mark.smoke
def test_a_traced_strip_is_the_planar_layer():
    g = Bars(Affine([1.0], 0.0, PLANE), [-0.1, 0.2], [1.0, 0.0, 1.0])
    x, y = np.linspace(-1.0, 1.0, 41)[:, None] + 1e-3, np.linspace(-0.79, 0.79, 37)
    truth = to_two_planes(D1)(planar_blocker(g, 0.5))(x, y)
    np.testing.assert_array_equal(jax.jit(ray_visibility)(strip(), x, y, HEIGHT, D1), truth)
    v = np.linspace(-1.0, 1.0, 29)
    by_slope = ray_visibility_by_slope(strip(), y[:, None], v, HEIGHT, D1)
    np.testing.assert_array_equal(by_slope, planar_blocker(g, 0.5)(y[:, None], v))


def test_a_disc_hides_the_rays_that_pass_it_within_its_radius():
    scene = Scene.of(primitive(Circles((0.1, 0.6), 0.15)))
    grid = Grid.spanning((40, 41), (0.5, 0.5), (0.5, 0.5))
    x, y = grid.points()[..., 0], grid.points()[..., 1]
    # Distance of the middle from the line through (x, 0) and (y, 1).
    away = np.abs((y - x) * 0.6 - (0.1 - x)) / np.hypot(y - x, 1.0)
    np.testing.assert_array_equal(grid_visibility(scene, grid), away >= 0.15)


def test_the_visible_length_is_the_mean_of_many_rays():
    scene, x = e11_fig07(2), np.linspace(0.05, 0.95, 7)
    n = 20000
    y = (np.arange(n) + 0.5) / n
    many = jnp.mean(jax.jit(ray_visibility)(scene, x[:, None], y), axis=1)
    exact = jax.jit(visible_lengths)(scene, x)
    # Each of at most 30 shadows has two ends, wrong by half a ray.
    np.testing.assert_allclose(exact, many, rtol=0.0, atol=30.0 / n)


def test_a_blocker_moved_changes_the_visible_length_by_its_shadow():
    def h(shift):
        lamp = primitive(Segments((1.0, 1.0), (0.0, 1.0)), name="light")
        disc = primitive(Circles(jnp.stack([shift, 0.6]), 0.1))
        return visible_lengths(Scene.of(disc, lamp, crossings=None), jnp.array([0.5]))[0]

    def end(cx, side, x=0.5, cy=0.6, r=0.1):
        """Where a tangent from (x, 0) to the disc meets the light."""
        base, open = np.arctan2(cx - x, cy), np.arcsin(r / np.hypot(cx - x, cy))
        return x + np.tan(base + side * open)

    step = 1e-5
    hidden = [end(0.6 + s, 1) - end(0.6 + s, -1) for s in (step, -step)]
    assert abs(jax.jit(jax.grad(h))(0.6) + (hidden[0] - hidden[1]) / (2 * step)) < 1e-8


def test_where_nothing_is_seen_the_slope_is_zero_and_no_nan():
    """In the funnel's dark: gaps that end on the horizon have no finite tangent."""
    scene = e11_fig18b(5)
    h, slope = jax.jit(jax.value_and_grad(lambda x: visible_lengths(scene, x[None])[0]))(0.1)
    assert h == slope == 0.0


@pytest.mark.smoke
def test_a_bad_distance_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `d1` must be positive, but is 0.0.$"):
        ray_visibility(strip(), 0.0, 0.0, HEIGHT, 0.0)


def test_a_scene_without_blockers_has_no_depths_and_one_without_a_light_no_lengths():
    lamp = primitive(Segments((0.8, HEIGHT), (-0.8, HEIGHT)), name="light", emission=1.0)
    blocker = primitive(Segments((-0.1, 1.5), (0.2, 1.5)), name="blocker")
    with pytest.raises(ValueError, match="must have shapes besides light and floor"):
        depth_range(Scene.of(lamp), HEIGHT)
    with pytest.raises(ValueError, match='must have a shape named "light"'):
        visible_lengths(Scene.of(blocker), jnp.array([0.0, 0.5]), HEIGHT, D1)


def test_a_light_at_another_height_is_refused():
    """Its length once came out in proportion to the height that was said."""
    lamp = Segments((1.0, 2.0), (-1.0, 2.0))
    scene = Scene.of(primitive(lamp, emission=1.0, name="light"))
    np.testing.assert_allclose(visible_lengths(scene, np.zeros(1), 2.0, 2.0), 2.0)
    with pytest.raises(ValueError, match="`light_height` must be that of the light, 2 to 2, but"):
        visible_lengths(scene, np.zeros(1))


@pytest.mark.parametrize("name", ["x", "y", "light_height"])
def test_a_ray_from_nowhere_is_refused(name):
    """Nothing would hide it."""
    scene = Scene.of(primitive(Segments((0.0, 0.5), (1.0, 0.5))))
    with pytest.raises(ValueError, match=f"`{name}` must be finite"):
        ray_visibility(scene, **({"x": 0.5, "y": 0.5} | {name: np.nan}))


def test_blockers_stand_below_the_light():
    scene = Scene.of(primitive(Segments((0.0, 0.5), (1.0, 0.75))))
    with pytest.raises(ValueError, match=r"above all blockers, of which one is at 0.75 m"):
        depth_range(scene, 0.6)
    with pytest.raises(ValueError, match="`light_height` must be finite"):
        depth_range(scene, np.nan)


def test_a_light_beside_its_height_is_refused_far_from_the_origin_too():
    scene = Scene.of(primitive(Segments((0.5, 1e5 + 0.5), (-0.5, 1e5 + 0.5)), name="light"))
    with pytest.raises(ValueError, match="light_height"):
        visible_lengths(scene, np.zeros(1), 1e5, 1.0)
