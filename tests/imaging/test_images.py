"""Images against closed forms: values, gradients through soft shadows, glossy lobes, labels."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise, rounding
from firstorder.imaging import images
from firstorder.imaging.camera import pinhole
from firstorder.imaging.images import _render_pixels, pixel_grid, pixel_labels
from firstorder.space import (
    Scene,
    box,
    cylinder,
    primitive,
    rectangle,
    sphere,
)
from tests.imaging.worlds import ALBEDO, GROUND, SKY, ball_over_floor, open_light

CAMERA = pinhole((0.4, -4.0, 2.2), (0.2, 0.1, 0.3), gamma=2.0)
world = pytest.fixture(scope="module")(ball_over_floor)


def on_floor(p):
    """Where rays through p meet z = 0, by arithmetic of this test's own."""
    axes, eye = np.asarray(CAMERA.axes), np.asarray(CAMERA.eye)
    d = p[:, :1] * axes[:, 0] + p[:, 1:] * axes[:, 1] - 2.0 * axes[:, 2]
    return (eye - d * (eye[2] / d[:, 2:]))[:, :2]


@pytest.fixture(scope="module")
def image(world):
    return images.render(world, CAMERA, 16, 12)


def floor_pixels(image):
    p = images.pixel_positions(image.px, image.py)
    seen = image.label.ravel() == 6 * 1  # the plane comes after the ellipsoid
    return p[seen], image.value.ravel()[seen], image.gradient.reshape(-1, 2)[seen]


@pytest.mark.smoke
def test_soft_shadows_are_the_closed_form(image):
    p, value, _ = floor_pixels(image)
    assert len(p) > 80
    assert normwise(value, ALBEDO / np.pi * open_light(on_floor(p))) < 1e-12


def gradient_error(p, gradient):
    """Against the closed form's slope times the slope of where a ray meets the floor."""
    axes, height = np.asarray(CAMERA.axes), float(CAMERA.eye[2])
    d = p[:, :1] * axes[:, 0] + p[:, 1:] * axes[:, 1] - 2.0 * axes[:, 2]
    x, z = on_floor(p), d[:, 2:]
    slope = ALBEDO * SKY * 0.75 * x / (1.0 + np.sum(x * x, -1, keepdims=True)) ** 2.5
    moved = [-height * (axes[:2, k] / z - d[:, :2] * axes[2, k] / z**2) for k in (0, 1)]
    return normwise(gradient, np.stack([np.sum(slope * m, -1) for m in moved], -1))


def test_gradients_of_the_image_are_exact_through_shadows(image):
    p, _, gradient = floor_pixels(image)
    assert gradient_error(p, gradient) < 1e-12


def test_a_fault_of_the_gradient_is_noticed(image):
    p, _, gradient = floor_pixels(image)
    assert gradient_error(p, gradient[:, ::-1]) > 1e-2
    assert gradient_error(p, 0.5 * gradient) > 1e-2


def test_the_sky_and_the_black_ball_are_what_they_emit(world, image):
    assert set(image.value[image.label == 0].tolist()) == {0.0}
    assert np.all(np.isfinite(image.gradient))
    above = np.array([[0.0, 1.5]])
    index, label = pixel_labels(world, CAMERA, jnp.asarray(above))
    assert label.tolist() == [-1]
    value, gradient = _render_pixels(world, CAMERA, above, index)
    assert value.tolist() == [SKY]
    assert gradient.tolist() == [[0.0, 0.0]]


def test_pictures_have_their_first_row_on_top(image):
    assert image.picture.shape == (12, 16)
    assert image.picture[0, 0] == image.value[0, -1]


def test_pixels_fill_the_width_and_are_square():
    px, py = pixel_grid(4, 2, 2.0)
    assert px.tolist() == [-1.5, -0.5, 0.5, 1.5]
    assert py.tolist() == [-0.5, 0.5]


# --- labels --------------------------------------------------------------------------------------


def test_labels_tell_faces_apart():
    scene = Scene.of(
        primitive(box((-1.0, -1.0, 0.0), (1.0, 1.0, 1.0))),
        primitive(cylinder((4.0, 0.0, 0.0), (4.0, 0.0, 1.0), 0.5)),
    )
    camera = pinhole((0.0, -6.0, 5.0), (0.0, 0.0, 0.5), gamma=1.0)

    def seen(*points):
        way = (np.array(points) - np.asarray(camera.eye)) @ np.asarray(camera.axes)
        p = -way[:, :2] / way[:, 2:]
        return np.asarray(pixel_labels(scene, camera, jnp.asarray(p))[1]).tolist()

    assert seen((0.0, 0.0, 1.0), (0.0, -1.0, 0.5)) == [5, 2]
    assert seen((4.0, 0.1, 1.0), (4.0, -0.5, 0.5), (0.0, 60.0, 30.0)) == [8, 6, -1]


def test_bad_sizes_are_one_sentence():
    with pytest.raises(ValueError, match="`columns` must be positive"):
        pixel_grid(0, 3)
    with pytest.raises((ValueError, TypeError), match=r"`half_width` must be one|parameter half_"):
        pixel_grid(2, 3, np.ones(3))


def test_one_place_without_its_row_is_one_sentence():
    scene = Scene.of(primitive(sphere((0.0, 0.0, 0.0), 0.8)))
    with pytest.raises(ValueError, match=r"`p` must have shape \(n, 2\), but has \(2,\)"):
        pixel_labels(scene, CAMERA, np.zeros(2))
    with pytest.raises(TypeError, match=r"Argument `camera` must be a camera|parameter camera="):
        pixel_labels(scene, scene, np.zeros((1, 2)))


def test_a_lamp_that_runs_into_a_ball_is_refused_where_its_light_is_seen():
    """Exact light is 3 % off there; from the side of the lamp that is dark nothing is."""
    lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
    ball = primitive(sphere((0.1, 0.1, 2.1), 0.2))
    camera = pinhole((0.0, -4.0, 1.0), (0.0, 0.0, 0.0), gamma=0.3)
    lit = Scene.of(primitive(GROUND, albedo=0.5), primitive(lamp, emission=1.0), ball)
    with pytest.raises(ValueError, match=r"^Shapes \d and \d run into each other"):
        images.render(lit, camera, 3, 2)
    dark = Scene.of(primitive(GROUND, albedo=0.5), primitive(lamp, emission=(0.0, 1.0)), ball)
    np.testing.assert_array_equal(images.render(dark, camera, 3, 2).value, 0.0)


def test_rounding_is_what_the_closed_form_is_met_to(image):
    """The brightest floor pixel is far out, where nearly all of the sky is seen."""
    _, value, _ = floor_pixels(image)
    assert np.max(value) < ALBEDO * SKY * (1.0 + rounding())
