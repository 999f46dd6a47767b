import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder._argument_checks import is_concrete
from firstorder.space.library import _scenes
from firstorder.space.shapes._bounds import bounds


@pytest.mark.parametrize("name", _scenes.scene_names())
def test_a_scene_is_finite_named_and_told_about(name):
    scene = _scenes.named_scene(name)
    leaves = jax.tree.leaves((scene.groups, scene.material))
    assert is_concrete(scene)
    assert all(np.all(np.isfinite(leaf)) for leaf in leaves)
    assert all(scene.names)
    assert _scenes.describe_scene(name).endswith(".")


@pytest.mark.smoke
def test_the_box_of_j12_faces_inwards_and_loses_its_wall():
    scene = _scenes.j12_box()
    normals = {n: np.asarray(scene.normal(i, jnp.zeros(3))) for i, n in enumerate(scene.names)}
    assert normals["floor"].tolist() == [0.0, 0.0, 1.0]
    assert normals["light"].tolist() == [0.0, 0.0, -1.0]
    assert normals["left"].tolist() == [1.0, 0.0, 0.0]
    assert normals["right"].tolist() == [-1.0, 0.0, 0.0]
    assert "right" not in _scenes.j12_box("none").names


def extents(scene):
    """Lowest and highest coordinates of all shapes."""
    return [np.concatenate(a) for a in zip(*map(bounds, scene.groups), strict=True)]


@pytest.mark.parametrize("name", ["j12_box", "j12_occluder", "clutter", "tables"])
def test_a_room_is_the_unit_cube_with_the_unit_square_for_a_floor(name):
    scene = _scenes.named_scene(name)
    low, high = extents(scene)
    np.testing.assert_allclose(
        [low.min(0), high.max(0)], [[0, 0, 0], [1, 1, 1]], rtol=0.0, atol=1e-15
    )
    (floor,) = scene.named("floor")
    assert [*low[floor], *high[floor]] == [0.0, 0.0, 0.0, 1.0, 1.0, 0.0]


def test_three_spheres_stand_apart_on_two_metres_of_the_plane():
    scene = _scenes.three_spheres()
    low, high = (a[list(scene.named("sphere"))] for a in extents(scene))
    center, radius = 0.5 * (low + high), 0.5 * (high - low)[:, 0]
    apart = np.linalg.norm(center[:, None] - center, axis=-1) + 9.0 * np.eye(3)
    assert np.all(apart > radius[:, None] + radius)
    assert np.all(low[:, :2] >= -1.0)
    assert np.all(high[:, :2] <= 1.0)
    np.testing.assert_allclose(
        low[:, 2].min(), 0.0, rtol=0.0, atol=1e-15
    )  # the first rests on the plane


def test_no_ball_is_higher_than_the_one_that_rests_on_the_plane():
    scene = _scenes.three_spheres()
    low, high = (a[list(scene.named("sphere"))] for a in extents(scene))
    assert np.argmin(low[:, 2]) == np.argmax(high[:, 2]) == 0


def test_the_lamp_over_the_tables_hangs_half_way_up_and_shines_at_the_ceiling():
    """Above the lamp there is nothing but the ceiling, below it the tables."""
    scene = _scenes.tables()
    low, high = extents(scene)
    (lamp,), tables = scene.named("light"), list(scene.named("table"))
    assert high[tables, 2].max() < low[lamp, 2] == high[lamp, 2] < 1.0
    np.testing.assert_allclose(0.5 * (low[lamp] + high[lamp]), 0.5)
    assert scene.normal(lamp, jnp.zeros(3)).tolist() == [0.0, 0.0, 1.0]


def test_the_clutter_does_not_touch_itself_nor_the_walls():
    """Boxes by their outer circles; balls over them."""
    scene = _scenes.clutter()
    boxes = next(g for g in scene.groups if type(g).__name__ == "Boxes")
    center, axes = np.asarray(boxes.center), np.asarray(boxes.axes)
    reach = np.linalg.norm(np.linalg.norm(axes[:, :2, :2], axis=1), axis=1)
    apart = np.linalg.norm(center[:, None, :2] - center[None, :, :2], axis=-1)
    apart = apart - reach[:, None] - reach[None] + 9.0 * np.eye(len(reach))
    assert np.min(apart) > 0.0
    assert np.all(center[:, :2] - reach[:, None] > 0.0)
    assert np.all(center[:, :2] + reach[:, None] < 1.0)
    np.testing.assert_allclose(center[:, 2], axes[:, 2, 2])  # they stand on the floor


def test_each_table_stands_on_four_legs_under_its_top():
    scene = _scenes.tables()
    low, high = (a[list(scene.named("table"))].reshape(3, 5, 3) for a in extents(scene))
    top, legs = (low[:, :1], high[:, :1]), (low[:, 1:], high[:, 1:])
    np.testing.assert_allclose(legs[0][..., 2], 0.0, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(
        legs[1][..., 2], top[0][..., 2] + np.zeros((3, 4)), rtol=0.0, atol=1e-15
    )
    np.testing.assert_allclose((legs[1] - legs[0])[..., :2], 0.02, rtol=0.0, atol=1e-15)
    # They stand as far from one end as from the other, within the top.
    gaps = [np.min((legs[0] - top[0])[..., :2], 1), np.min((top[1] - legs[1])[..., :2], 1)]
    np.testing.assert_allclose(gaps, 0.01, rtol=0.0, atol=1e-15)


def test_an_unknown_name_is_one_sentence():
    with pytest.raises(ValueError, match="Argument `name` must be one of"):
        _scenes.named_scene("cornell")
    with pytest.raises(ValueError, match="Argument `name` must be one of"):
        _scenes.describe_scene("cornell")
    with pytest.raises((ValueError, TypeError), match=r"Argument `name` must be one of|name="):
        _scenes.describe_scene(_scenes.three_spheres())  # of a scene; a type check may be first
    with pytest.raises(ValueError, match="Argument `wall` must be one of"):
        _scenes.j12_box("white")
