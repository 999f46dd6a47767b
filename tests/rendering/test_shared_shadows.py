"""Shared shadows of an image: values by exact silhouettes, gradients by differences, refusals."""

import jax
import numpy as np
import pytest

from firstorder import imaging, reconstruction, space
from firstorder.rendering.shared_shadows import share_shadow_rays

FLOOR = space.primitive(
    space.plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor", albedo=(0.7, 0.0)
)
BALL = space.primitive(space.sphere((-0.3, 0.1, 0.9), 0.35), name="ball", albedo=0.6)
AWAY = space.primitive(space.sphere((0.0, -9.0, 0.0), 0.1), name="behind the eye")
SCENE = space.Scene.of(FLOOR, BALL, AWAY)
CAMERA = imaging.pinhole((0.1, -3.4, 2.6), (0.1, 0.0, 0.35), gamma=2.5)
LAMP = imaging.Lamp((-0.3, 0.2, 3.2), (0.0, 0.45, 0.0), (0.45, 0.0, 0.0), 12.0)
COLUMNS, ROWS = 40, 24
HITS = imaging.primary_hits(SCENE, CAMERA, (COLUMNS, ROWS))


def shared(name="floor", rays=16.0, **options):
    return share_shadow_rays(SCENE, CAMERA, LAMP, HITS, name, rays_per_pixel=rays, **options)


def centres():
    k = np.stack(np.meshgrid(np.arange(COLUMNS), np.arange(ROWS), indexing="ij"), -1)
    return k.reshape(-1, 2) + 0.5


def exact():
    """Radiance of the floor's pixels by silhouettes, NaN elsewhere."""
    light = space.primitive(space.rectangle(LAMP.center, LAMP.u, LAMP.v), emission=(12.0, 0.0))
    scene = space.Scene.of(FLOOR, BALL, AWAY, light)
    on, met = scene.named("floor")[0], HITS.index == SCENE.named("floor")[0]
    E = jax.lax.map(lambda x: space.irradiance(scene, space.receiver(x, on=on)), HITS.position[met])
    value = np.full((COLUMNS, ROWS), np.nan)
    value[met] = 0.7 / np.pi * np.asarray(E)
    return value


TRUTH = exact()


def off(values):
    """Root mean square error over the floor, over the brightest of it."""
    return np.sqrt(np.nanmean((values - TRUTH) ** 2)) / np.nanmax(TRUTH)


def test_many_shared_rays_give_the_exact_shadow_and_few_are_expected_to_be_off():
    errors, expected = [], []
    for rays, band in ((1.0, 1.0), (64.0, 8.0)):
        one = shared(rays=rays, band_limit=band)
        errors.append(off(one.shade(centres()).value.reshape(COLUMNS, ROWS)))
        wrong = one.expected_error(centres()).reshape(COLUMNS, ROWS)[~np.isnan(TRUTH)]
        expected.append(np.sqrt(np.mean(wrong**2)) / np.nanmax(TRUTH))
    assert errors[1] < 0.01 < 0.5 * errors[0]
    assert 0.5 < expected[0] / errors[0] < 3.0
    assert expected[1] < 0.4 * expected[0]


def test_the_reference_has_rays_of_its_own_in_every_pixel():
    reference = shared().reference(16, 5)
    assert off(reference) < 256**-0.75  # stratified rays where an edge crosses the lamp
    ball = reference[HITS.index == SCENE.named("ball")[0]]
    assert np.mean(ball > 0.0) > 0.5, "the lamp shines on the ball's upper half"
    assert np.array_equal(reference, shared().reference(16, 5))


def test_gradients_are_those_of_the_image():
    one = shared(rays=64.0, band_limit=2.0)
    inside = np.zeros((COLUMNS, ROWS), bool)
    inside[1:-1, 1:-1] = True
    for axis in range(2):
        for step in (-1, 1):
            inside &= np.roll(HITS.index, step, axis) == SCENE.named("floor")[0]
    p = centres()[inside.ravel()]
    found = one.shade(p)
    h = 0.5 * np.eye(2)
    wanted = np.stack([one.shade(p + e).value - one.shade(p - e).value for e in h], -1)
    scale = np.max(abs(wanted))
    # Over a pixel the product's difference has second derivatives too: percents of the largest.
    np.testing.assert_allclose(found.gradient, wanted, rtol=0.0, atol=0.04 * scale)
    assert np.sqrt(np.mean((found.gradient - wanted) ** 2)) < 0.02 * np.sqrt(np.mean(wanted**2))
    # Where a shadow moves, the light alone knows little of it.
    assert np.max(abs(found.more - wanted)) > 0.5 * scale


