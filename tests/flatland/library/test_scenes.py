import jax
import numpy as np
import pytest

from firstorder._argument_checks import is_concrete
from firstorder.flatland import irradiance, receiver
from firstorder.flatland.library import _scenes as scenes
from firstorder.flatland.scene import Scene
from firstorder.io import flatland_from_toml, flatland_to_toml


def floor_irradiance(scene, s, part=0):
    index = scene.named("floor")[part]
    return np.array(jax.jit(jax.vmap(lambda s: irradiance(scene, receiver(scene, index, s))))(s))


def same(a: Scene, b: Scene):
    """Whether two scenes are alike to the bit."""
    one, other = (jax.tree.flatten(scene) for scene in (a, b))
    assert one[1] == other[1]
    return all(np.array_equal(p, q) for p, q in zip(one[0], other[0], strict=True))


@pytest.mark.parametrize("name", scenes.scene_names())
def test_a_scene_is_finite_named_told_about_and_comes_back_from_its_file(name):
    scene = scenes.named_scene(name)
    assert is_concrete(scene)
    leaves = jax.tree.leaves((scene.groups, scene.material, scene.points, scene.environment))
    assert all(np.all(np.isfinite(leaf)) for leaf in leaves)
    assert all(scene.names)
    assert scenes.describe_scene(name).endswith(".")
    assert same(flatland_from_toml(flatland_to_toml(scene)), scene)


@pytest.mark.smoke
def test_scenes_a_and_b_have_the_irradiance_of_their_sines():
    """At the centre all of the occluder is before the lamp."""
    s = np.linspace(0.1, 0.9, 9)
    x = 2 * s - 1
    exact = (0.5 - x) / np.hypot(0.5 - x, 1) + (0.5 + x) / np.hypot(0.5 + x, 1)
    E = floor_irradiance(scenes.scene_a(), s)
    np.testing.assert_allclose(E, exact, rtol=1e-13)
    blocked = E[4] - floor_irradiance(scenes.scene_b(), s)[4]
    np.testing.assert_allclose(blocked, 2 * 0.2 / np.hypot(0.2, 0.5), rtol=1e-13)


def test_walls_face_into_the_room_and_blocks_out_of_themselves():
    for scene in (scenes.scene_c(), scenes.scene_d(), scenes.fig15()):
        for index, name in enumerate(scene.names):
            frame = scene.frame(index, 0.3)
            middle = np.array([0.5, 0.5])
            if name == "occluder":
                middle = np.array(scene.groups[1].center[index - 4])
            inward = np.dot(frame.normal, middle - np.asarray(frame.position)) > 0
            assert inward == (name not in ("block", "occluder")), (name, index)


def test_the_room_is_closed():
    """The walls' ends meet, and their lengths add up to the perimeter."""
    for scene in (scenes.scene_c(), scenes.fig15()):
        walls = [i for i, name in enumerate(scene.names) if name != "block"]
        group = scene.groups[0]
        starts = {tuple(np.asarray(group.start[i]).tolist()) for i in walls}
        assert starts == {tuple(np.asarray(group.end[i]).tolist()) for i in walls}
        np.testing.assert_allclose(sum(scene.length(i) for i in walls), 4.0, rtol=1e-13)


def test_the_lamp_and_the_block_of_fig_15_are_where_they_are_put():
    scene = scenes.fig15(lamp=(0.1, 0.9), low=(0.2, 0.3), high=(0.5, 0.7))
    (lamp,) = scene.named("lamp")
    block = np.asarray(scene.groups[0].start)[list(scene.named("block"))]
    np.testing.assert_allclose(scene.length(lamp), 0.8, rtol=1e-13)
    np.testing.assert_allclose(np.min(block, axis=0), (0.2, 0.3), rtol=1e-13)
    np.testing.assert_allclose(np.max(block, axis=0), (0.5, 0.7), rtol=1e-13)


def test_the_wall_of_fig_14_throws_no_shadow():
    s = np.linspace(0.01, 0.99, 8)
    white, black, none = (floor_irradiance(scenes.fig14(w), s) for w in ("white", "black", "none"))
    np.testing.assert_array_equal(black, none)
    np.testing.assert_array_equal(white, none)


def test_the_wall_of_fig_14_is_as_high_as_its_lamp_and_faces_the_floor():
    scene = scenes.fig14()
    (wall,) = scene.named("wall")
    points = [np.asarray(scene.frame(wall, s).position) for s in (0.0, 0.25, 1.0)]
    np.testing.assert_allclose(points, [[0.0, 1.0], [0.0, 0.75], [0.0, 0.0]], rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(scene.frame(wall, 0.5).normal, [1.0, 0.0], rtol=0.0, atol=1e-15)


def test_the_lamp_of_fig_14_hangs_over_the_middle_of_the_floor():
    E = floor_irradiance(scenes.fig14("none"), np.linspace(0.0, 1.0, 9))
    np.testing.assert_allclose(E, E[::-1], rtol=1e-13)


def test_the_shadows_of_r07_fig_9_are_deep_under_both():
    scene = scenes.r07_fig09()
    under_box, under_circle, free = floor_irradiance(scene, (np.array([-0.95, 0.6, 3.0]) + 3) / 6)
    assert under_box < 0.1 * free
    assert under_circle < 0.5 * free


def test_bumps_lie_on_their_profile():
    for scene, bumps in (
        (scenes.r07_fig16(), scenes.SineBumps()),
        (scenes.r07_fig17(), scenes.ChirpBumps()),
    ):
        group = scene.groups[0]
        for points in (np.asarray(group.start), np.asarray(group.end)):
            np.testing.assert_allclose(
                points[:, 1], bumps.height(points[:, 0]), rtol=0.0, atol=1e-15
            )
        middle = np.asarray(0.5 * (group.start + group.end))
        step = float(np.asarray(group.end - group.start)[0, 0])
        x = np.linspace(middle[0, 0], middle[-1, 0], 4001)
        bound = np.max(np.abs(bumps.heights(x)[2])) * step**2 / 8
        assert np.max(np.abs(middle[:, 1] - bumps.height(middle[:, 0]))) <= bound


def test_parameters_can_be_differentiated():
    def light(radius):
        scene = scenes.scene_d(radius=radius)
        return scene.length(4)

    np.testing.assert_allclose(jax.grad(light)(0.08), 2 * np.pi, rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: scenes.fig14("grey"),
            "Argument `wall` must be white, black or none, but is 'grey'.",
        ),
        (
            lambda: scenes.named_scene("scene_z"),
            r"Argument `name` must be one of scene_a, .*, but is 'scene_z'.",
        ),
    ],
)
def test_a_scene_that_is_not_there_is_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()
