"""Expected errors of shared rays, against measured ones, and the choice that follows from them."""

import numpy as np
import pytest
import scipy.integrate

from firstorder.shadowfield.rendering import band_limit_choice as module
from firstorder.shadowfield.rendering._weighted_sums import Sums
from firstorder.shadowfield.rendering.band_limit_choice import (
    STEP,
    _free_probability,
    _noise,
    band_limit_sweep,
    select_band_limits,
)
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays
from tests.shadowfield.cards import FENCE, LAMP, PIXEL, bad_receivers, cards, fence_light, floor

SIDE = 32
ALL = np.arange(SIDE**2), SIDE
LIMITS = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
INNER = np.zeros((SIDE, SIDE), bool)
INNER[8:-8, 8:-8] = True


def answers(rays, seed=0):
    receivers = floor(SIDE)
    table, _ = trace_shadow_rays(LAMP, receivers, rays, cards(*FENCE), seed)
    return band_limit_sweep(LAMP, table, receivers, LIMITS, PIXEL, np.zeros(SIDE**2), ALL)


def rms(a):
    return np.sqrt(np.mean(np.square(a)))


def test_steps_bound_what_is_left_out_and_hardly_exceed_it():
    """For power Omega^-4, by quadrature: the sum of the sizes of all steps over the true size."""

    def gone(u):
        return -np.expm1(-0.5 * u**2)

    step, _ = scipy.integrate.quad(lambda u: (gone(u) - gone(u / 2)) ** 2 / u**4, 1e-3, 60.0)
    out, _ = scipy.integrate.quad(lambda u: gone(u) ** 2 / u**4, 1e-3, 60.0)
    start, tail = 1e-3, 1.0 / (3.0 * 60.0**3)  # below 1e-3, gone(u) is u^2 / 2
    true, first = out + start / 4.0 + tail, step + 9.0 / 64.0 * start
    ratio = np.sqrt(first / true) / (1.0 - STEP)
    np.testing.assert_allclose(ratio, 1.0572, rtol=1e-4)


def test_a_single_frequency_is_lost_in_full():
    """Steps of one wave add up to all of it, wherever the rungs lie."""
    T = np.exp(-0.5 * (0.7 / 2.0 ** np.arange(-2, 8)) ** 2)
    wave = 0.1 * T[:, None] * np.ones(SIDE**2)
    found = module._bias(np.stack([wave, wave], 1), ALL, 4.0)
    np.testing.assert_allclose(found[:4, 0], 0.1 * (1.0 - T[:4]), rtol=0.0, atol=1e-4)


def test_steps_that_shrink_as_expected_add_up_to_all_that_is_left():
    """Beyond the last rung too: a geometric series, by its sum."""
    left = 0.3 * STEP ** np.arange(5)[:, None] * np.ones(SIDE**2)
    found = module._bias(np.stack([1.0 - left, 1.0 - left], 1), ALL, 4.0)
    np.testing.assert_allclose(found, left, rtol=1e-12)


def test_the_noise_is_that_of_coins():
    """Many trials of weighed coins in four cells of different odds and shares."""
    rng, trials = np.random.default_rng(0), 4000
    p, share = np.array([0.1, 0.5, 0.9, 0.3]), np.array([0.4, 0.3, 0.2, 0.1])
    w = rng.uniform(0.5, 1.5, (4, 200))
    free = rng.random((trials, 4, 200)) < p[:, None]
    found = np.sum(share * np.sum(w * free, 2) / w.sum(1), 1)
    sums = Sums(w.sum(1)[None], (w * free[0]).sum(1)[None], np.array([np.sum(w**2)]))
    # A deviation from so many trials is off by 1 / sqrt(2 trials); four of these. The formula takes
    # all cells for equally full: off by half of how much their numbers of rays differ.
    full = w.sum(1) ** 2 / np.sum(w**2, 1)
    exact = np.sqrt(np.sum(share**2 * p * (1.0 - p) / full))
    uneven = 0.5 * np.max(abs(4.0 * full / sums.samples[0] - 1.0))
    np.testing.assert_allclose(np.std(found), exact, rtol=4.0 / np.sqrt(2.0 * trials))
    np.testing.assert_allclose(_noise(sums, share, p[None])[0], exact, rtol=1.1 * uneven)
    assert uneven < 0.03
    assert np.max(abs(_free_probability(sums)[0] - p)) < 0.12


