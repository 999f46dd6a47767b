"""Photons seen straight: unbiased where the shadow is even, blurred and noisy as foretold."""

import numpy as np
import pytest

from figures.e11.competitors import photons
from figures.e11.competitors.photons import nearest, shares, shoot
from firstorder.checks.statistics import error_slope, z_test
from firstorder.shadowfield.rendering.lamp import lamp_frame

HIGH, HALF = 4.0, 0.8
LAMP = lamp_frame((0.0, 0.0, HIGH), (0.0, HALF, 0.0), (HALF, 0.0, 0.0))
CORNER, EDGES = np.array([-2.0, -2.0, 0.0]), np.array([(4.0, 0.0, 0.0), (0.0, 4.0, 0.0)])


def half_way(a, b):
    """A sheet at half the height hides x < 0: the share seen is (0.8 + x) / 1.6."""
    hit = 0.5 * (a + b)[:, 0] < 0.0
    return np.where(hit, 0.5, np.inf), np.where(hit, 0.5, -np.inf)


def at_the_lamp(a, b):
    """Hides three quarters of the lamp from everywhere."""
    hit = b[:, 0] < 0.5 * HALF
    return np.where(hit, 1e-6, np.inf), np.where(hit, 1e-6, -np.inf)


def free(a, b):
    return np.full(len(a), np.inf), np.full(len(a), -np.inf)


MIDDLE = np.array([[0.1, -0.2, 0.0]])


@pytest.mark.smoke
@pytest.mark.parametrize("k", [3, 20])
@pytest.mark.parametrize(("blockers", "true"), [(free, 1.0), (at_the_lamp, 0.25)])
def test_even_light_is_right_on_average(k, blockers, true):
    runs = [shares(shoot(LAMP, CORNER, EDGES, 2000, blockers, s), MIDDLE, k)[0] for s in range(600)]
    test = z_test(np.mean(runs), np.std(runs, ddof=1) / np.sqrt(len(runs)), true)
    assert test.passed, (k, np.mean(runs), true)


@pytest.mark.parametrize("k", [10, 40])
def test_the_noise_is_that_of_k_photons(k):
    """(k - 1) / (pi r^2) of a Poisson process has the variance `f^2 / (k - 2)`."""
    runs = [shares(shoot(LAMP, CORNER, EDGES, 4000, free, s), MIDDLE, k)[0] for s in range(600)]
    off = np.std(runs) * np.sqrt(k - 2.0)
    assert abs(off - 1.0) < 4.0 / np.sqrt(2 * 600) + 0.5 * k / 2000.0


def test_a_falloff_is_where_photons_leave():
    """A light of the right half alone: the sheet before the left one hides nothing."""
    found = shoot(LAMP, CORNER, EDGES, 5000, at_the_lamp, 0, lambda p: 1.0 * (p[:, 1] > 0.5))
    assert len(found.position) == 5000


def penumbra_error(count, k):
    """Within the penumbra, where light is linear; its ends at 0.8, where the slope jumps, are out
    of view: with them errors fall with N^(-1/4) at best, not N^(-1/3)."""
    x = np.linspace(-0.7, 0.7, 60)
    at = np.stack([np.repeat(x, 8), np.tile(np.linspace(-0.8, 0.8, 8), 60), np.zeros(480)], 1)
    off = shares(shoot(LAMP, CORNER, EDGES, count, half_way, 1), at, k) - (0.8 + at[:, 0]) / 1.6
    return np.sqrt(np.mean(off**2))


def test_errors_fall_while_more_photons_count_and_stay_for_a_fixed_number():
    counts = [4000, 32000, 256000]
    growing = [penumbra_error(n, nearest(n)) for n in counts]
    fixed = [penumbra_error(n, 30) for n in counts]
    slope = error_slope(counts, growing).slope  # of smooth light alone: see `penumbra_error`
    assert -0.45 < slope < -0.2, slope
    assert fixed[-1] > 0.6 * fixed[0]
    assert growing[-1] < 0.3 * fixed[-1]


def test_no_photons_no_light_and_bytes():
    none = shoot(LAMP, CORNER, EDGES, 50, lambda a, b: (0 * a[:, 0] + 0.5, 0 * a[:, 0] + 0.5))
    assert none.position.shape == (0, 3)
    assert shares(none, MIDDLE, 5).tolist() == [0.0]
    some = shoot(LAMP, CORNER, EDGES, 50, free)
    assert some.position.nbytes == 12 * 50
    assert some.bytes_each == 12.0


@pytest.mark.parametrize("away", [0.0, 1e6])
def test_a_scene_may_be_far_from_the_origin(away):
    """In single precision places a thousand kilometres off would be 6 cm apart."""
    shift = np.array([away, -away, 0.5 * away])
    lamp = LAMP._replace(center=LAMP.center + shift)
    sent = shoot(lamp, CORNER + shift, EDGES, 2000, free, 3)
    assert sent.position.dtype == np.float32
    here = shoot(LAMP, CORNER, EDGES, 2000, free, 3)
    np.testing.assert_allclose(sent.places, here.places + shift, rtol=0.0, atol=1e-6)
    found = shares(sent, MIDDLE + shift, 20)
    np.testing.assert_allclose(found, shares(here, MIDDLE, 20), rtol=1e-5)


def test_bad_input():
    with pytest.raises(ValueError, match="`k` must be at least 2"):
        shares(shoot(LAMP, CORNER, EDGES, 10, free), MIDDLE, 1)
    with pytest.raises(ValueError, match="`edges` must be positive"):
        shoot(LAMP, CORNER, np.ones((2, 3)), 10, free)


@pytest.mark.parametrize("fault", ["k photons", "no photon is lost"])
def test_faults_are_noticed(monkeypatch, fault):
    right = photons.shares
    if fault == "k photons":
        monkeypatch.setitem(globals(), "shares", lambda p, x, k: right(p, x, k) * k / (k - 1.0))
        check = (3, free, 1.0)
    else:
        monkeypatch.setattr(photons.np, "isinf", lambda a: np.ones(len(a), bool))
        check = (20, at_the_lamp, 0.25)
    with pytest.raises(AssertionError):
        test_even_light_is_right_on_average(*check)
