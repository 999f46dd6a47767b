import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.fields import BoxProfile, GaussianProfile, Separable
from firstorder.shadowfield import (
    PLANE,
    average_occlusion_bound,
    coarsest_average_period,
    moire,
    moire_frequency,
    shadow_harmonic,
)
from firstorder.shadowfield.plane import periodic
from firstorder.shadowfield.plane.periodic import _bars_coefficient

D1, D2, OPEN, W = 1.2, 0.5, 0.3, 0.8
UNIFORM = Separable([0.0], (BoxProfile(0.5 * W, "y", PLANE),)).spectrum()
SOFT = Separable([0.1], (GaussianProfile(0.15, "y", PLANE),)).spectrum()


def comb(u, period, open=OPEN):
    return np.abs(u / period - np.round(u / period)) < 0.5 * open


def shadow(x, period, d2=D2):
    """Uniform light: the primitive of the comb at both ends of the stretch that is seen."""

    def passed(u):
        t = u / period + 0.5 * OPEN
        return period * (np.floor(t) * OPEN + np.minimum(t - np.floor(t), OPEN))

    share = d2 / D1
    low, high = (-0.5 * W * (1 - share) + x * share, 0.5 * W * (1 - share) + x * share)
    return (passed(high) - passed(low)) / (1 - share)


@pytest.mark.smoke
@pytest.mark.parametrize("period", [0.7, 0.13])
def test_the_waves_of_the_shadow_are_those_of_the_traced_one(period):
    n = 40000
    x = (np.arange(n) + 0.5) / n * period * D1 / D2
    h = shadow(x, period)
    for k in range(4):
        truth = np.mean(h * np.exp(-2j * np.pi * k * x * D2 / (D1 * period)))
        assert abs(shadow_harmonic(k, period, OPEN, UNIFORM, D1, D2) - truth) < 1e-7


