"""Images against closed forms: values, gradients through soft shadows, glossy lobes, labels."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise, rounding
from firstorder.imaging import images
from firstorder.imaging.camera import pinhole
from firstorder.imaging.images import _gathered, _render_pixels, pixel_grid, pixel_labels
from firstorder.space import (
    Receiver,
    Scene,
    box,
    cylinder,
    plane,
    primitive,
    receiver,
    rectangle,
    sphere,
)

ALBEDO, SKY = 0.7, 1.5
CAMERA = pinhole((0.4, -4.0, 2.2), (0.2, 0.1, 0.3), gamma=2.0)
GROUND = plane((0, 0, 0), (0, 0, 1))


def open_light(x):
    """Irradiance beside a sphere of 0.5 m, 1 m up, under a uniform sky."""
    return SKY * np.pi * (1.0 - 0.25 / (1.0 + np.sum(x * x, -1)) ** 1.5)


@pytest.fixture(scope="module")
def world():
    ball = primitive(sphere((0.0, 0.0, 1.0), 0.5), name="ball", emission=(0.0, 0.0))
    return Scene.of(primitive(GROUND, name="floor", albedo=ALBEDO), ball, environment=SKY)


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


# --- gathered light ------------------------------------------------------------------------------


def lit(world, sky, exponent, rays=2048):
    """Value and gradient by the receiver's place of what a lobe about the normal gathers."""
    scene = Scene(world.groups, world.material, sky, world.names)

    def light(x):
        at = Receiver(x, jnp.eye(3), jnp.zeros((2, 2)), jnp.asarray(1))
        return _gathered(scene, at, jnp.array([0.0, 0.0, 1.0]), jnp.asarray(exponent), rays)

    return jax.jit(jax.value_and_grad(light))


def test_irradiance_under_a_sky_that_is_a_function(world):
    """The same uniform sky, as a function: gathered to a share, its gradient exact."""
    x = jnp.array([0.9, 0.3, 0.0])
    E, dE = lit(world, jax.tree_util.Partial(lambda w: SKY + 0.0 * w[2]), 0.0)(x)
    here = np.array([0.9, 0.3])
    slope = SKY * np.pi * 0.75 * here / (1.0 + here @ here) ** 2.5
    assert abs(float(E) / open_light(here) - 1.0) < 2e-3
    assert normwise(dE[:2], slope) < 1e-12


def test_a_lobe_of_exponent_zero_is_irradiance_whatever_its_axis():
    """Under a white sky; of exponent one, b off the normal, 2/3 ((pi - b) cos b + sin b)."""
    scene, cos, sin = Scene.of(primitive(GROUND), environment=1.0), 0.8, 0.6
    at, axis = receiver((0.1, 0.2, 0.0), on=0), jnp.array([sin, 0.0, cos])
    gathered = jax.jit(lambda e: _gathered(scene, at, axis, e, 2048))
    assert float(gathered(0.0)) == pytest.approx(np.pi, rel=1e-12)
    leaning = ((np.pi - np.arccos(cos)) * cos + sin) / 1.5
    assert float(gathered(1.0)) == pytest.approx(leaning, rel=1e-3)


def cap_error(world):
    """Below the ball, lobe about the normal: the ball hides a cap of half-angle a, sin a = R / d.

    Light is left from a on: `2 pi / (e + 2) cos^(e+2) a`; nearer, a grows by `tan a / d`.
    """
    e, sine = 6.0, 0.5
    _, slope = lit(world, jax.tree_util.Partial(lambda w: 1.0 + 0.0 * w[2]), e)(jnp.zeros(3))
    exact = -2.0 * np.pi * sine**2 * (1.0 - sine**2) ** (0.5 * e)
    return normwise(slope, np.array([0.0, 0.0, exact]))


def test_the_gradient_of_a_glossy_lobe_behind_a_ball(world):
    assert cap_error(world) < 1e-12


@pytest.mark.parametrize("fault", ["no boundary term", "the weight forgets the lobe"])
def test_a_wrong_boundary_is_noticed(fault, world, monkeypatch):
    right = images.boundary_gradient
    wrong = {
        "no boundary term": lambda *a, **k: jnp.zeros(3),
        "the weight forgets the lobe": lambda s, at, weight: right(s, at),
    }[fault]
    monkeypatch.setattr(images, "boundary_gradient", wrong)
    error = cap_error(world)
    assert np.isfinite(error)
    assert error > 1e-3


def test_a_glossy_floor_under_a_white_sky_shows_its_share():
    floor = primitive(GROUND, albedo=0.3, specular=0.4, exponent=20.0)
    scene = Scene.of(floor, environment=1.0)
    camera = pinhole((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    value, gradient = _render_pixels(scene, camera, np.zeros((1, 2)), np.zeros(1, int), rays=4096)
    assert abs(value[0] - 0.7) < 1e-3
    assert np.max(np.abs(gradient)) < 1e-3


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
