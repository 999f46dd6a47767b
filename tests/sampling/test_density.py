import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import spread_test, z_test
from firstorder.sampling._density import (
    ExpectedDensity,
    expected_fixed_radius,
    expected_k_nearest,
    fixed_window,
    nearest_window,
)

COUNT, RUNS = 600, 400
X = np.array([0.0, 0.03, 0.3, 0.62, 1.0])  # both ends, near one, inside


def cumulative(x):
    """Of the density 3/8 + 3/4 x^2 ... on [0, 1], with a kink at 0.6; the rest falls elsewhere."""
    x = np.clip(x, 0.0, 1.0)
    return 0.4 * x + 0.3 * x**2 + np.where(x > 0.6, 0.5 * (x - 0.6) ** 2, 0.0)


@pytest.fixture(scope="module")
def points():
    grid = np.linspace(0.0, 1.0, 20001)
    u = np.random.default_rng(5).random((RUNS, COUNT))
    x = np.where(u < cumulative(1.0), np.interp(u, cumulative(grid), grid), 1e9)
    return jnp.asarray(np.sort(x, -1))


def estimates(points, k=0, radius=0.0, kept=None):
    none, all_ = jnp.zeros(X.size, int), jnp.full(X.size, COUNT)

    def run(at):
        if k:
            w = nearest_window(at, jnp.asarray(X), k, none, all_)
            return (kept or k) / (2.0 * w.radius * COUNT)
        w = fixed_window(at, jnp.asarray(X), jnp.full(X.size, radius), none, all_)
        return (w.last - w.first) / (2.0 * w.radius * COUNT)

    return np.asarray(jax.jit(jax.vmap(run))(points))


CASES = [("fixed", {"radius": 0.05}), ("all k", {"k": 12}), ("all but one", {"k": 12, "kept": 11})]


def expected(case, x=X):
    if "radius" in case:
        return expected_fixed_radius(cumulative, x, case["radius"], COUNT)
    return expected_k_nearest(cumulative, x, case["k"], COUNT, case.get("kept"))


@pytest.mark.parametrize(("name", "case"), CASES)
def test_mean_and_spread_are_what_was_predicted(points, name, case):
    seen, want = estimates(points, **case), expected(case)
    error = seen.std(0, ddof=1) / np.sqrt(RUNS)
    assert z_test(seen.mean(0), error, want.mean, freedom=RUNS - 1).passed
    # The nearest photons' density has a heavier tail than the normal law of `spread_test`.
    if "radius" in case:
        assert spread_test(seen.std(0, ddof=1), want.spread, RUNS).passed


@pytest.mark.parametrize(("name", "case"), CASES)
def test_the_density_itself_is_not_what_comes_out(points, name, case):
    """Bias is real: the same test is red against the truth, at the ends or everywhere."""
    seen = estimates(points, **case)
    h = 1e-6
    truth = (cumulative(X + h) - cumulative(X - h)) / (2 * h)
    truth[[0, -1]] *= 2.0
    z = z_test(seen.mean(0), seen.std(0) / np.sqrt(RUNS), truth)
    assert not z.passed


def test_a_uniform_density_is_overestimated_by_k_over_k_less_one():
    def uniform(x):
        return np.clip(x, 0.0, 1.0)

    for k in (2, 5, 50):
        all_k = expected_k_nearest(uniform, 0.5, k, 100_000).mean[0]
        kept = expected_k_nearest(uniform, 0.5, k, 100_000, k - 1).mean[0]
        # For k = 2 the quantile's end limits the quadrature.
        assert abs(all_k - k / (k - 1)) < 2e-3 / k**2
        assert abs(kept - 1.0) < 2e-3 / k**2


@pytest.mark.parametrize("r", [0.01, 0.02, 0.04])
def test_bias_of_a_fixed_width_in_small(r):
    """`f'' r^2 / 6` where smooth, `f / 2` at an end, `f + J r / 4` at a kink."""

    def smooth(x):
        return x + 0.5 * x**3

    assert isinstance(expected_fixed_radius(smooth, 0.3, r, 9), ExpectedDensity)
    assert (
        abs(expected_fixed_radius(smooth, 0.3, r, 9).mean - (1.0 + 1.5 * 0.09 + 0.5 * r**2)) < 1e-12
    )
    assert abs(expected_fixed_radius(cumulative, 0.0, r, 9).mean - 0.5 * (0.4 + 0.3 * r)) < 1e-12
    kink = expected_fixed_radius(cumulative, 0.6, r, 9).mean - (0.4 + 0.6 * 0.6)
    assert abs(kink - 1.0 * r / 4.0) < 1e-12