def test_a_soft_light_away_from_the_middle():
    period, n = 0.5, 4000
    y = np.linspace(-1.1, 1.3, 24001)
    light = np.exp(-0.5 * ((y - 0.1) / 0.15) ** 2) / (0.15 * np.sqrt(2 * np.pi))
    x = (np.arange(n // 100) + 0.5) / (n // 100) * period * D1 / D2
    h = [np.sum(comb(y + (t - y) * D2 / D1, period) * light) * (y[1] - y[0]) for t in x]
    truth = np.mean(h * np.exp(-2j * np.pi * x * D2 / (D1 * period)))
    # 40 samples of the shadow alias its waves 39 and 41, of which a soft light leaves nothing.
    assert abs(shadow_harmonic(1, period, OPEN, SOFT, D1, D2) - truth) < 2e-4


def test_the_average_errs_by_no_more_than_the_bound_and_reaches_it():
    x = np.linspace(0.0, 3.0, 60001)
    reached = []
    for period in np.geomspace(0.02, 0.4, 60):
        h, mean = shadow(x, period), OPEN * W
        error = np.max(np.abs(h - mean)) / mean
        bound = average_occlusion_bound(period, OPEN, W, D1, D2)
        assert error <= bound * (1 + 1e-9)
        reached.append(error / bound)
    assert max(reached) > 0.97


@pytest.mark.smoke
def test_the_coarsest_period_for_a_tolerance_keeps_it():
    period = float(coarsest_average_period(0.05, OPEN, W, D1, D2))
    x = np.linspace(0.0, 3.0, 20001)
    assert np.max(np.abs(shadow(x, period) / (OPEN * W) - 1.0)) <= 0.05 * (1 + 1e-9)
    assert abs(average_occlusion_bound(period, OPEN, W, D1, D2) - 0.05) < 1e-12


def test_a_soft_light_forgets_fine_bars_faster_than_a_sharp_one():
    def wave(light, period):
        return float(abs(shadow_harmonic(1, period, OPEN, light, D1, D2)))

    assert wave(SOFT, 0.08) < 1e-8 * wave(SOFT, 1.0)
    sharp = [wave(UNIFORM, (1 - D2 / D1) * W / (m + 0.5)) for m in (4, 8, 16)]
    orders = np.diff(np.log(sharp)) / np.diff(np.log([4.5, 8.5, 16.5]))
    np.testing.assert_allclose(orders, -1.0, rtol=0.0, atol=0.01)


@pytest.mark.parametrize("period", [0.05, 0.0125])
def test_two_matched_planes_are_never_their_average(period):
    """Traced along rays to many places of a light of whole periods: between 0 and 1/2, always."""
    other = 0.8
    second = period * (D1 - other) / (D1 - D2)  # of the same angle, seen from the receiver
    common = period * D1 / (D1 - D2)
    y = (np.arange(20000) + 0.5) / 20000 * 4 * common
    x = np.linspace(0.0, 1.5 / float(moire_frequency(period, D1, D2, other)), 25)
    u = [y + (x[:, None] - y) * d / D1 for d in (D2, other)]
    both = comb(u[0], period, 0.5) & comb(u[1], second, 0.5)
    found = np.mean(both, axis=1)
    np.testing.assert_allclose(moire(x, period, D1, D2, other), found, rtol=0.0, atol=5e-4)
    assert np.ptp(found) > 0.48


def test_the_frequency_of_the_moire_is_its_period():
    f = float(moire_frequency(0.1, D1, D2, 0.8))
    x = jnp.linspace(0.0, 0.4, 9)
    np.testing.assert_allclose(
        moire(x, 0.1, D1, D2, 0.8), moire(x + 1.0 / f, 0.1, D1, D2, 0.8), rtol=0.0, atol=1e-12
    )


FAULTS = {
    "from the receiver's side": lambda n, p, o, L, a, b: _bars_coefficient(n, o) * L(b / a * n / p),
    "without the light's shrinking": lambda n, p, o, L, d1, d2: _bars_coefficient(n, o) * L(n / p),
    "on the receiver": lambda n, p, o, L, a, b: _bars_coefficient(n, o) * L((1 - a / b) * n / p),
    "closed for open": lambda n, p, o, L, d1, d2: shadow_harmonic(n, p, 1 - o + 0.1, L, d1, d2),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_waves_shows(fault):
    n, period = 20000, 0.7
    x = (np.arange(n) + 0.5) / n * period * D1 / D2
    truth = np.mean(shadow(x, period) * np.exp(-2j * np.pi * x * D2 / (D1 * period)))
    wrong = FAULTS[fault](1, period, OPEN, UNIFORM, D1, D2)
    assert np.isfinite(wrong)
    assert abs(wrong - truth) > 1e-3


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `period` must be positive, but is 0.0.$"):
        shadow_harmonic(1, 0.0, 0.5, UNIFORM, D1, D2)
    with pytest.raises(ValueError, match=r"^Argument `open` must lie in \[0, 1\], but is 1.5.$"):
        average_occlusion_bound(0.1, 1.5, W, D1, D2)
    with pytest.raises(ValueError, match=r"^Argument `tolerance` must be positive, but is 0.0.$"):
        coarsest_average_period(0.0, 0.5, W, D1, D2)
    with pytest.raises(
        ValueError, match=r"^Argument `d2` must be less than `d1` = 0.5, but is 0.6"
    ):
        average_occlusion_bound(0.1, 0.5, W, 0.5, 0.6)
    with pytest.raises(
        ValueError, match=r"^Argument `other` must be less than `d1` = 1.2, but is 2"
    ):
        moire(0.0, 0.1, D1, D2, 2.0)
    assert periodic._bars_coefficient(0, 0.3) == 0.3


BARS = {"period": 0.1, "d1": D1, "d2": D2}
AVERAGE = {**BARS, "open": OPEN, "width": W}
TWO = {**BARS, "other": 0.7}


@pytest.mark.parametrize(
    ("of", "arguments"),
    [
        (average_occlusion_bound, AVERAGE),
        (coarsest_average_period, {"tolerance": 0.1, **AVERAGE}),
        (moire_frequency, TWO),
        (functools.partial(moire, 0.03), TWO),
        (functools.partial(shadow_harmonic, 1, light=UNIFORM), {**BARS, "open": OPEN}),
    ],
)
def test_traced_numbers_that_are_refused_are_no_answer(of, arguments):
    arguments = {
        n: a for n, a in arguments.items() if (n, of) != ("period", coarsest_average_period)
    }
    traced = jax.jit(lambda numbers: of(**numbers))
    assert np.isfinite(traced(arguments))
    for name in arguments:
        assert np.isnan(traced({**arguments, name: -1.0})), name
    for name in {"d2", "other", "open"} & set(arguments):
        assert np.isnan(traced({**arguments, name: 1.5})), name
