"""Rates from differences of pixels: each pixel by itself, by loops in NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.bandwidth import (
    PixelDifferences,
    pixel_differences,
    screen_diffuse_bandwidth,
    screen_glossy_bandwidth,
)

RNG = np.random.default_rng(1)
W, H = 5, 4
POSITION = RNG.normal(size=(W, H, 3))
NORMAL = RNG.normal(size=(W, H, 3)) + np.array([0.0, 0.0, 3.0])
NORMAL = NORMAL / np.linalg.norm(NORMAL, axis=-1, keepdims=True)
EYE = np.array([0.5, -1.0, 6.0])
# Three things, of which one is seen in a single pixel.
LABEL = np.array([[0, 0, 1, 1], [0, 0, 1, 1], [0, 7, 1, 1], [0, 0, 0, 1], [2, 2, 0, 0]])


def neighbours(a, i, j, axis):
    """Mean difference to the neighbours of one label, before and behind; zero without any."""
    found = []
    for k in (-1, 1):
        p, q = (i + k, j) if axis == 0 else (i, j + k)
        if 0 <= p < W and 0 <= q < H and LABEL[p, q] == LABEL[i, j]:
            found.append(k * (a[p, q] - a[i, j]))
    return np.mean(found, axis=0) if found else np.zeros(3)


def differences(a):
    return np.array(
        [[[neighbours(a, i, j, axis) for axis in (0, 1)] for j in range(H)] for i in range(W)]
    ).swapaxes(-1, -2)


def test_differences_are_means_over_neighbours_that_show_the_same():
    got = pixel_differences(POSITION, NORMAL, EYE, LABEL)
    to_eye = EYE - POSITION
    to_eye = to_eye / np.linalg.norm(to_eye, axis=-1, keepdims=True)
    mirrored = 2.0 * np.sum(NORMAL * to_eye, -1, keepdims=True) * NORMAL - to_eye
    np.testing.assert_allclose(got.mirrored, differences(mirrored), rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(got.normal, differences(NORMAL), rtol=0.0, atol=1e-14)
    x = differences(POSITION)
    np.testing.assert_allclose(got.position, x, rtol=0.0, atol=1e-14)
    for i, j in np.ndindex(W, H):
        across = np.eye(3) - np.outer(mirrored[i, j], mirrored[i, j])
        np.testing.assert_allclose(got.moved[i, j], across @ x[i, j], rtol=0.0, atol=1e-14)
    np.testing.assert_array_equal(got.normal[2, 1], 0.0)  # it shows what no neighbour shows


def test_on_a_plain_both_sides_of_a_pixel_count():
    """Of squares, `((n + 1)^2 - (n - 1)^2) / 2 = 2 n`, and one-sided at the border."""
    x = np.zeros((4, 1, 3))
    x[:, 0, 0] = np.arange(4.0) ** 2
    up = np.broadcast_to((0.0, 0.0, 1.0), x.shape)
    got = pixel_differences(x, up, np.array([0.0, 0.0, 9.0]), np.zeros((4, 1), int))
    np.testing.assert_allclose(got.position[:, 0, 0, 0], [1.0, 2.0, 4.0, 5.0])
    np.testing.assert_array_equal(got.position[..., 1], 0.0)


TURNS = PixelDifferences(*(RNG.normal(size=(W, H, 3, 2)) for _ in range(4)))


def norm(a):
    return np.linalg.svd(a, compute_uv=False)[..., 0]


@pytest.mark.parametrize("each", [False, True])
def test_bandwidths_are_those_of_the_formulas(each):
    shape = (W, H) if each else ()
    cutoff, slope, light = (RNG.uniform(0.5, 2.0, shape) for _ in range(3))
    s = np.asarray(slope)[..., None, None]
    glossy = norm(TURNS.mirrored + s * TURNS.moved) * cutoff + slope * norm(TURNS.moved) * light
    found = screen_glossy_bandwidth(
        jnp.asarray(cutoff), TURNS, jnp.asarray(slope), jnp.asarray(light)
    )
    np.testing.assert_allclose(found, glossy, rtol=1e-12)
    diffuse = norm(TURNS.normal) * cutoff + slope * norm(TURNS.position) * (cutoff + light)
    found = screen_diffuse_bandwidth(
        jnp.asarray(cutoff), TURNS, jnp.asarray(slope), jnp.asarray(light)
    )
    np.testing.assert_allclose(found, diffuse, rtol=1e-12)


def test_slope_and_light_may_be_left_out():
    found = screen_glossy_bandwidth(2.0, TURNS)
    np.testing.assert_allclose(found, 2.0 * norm(TURNS.mirrored), rtol=1e-12)
    found = screen_diffuse_bandwidth(2.0, TURNS)
    np.testing.assert_allclose(found, 2.0 * norm(TURNS.normal), rtol=1e-12)


@pytest.mark.parametrize("rate", [screen_glossy_bandwidth, screen_diffuse_bandwidth])
def test_an_endless_spectrum_is_endless_where_anything_turns(rate):
    still = PixelDifferences(*(np.zeros((1, 1, 3, 2)) for _ in range(4)))
    assert rate(np.inf, still, 2.0, 1.0).tolist() == [[0.0]]
    assert np.isinf(rate(np.inf, TURNS, 2.0, 1.0)).all()


@pytest.mark.parametrize("rate", [screen_glossy_bandwidth, screen_diffuse_bandwidth])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_what_is_out_of_range_is_refused_or_is_not_a_number(rate, place):
    given = [1.0, 1.0, 1.0]
    given[place] = -1.0
    with pytest.raises(ValueError, match=("cutoff", "slope", "light")[place]):
        rate(given[0], TURNS, *given[1:])
    traced = jax.jit(lambda c, s, b: rate(c, TURNS, s, b))
    assert np.isnan(traced(*given)).all()
    assert np.isfinite(traced(1.0, 0.0, 0.0)).all()


@pytest.mark.parametrize(
    ("rate", "names"),
    [
        (screen_glossy_bandwidth, {"mirrored", "moved"}),
        (screen_diffuse_bandwidth, {"normal", "position"}),
    ],
)
def test_a_turn_that_is_not_finite_spoils_its_own_pixel(rate, names):
    for name in PixelDifferences._fields:
        turn = getattr(TURNS, name).copy()
        turn[1, 2, 0, 1] = np.nan
        found = np.asarray(rate(1.0, TURNS._replace(**{name: turn}), 1.0, 1.0))
        assert np.isnan(found[1, 2]) == (name in names)
        assert np.isnan(found).sum() == (name in names)
