"""Blue noise: a permutation, spread out at every density, and true to the density asked."""

import numpy as np
import pytest
import scipy.spatial

from firstorder import reconstruction
from firstorder.reconstruction.blue_noise import _ranks, blue_noise_samples

SIDE = 64


@pytest.fixture(scope="module")
def tile():
    return _ranks(SIDE)


def closest(points, side):
    """Distances to nearest neighbours on the torus, over that of a hexagonal grid."""
    tree = scipy.spatial.KDTree(points, boxsize=side)
    return tree.query(points, 2)[0][:, 1] / np.sqrt(2.0 / np.sqrt(3.0) * side**2 / len(points))


@pytest.mark.smoke
def test_ranks_are_a_permutation(tile):
    np.testing.assert_array_equal(np.sort(tile.ravel()), np.arange(SIDE**2))


@pytest.mark.parametrize("count", [50, 200, 400, 800])
def test_the_first_are_spread_out_at_every_density(tile, count):
    """Nearest neighbours are much farther than those of random points, and none is close."""
    points = np.argwhere(tile < count).astype(float)
    chance = np.random.default_rng(0).random((count, 2)) * SIDE
    assert np.mean(closest(points, SIDE)) > 1.35 * np.mean(closest(chance, SIDE))
    assert np.min(closest(points, SIDE)) > 0.4


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5])
def test_low_frequencies_are_missing(tile, share):
    """White noise has the same power everywhere: share (1 - share) a pixel."""
    pattern = (tile < share * SIDE**2).astype(float) - share
    power = np.abs(np.fft.fft2(pattern)) ** 2 / SIDE**2 / (share * (1.0 - share))
    f = np.fft.fftfreq(SIDE)
    radius = np.hypot(f[:, None], f)
    low = (radius > 0.0) & (radius < 0.4 * np.sqrt(min(share, 1.0 - share)))
    assert np.mean(power[low]) < 0.15
    assert np.mean(power) == pytest.approx(1.0, rel=1e-3)  # the share in whole pixels


def test_samples_follow_the_density():
    x = (np.arange(256) + 0.5) / 256
    density = 0.2 + x[:, None] + 2.0 * np.exp(-(((x - 0.3) / 0.1) ** 2))
    found = blue_noise_samples(density, 6000)
    share = density * 6000 / np.sum(density)
    assert abs(found.sum() - 6000) < 60  # evenly spread: far fewer than the 78 of chance
    boxes = found.reshape(8, 32, 8, 32).sum((1, 3))
    asked = share.reshape(8, 32, 8, 32).sum((1, 3))
    assert np.max(abs(boxes - asked) / np.sqrt(asked)) < 1.0


def test_smaller_budgets_are_part_of_larger_ones():
    density = np.random.default_rng(1).random((100, 70))
    few, many = blue_noise_samples(density, 500), blue_noise_samples(density, 1500)
    assert np.all(many[few])


def test_no_pixel_is_asked_for_more_than_once():
    """A spike takes its one sample, the others get the rest."""
    density = np.ones((64, 64))
    density[10, 10] = 1e6
    found = blue_noise_samples(density, 400)
    assert found[10, 10]
    assert abs(found.sum() - 400) < 5


@pytest.mark.parametrize(
    ("density", "count", "sentence"),
    [
        (-np.ones((8, 8)), 4, "`density` must not be negative"),
        (np.ones((8, 8, 3)), 4, "`density` must have shape"),
        (np.full((8, 8), np.nan), 4, "`density` must be finite"),
        (np.zeros((8, 8)), 4, "`count` must be at most 0"),
        (np.ones((8, 8)), 65, "`count` must be at most 64"),
        (np.ones((8, 8)), 0, "`count` must be a positive integer"),
    ],
)
def test_bad_input_gets_one_sentence(density, count, sentence):
    with pytest.raises(ValueError, match=sentence):
        blue_noise_samples(density, count)


def test_tiles_are_not_tiny():
    with pytest.raises(ValueError, match="`side` must be at least 4, but is 2"):
        _ranks(2)


def test_exactly_as_many_as_asked_and_nearly_the_same():
    density = np.random.default_rng(3).random((100, 70)) + 0.05
    for count in (1, 357, 4000, 7000):
        found, near = (
            blue_noise_samples(density, count, exactly=True),
            blue_noise_samples(density, count),
        )
        assert np.count_nonzero(found) == count
        assert np.count_nonzero(found ^ near) == abs(count - np.count_nonzero(near))
    density[:50] = 0.0
    assert not blue_noise_samples(density, 3400, exactly=True)[:50].any()


@pytest.mark.parametrize("unit", [1e-310, 1e-300, 1e12, 1e308])
def test_samples_do_not_depend_on_the_unit_of_a_density(unit):
    density = np.random.default_rng(0).uniform(0.5, 1.0, (16, 16))
    here = reconstruction.blue_noise_samples(density, 40)
    assert np.array_equal(reconstruction.blue_noise_samples(density * unit, 40), here)


@pytest.mark.parametrize("wrong", [{"seed": -1}, {"density": np.eye(9) * 1j}])
def test_a_seed_is_not_negative_and_a_density_is_real(wrong):
    given = {"density": np.ones((9, 9)), "count": 4, **wrong}
    with pytest.raises(ValueError, match=f"Argument `{next(iter(wrong))}` must"):
        reconstruction.blue_noise_samples(**given)
