"""Adaptive wavelet rendering: the transform against published taps, samples where they pay."""

import heapq

import numpy as np
import pytest

from figures.e11.competitors import wavelets
from figures.e11.competitors.wavelets import (
    Samples,
    decompose,
    priority,
    recompose,
    reconstructed,
    sample_image,
    step_matrix,
    weight_of_pixels,
)
from firstorder.checks.statistics import error_slope

# Antonini et al. 1992 and JPEG 2000 part 1, in the scale where low passes of ones are sqrt(2).
LOW = (0.852698679009, 0.377402855613, -0.110624404418, -0.023849465020, 0.037828455507)
HIGH = (0.788485616406, -0.418092273222, -0.040689417609, 0.064538882629)
SIDE = 64


def both_ways(taps):
    return np.array([*taps[:0:-1], *taps])


@pytest.mark.smoke
def test_the_filters_are_the_published_ones():
    A = step_matrix(32)
    np.testing.assert_allclose(A[8, 12:21], both_ways(LOW), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(A[16 + 8, 14:21], both_ways(HIGH), rtol=0.0, atol=1e-9)


def test_polynomials_have_no_details():
    x = np.arange(64.0) / 64
    for power in range(4):
        high = step_matrix(64)[32:] @ x**power
        assert np.max(abs(high[2:-2])) < 1e-13
    assert np.max(abs((step_matrix(64)[32:] @ x**4)[2:-2])) > 1e-7


@pytest.mark.parametrize("shape", [(64, 64), (48, 96), (16, 8), (7, 30)])
def test_pictures_come_back(shape):
    f = np.random.default_rng(0).normal(size=shape)
    np.testing.assert_allclose(recompose(decompose(f)), f, rtol=0.0, atol=1e-12)


def test_variances_of_coefficients_are_those_of_many_noisy_pictures():
    rng = np.random.default_rng(1)
    sigma = 0.5 + rng.random((16, 32))
    many = [decompose(sigma * rng.normal(size=sigma.shape)) for _ in range(4000)]
    found = decompose(sigma**2, 2)
    for pick in (lambda b: b.rest, lambda b: b.details[0][0], lambda b: b.details[-1][2]):
        measured = np.var([pick(b) for b in many], axis=0)
        # A variance over n runs has the relative spread sqrt(2 / n).
        off = (measured / pick(found) - 1.0) / np.sqrt(2.0 / len(many))
        assert np.max(abs(off)) < 5.0
        assert 0.8 < np.std(off) < 1.2


def test_weights_of_pixels_are_the_sum_over_all_coefficients():
    """Of one pixel: its own picture, taken apart and squared."""
    shape = (32, 16)
    rng = np.random.default_rng(2)
    kept = decompose(np.zeros(shape))
    kept = kept._replace(
        rest=rng.random(kept.rest.shape),
        details=tuple(tuple(rng.random(a.shape) for a in level) for level in kept.details),
    )
    weight = weight_of_pixels(kept, shape)
    for p in ((0, 0), (17, 9), (31, 15)):
        one = np.zeros(shape)
        one[p] = 1.0
        c = decompose(one)
        total = np.sum(kept.rest * c.rest**2) + sum(
            np.sum(k * a**2)
            for keeps, level in zip(kept.details, c.details, strict=True)
            for k, a in zip(keeps, level, strict=True)
        )
        np.testing.assert_allclose(weight[p], total)


# --- a picture of an edge, smooth and sharp, and of noise ----------------------------------------


def truth(side=SIDE):
    """Dark left, a soft ramp, light, and a hard edge to the right: shares of light in [0, 1]."""
    x = (np.arange(side) + 0.5) / side
    ramp = np.clip((x - 0.2) / 0.3, 0.0, 1.0)
    soft = ramp**2 * (3.0 - 2.0 * ramp)
    return np.where(x > 0.8, 0.0, soft)[:, None] + np.zeros(side)


def chance(pixel, number, seed):
    """Independent numbers in [0, 1) by what they are for (splitmix64)."""
    with np.errstate(over="ignore"):
        z = (pixel * 65536 + number).astype(np.uint64) + np.uint64(seed + 1) * np.uint64(1 << 40)
        z = z * np.uint64(0x9E3779B97F4A7C15)
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            z = (z ^ (z >> np.uint64(shift))) * np.uint64(factor)
    return (z ^ (z >> np.uint64(31))) / 2.0**64


def coins(p, seed=0):
    """0 or 1 with the picture's chance, as shadow rays are."""
    flat = p.ravel()
    return lambda pixel, number: (chance(pixel, number, seed) < flat[pixel]).astype(float)


def rms(a):
    return np.sqrt(np.mean((a - truth()) ** 2))


@pytest.mark.parametrize("total", [4 * SIDE**2, 4 * SIDE**2 + 1, 5 * SIDE**2 + 77, 12 * SIDE**2])
def test_so_many_samples_as_asked(total):
    calls = []
    shade = coins(truth())

    def counted(pixel, number):
        calls.append(np.stack([pixel, number]))
        return shade(pixel, number)

    samples = sample_image(counted, (SIDE, SIDE), total)
    asked = np.concatenate(calls, 1)
    assert samples.number.sum() == asked.shape[1] == total
    assert len(np.unique(asked[0] * 1000 + asked[1])) == total  # none twice
    np.testing.assert_array_equal(np.bincount(asked[0]), samples.number.ravel())


def test_pictures_without_noise_are_exact():
    f = np.random.default_rng(3).random((SIDE, SIDE))
    samples = sample_image(lambda p, _: f.ravel()[p], (SIDE, SIDE), 6 * SIDE**2)
    np.testing.assert_allclose(reconstructed(samples), f, rtol=0.0, atol=1e-7)


def test_samples_go_where_light_varies():
    samples = sample_image(coins(truth()), (SIDE, SIDE), 12 * SIDE**2)
    x = (np.arange(SIDE) + 0.5) / SIDE
    ramp, flat = (x > 0.3) & (x < 0.4), (x < 0.1) | ((x > 0.58) & (x < 0.72))
    assert samples.number[ramp].mean() > 2.0 * samples.number[flat].mean()
    assert np.all(samples.number >= 4)


def errors(rays=(8, 16, 32, 64)):
    found = []
    for n in rays:
        samples = sample_image(coins(truth(), n), (SIDE, SIDE), n * SIDE**2)
        even = sample_image(coins(truth(), n), (SIDE, SIDE), n * SIDE**2, first=n)
        found.append((rms(reconstructed(samples)), rms(reconstructed(even)), rms(even.mean)))
    return np.array(found).T


def test_errors_fall_to_nothing_and_stay_below_those_of_even_samples():
    """Its own, those of even samples shrunk alike, and of plain means.

    Shrunk wavelets of pictures with edges converge at n^(-1/4) at least, at n^(-1/2) in the end,
    when no coefficient is shrunk away (Donoho and Johnstone 1994 on what N coefficients leave).
    """
    rays = (8, 16, 32, 64)
    own, even, plain = errors(rays)
    assert np.all(np.diff(own) < 0.0)
    assert error_slope(rays, own).slope < -0.25
    assert np.all(own < 0.6 * plain)
    assert np.mean(np.log(own / even)) < -0.05


def test_a_threshold_of_nothing_leaves_the_mean():
    samples = sample_image(coins(truth()), (SIDE, SIDE), 4 * SIDE**2)
    np.testing.assert_allclose(reconstructed(samples, 0), samples.mean, rtol=0.0, atol=1e-12)


def test_the_priority_foretells_what_a_sample_gains():
    """The variance that stays in the kept coefficients, before and after one more everywhere."""
    rng = np.random.default_rng(5)
    count = rng.integers(2, 9, (32, 32))
    mean, sigma2 = rng.random((32, 32)), 0.25
    square = count * mean**2 + sigma2 * (count - 1)
    samples = Samples(count, count * mean, square)
    np.testing.assert_allclose(samples.variance, sigma2, rtol=1e-12)
    tiny = Samples(count, 1e6 * samples.total, 1e12 * (count * mean**2) + sigma2 * (count - 1))
    gains = priority(tiny)  # nothing is shrunk: all coefficients are kept
    p = (10, 20)
    less = np.where((np.arange(32)[:, None] == p[0]) & (np.arange(32) == p[1]), 1, 0)
    variance = tiny.variance[p]

    def kept(n):
        bands = decompose(variance / n, 2)
        return bands.rest.sum() + sum(a.sum() for level in bands.details for a in level)

    np.testing.assert_allclose(gains[p], kept(count) - kept(count + less), rtol=1e-5)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (dict(first=1, total=4096), "`first` must be at least 2"),
        (dict(total=100), "`total` must be at least 16384"),
        (dict(total=20000, rounds=0), "`rounds` must be positive"),
    ],
)
def test_bad_input(wrong, words):
    with pytest.raises(ValueError, match=words):
        sample_image(coins(truth()), (SIDE, SIDE), **wrong)


