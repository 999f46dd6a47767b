import numpy as np
import pytest

from firstorder.checks.statistics import (
    LEVEL,
    chi_square,
    error_slope,
    sampler_p_value,
    spread_test,
    z_test,
    z_test_of,
    z_threshold,
)
from firstorder.checks.tolerance import fitted_order
from firstorder.sampling import estimate


def test_the_threshold_keeps_its_word():
    """One seed for all: the largest of m deviations exceeds it as often as it says."""
    z = np.abs(np.random.default_rng(0).normal(size=(20_000, 50)))
    share = np.mean(z.max(1) > z_threshold(50, 0.05))
    assert abs(share - 0.05) < 5 * np.sqrt(0.05 * 0.95 / 20_000)
    # Without the correction, the test would be red nine times in ten.
    assert np.mean(z.max(1) > z_threshold(1, 0.05)) > 0.9


def test_student_needs_more_where_errors_are_guessed():
    x = np.random.default_rng(1).normal(size=(40_000, 5))
    t = np.abs(x.mean(1) / (x.std(1, ddof=1) / np.sqrt(5)))
    share = np.mean(t > z_threshold(1, 0.05, 4.0))
    assert abs(share - 0.05) < 5 * np.sqrt(0.05 * 0.95 / 40_000)
    assert np.mean(t > z_threshold(1, 0.05)) > 0.1


def test_a_bias_of_six_errors_is_red_and_what_is_not_a_number_too():
    assert z_test([0.1, -0.2], 0.1, 0.0).passed
    assert not z_test([0.1, 0.6], 0.1, 0.0).passed
    assert not z_test([0.1, np.nan], 0.1, 0.0).passed
    assert not z_test([0.1, 0.1], [0.1, np.nan], 0.0).passed
    assert not z_test([0.0, 0.1], [np.nan, 0.1], 0.0).passed
    assert not z_test(5.0, np.inf, 0.0).passed  # what is not known has not been seen
    assert not z_test(1.0, 0.0, 0.5).passed
    assert z_test(1.0, 0.0, 1.0).passed
    assert z_test(1.0, 0.0, 0.5, truth_error=0.5).passed
    assert z_test_of(estimate([0.9, 1.1, 1.0]), 1.0).passed


def test_chi_square_keeps_its_word():
    rng = np.random.default_rng(2)
    share = np.array([0.5, 0.3, 0.1, 0.05, 0.03, 0.02])
    p = [chi_square(rng.multinomial(2000, share), 2000 * share) for _ in range(2000)]
    for level in (0.01, 0.1, 0.5):
        found = np.mean(np.array(p) < level)
        assert abs(found - level) < 5 * np.sqrt(level * (1 - level) / 2000)


def test_chi_square_knows_the_impossible():
    assert chi_square([5, 95], [0, 100]) == 0.0
    assert chi_square([3, 2], [2.5, 2.5]) == 1.0  # too few for any judgement
    with pytest.raises(ValueError, match="must have one sum"):
        chi_square([5, 5], [5, 6])
    with pytest.raises(ValueError, match="must have one sum"):
        chi_square([5, 5], [np.nan, 5])


