"""Reconstruction along edges: directions that are known, and a straight shadow's edge."""

import numpy as np
import pytest

from firstorder import reconstruction
from firstorder.reconstruction import (
    DirectionalCoherence,
    coherent_image,
    directional_coherence,
)

SIZE = 96
X = np.stack(np.meshgrid(*2 * [np.arange(SIZE) + 0.5], indexing="ij"), -1)
NORMAL = np.array([np.cos(0.5), np.sin(0.5)])  # across the edge; no axis of the grid


def scattered(pitch=8.0, seed=0):
    """Samples in jittered squares, some tenth of what has pixels."""
    k = np.arange(0.0, SIZE, pitch)
    corner = np.stack(np.meshgrid(k, k, indexing="ij"), -1).reshape(-1, 2)
    return corner + pitch * np.random.default_rng(seed).uniform(size=corner.shape)


def penumbra(p, wide=6.0):
    """A shadow's edge: irradiance of a lamp that is hidden bit by bit, and its gradient."""
    s = ((p - 0.5 * SIZE) @ NORMAL) / wide
    inside = np.abs(s) < 1.0
    value = np.where(inside, 0.5 + 0.25 * s * (3.0 - s**2), s > 0.0)
    slope = np.where(inside, 0.75 * (1.0 - s**2) / wide, 0.0)
    return value, slope[..., None] * NORMAL


def disc(p, radius=25.0, wide=6.0):
    """The same edge around a circle."""
    away = p - 0.5 * SIZE
    r = np.linalg.norm(away, axis=-1)
    s = (radius - r) / wide
    inside = np.abs(s) < 1.0
    value = np.where(inside, 0.5 + 0.25 * s * (3.0 - s**2), s > 0.0)
    slope = np.where(inside, -0.75 * (1.0 - s**2) / wide, 0.0)
    return value, (slope / np.maximum(r, 1e-9))[..., None] * away


def error(image, stretch, seed):
    p = scattered(seed=seed)
    found = coherent_image(p, *image(p), (SIZE, SIZE), stretch=stretch)
    return np.sqrt(np.mean((found - image(X)[0]) ** 2))


@pytest.mark.smoke
def test_along_a_straight_shadow_edge_it_beats_the_isotropic_filter():
    """Same samples, same values, same widths: only the direction is new; ten patterns."""
    pairs = np.array([[error(penumbra, k, seed) for k in (4.0, 1.0)] for seed in range(10)])
    ratio = pairs[:, 0] / pairs[:, 1]
    assert np.mean(ratio) < 0.8
    assert np.all(ratio < 1.0)


def test_gradients_turned_by_a_right_angle_make_it_worse():
    """The filter blurs across the edge if it is told the wrong direction."""

    def turned(p):
        value, g = penumbra(p)
        return value, np.stack([-g[..., 1], g[..., 0]], -1)

    for seed in range(3):
        assert error(turned, 4.0, seed) > 1.1 * error(penumbra, 1.0, seed)


def test_around_a_small_disc_the_stretch_is_a_loss():
    """Edges that bend are the price: a radius of three times the samples' distance is too small."""
    gain = {}
    for image in (penumbra, disc):
        pairs = np.array([[error(image, k, seed) for k in (4.0, 1.0)] for seed in range(5)])
        gain[image] = np.mean(pairs[:, 0] / pairs[:, 1])
    assert gain[penumbra] < 0.8 < 1.0 < gain[disc]


def test_the_direction_of_an_edge_is_found_and_that_of_a_corner_is_not():
    p = scattered()
    at = 0.5 * SIZE + np.array([[0.0, 0.0], [3.0, -2.0]])
    edge = directional_coherence(p, penumbra(p)[1], at)
    np.testing.assert_allclose(np.abs(edge.across @ NORMAL), 1.0, rtol=1e-12)
    np.testing.assert_allclose(edge.coherence, 1.0, rtol=1e-12)
    rng = np.random.default_rng(1)
    noise = rng.normal(size=(4000, 2))
    where = rng.uniform(size=(4000, 2))
    many = directional_coherence(where, noise, np.array([[0.5, 0.5]]), neighbours=4000)
    assert many.coherence[0] < 0.06  # two deviations over the root of 4000
    nothing = directional_coherence(p, 0.0 * p, at)
    assert isinstance(nothing, DirectionalCoherence)
    assert nothing.coherence.tolist() == [0.0, 0.0]


def test_coherence_is_that_of_the_eigenvalues():
    g = np.random.default_rng(2).normal(size=(8, 2)) * (2.0, 0.5)
    found = directional_coherence(np.zeros((8, 2)), g, np.zeros((1, 2)))
    values, axes = np.linalg.eigh(g.T @ g)
    np.testing.assert_allclose(found.coherence, (values[1] - values[0]) / values.sum())
    np.testing.assert_allclose(abs(found.across[0] @ axes[:, 1]), 1.0)


@pytest.mark.parametrize("stretch", [1.0, 4.0])
def test_constants_stay_and_a_single_sample_fills_the_image(stretch):
    p, options = scattered(), {"stretch": stretch}
    gradient = np.random.default_rng(3).normal(size=p.shape)
    found = coherent_image(p, np.full(len(p), 2.5), gradient, (20, 30), **options)
    np.testing.assert_allclose(found, 2.5, rtol=1e-14)
    alone = coherent_image(p[:1], np.ones(1), gradient[:1], (4, 4), **options)
    np.testing.assert_allclose(alone, 1.0)