def test_few_rays_that_agree_promise_no_certainty():
    sums = Sums(np.array([[2.0]]), np.array([[2.0]]), np.array([2.0]))
    assert 0.5 < _free_probability(sums)[0, 0] < 1.0


def calibration(rays):
    """Measured over expected root mean square error, limit by limit."""
    found, true = answers(rays), fence_light(floor(SIDE))
    inner = INNER.ravel()
    both = zip(found.visible, found.error, strict=True)
    return np.array([rms((v - true)[inner]) / rms(e[inner]) for v, e in both])


@pytest.mark.smoke
@pytest.mark.parametrize("rays", [4, 16])
def test_measured_errors_are_those_expected(rays):
    """Within a factor of 3 either way at every limit, on bars that hide each other."""
    assert np.all(np.abs(np.log(calibration(rays))) < np.log(3.0)), calibration(rays)


def test_at_one_ray_the_expected_error_is_too_large():
    """Halves of one additive sequence err together, so that their noise is taken for steps.

    Not what is clipped at zero: halves from two seeds are clipped too, and see below.
    """
    assert 0.25 < calibration(1).min() < calibration(1).max() < 1.0


@pytest.mark.parametrize(("rays", "low", "high"), [(1, 0.7, 1.6), (4, 0.6, 1.25)])
def test_halves_from_two_seeds_expect_the_right_error_on_average(rays, low, high):
    """Half of the rays by each; single runs scatter by two, so that eight are averaged."""
    true, inner = fence_light(floor(SIDE)), INNER.ravel()
    found, expected = np.zeros((2, len(LIMITS)))
    for seed in range(8):
        parts = (
            trace_shadow_rays(LAMP, floor(SIDE), rays / 2, cards(*FENCE), 2 * seed + k)[0]
            for k in (0, 1)
        )
        pairs = (np.stack(c, 1).reshape(-1, *c[0].shape[1:]) for c in zip(*parts, strict=True))
        rungs = band_limit_sweep(
            LAMP, RayTable(*pairs), floor(SIDE), LIMITS, PIXEL, np.zeros(SIDE**2), ALL
        )
        found += np.mean((rungs.visible - true)[:, inner] ** 2, 1)
        expected += np.mean(rungs.error[:, inner] ** 2, 1)
    ratio = np.sqrt(found / expected)
    assert np.all((low < ratio) & (ratio < high)), ratio


@pytest.mark.parametrize(("rays", "most"), [(1, 1.7), (4, 1.35), (16, 1.35)])
def test_the_choice_is_near_the_best_that_a_search_finds(rays, most):
    """Which needs the truth; the choice does not. At one ray it is too sharp: see above."""
    found, true = answers(rays), fence_light(floor(SIDE))
    inner = INNER.ravel()
    fixed = [rms((v - true)[inner]) for v in found.visible]
    chosen = rms((select_band_limits(found, ALL).visible - true)[inner])
    assert chosen < most * min(fixed)
    assert max(fixed) > 2.0 * min(fixed)
    if rays > 1:
        assert fixed[found.best_of_all] < most * min(fixed)


def test_more_rays_want_a_sharper_filter():
    few, many = (np.mean(select_band_limits(answers(rays), ALL).limit) for rays in (0.25, 16))
    assert many > 1.5 * few


def test_neighbours_do_not_jump():
    limit = select_band_limits(answers(4), ALL).limit.reshape(SIDE, SIDE)
    assert np.max(abs(np.diff(np.log2(limit), axis=0))) < 1.0


