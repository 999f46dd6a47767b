"""The cross-bilateral filter: constants and planes kept, edges of depth and normal respected."""

import numpy as np
import pytest

from firstorder import reconstruction
from firstorder.reconstruction.bilateral import bilateral_widths, cross_bilateral
from firstorder.reconstruction.blue_noise import blue_noise_samples

WIDTH, HEIGHT = 96, 64


def samples(count=400, density=None):
    density = np.ones((WIDTH, HEIGHT)) if density is None else density
    return np.argwhere(blue_noise_samples(density, count)) + 0.5, bilateral_widths(density, count)


def flat():
    return np.full((WIDTH, HEIGHT), 3.0), np.broadcast_to((0.0, 0.0, 1.0), (WIDTH, HEIGHT, 3))


def test_constants_stay_whatever_the_guides():
    rng = np.random.default_rng(0)
    p, h = samples()
    normal = rng.normal(size=(WIDTH, HEIGHT, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    depth = 1.0 + 5.0 * rng.random((WIDTH, HEIGHT))
    found = cross_bilateral(p, np.full(len(p), 2.5), h, depth, normal)
    np.testing.assert_allclose(found, 2.5, rtol=1e-14)


def test_smooth_pictures_come_back():
    def wave(p):
        return np.sin(0.08 * p[..., 0]) + np.cos(0.06 * p[..., 1])

    at = np.stack(np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5, indexing="ij"), -1)
    errors = []
    for count in (200, 800):
        p, h = samples(count)
        found = cross_bilateral(p, wave(p), h, *flat())
        errors.append(np.sqrt(np.mean((found - wave(at)) ** 2)))
    assert errors[1] < 0.05
    assert errors[1] < 0.7 * errors[0]


@pytest.mark.parametrize("guide", ["depth", "normal"])
def test_edges_of_the_guides_are_kept(guide):
    """One value on each side of a slanted edge; without the guide it would be blurred."""
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5, indexing="ij")
    side = x + 0.5 * y > 60.0
    depth, normal = flat()
    p, h = samples()
    value = np.where(side[tuple(p.astype(int).T)], 1.0, 0.0)
    blurred = cross_bilateral(p, value, h, depth, normal)
    if guide == "depth":
        depth = np.where(side, 3.0, 4.0)
    else:
        normal = np.where(side[..., None], (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    kept = cross_bilateral(p, value, h, depth, normal)
    assert np.max(abs(kept - side)) < 1e-3
    assert np.sqrt(np.mean((blurred - side) ** 2)) > 0.05


def test_what_nothing_resembles_takes_what_is_most_alike():
    """A pixel of its own depth: its neighbours are equally unlike, and finite weights remain."""
    depth, normal = flat()
    depth[40, 30] = 500.0
    p, h = samples()
    p = p[np.any(p != (40.5, 30.5), 1)]
    found = cross_bilateral(p, np.full(len(p), 1.5), h, depth, normal)
    assert np.all(np.isfinite(found))
    assert found[40, 30] == pytest.approx(1.5)


def test_widths_follow_the_density():
    density = np.where(np.arange(WIDTH) < 48, 4.0, 1.0)[:, None] + np.zeros(HEIGHT)
    h = bilateral_widths(density, 500)
    np.testing.assert_allclose(h[60] / h[10], 2.0)
    np.testing.assert_allclose(np.sum((0.7 / h) ** 2), 500.0)


def test_what_a_full_pixel_cannot_take_goes_to_the_others():
    density = np.ones((20, 20))
    density[3, 3] = 1e6
    h = bilateral_widths(density, 100, 1.0)
    assert abs(np.sum(blue_noise_samples(density, 100)) - 100) <= 1  # so many are placed
    assert h[3, 3] == 1.0
    np.testing.assert_allclose(h[10, 10], np.sqrt(399.0 / 99.0), rtol=1e-12)  # without that one
    np.testing.assert_allclose(bilateral_widths(density, 500), 0.7)  # more than there is room


@pytest.mark.parametrize(
    ("change", "name"),
    [(dict(depth_share=0.0), "depth_share"), (dict(normal_spread=-1.0), "normal_spread")],
)
def test_bad_input_gets_one_sentence(change, name):
    p, h = samples()
    with pytest.raises(ValueError, match=f"`{name}` must be positive"):
        cross_bilateral(p, np.ones(len(p)), h, *flat(), **change)


def test_what_cannot_be_filtered_is_one_sentence():
    with pytest.raises(ValueError, match="`density` must be positive somewhere, but is zero"):
        bilateral_widths(np.zeros((4, 4)), 2)
    with pytest.raises(ValueError, match="`density` must not be negative, but is -1"):
        bilateral_widths(-np.ones((4, 4)), 2)
    with pytest.raises(ValueError, match="`p` must have at least one sample, but has none"):
        cross_bilateral(np.zeros((0, 2)), np.zeros(0), np.ones((WIDTH, HEIGHT)), *flat())


@pytest.mark.parametrize("place", [(-0.5, 3.0), (3.0, HEIGHT + 1.0)])
def test_samples_outside_show_no_pixel(place):
    """A place below zero once took depth and normal from the other side of the image."""
    with pytest.raises(ValueError, match="`p` must lie inside the image, but has a sample at"):
        cross_bilateral(np.array([place]), np.ones(1), np.ones((WIDTH, HEIGHT)), *flat())
    shows = np.full(1, 3.0), np.array([(0.0, 0.0, 1.0)])
    width = np.ones((WIDTH, HEIGHT))
    found = cross_bilateral(np.array([place]), np.ones(1), width, *flat(), shows=shows)
    np.testing.assert_array_equal(found, 1.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (dict(value=np.ones(3)), "`value` must have shape"),
        (dict(width=np.ones((3, 3))), "`width` must have shape"),
        (dict(normal=np.full((WIDTH, HEIGHT, 3), np.nan)), "`normal` must be finite"),
        (dict(shows=(np.ones(3), np.ones((3, 3)))), "`shows` must have shape"),
        (dict(depth=np.ones(WIDTH)), "`depth` must have shape"),
    ],
)
def test_what_does_not_fit_is_one_sentence(change, words):
    p, h = samples()
    depth, normal = flat()
    known = dict(p=p, value=np.ones(len(p)), width=h, depth=depth, normal=normal)
    with pytest.raises(ValueError, match=words):
        cross_bilateral(**(known | change))


def test_one_width_is_that_of_all_pixels():
    p, _ = samples()
    value, h = p[:, 0], np.full((WIDTH, HEIGHT), 2.0)
    found = cross_bilateral(p, value, 2.0, *flat())
    np.testing.assert_array_equal(found, cross_bilateral(p, value, h, *flat()))


@pytest.mark.parametrize("unit", [1e-310, 1e-300, 1e300, 1e308])
def test_widths_do_not_depend_on_the_unit_of_a_density(unit):
    width = reconstruction.bilateral_widths(np.full((10, 10), unit), 25, 1.0)
    np.testing.assert_allclose(width, 2.0, rtol=1e-12)


@pytest.mark.parametrize("sky", [1e30, 1e160, np.finfo(float).max])
def test_a_sky_may_be_as_far_as_numbers_go(sky):
    depth = np.where(np.arange(8) < 4, 1.0, sky)[:, None] + np.zeros(8)
    up = np.broadcast_to((0.0, 0.0, 1.0), (8, 8, 3))
    p, light = np.array([(5.5, 4.5), (6.5, 4.5)]), np.array([3.0, 7.0])
    found = reconstruction.cross_bilateral(p, light, np.full((8, 8), 4.0), depth, up)
    assert np.isfinite(found).all()
    near = reconstruction.cross_bilateral(p, light, 1e-200, np.ones((8, 8)), up)
    assert near[[0, 7], 4].tolist() == [3.0, 7.0]  # the nearest alone