def test_a_pixel_is_as_wide_as_the_step_to_the_next_place_beside_it():
    place, floor = np.asarray(HITS.position), HITS.index == SCENE.named("floor")[0]
    both = np.asarray(floor[1:] & floor[:-1])
    step = np.linalg.norm(place[1:] - place[:-1], axis=-1)[both]
    # Steps grow towards the sides, where the view is oblique.
    np.testing.assert_allclose(shared(rays=1.0).pixel, np.median(step), rtol=0.03)


def test_shapes_that_do_not_share_have_rays_of_their_own():
    on_ball = HITS.index.ravel() == SCENE.named("ball")[0]
    by_floor, by_ball = (shared(name).shade(centres()) for name in ("floor", "ball"))
    assert by_floor.gradient is not None
    assert by_floor.more is not None
    assert by_ball.gradient is not None
    assert by_ball.more is not None
    assert not np.array_equal(by_floor.gradient[~on_ball], by_floor.more[~on_ball])
    np.testing.assert_array_equal(by_floor.gradient[on_ball], by_floor.more[on_ball])
    np.testing.assert_array_equal(by_ball.gradient[~on_ball], by_ball.more[~on_ball])


def test_an_image_from_all_pixels_is_what_they_show():
    one = shared()
    found = reconstruction.sample_image(
        one.shade, COLUMNS, ROWS, 2 * COLUMNS * ROWS, smallest=1.0, thorough=True
    )
    image = one.image(found)
    every = one.shade(centres()).value.reshape(COLUMNS, ROWS)
    # Samples in the middles of larger squares lie between the pixels.
    assert np.sqrt(np.mean((image.value - every) ** 2)) < 0.02 * np.max(every)
    assert image.error.shape == (COLUMNS, ROWS)
    assert np.all(image.error >= 0.0)


def test_a_shape_that_no_pixel_shows_is_refused():
    with pytest.raises(ValueError, match=r"`name` .* shape that is seen, but is 'behind the eye'"):
        shared("behind the eye")


def test_a_place_that_is_nan_has_no_light():
    with pytest.raises(ValueError, match=r"^Argument `p` must be finite, but is nan\.$"):
        shared().shade(np.array([[np.nan, 1.5]]))


def test_an_image_of_one_column_has_pixels_of_a_size():
    hits = imaging.primary_hits(SCENE, CAMERA, (1, 4))
    one = share_shadow_rays(SCENE, CAMERA, LAMP, hits, "floor")
    assert one.side == 2.0
    assert np.all(np.isfinite(one.shade(np.array([[0.5, 0.5]])).value))


def test_a_camera_in_place_of_the_scene_is_one_sentence():
    hits = imaging.primary_hits(SCENE, CAMERA, (1, 4))
    with pytest.raises(TypeError, match=r"^Argument `scene` must be a Scene|parameter scene="):
        share_shadow_rays(CAMERA, SCENE, LAMP, hits, "floor")


def test_a_band_limit_of_nothing_is_refused():
    with pytest.raises(ValueError, match="`band_limit` must be positive"):
        shared(band_limit=0.0)


def test_a_name_of_several_shapes_and_no_strata_are_refused():
    both = space.Scene.of(FLOOR, BALL, BALL)
    hits = imaging.primary_hits(both, CAMERA, (4, 3))
    with pytest.raises(ValueError, match=r"`name` must be that of one shape, but 'ball' names 2"):
        share_shadow_rays(both, CAMERA, LAMP, hits, "ball")
    with pytest.raises(ValueError, match=r"`strata` must be a positive integer, but is 0\."):
        shared(strata=0)


def test_places_that_are_not_below_the_lamp_are_dark():
    wall = space.primitive(space.rectangle((0.0, 1.5, 1.0), (1.5, 0.0, 0.0), (0.0, 0.0, 1.0)))
    scene, lamp = space.Scene.of(FLOOR, wall), imaging.Lamp((0, 0, 1), (0, 0.2, 0), (0.2, 0, 0))
    eye = imaging.pinhole((0.0, -4.0, 1.0), (0.0, 0.0, 0.8), gamma=1.5)
    hits = imaging.primary_hits(scene, eye, (16, 12))
    made = share_shadow_rays(scene, eye, lamp, hits, "floor", rays_per_pixel=2.0)
    above = (hits.position[..., 2] >= 1.0) & (hits.index >= 0)
    assert np.any(above)
    np.testing.assert_array_equal(made.reference(4, 7)[above], 0.0)
    p = np.argwhere(above) + 0.5
    for found in (made.shade(p).value, made.shade(p).gradient, made.expected_error(p)):
        np.testing.assert_array_equal(found, 0.0)
