import jax.numpy as jnp
import numpy as np
import pytest

from derivations.caching._light import lamp, scene_a_columns
from firstorder.caching import (
    Cache,
    Candidates,
    clamped,
    expected_error,
    fill,
    fit,
    interpolate,
    radius_for,
    random_orders,
    rms,
)

M, ORDERS, TARGET = 120, 40, 14
X = np.linspace(-1.0, 1.0, M)
WHERE = np.linspace(-0.97, 0.97, 101)


@pytest.fixture(scope="module")
def some():
    return Candidates.along(lamp, X)


@pytest.fixture(scope="module")
def visits():
    return random_orders(M, ORDERS, seed=3)


@pytest.fixture(scope="module")
def fitted(some, visits):
    def radii(tolerance):
        return clamped(radius_for(some.derivatives[:, 2], tolerance), 0.02, 2.0)

    return fit(some, radii, visits, TARGET, low=1e-9, high=1.0)


def filled_slowly(x, n, radius, visits):
    """The same in plain loops."""
    records = []
    for i in visits:
        reached = (
            abs(x[i] - x[j]) / radius[j] + np.sin(min(abs(n[i] - n[j]), np.pi / 2)) for j in records
        )
        if not any(e < 1.0 for e in reached):
            records.append(int(i))
    return np.isin(np.arange(len(x)), records)


@pytest.mark.parametrize("bent", [False, True])
def test_filling_is_what_plain_loops_do(some, bent):
    rng = np.random.default_rng(1)
    for seed in range(4):
        radius = rng.uniform(0.03, 0.5, M)
        n = np.cumsum(rng.normal(size=M)) * 0.05 * bent
        order = random_orders(M, 1, seed)[0]
        surface = Candidates(some.x, jnp.asarray(n), some.derivatives, some.minimum, some.harmonic)
        ours = fill(surface, jnp.asarray(radius), jnp.asarray(order))
        assert np.asarray(ours).tolist() == filled_slowly(X, n, radius, order).tolist()


def wrong_fills(some):
    """Wrong twins of `fill`: the visitor's radius decides; only the last record is remembered."""

    def by_the_visitor(radius, visits):
        records = []
        for i in visits:
            if not any(abs(X[i] - X[j]) < radius[i] for j in records):
                records.append(i)
        return np.isin(np.arange(M), records)

    def only_the_last(radius, visits):
        records = []
        for i in visits:
            if not records or abs(X[i] - X[records[-1]]) >= radius[records[-1]]:
                records.append(i)
        return np.isin(np.arange(M), records)

    return {"the visitor's radius": by_the_visitor, "only the last record": only_the_last}


@pytest.mark.parametrize("fault", ["the visitor's radius", "only the last record"])
def test_a_fault_in_filling_is_noticed(some, fault):
    radius, visits = np.random.default_rng(1).uniform(0.03, 0.5, M), random_orders(M, 1)[0]
    wrong = wrong_fills(some)[fault](radius, visits)
    assert wrong.tolist() != filled_slowly(X, 0.0 * X, radius, visits).tolist()


@pytest.mark.smoke
def test_every_candidate_is_covered(some, fitted):
    _, covered = interpolate(some, fitted, X)
    assert np.all(covered)


@pytest.mark.smoke
def test_the_wanted_count_is_met_or_the_miss_is_said(fitted):
    count = np.asarray(fitted.records).sum(axis=1)
    np.testing.assert_array_equal(count, fitted.size)
    np.testing.assert_array_equal(np.asarray(fitted.exact), count == TARGET)
    assert np.mean(fitted.exact) > 0.5
    assert np.max(np.abs(count - TARGET)) <= 2


def test_thresholds_are_met_by_the_radii(some, fitted):
    free = np.asarray(fitted.clamp) == 0
    estimate = expected_error(some.derivatives[:, 2], fitted.radius)
    aim = np.broadcast_to(np.asarray(fitted.threshold)[:, None], free.shape)
    np.testing.assert_allclose(np.asarray(estimate)[free], aim[free], rtol=1e-12)
    assert free.any()


def test_many_caches_answer_as_one_does(some, fitted):
    values, _ = interpolate(some, fitted, WHERE, order=2)
    for o in (0, ORDERS - 1):
        radii = clamped(fitted.radius[o], 0.01, 3.0)
        cache = Cache.of(some, radii, fitted.records[o], order=2)
        assert cache.count == int(fitted.size[o])
        np.testing.assert_allclose(values[o], cache(WHERE).value, rtol=1e-12)


def test_the_order_of_insertion_matters_and_its_spread_is_seen(some, fitted):
    values, _ = interpolate(some, fitted, WHERE)
    error = rms(values, scene_a_columns(WHERE)[:, 0])
    assert error.shape == (ORDERS,)
    assert 0.0 < error.std() < error.mean()
    assert error.max() < 0.02


@pytest.mark.smoke
def test_bad_input_is_one_sentence(some, visits):
    def radii(r):
        return clamped(r + jnp.zeros(M), 1e-3, 4.0)

    with pytest.raises(ValueError, match=r"^Argument `high` must be a threshold on its side of 3"):
        fit(some, radii, visits, 3, low=0.01, high=0.02)
    with pytest.raises(ValueError, match=r"^Argument `low` must be a threshold on its side of 90"):
        fit(some, radii, visits, 90, low=0.1, high=1.0)
    with pytest.raises(ValueError, match=r"^Argument `target` must be positive, but is 0.$"):
        fit(some, radii, visits, 0, low=0.1, high=1.0)
