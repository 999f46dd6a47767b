import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.sampling import Estimate, Moments, combine, estimate


def test_moments_are_those_of_numpy():
    x = np.random.default_rng(0).normal(3.0, 2.0, (40, 5))
    seen = Moments.none((5,))
    for row in x:
        seen = seen.add(row)
    np.testing.assert_allclose(seen.mean, x.mean(0), rtol=1e-13)
    np.testing.assert_allclose(seen.variance(), x.var(0, ddof=1), rtol=1e-12)
    np.testing.assert_allclose(seen.merged().variance(), x.var(ddof=1), rtol=1e-12)
    np.testing.assert_allclose(estimate(x).error, x.std(0, ddof=1) / np.sqrt(40), rtol=1e-12)


def test_samples_of_weight_zero_are_left_out():
    seen = Moments.none().add(2.0).add(1e9, 0.0).add(4.0)
    assert (seen.count.item(), seen.mean.item(), seen.square.item()) == (2.0, 3.0, 2.0)


def test_runs_of_unequal_length_combine_to_the_whole():
    x = np.random.default_rng(1).exponential(size=60)
    whole, parts = estimate(x), combine([estimate(x[:7]), estimate(x[7:20]), estimate(x[20:])])
    for field in ("mean", "error", "count"):
        np.testing.assert_allclose(getattr(parts, field), getattr(whole, field), rtol=1e-12)


def test_weights_by_their_own_errors_would_be_biased(key):
    """Why `combine` counts samples: dark runs of skewed light look sure of themselves."""
    x = np.asarray(jax.random.exponential(key, (4000, 2, 8)))
    mean, error = x.mean(-1), x.std(-1, ddof=1) / np.sqrt(8)
    w = error**-2
    tempting = (mean * w).sum(1) / w.sum(1)
    ours = np.asarray(combine([estimate(x[:, i].T) for i in (0, 1)]).mean)
    bound = 5.0 / np.sqrt(4000 * 16)
    assert abs(ours.mean() - 1.0) < bound
    assert tempting.mean() - 1.0 < -5.0 * bound


def test_single_precision_does_not_cancel():
    def add(seen, x):
        return seen.add(x), None

    x = (1000.0 + 0.01 * np.sin(np.arange(5000))).astype(np.float32)
    seen, _ = jax.lax.scan(add, Moments.none(dtype=jnp.float32), jnp.asarray(x))
    assert seen.mean.dtype == jnp.float32
    assert abs(float(seen.variance()) / x.astype(float).var(ddof=1) - 1.0) < 0.02


def test_one_sample_has_no_finite_error():
    assert estimate([2.0]).error.item() == np.inf
    assert Estimate(1.0, np.inf, 1.0).z(3.0).item() == 0.0


def test_z_and_scale():
    e = Estimate(jnp.array([1.0, 2.0]), jnp.array([0.1, 0.0]), 5.0)
    np.testing.assert_allclose(e.z(jnp.array([1.2, 2.0])), [-2.0, 0.0])
    assert e.z(jnp.array([1.0, 2.5]))[1] == -np.inf
    np.testing.assert_allclose(e.scaled(-3.0).error, [0.3, 0.0])


def test_nothing_cannot_be_combined():
    with pytest.raises(ValueError, match="must hold at least one"):
        combine([])


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_not_even_what_is_no_number_counts_with_weight_zero(value):
    seen = Moments.none().add(2.0).add(value, 0.0).add(4.0)
    assert (seen.count.item(), seen.mean.item(), seen.square.item()) == (2.0, 3.0, 2.0)


def test_runs_of_a_single_sample_are_combined():
    """Their errors are infinite, and were once multiplied by zero."""
    found = combine([estimate(np.array([x])) for x in (1.0, 3.0)])
    both = estimate(np.array([1.0, 3.0]))
    np.testing.assert_allclose([found.mean, found.error], [both.mean, both.error], rtol=1e-12)
    assert np.isinf(combine([estimate(np.array([1.0]))]).error)


@pytest.mark.parametrize("unit", [1e-25, 1e-30, 1e25, 1e37])
def test_errors_keep_their_digits_in_any_unit_of_radiance(unit):
    """Squares of such numbers leave the range of single precision."""
    x = np.array([1.0, 3.0, 2.0, 4.0])
    runs = [estimate(np.float32(unit * part)) for part in (x[:2], x[2:])]
    np.testing.assert_allclose(runs[0].error / np.float32(unit), 1.0, rtol=1e-5)
    whole = combine(runs)
    np.testing.assert_allclose(whole.error / np.float32(unit), x.std(ddof=1) / 2.0, rtol=1e-5)
    np.testing.assert_allclose(whole.mean / np.float32(unit), 2.5, rtol=1e-5)


def test_of_no_samples_the_error_is_infinite():
    assert estimate(np.zeros(0)).error.item() == np.inf


BAD = {
    "a number": (lambda: estimate(1.0), ValueError, "`samples` must have an axis 0"),
    "another axis": (lambda: estimate([1.0, 2.0], 1), ValueError, "must have an axis 1"),
    "no axis": (lambda: estimate([1.0, 2.0], 0.5), ValueError, "`axis` must be an integer"),
    "complex samples": (lambda: estimate([1j, 2.0]), ValueError, "`samples` must be real"),
    "a complex mean": (lambda: Estimate(1j, 0.1, 3.0), ValueError, "`mean` must be real"),
    "numbers": (lambda: combine([1.0]), TypeError, r"`estimates\[0\]` must be an `Estimate`"),
    "no list": (lambda: combine(1.0), TypeError, "`estimates` must be a list of estimates"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_sample_and_no_estimate_is_refused(name):
    ask, kind, words = BAD[name]
    with pytest.raises((kind, TypeError), match=f"{words}|violates type hint"):
        ask()


def test_the_error_of_samples_that_are_alike_has_a_derivative():
    slope = jax.grad(lambda x: estimate(x).error)(jnp.full(3, 2.0))
    np.testing.assert_array_equal(slope, 0.0)
    both = jax.grad(lambda x: combine([estimate(x), estimate(x[:2])]).error)(jnp.ones(3))
    np.testing.assert_array_equal(both, 0.0)


def test_the_deviation_of_a_mean_that_is_right_moves_with_the_mean():
    """By one over the error; without an error it is at rest."""
    slope = jax.grad(lambda mean, error: Estimate(mean, error, 3.0).z(1.0))
    np.testing.assert_allclose(slope(1.0, 0.1), 10.0)
    assert slope(1.0, 0.0) == 0.0


def test_an_unknown_error_gives_no_deviation():
    assert np.isnan(Estimate(1.0, np.nan, 3.0).z(np.array([1.0, 2.0]))).all()


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: Moments.none((2,)).add(np.array([1j, 2.0])), "`value` must be real"),
        (
            lambda: Moments.none((2,)).add(np.ones((3, 2))),
            r"`value` must broadcast to shape \(2,\)",
        ),
        (lambda: Moments.none().add(3.0, 0.25), "`weight` must be 0 or 1, but is 0.25"),
        (lambda: Moments.none().add(3.0, -1.0), "`weight` must be 0 or 1, but is -1"),
        (lambda: Moments(-3.0, 1.0, 2.0), "`count` must not be negative, but is -3"),
        (lambda: Moments(1.0, 1j, 2.0), "`mean` must be real"),
    ],
)
def test_samples_are_counted_one_by_one(ask, words):
    with pytest.raises((TypeError, ValueError), match=f"^Argument {words}|type hint"):
        ask()
