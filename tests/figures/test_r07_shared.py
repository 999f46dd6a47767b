"""What R07's figures share: lay-outs, and measures of which the answer is known."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from figures.r07 import fig04, fig12
from figures.r07.shared import meshes, shadows, spheres, table
from firstorder.flatland import Circles, Scene, Segments, primitive
from firstorder.reconstruction import LineCell


def lamps():
    return [o.lamp(2.0) for o in table.layouts(4)] + meshes.lamps(4, 3)


def test_the_lamps_of_all_layouts_shine_on_the_middle():
    for lamp in lamps():
        toward = np.asarray(lamp.center) - (0.0, 0.0, 0.4)
        assert np.all(np.asarray(lamp.area) @ toward < 0.0)


def test_a_lamp_gives_the_middle_as_much_light_wherever_it_is():
    near, far = (next(table.layouts(1)).lamp(d) for d in (1.0, 3.0))
    light = [
        float(lamp.radiance * jnp.sum(jnp.linalg.norm(lamp.area, axis=-1)))
        / float(jnp.sum((lamp.center - jnp.array([0.0, 0.0, 0.4])) ** 2))
        for lamp in (near, far)
    ]
    np.testing.assert_allclose(light[0], light[1], rtol=1e-12)


def test_the_bumps_of_all_layouts_have_the_slope_of_the_first_on_average():
    for layout in table.layouts(3):
        bumps = layout.world.height
        slope = bumps.height * jnp.mean(bumps.waves)
        np.testing.assert_allclose(slope, table.BUMP * table.WAVE, rtol=1e-12)


def test_references_of_a_changed_scene_are_others():
    scene = meshes.world()
    ball = scene.models[1]
    changed = (
        scene,
        scene._replace(models=(ball,)),
        scene._replace(models=(dataclasses.replace(ball, material={"albedo": 0.1}),)),
        scene._replace(camera=meshes.pinhole((0.0, -6.0, 2.4), (0.0, 0.0, 0.3), gamma=2.7)),
        *(scene._replace(lamps=(lamp,)) for lamp in meshes.lamps(2, 3)),
    )
    assert len({meshes._digest(one) for one in changed}) == len(changed)
    assert meshes._digest(scene) == meshes._digest(scene._replace(lamps=(meshes.lamp(),)))


def test_adaptive_azimuths_agree_with_the_derivative_by_hand():
    x, y = np.array([1.3, 0.7, 0.1, -0.9]), np.array([0.2, -0.6, 0.3, 1.1])
    exact = fig12.analytic(x, y)
    level = 2.0 * np.max(np.abs(exact)) / 255.0
    np.testing.assert_allclose(fig12.adaptive(x, y, 400, batch=4), exact, rtol=0.0, atol=level)
    few = np.abs(fig12.adaptive(x, y, 100, batch=4) - exact)
    assert np.max(few) > np.max(np.abs(fig12.adaptive(x, y, 400, batch=4) - exact))


def test_the_derivative_by_hand_is_that_of_what_is_seen():
    x, y, h = np.array([1.3, 0.1]), np.array([0.2, 0.3]), 1e-5
    slope = (fig12.seen(x + h, y) - fig12.seen(x - h, y)) / (2.0 * h)
    np.testing.assert_allclose(fig12.analytic(x, y), slope, rtol=1e-8)


def test_the_blockers_of_all_rooms_stand_clear_of_the_floor():
    for room in shadows.rooms(20):
        segments, circles = (
            next(g for g in room.groups if isinstance(g, kind)) for kind in (Segments, Circles)
        )
        assert float(circles.center[0, 1] - circles.radius[0]) > 0.05
        assert segments.start.shape[0] == 5  # the floor, and four sides of the box
        assert float(jnp.min(segments.start[1:, 1])) >= 0.15
    for world, _ in spheres.rooms(20):
        assert bool(jnp.all(world.center[:, 2] >= world.radius - 1e-12))


def test_disagreement_is_the_error_of_lines_without_a_second_derivative():
    left, right = jnp.array([0.0, 0.0, 99.0]), jnp.array([1.0, 2.0, 99.0])
    assert shadows.disagreement(LineCell(jnp.array(1.0), left, right)).item() == 0.25


def test_cubics_through_samples_know_their_slopes():
    at, x = np.array([-1.0, 0.5, 1.0]), np.linspace(-1.0, 1.0, 7)
    known = np.stack([at**3, 3.0 * at**2], 1)
    np.testing.assert_allclose(
        shadows._through(at, known, shadows.CUBIC, x), x**3, rtol=0.0, atol=1e-14
    )


def test_the_samples_that_are_needed_are_those_of_the_median_image():
    budgets = np.array([5, 9, 17])
    errors = np.array([[0.3, 0.2, 0.05], [0.3, 0.05, 0.01], [0.3, 0.2, 0.05]])
    assert shadows.samples_needed(errors, budgets, 0.1) == 17.0
    assert shadows.samples_needed(errors, budgets, 0.001) == 34.0


def test_the_inverse_distance_below_a_wide_ceiling_is_the_mean_of_the_cosine_over_its_height():
    ceiling = Scene.of(
        primitive(Segments((-3.0, 0.0), (3.0, 0.0)), name="floor"),
        primitive(Segments((1e4, 2.0), (-1e4, 2.0)), name="ceiling"),
    )
    got = shadows.inverse_distance(ceiling, np.zeros(1))
    np.testing.assert_allclose(got, 2.0 / np.pi / 2.0, rtol=1e-3)


def test_a_light_moves_away_along_the_direction_in_which_the_top_of_the_hill_sees_it():
    top = [float(fig04.line(near, 0.2, 0.3, 0.0, np.arctan(0.3))) for near in (0.0, 0.5, 4.0)]
    np.testing.assert_allclose(top, 1.0, rtol=1e-12)