def test_the_nearest_are_the_nearest(points):
    at = np.asarray(points[0])
    at = np.append(at[at < 2.0], [np.inf] * 3)
    m = at.size - 3
    x = jnp.linspace(-0.2, 1.2, 57)
    for k in (1, 2, 9, m, m + 5):
        w = nearest_window(jnp.asarray(at), x, k, jnp.zeros(57, int), jnp.full(57, m))
        for i, place in enumerate(np.asarray(x)):
            d = np.sort(np.abs(at[:m] - place))[: min(k, m)]
            assert w.last[i] - w.first[i] == d.size
            assert abs(float(w.radius[i]) - d[-1]) < 1e-12


def test_the_nearest_are_sought_among_a_row_s_own(points):
    """Other curves' points lie right before and behind, nearer than some of these."""
    at, low, high = np.asarray(points[0])[:90], 20, 50
    x = np.append(np.linspace(at[10], at[60], 41), at[[low, high - 1]])
    ends = jnp.full(x.size, low), jnp.full(x.size, high)
    for k in (1, 7, 30, 40):
        w = nearest_window(jnp.asarray(at), jnp.asarray(x), k, *ends)
        d = np.sort(abs(at[low:high] - x[:, None]), axis=1)[:, :k]
        np.testing.assert_array_equal(w.last - w.first, d.shape[1])
        np.testing.assert_allclose(w.radius, d[:, -1], rtol=1e-12)


def test_no_points_have_no_density():
    w = nearest_window(jnp.full(4, jnp.inf), jnp.array([0.5]), 3, jnp.array([0]), jnp.array([0]))
    assert w.radius.item() == np.inf
    with pytest.raises(ValueError, match="must be positive, but is 0"):
        nearest_window(jnp.zeros(4), jnp.array([0.5]), 0, jnp.array([0]), jnp.array([4]))


@pytest.mark.parametrize("unit", [1e-15, 1e9])
def test_the_unit_of_length_is_of_no_matter_to_the_nearest(unit):
    def even(x):
        return np.clip(x / unit, 0.0, 1.0)

    mean = expected_k_nearest(even, [0.5 * unit], 11, 1000).mean
    np.testing.assert_allclose(mean * unit, 1.1, rtol=1e-6)


@pytest.mark.parametrize("radius", [0.0, -0.1, np.nan])
def test_a_window_has_a_width(radius):
    """One of a negative width once held as many points as its opposite."""
    with pytest.raises(ValueError, match="`radius` must be positive"):
        expected_fixed_radius(lambda x: np.clip(x, 0.0, 1.0), [0.5], radius, 100)


@pytest.mark.parametrize("k", [1, 11])
def test_neither_the_nearest_point_alone_nor_more_points_than_there_are(k):
    """The mean of one over the distance of the nearest is infinite."""
    with pytest.raises(ValueError, match=rf"`k` must lie in \[2, 10\], but is {k}"):
        expected_k_nearest(lambda x: np.clip(x, 0.0, 1.0), [0.5], k, 10)


def test_a_window_that_holds_all_points_has_no_spread():
    """Sums of shares end at 1 + 2e-16 as often as at 1: the root was of a negative number."""

    def one(x):
        return np.where(x > 0.5, 1.0 + 4e-16, 0.0)

    mean, spread = expected_fixed_radius(one, [0.5], 1.0, 9)
    assert (mean.item(), spread.item()) == (0.5, 0.0)


@pytest.mark.parametrize("count", [0, -1])
def test_points_are_counted(count):
    with pytest.raises(ValueError, match="`count` must be a positive integer"):
        expected_fixed_radius(lambda x: np.clip(x, 0.0, 1.0), [0.5], 0.1, count)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"x": np.nan}, "`x` must be finite"),
        ({"kept": 0}, "`kept` must be a positive integer"),
        ({"kept": -1}, "`kept` must be a positive integer"),
        ({"kept": np.nan}, "`kept` must be a positive integer"),
        ({"kept": 6}, "`kept` must be at most `k`, 5, but is 6"),
        ({"count": np.inf}, "`count` must be a positive integer"),
        ({"k": 2.5}, "`k` must be a positive integer"),
    ],
)
def test_an_expectation_of_what_is_no_place_and_no_count_is_refused(given, words):
    with pytest.raises((ValueError, TypeError), match=f"{words}|violates type hint"):
        expected_k_nearest(**{"cumulative": cumulative, "x": X, "k": 5, "count": 600} | given)


def test_an_expectation_at_no_place_is_refused():
    with pytest.raises(ValueError, match="`x` must be finite"):
        expected_fixed_radius(cumulative, [0.3, np.nan], 0.1, 600)
