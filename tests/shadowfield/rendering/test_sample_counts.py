"""Rays for each pixel: E11's rates, whole numbers with a given sum, no bias from their density."""

import numpy as np
import pytest

from firstorder.checks.statistics import z_test
from firstorder.shadowfield import light_rate_of_endless_wedge, sheared_filter
from firstorder.shadowfield.rendering import sheared_filter as space
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays
from firstorder.shadowfield.rendering.sample_counts import distribute_rays, rays_per_pixel
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow
from tests.shadowfield.cards import EDGE, FENCE, LAMP, PIXEL, cards, fence_light, floor


def test_what_is_wanted_is_the_product_of_both_rates():
    """Against the module that derives them: `receiver_rate` with the wedge cut at the filter."""
    d1, near, far, Omega, pixel = 4.0, 1.2, 2.5, 3.0, 0.05
    k = sheared_filter(d1, near, far, Omega, 10.0)
    along_x = 2.0 * float(np.max(np.asarray(k.corners())[:, 0]))
    along_y = float(light_rate_of_endless_wedge(d1, near, far, Omega))
    true = (along_x * along_y) ** 2 * pixel**2 * (2.0 * 0.8) * (2.0 * 0.3)
    one = np.ones(1)
    found = rays_per_pixel(d1 * one, near * one, far * one, Omega, pixel, np.array([0.8, 0.3]))
    np.testing.assert_allclose(found, true, rtol=1e-12)


def test_nothing_and_a_single_depth_want_no_rays():
    one = np.ones(2)
    near, far = np.array([np.inf, 0.5]), np.array([-np.inf, 0.5])
    np.testing.assert_array_equal(rays_per_pixel(one, near, far, 1.0, 0.1, np.ones(2)), 0.0)


@pytest.mark.smoke
@pytest.mark.parametrize("least", [0.0, 0.25, 1.0])
def test_counts_are_whole_and_add_up(least):
    share = np.random.default_rng(0).random(1000) ** 4
    counts = distribute_rays(share, 3000, least=least)
    assert counts.sum() == 3000
    exact = 3000 * (least / 1000 + (1.0 - least) * share / share.sum())
    assert np.max(abs(counts - exact)) < 1.0 + 1e-6


def fence_error(weighted):
    """Rays twelve times as dense on one side: counted as they are, that side would weigh more."""
    R = floor()
    counts = np.where(R[:, 0] > 0.0, 12, 1)
    table, owner = trace_shadow_rays(LAMP, R, counts, cards(*FENCE))
    assert np.array_equal(np.bincount(owner), counts)
    weights = 1.0 / counts[owner] if weighted else None
    found = sheared_shadow(LAMP, table, R, 4.0, PIXEL, np.zeros(len(R)), weights=weights).visible
    inner = np.all(abs(R[:, :2]) < 0.3, 1)
    return np.sqrt(np.mean((found - fence_light(R))[inner] ** 2))


def test_rays_of_any_density_give_the_same_light():
    """Weighed rays err by 0.0190, as they are counted by 0.0299: 0.64 times as much."""
    right = fence_error(True)
    assert right < 0.024
    assert right < 0.75 * fence_error(False)


def test_a_fault_is_noticed(monkeypatch):
    """Weights that nobody looks at."""
    right = space.gather
    monkeypatch.setattr(space, "gather", lambda *about: right(*about[:6]))
    with pytest.raises(AssertionError):
        test_rays_of_any_density_give_the_same_light()


@pytest.mark.parametrize(
    ("share", "words"),
    [
        ((1.0, np.nan), "`share` must not be negative, but is nan"),
        ((1.0, -1.0, 2.0), "`share` must not be negative, but is -1.0"),
        ((), r"`share` must hold a number for each pixel, but has shape \(0,\)"),
        (((1.0, 2.0),), r"`share` must hold a number for each pixel, but has shape \(1, 2\)"),
    ],
)
def test_shares_are_numbers_that_add_up(share, words):
    with pytest.raises((ValueError, TypeError), match=f"{words}|violates type hint"):
        distribute_rays(np.array(share, float), 12)


def test_weights_have_no_unit():
    """Squares of small ones are zero in single precision, and a place without weight is lit."""
    table, _ = trace_shadow_rays(LAMP, floor(), 4, cards(EDGE))
    rest = table, floor(), 1.5, PIXEL, np.full(len(floor()), np.nan)
    bounds = np.full(len(floor()), 1.0), np.full(len(floor()), 1.2)
    some = np.where(np.arange(len(table.y)) % 3, 1.0, 0.5)
    found = [
        sheared_shadow(LAMP, *rest, bounds=bounds, weights=unit * some) for unit in (1, 1e-30, 1e30)
    ]
    assert np.min(found[0].visible) < 0.5
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=1e-5)


@pytest.mark.smoke
def test_shares_and_depths_may_be_lists():
    """Without the import hook, by which an annotation says that a list is no array."""
    try:
        assert distribute_rays([0.0, 1.0, 1.0], 12).tolist() == [1, 6, 5]
        found = rays_per_pixel([1.0, 1.0], [0.3, np.inf], [0.6, -np.inf], 2.0, 0.01, [0.5, 0.5])
        assert found[0] > found[1] == 0.0
    except TypeError as error:
        assert "violates type hint" in str(error)  # noqa: PT017


def rounded(share, total=7, runs=4000):
    """Mean counts of many runs, and their standard errors."""
    counts = np.array([distribute_rays(share, total, seed, least=0.0) for seed in range(runs)])
    assert np.all(counts.sum(1) == total)
    return counts.mean(0), counts.std(0) / np.sqrt(runs)


def test_shares_of_a_ray_are_rounded_evenly():
    """Each pixel has its share on average; counts of one run are within one of it."""
    share = np.array([0.13, 0.4, 0.02, 0.25, 0.2])
    mean, error = rounded(share)
    assert z_test(mean, error, 7 * share).passed
    assert not z_test(mean, error, 7 * np.roll(share, 1)).passed
    assert not z_test(mean, error, np.round(7 * share)).passed


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"d1": -1.0}, "`d1` must be positive"),
        ({"near": np.array([0.0])}, "`near` must be positive"),
        ({"far": np.array([0.0])}, "`far` must be positive"),
        ({"half": np.array([0.5, -0.5])}, "`half` must not be negative"),
        ({"margin": np.nan}, "`margin` must"),
        ({"margin": 0.0}, "`margin` must"),
        ({"near": np.array([np.nan])}, "`near` must be positive, but is nan"),
        ({"near": np.array([0.3, 0.4])}, r"`d1` must broadcast|`far` must have shape \(2,\)"),
        ({"half": np.ones(3)}, r"`half` must have shape \(2,\)"),
    ],
)
def test_rays_are_counted_for_blockers_between_lamp_and_receiver(given, words):
    usual = {"d1": np.ones(1), "near": np.array([0.3]), "far": np.array([0.6])}
    rest = {"Omega_y": 2.0, "pixel": 0.01, "half": np.array([0.5, 0.5])}
    with pytest.raises((ValueError, TypeError), match=f"{words}|violates type hint"):
        rays_per_pixel(**(usual | rest | given))


def test_one_depth_stands_for_all_pixels():
    depths, rest = np.array([2.0, 3.0]), (4.0, 0.1, np.array([0.5, 0.5]))
    whole = rays_per_pixel(depths, np.full(2, 0.5), np.full(2, 0.7), *rest)
    assert np.array_equal(rays_per_pixel(depths, 0.5, 0.7, *rest), whole)