def test_receivers_that_no_lamp_can_light_are_nan_and_alone():
    """Rungs and choice of all others are the same; in the image they take pixels of their own."""
    receivers, bad = bad_receivers(floor(SIDE))
    places = np.arange(len(receivers))
    table, _ = trace_shadow_rays(LAMP, floor(SIDE), 1, cards(*FENCE))
    # An image with free pixels at its end, in which the others stay where they are.
    where = np.insert(np.arange(SIDE**2), bad - np.arange(3), SIDE**2 + 1500 + np.arange(3))
    image = np.delete(where, bad), 60
    right = band_limit_sweep(LAMP, table, floor(SIDE), LIMITS, PIXEL, np.zeros(SIDE**2), image)
    unknown = np.full(len(places), np.nan)
    found = band_limit_sweep(LAMP, table, receivers, LIMITS, PIXEL, unknown, (where, 60))
    np.testing.assert_array_equal(found.limits, right.limits)
    for a, b in zip(found[1:], right[1:], strict=True):
        assert np.all(np.isnan(a[:, bad]))
        np.testing.assert_array_equal(np.delete(a, bad, 1), b)
    assert found.best_of_all == right.best_of_all
    chosen, expected = select_band_limits(found, (where, 60)), select_band_limits(right, image)
    for a, b in zip(chosen, expected, strict=True):
        np.testing.assert_array_equal(np.delete(a, bad), b)
        assert np.all(np.isnan(a[bad]))


def test_limits_must_double():
    table = trace_shadow_rays(LAMP, floor(2), 1, cards())[0]
    where = np.arange(4), 2
    for limits in (np.array([1.0, 3.0]), np.array([1e-9, 3e-9])):  # in any unit
        with pytest.raises(ValueError, match="each twice the one before"):
            band_limit_sweep(LAMP, table, floor(2), limits, PIXEL, np.zeros(4), where)


IMAGES = {
    "a pixel beyond its end": (
        (np.arange(1, 5), 2),
        r"^Argument `image\[0\]` must hold numbers of pixels, 0 to 3, but holds 1 to 4\.",
    ),
    "a pixel before its start": ((np.arange(-1, 3), 2), "0 to 3, but holds -1 to 2"),
    "too few pixels": (
        (np.arange(3), 2),
        r"must have shape \(4,\), but has \(3,\)|violates type hint",
    ),
    "no side": ((np.arange(4), 0), r"^Argument `image\[1\]` must be a positive integer"),
    "no pair": (np.arange(4), "^Argument `image` must be a pair|violates type hint"),
}


@pytest.mark.parametrize("name", IMAGES)
def test_an_image_holds_each_receiver(name):
    image, words = IMAGES[name]
    table = trace_shadow_rays(LAMP, floor(2), 1, cards())[0]
    limits = np.array([1.0, 2.0])
    with pytest.raises((ValueError, TypeError), match=words):
        band_limit_sweep(LAMP, table, floor(2), limits, PIXEL, np.zeros(4), image)
    rungs = band_limit_sweep(LAMP, table, floor(2), limits, PIXEL, np.zeros(4), (np.arange(4), 2))
    with pytest.raises((ValueError, TypeError), match=words):
        select_band_limits(rungs, image)


@pytest.mark.parametrize("rays", [0.0, -4.0, np.nan])
def test_a_fallback_is_made_of_rays(rays):
    table = trace_shadow_rays(LAMP, floor(2), 1, cards())[0]
    given = np.array([1.0, 2.0]), PIXEL, np.zeros(4), (np.arange(4), 2)
    with pytest.raises(ValueError, match="`own_rays` must be positive"):
        band_limit_sweep(LAMP, table, floor(2), *given, own_rays=rays)


def test_a_fault_is_noticed(monkeypatch):
    """Steps of all rays taken for bias, noise and all: everything looks blurred."""
    right, bias = np.mean(answers(1).bias[0] ** 2), module._bias

    def noisy(halves, *about):
        return bias(np.stack([halves[:, 0], halves[:, 0]], 1), *about)

    monkeypatch.setattr(module, "_bias", noisy)
    assert np.mean(answers(1).bias[0] ** 2) > 1.5 * right
