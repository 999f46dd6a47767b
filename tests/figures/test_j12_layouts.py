"""What figures of J12 scan: their light is that of the library, their errors are true."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from figures.j12 import occlusion_hessian
from figures.j12.shared import rooms, walls
from figures.j12.shared.box import Size, random_block, tabulated
from figures.j12.shared.caching import by_the_wall
from firstorder.flatland import irradiance, receiver
from firstorder.flatland.bounces._panels import Discretization
from firstorder.flatland.bounces.radiosity import solve_radiosity
from firstorder.flatland.library import _scenes as scenes
from firstorder.space import receiver as receiver_in_space
from firstorder.space.estimators import hemisphere_strata, surface_area_estimate, trace_strata
from firstorder.space.library import j12_box

SHOWN = walls.Layout(0.8, 1.2, 1.0, 1.0)  # Fig. 14 itself


@pytest.mark.parametrize("wall", walls.WALLS)
def test_light_and_rays_of_a_layout_are_those_of_the_scene_of_fig_14(wall):
    scene = scenes.fig14(wall)
    (floor,) = scene.named("floor")
    E = by_the_wall(scene) if wall == "white" else (lambda at: irradiance(scene, at))
    s = jnp.array([0.02, 0.3, 0.8])
    expected = jax.jit(jax.vmap(lambda s: E(receiver(scene, floor, s))))(s)
    share_of_wall = 1.0 if wall == "white" else 0.0
    found = walls._jet(SHOWN, share_of_wall, 2.0 * s)[0]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    t = walls._lengths(SHOWN, wall != "none", np.array([0.04]))
    assert (np.min(t) < 0.05) == (wall != "none")  # the wall is 4 cm away


def test_light_that_a_room_reflects_is_the_radiosity_solution():
    scene = scenes.fig15()
    coarse = Discretization(4, 1e-2)
    solution = solve_radiosity(scene, fineness=coarse)

    @jax.jit
    def lights(s):
        sent = rooms._reflected(scene)
        at = jax.vmap(lambda s: receiver(scene, rooms.FLOOR, s))(s)
        E = jax.vmap(lambda at: irradiance(scene, at, radiance=sent, nodes=rooms.NODES))(at)
        return E, jax.vmap(solution.irradiance)(at)

    found, expected = lights(jnp.array([0.1, 0.3, 0.5]))
    np.testing.assert_allclose(found, expected, rtol=5e-3)


def test_random_rooms_hold_a_block_clear_of_the_walls_and_lamps_of_all_widths():
    found = rooms.random_rooms(8, 3)
    assert [room.width for room in found] == [*rooms.WIDTHS, *rooms.WIDTHS]
    for room in found:
        (lamp,) = room.scene.named("lamp")
        np.testing.assert_allclose(room.scene.length(lamp), room.width, rtol=1e-6)
        block = np.asarray(room.scene.groups[0].start)[list(room.scene.named("block"))]
        assert np.min(block) > 0.05
        assert np.max(block) < 0.95


def test_the_hessian_whose_time_is_taken_is_that_of_the_surface_area_form():
    at = receiver_in_space((0.4, 0.3, 0.0), on=0)
    seen = trace_strata(j12_box(), at, where=hemisphere_strata(8, 24))
    expected = surface_area_estimate(seen).translation().hessian[:2, :2]
    np.testing.assert_allclose(occlusion_hessian._hessian(seen), expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("seed", [0, 1])
def test_exact_light_beside_a_random_block_is_what_rays_find(seed):
    c = tabulated(random_block(seed), Size(16, 40, 120, 0, 0))
    assert c.noise < 0.006 * np.mean(c.truth)  # 0.2 % with twice as many rays
    assert np.mean(c.open) < 1.0
