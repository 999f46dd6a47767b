import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.caching import (
    ValidityRegion,
    circular_regions,
    fill_surface,
    fit_surface,
    random_orders,
)
from firstorder.caching.surface_filling import _fill_with_neighbours, _fit_with

N = 18
GRID = (np.arange(N) + 0.5) / N
X = np.stack(np.meshgrid(GRID, GRID), -1).reshape(-1, 2)
RNG = np.random.default_rng(4)
VISITS = random_orders(N * N, 3, 2)


def leaning(count=N * N):
    """Ellipses of every size and direction."""
    turn, size = RNG.uniform(0, np.pi, count), RNG.uniform(3.0, 25.0, (count, 2))
    c, s = np.cos(turn), np.sin(turn)
    Q = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], -2)
    return np.swapaxes(Q, 1, 2) @ (size[:, :, None] * Q)


M = leaning()


def filled_slowly(matrix, visits):
    records = []
    for i in visits:
        if not any(np.linalg.norm(matrix[j] @ (X[i] - X[j])) < 1.0 for j in records):
            records.append(int(i))
    return np.isin(np.arange(len(X)), records)


def test_filling_is_what_plain_loops_do():
    for visits in VISITS[:2]:
        assert fill_surface(X, M, visits).tolist() == filled_slowly(M, visits).tolist()


FAULTS = {
    "the visitor's ellipse": lambda i, j: np.linalg.norm(M[i] @ (X[i] - X[j])) < 1.0,
    "axes exchanged": lambda i, j: np.linalg.norm(M[j] @ (X[i] - X[j])[::-1]) < 1.0,
    "half the reach": lambda i, j: np.linalg.norm(M[j] @ (X[i] - X[j])) < 0.5,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_filling_is_noticed(fault):
    records = []
    for i in VISITS[0]:
        if not any(FAULTS[fault](i, j) for j in records):
            records.append(int(i))
    assert np.isin(np.arange(len(X)), records).tolist() != fill_surface(X, M, VISITS[0]).tolist()


@pytest.mark.smoke
def test_the_wanted_count_is_met_or_the_miss_is_said():
    base = 0.02 + 0.3 * X[:, 0] * (1 + X[:, 1])

    def radii(t):
        return circular_regions(base * t, 1e-3, 2.0)

    fit = fit_surface(X, radii, VISITS, 60, low=1e-2, high=10.0)
    np.testing.assert_array_equal(fit.records.sum(axis=1), fit.size)
    np.testing.assert_array_equal(fit.exact, fit.size == 60)
    assert np.max(np.abs(fit.size - 60)) <= 1
    assert len({tuple(r) for r in fit.records.tolist()}) == 3  # orders differ
    for t, reach, records, visits in zip(
        fit.threshold, fit.reach, fit.records, VISITS, strict=True
    ):
        np.testing.assert_allclose(reach.matrix, radii(t).matrix)
        assert records.tolist() == filled_slowly(np.asarray(reach.matrix), visits).tolist()


def test_giving_up_early_gives_as_many_as_said():
    assert fill_surface(X, M, VISITS[0], most=7).sum() == 7


def test_neighbours_cut_each_other_and_everything_stays_covered():
    lengths = np.where(np.abs(X[:, 0] - 0.5) < 0.06, 0.02, 1.0)
    records, reach = _fill_with_neighbours(X, lengths, 0.5, VISITS[0], 1e-3, 2.0)
    rows = np.flatnonzero(records)
    radius = 1.0 / np.asarray(reach.matrix)[:, 0, 0]
    away = np.linalg.norm(X[rows, None] - X[None, rows], axis=-1)
    cut = radius[rows] / 0.5
    assert np.all(cut[:, None] - cut[None] <= away + 1e-12)
    assert np.all(
        np.any(np.linalg.norm(X[:, None] - X[None, rows], axis=-1) < radius[rows], axis=1)
    )
    plain = fill_surface(
        X, circular_regions(jnp.asarray(0.5 * lengths), 1e-3, 2.0).matrix, VISITS[0]
    )
    assert records.sum() > plain.sum()


def test_any_way_of_filling_can_be_fitted():
    lengths = 0.05 + X[:, 0]

    def make(accuracy, visits):
        return _fill_with_neighbours(X, lengths, accuracy, visits, 1e-3, 2.0)

    fit = _fit_with(make, VISITS[:1], 40, low=0.02, high=3.0)
    assert abs(int(fit.size[0]) - 40) <= 1
    assert isinstance(fit.reach[0], ValidityRegion)


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    def radii(t):
        return circular_regions(np.full(N * N, t), 1e-4, 9.0)

    with pytest.raises(ValueError, match=r"^Argument `high` must be a threshold on its side of 3 "):
        fit_surface(X, radii, VISITS, 3, low=0.01, high=0.02)
    with pytest.raises(ValueError, match=r"^Argument `low` must be a threshold on its side of 90 "):
        fit_surface(X, radii, VISITS, 90, low=0.5, high=1.0)
    with pytest.raises(ValueError, match=r"^Argument `target` must be positive, but is 0.$"):
        fit_surface(X, radii, VISITS, 0, low=0.1, high=1.0)
