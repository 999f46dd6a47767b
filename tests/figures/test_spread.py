"""Means with their standard errors, and root mean squares."""

import numpy as np
import pytest

from figures.spread import geometric, ratio_of_means, rms, share, spread


def test_spread_is_the_mean_and_its_standard_error():
    mean, error = spread([1.0, 2.0, 3.0, 6.0])
    assert mean == 3.0
    assert error == pytest.approx(np.sqrt(14.0 / 3.0) / 2.0)


def test_the_error_of_a_geometric_mean_is_that_of_the_logarithms():
    got = geometric(np.array([1.0, 4.0]))
    np.testing.assert_allclose(got, (2.0, 2.0 * np.log(2.0)), rtol=1e-12)


def test_the_root_of_the_mean_square_counts_every_number_once():
    assert rms([[3.0, 4.0], [0.0, 0.0]]) == 2.5


def test_standard_errors_are_those_of_many_repetitions():
    """Each error against the scatter of its mean over 4000 draws."""
    rng = np.random.default_rng(5)
    a = rng.normal(2.0, 0.3, (4000, 20))
    b = a * rng.normal(0.5, 0.05, a.shape)
    hits = rng.random(a.shape) < 0.7
    for function, draws in (
        (lambda i: spread(a[i]), "mean"),
        (lambda i: ratio_of_means(b[i], a[i]), "ratio"),
        (lambda i: geometric(b[i] / a[i]), "geometric"),
        (lambda i: share(hits[i]), "share"),
    ):
        found = np.array([function(i) for i in range(len(a))])
        np.testing.assert_allclose(
            np.mean(found[:, 1]), np.std(found[:, 0]), rtol=0.06, err_msg=draws
        )
    assert share([True] * 10).error > 0.05  # ten of ten leave room for one in twenty