def test_a_density_and_samples_that_are_no_numbers_are_failures():
    x = np.random.default_rng(5).uniform(size=4096)
    assert sampler_p_value(x, lambda x: np.full_like(x, np.nan), 0.0, 1.0) == 0.0
    assert sampler_p_value(np.append(x, np.nan), np.ones_like, 0.0, 1.0) == 0.0


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: z_test([], [], []), "`mean` must hold a number, but holds none."),
        (lambda: z_test(np.nan, 1.0, 0.0, level=0.0), r"`level` must lie in \(0, 1\)"),
        (lambda: chi_square([], []), "`counts` must hold samples, but holds none."),
        (lambda: chi_square([50, 50], [100]), "equally many bins, but have 2 and 1."),
        (
            lambda: sampler_p_value([0.1] * 15, np.ones_like, 0.0, 1.0),
            "`samples` must hold at least 16, but holds 15.",
        ),
        (
            lambda: sampler_p_value([0.1] * 99, np.ones_like, 0.0, 1.0, bins=1),
            "`bins` must be two at least, but is 1.",
        ),
        (lambda: z_threshold(-3), "`comparisons` must not be negative, but is -3"),
        (lambda: chi_square([0, 100], [-50, 150]), "`expected` must not be negative, but is -50"),
        (lambda: chi_square([-4, 54, 50], [5, 45, 50]), "`counts` must not be negative, but is -4"),
        (lambda: z_test(np.array([1 + 5j]), 0.1, 1.0), "`mean` must be real"),
        (lambda: z_test(1.0, 0.1, np.array([1 + 5j])), "`truth` must be real"),
        (lambda: spread_test(np.array([1 + 9j]), 1.0, 9), "`measured` must be real"),
        (
            lambda: sampler_p_value(np.linspace(0, 1, 99) + 9j, np.ones_like, 0.0, 1.0),
            "`samples` must be real",
        ),
        (lambda: error_slope([1], [1]), "`counts` must hold two different numbers"),
        (lambda: error_slope([2, 2], [1, 2]), "`counts` must hold two different numbers"),
        (lambda: error_slope([1, 2], [0, 2]), "`errors` must be positive, but is 0"),
        (lambda: error_slope([1, 2, 3], np.ones((3, 1))), r"`errors` must have shape \(3,\)"),
    ],
)
def test_what_could_not_fail_is_refused(ask, sentence):
    with pytest.raises(ValueError, match=sentence):
        ask()


def test_what_is_not_known_or_no_spread_is_near_nothing():
    assert not z_test([1.0], [0.1], [9.0], truth_error=np.inf).passed
    assert not spread_test(-1.0, -1.0, 9).passed
    x = np.linspace(0.5, 1.0, 999)
    assert sampler_p_value(x, lambda x: np.where(x < 0.5, -1.0, 3.0), 0.0, 1.0, bins=2) == 0.0


def test_one_run_has_no_spread():
    with pytest.raises(ValueError, match="`runs` must be two at least, but is 1"):
        spread_test(2.0, 1.0, 1)


def test_samples_outside_or_a_density_of_the_wrong_integral_fail():
    u = np.random.default_rng(3).random(4000)
    assert sampler_p_value(u, np.ones_like, 0.0, 1.0) > LEVEL
    assert sampler_p_value(u**1.1, np.ones_like, 0.0, 1.0) < LEVEL
    assert sampler_p_value(u, lambda x: 1.01 + 0 * x, 0.0, 1.0) == 0.0
    assert sampler_p_value(1.001 * u, np.ones_like, 0.0, 1.0) == 0.0


def test_slopes_have_errors():
    n = 2.0 ** np.arange(4, 16)
    noise = np.exp(0.1 * np.random.default_rng(4).normal(size=n.size))
    fit = error_slope(n, noise / np.sqrt(n))
    assert fit.is_near(-0.5, count=n.size)
    assert not fit.is_near(-1.0, count=n.size)


def test_spreads_are_compared_on_a_logarithmic_scale():
    x = np.random.default_rng(6).normal(0.0, 2.0, (300, 8))
    assert spread_test(x.std(0, ddof=1), 2.0, 300).passed
    assert not spread_test(x.std(0, ddof=1), 3.0, 300).passed


@pytest.mark.parametrize(
    ("sizes", "errors", "words"),
    [
        ([1.0], [1.0], "`sizes` must hold two different numbers, but holds"),
        ([2.0, 2.0, 2.0], [1.0, 2.0, 3.0], "`sizes` must hold two different numbers, but holds"),
        ([1.0, 2.0], [0.0, 1.0], "`errors` must be positive, but is 0"),
        ([1.0, np.nan], [1.0, 1.0], "`sizes` must be positive, but is nan"),
        ([1.0, 2.0, 3.0], [1.0, 2.0], r"`errors` must have shape \(3,\)"),
        ([1.0, 2.0], np.array([1j, 1.0]), "`errors` must be real"),
    ],
)
def test_an_order_is_fitted_to_errors_of_several_sizes(sizes, errors, words):
    with pytest.raises(ValueError, match=f"^Argument {words}"):
        fitted_order(sizes, errors)


def test_an_expectation_may_be_negative_by_rounding():
    assert chi_square([10, 0, 10], [10, -1e-17, 10]) == 1.0
    with pytest.raises(ValueError, match="`expected` must not be negative"):
        chi_square([10, 0, 10], [11, -1.0, 10])
