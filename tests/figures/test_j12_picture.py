import jax
import jax.numpy as jnp
import numpy as np
import pytest

from figures.j12.shared import exact_box, picture
from figures.j12.shared.exact_box import BLOCK, Room
from firstorder.plotting import panels
from firstorder.space import Receiver, irradiance
from firstorder.space.library import _scenes

GREY = np.zeros((picture.CELLS, picture.CELLS))


def rays(targets):
    """Image coordinates at which the camera sees places, shape (n, 3)."""
    right, up, back = ((targets - np.asarray(picture.CAMERA.eye)) @ picture.CAMERA.axes).T
    return jnp.asarray(float(picture.CAMERA.gamma) * np.stack([right, up], 1) / -back[:, None])


def seen(targets, blocked=False):
    """Radiance in three bands and whether nothing is met, where the floor is black."""
    return np.asarray(picture._seen(Room(), jnp.asarray(GREY), rays(targets), blocked))


@pytest.mark.parametrize("blocked", [False, True])
def test_the_lamp_lights_the_floor_as_the_library_says(blocked):
    scene = _scenes.j12_occluder() if blocked else _scenes.j12_box()
    cells = [(20, 30), (40, 66), (58, 60), (30, 38)]  # row and column; the last beside the block
    x = np.array([((j + 0.5) / picture.CELLS, (i + 0.5) / picture.CELLS, 0.0) for i, j in cells])
    exact = jax.vmap(lambda p: irradiance(scene, Receiver.at(p)))(jnp.asarray(x))
    found = picture._direct(Room(), blocked)[tuple(np.transpose(cells))]
    # Where the block hides some of the lamp, 32^2 places on it tell its share to two of their rows.
    assert np.allclose(found, exact, rtol=2.0 / 32.0 if blocked else 1e-6)


def test_the_left_wall_the_lamp_and_nothing_are_seen_where_they_are():
    targets = np.array([(0.0, 0.4, 0.6), (0.5, 0.5, 1.0), (1.0, 0.5, 0.5), (0.5, 1.5, 0.9)])
    found = seen(targets)
    wall = exact_box.wall_light(Room(), 0.4, 0.6)
    assert np.allclose(found[0, :3], wall * picture.TINTS[0])
    assert np.allclose(found[1], (1.0, 1.0, 1.0, 0.0))
    assert np.array_equal(found[2], (0.0, 0.0, 0.0, 0.0))
    assert found[3, 3] == 1.0


def test_the_block_sends_what_the_lamp_gives_its_top_and_hides_what_is_behind_it():
    top = np.array([[0.45, 0.5, 0.25]])
    E = irradiance(_scenes.j12_box(), Receiver.at(jnp.asarray(top[0])))
    grey = 0.5 / np.pi * float(E)
    assert np.allclose(seen(top, True)[0, :3], grey * picture.TINTS[1], rtol=1e-3)
    behind = np.array([[0.4, 0.7, 0.0]])  # on the floor, behind the block for the camera
    white = jnp.asarray(GREY + 1.0)
    lit, hidden = (picture._seen(Room(), white, rays(behind), b)[0] for b in (False, True))
    assert np.allclose(lit, (1.0, 1.0, 1.0, 0.0))
    assert np.all(hidden < 0.1)


def test_records_are_drawn_where_the_camera_sees_them_and_not_behind_the_block():
    _, axes = panels()
    corner = BLOCK[0] - 0.05
    records = np.array([corner, (0.4, 0.7)])
    picture.show_box(axes[0, 0], Room(), GREY, "", records=records, blocked=True)
    (dots,) = axes[0, 0].lines
    x, y = np.asarray(dots.get_data())
    assert len(x) == 1
    p = np.asarray(rays(np.array([[*corner, 0.0]])))[0]
    width, height = picture.SHAPE
    assert np.allclose((x[0], y[0]), (0.5 * width * (1 + p[0]), 0.5 * (height + width * p[1])))