def test_other_bad_input():
    with pytest.raises(ValueError, match="must be even"):
        step_matrix(7)
    with pytest.raises(ValueError, match="`threshold` must not be negative"):
        reconstructed(Samples(np.full((8, 8), 2), np.ones((8, 8)), np.ones((8, 8))), -1)


def test_one_sample_has_no_variance_and_nan_is_none():
    one = Samples(np.ones((8, 8), int), np.ones((8, 8)), np.ones((8, 8)))
    bad = Samples(np.full((8, 8), 4), np.where(np.eye(8) > 0.0, np.nan, 1.0), np.ones((8, 8)))
    for judge in (reconstructed, priority):
        with pytest.raises(ValueError, match="at least two samples in each pixel"):
            judge(one)
        with pytest.raises(ValueError, match="`samples` must be finite, but 8 pixels are not"):
            judge(bad)
    with pytest.raises(ValueError, match="`shade` must give finite values, but gave nan"):
        sample_image(lambda p, n: np.where(p == 5, np.nan, 1.0), (8, 8), 300)


@pytest.mark.parametrize("fault", ["noise everywhere", "a lifting step twice", "last pixels first"])
def test_faults_are_noticed(monkeypatch, fault):
    if fault == "noise everywhere":
        monkeypatch.setattr(wavelets, "priority", lambda s: np.ones(s.total.shape))
        with pytest.raises(AssertionError):
            test_samples_go_where_light_varies()
    elif fault == "a lifting step twice":
        monkeypatch.setattr(wavelets, "LIFT", (*wavelets.LIFT[:2], wavelets.LIFT[1]))
        step_matrix.cache_clear()
        with pytest.raises(AssertionError):
            test_the_filters_are_the_published_ones()
        step_matrix.cache_clear()
    else:
        right = wavelets.priority
        monkeypatch.setattr(wavelets, "priority", lambda s: right(s)[::-1])
        with pytest.raises(AssertionError):
            test_errors_fall_to_nothing_and_stay_below_those_of_even_samples()


def test_samples_go_one_by_one_to_what_gains_most():
    """By a heap, each pixel's next sample at a time; no pixel gets more than it has."""
    rng = np.random.default_rng(0)
    n = rng.integers(2, 12, (16, 16))
    mean, spread = rng.random((16, 16)), rng.random((16, 16)) ** 4
    samples = wavelets.Samples(n, mean * n, n * mean**2 + spread * (n - 1))
    have = n.ravel()
    gain = wavelets.priority(samples).ravel() * have * (have + 1.0)
    many = have.copy()
    left = [(-gain[p] / (many[p] * (many[p] + 1)), p) for p in range(256)]
    heapq.heapify(left)
    for _ in range(300):
        _, p = heapq.heappop(left)
        many[p] += 1
        if many[p] < 2 * have[p]:
            heapq.heappush(left, (-gain[p] / (many[p] * (many[p] + 1)), p))
    np.testing.assert_array_equal(wavelets._handed_out(samples, 300), many - have)