def test_a_sample_in_the_middle_of_a_pixel_fills_that_pixel_too():
    """Alone, and four times over: the width is that of samples at no distance."""
    for count in (1, 4):
        p, right = np.full((count, 2), 2.5), np.tile((1.0, 0.0), (count, 1))
        np.testing.assert_array_equal(coherent_image(p, np.full(count, 3.0), right, (4, 4)), 3.0)


def test_the_width_is_in_distances_of_the_fourth_sample():
    """Three samples one pixel away, the fourth two, and others too far to count."""
    way = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -2.0), *4 * [(60.0, 80.0)]])
    value, flat = np.array([0.0, 0.0, 0.0, 1.0, *4 * [9.0]]), np.tile((1.0, 0.0), (8, 1))
    found = coherent_image(0.5 + way, value, flat, (1, 1), width=0.5, stretch=1.0)
    share = np.exp(-(2.0**2 - 1.0**2) / 2.0)
    np.testing.assert_allclose(found, [[share / (3.0 + share)]], rtol=1e-12)


def test_without_a_stretch_the_direction_does_not_matter():
    p = scattered()
    value, gradient = penumbra(p)
    some = np.random.default_rng(4).normal(size=p.shape)
    one, other = (coherent_image(p, value, g, (40, 40), stretch=1.0) for g in (gradient, some))
    np.testing.assert_allclose(one, other, rtol=1e-9)


def test_a_turned_picture_is_reconstructed_turned():
    """By an eighth, so that no axis stays one: the same numbers at the turned place."""
    turn = np.array([[1.0, -1.0], [1.0, 1.0]]) / np.sqrt(2.0)
    p = scattered() - 0.5 * SIZE
    value, gradient = penumbra(p + 0.5 * SIZE)
    middle = coherent_image(p + 0.5, value, gradient, (1, 1))
    np.testing.assert_allclose(
        coherent_image(p @ turn.T + 0.5, value, gradient @ turn.T, (1, 1)), middle, rtol=1e-9
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"stretch": 0.5}, "`stretch` must be at least 1"),
        ({"stretch": np.inf}, "`stretch` must be finite"),
        ({"width": 0.0}, "`width`"),
        ({"neighbours": 0}, "`neighbours`"),
        ({"voters": 0}, "`voters`"),
    ],
)
def test_bad_input_is_one_sentence(change, words):
    p = scattered()
    with pytest.raises(ValueError, match=words):
        coherent_image(p, *penumbra(p), (8, 8), **change)
    with pytest.raises(ValueError, match="at least one sample"):
        coherent_image(p[:0], *penumbra(p[:0]), (8, 8))
    with pytest.raises(ValueError, match="`gradient`"):
        directional_coherence(p, np.nan * p, p)
    with pytest.raises(ValueError, match=r"`p` must have shape \(n, 2\), but has"):
        directional_coherence(np.zeros((4, 3)), np.zeros((4, 2)), p)
    with pytest.raises(ValueError, match="`p` must be finite"):
        directional_coherence(np.nan * p, p, p)
    with pytest.raises(ValueError, match="`value` must have shape"):
        coherent_image(p, np.ones(3), p, (8, 8))


@pytest.mark.parametrize("neighbours", [1, 24])
def test_a_pixel_whose_nearest_samples_lie_in_its_middle_takes_their_value(neighbours):
    p = np.array([(0.5, 0.5), (5.5, 5.5)] if neighbours == 1 else [(0.5, 0.5)] * 4 + [(5.5, 5.5)])
    value = np.where(p[:, 0] < 1.0, 2.0, 7.0)
    image = coherent_image(p, value, np.ones_like(p), (6, 6), neighbours=neighbours)
    assert image[0, 0] == 2.0


@pytest.mark.parametrize("unit", [1e-170, 1e-12, 1e12, 1e170])
def test_directions_do_not_depend_on_the_unit_of_light(unit):
    rng = np.random.default_rng(0)
    p, gradient = rng.uniform(0.0, 8.0, (30, 2)), rng.normal(size=(30, 2))
    here = reconstruction.directional_coherence(p, gradient, p[:3])
    there = reconstruction.directional_coherence(p, unit * gradient, p[:3])
    np.testing.assert_allclose(there.across, here.across, rtol=1e-12)
    np.testing.assert_allclose(there.coherence, here.coherence, rtol=1e-12)


@pytest.mark.parametrize("how", [{"stretch": 1e200}, {"width": 1e-200}])
def test_weights_are_numbers_at_any_stretch_and_width(how):
    rng = np.random.default_rng(0)
    p, value = rng.uniform(0.0, 8.0, (30, 2)), rng.uniform(1.0, 2.0, 30)
    found = reconstruction.coherent_image(p, value, rng.normal(size=(30, 2)), (8, 8), **how)
    assert ((found >= 1.0) & (found <= 2.0)).all()


@pytest.mark.parametrize("shape", [(0, 8), (-1, 8)])
def test_an_image_has_pixels(shape):
    p = np.array([(0.5, 0.5), (1.5, 0.5)])
    with pytest.raises(ValueError, match="Argument `shape` must be"):
        reconstruction.coherent_image(p, np.ones(2), np.ones((2, 2)), shape)


@pytest.mark.parametrize("at", [np.zeros(2), np.zeros((2, 3)), np.full((1, 2), np.nan)])
def test_places_are_checked_in_a_sentence(at):
    p = np.array([(0.5, 0.5), (1.5, 0.5)])
    with pytest.raises(ValueError, match="Argument `at` must"):
        reconstruction.directional_coherence(p, np.ones((2, 2)), at)
