"""Filling along a line and on a plane: what plain loops do, wanted counts, neighbours, rims."""

import jax.numpy as jnp
import numpy as np
import pytest

from derivations.caching._light import lamp, scene_a_columns
from firstorder.caching import (
    Cache,
    Candidates,
    ValidityRegion,
    _records,
    _strips,
    cache,
    circular_regions,
    expected_error,
    fill,
    fit,
    radius_for,
    random_orders,
    rms,
)
from firstorder.checks.statistics import LEVEL, chi_square

M, ORDERS, TARGET = 120, 40, 14
X = np.linspace(-1.0, 1.0, M)
WHERE = np.linspace(-0.97, 0.97, 101)[:, None]
N = 18
GRID = (np.arange(N) + 0.5) / N
PLANE = np.stack(np.meshgrid(GRID, GRID), -1).reshape(-1, 2)
RNG = np.random.default_rng(4)
VISITS = random_orders(N * N, 3, 2)


def flat(places, tilt=None):
    """Candidates that hold nothing but their places."""
    count = len(places)
    return Candidates.of(places, np.zeros(count), np.zeros((count, places.shape[1])), tilt=tilt)


def segments(radius):
    return ValidityRegion(jnp.asarray(1.0 / radius)[:, None, None])


def leaning(count=N * N, small=(3.0, 25.0), large=(3.0, 25.0)):
    """Ellipses of every direction, with the reciprocals of their two radii in two ranges."""
    turn, size = (
        RNG.uniform(0, np.pi, count),
        RNG.uniform(*np.transpose([small, large]), (count, 2)),
    )
    c, s = np.cos(turn), np.sin(turn)
    Q = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], -2)
    return np.swapaxes(Q, 1, 2) @ (size[:, :, None] * Q)


LEANING = leaning()
NEEDLES = leaning(small=(1.5, 2.0), large=(20.0, 40.0))


def filled_slowly(places, matrix, visits, tilt=None):
    """The same in plain loops."""
    tilt = np.zeros_like(places) if tilt is None else tilt
    records = []
    for i in visits:
        reached = (
            np.linalg.norm(matrix[j] @ (places[i] - places[j]))
            + np.sin(min(np.linalg.norm(tilt[i] - tilt[j]), np.pi / 2))
            for j in records
        )
        if not any(e < 1.0 for e in reached):
            records.append(int(i))
    return np.isin(np.arange(len(places)), records)


@pytest.mark.parametrize("bent", [False, True])
def test_filling_is_what_plain_loops_do(bent):
    rng = np.random.default_rng(1)
    for seed in range(4):
        radius = rng.uniform(0.03, 0.5, M)
        n = np.cumsum(rng.normal(size=M))[:, None] * 0.05 * bent
        order = random_orders(M, 1, seed)[0]
        ours = fill(flat(X[:, None], n), segments(radius), order)
        slowly = filled_slowly(X[:, None], 1.0 / radius[:, None, None], order, n)
        assert ours.tolist() == slowly.tolist()


@pytest.mark.parametrize("regions", [LEANING, NEEDLES], ids=["leaning", "needles"])
@pytest.mark.parametrize("bent", [False, True])
def test_filling_a_plane_is_what_plain_loops_do(bent, regions):
    tilt = np.cumsum(RNG.normal(size=(N * N, 2)), axis=0) * 0.02 if bent else None
    for visits in VISITS[:2]:
        ours = fill(flat(PLANE, tilt), ValidityRegion(jnp.asarray(regions)), visits)
        assert ours.tolist() == filled_slowly(PLANE, regions, visits, tilt).tolist()


def wrong_fills():
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
def test_a_fault_in_filling_is_noticed(fault):
    radius, visits = np.random.default_rng(1).uniform(0.03, 0.5, M), random_orders(M, 1)[0]
    wrong = wrong_fills()[fault](radius, visits)
    right = filled_slowly(X[:, None], 1.0 / radius[:, None, None], visits)
    assert wrong.tolist() != right.tolist()
    assert fill(flat(X[:, None]), segments(radius), visits).tolist() == right.tolist()


FAULTS = {
    "the visitor's ellipse": lambda x, i, j: np.linalg.norm(LEANING[i] @ (x[i] - x[j])) < 1.0,
    "axes exchanged": lambda x, i, j: np.linalg.norm(LEANING[j] @ (x[i] - x[j])[::-1]) < 1.0,
    "half the reach": lambda x, i, j: np.linalg.norm(LEANING[j] @ (x[i] - x[j])) < 0.5,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_filling_a_plane_is_noticed(fault):
    records = []
    for i in VISITS[0]:
        if not any(FAULTS[fault](PLANE, i, j) for j in records):
            records.append(int(i))
    right = fill(flat(PLANE), ValidityRegion(jnp.asarray(LEANING)), VISITS[0])
    assert np.isin(np.arange(len(PLANE)), records).tolist() != right.tolist()


# --- on the rim ----------------------------------------------------------------------------------


def on_the_rim(dims, pitch, k):
    """A grid of which every k-th place is exactly on the rim of a record's region, to rounding."""
    at = pitch * np.arange(4 * k + 1)
    places = np.stack(np.meshgrid(*[at] * dims, indexing="ij"), -1).reshape(-1, dims)
    region = circular_regions(np.full(len(places), k * pitch), 1e-6, 1e6, dims)
    return flat(places), region


@pytest.mark.parametrize("dims", [1, 2])
def test_a_place_on_the_rim_is_outside_however_it_was_rounded(dims):
    """In a fill and in a look-up alike, along a line and on a plane."""
    inside = []
    for pitch in (0.1, 1.0 / 3.0, 1.0 / 64.0, 0.7):
        for k in (1, 3, 7):
            some, region = on_the_rim(dims, pitch, k)
            places = np.asarray(some.position)
            cell = np.round(places / (k * pitch), 9)
            corners = np.flatnonzero(np.all(cell == np.round(cell), axis=1))
            chosen = fill(some, region, corners)
            assert np.flatnonzero(chosen).tolist() == corners.tolist()
            one = np.arange(len(places)) == corners[len(corners) // 2]
            far = np.linalg.norm(places - places[one], axis=1)
            answer = np.asarray(Cache.of(some, region, one)(places).covered)
            assert not answer[far > (1.0 - 1e-9) * k * pitch].any()
            assert answer[far < (1.0 - 1e-9) * k * pitch].all()
            inside.append(int(np.sum(far / (k * pitch) < 1.0) - answer.sum()))
    assert max(inside) > 0  # by `< 1` rounding would let some in


@pytest.mark.parametrize("dims", [1, 2])
def test_a_rim_that_counts_as_inside_is_noticed(dims, monkeypatch):
    """In the fill, and in the look-up where the fill is right."""
    for module in (_strips, _records):
        with monkeypatch.context() as patch:
            patch.setattr(module, "reached", lambda error: error < 1.0)
            patch.setattr(cache, "_answers", cache._answered)  # what is compiled stays
            with pytest.raises(AssertionError):
                test_a_place_on_the_rim_is_outside_however_it_was_rounded(dims)


# --- a wanted count ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def some():
    return Candidates.from_function(lamp, X, derivatives=3, tilt=0.0)


@pytest.fixture(scope="module")
def visits():
    return random_orders(M, ORDERS, seed=3)


@pytest.fixture(scope="module")
def fitted(some, visits):
    def regions(tolerance):
        return circular_regions(radius_for(some.derivative(2)[:, 0, 0], tolerance), 0.02, 2.0)

    return fit(some, regions, visits, TARGET, low=1e-9, high=1.0)


@pytest.mark.smoke
def test_every_candidate_is_covered(some, fitted):
    assert np.all(fitted.lookup(some, X[:, None]).covered)


@pytest.mark.smoke
def test_the_wanted_count_is_met_or_the_miss_is_said(fitted):
    count = fitted.records.sum(axis=1)
    np.testing.assert_array_equal(count, fitted.size)
    np.testing.assert_array_equal(fitted.exact, count == TARGET)
    assert np.mean(fitted.exact) > 0.5
    assert np.max(np.abs(count - TARGET)) <= 2


@pytest.mark.smoke
def test_the_wanted_count_is_met_on_a_plane_or_the_miss_is_said():
    base = 0.02 + 0.3 * PLANE[:, 0] * (1 + PLANE[:, 1])

    def regions(t):
        return circular_regions(base * t, 1e-3, 2.0, dims=2)

    found = fit(flat(PLANE), regions, VISITS, 60, low=1e-2, high=10.0)
    np.testing.assert_array_equal(found.records.sum(axis=1), found.size)
    np.testing.assert_array_equal(found.exact, found.size == 60)
    assert np.max(np.abs(found.size - 60)) <= 1
    assert len({tuple(r) for r in found.records.tolist()}) == 3  # orders differ
    for t, matrix, records, visits in zip(
        found.threshold, found.region.matrix, found.records, VISITS, strict=True
    ):
        np.testing.assert_allclose(matrix, regions(t).matrix)
        assert records.tolist() == filled_slowly(PLANE, np.asarray(matrix), visits).tolist()


def test_thresholds_are_met_by_the_radii(some, fitted):
    free = fitted.region.clamp == 0
    estimate = expected_error(some.derivative(2), fitted.region)
    aim = np.broadcast_to(fitted.threshold[:, None], free.shape)
    np.testing.assert_allclose(np.asarray(estimate)[free], aim[free], rtol=1e-12)
    assert free.any()


def test_many_caches_answer_as_one_does(some, fitted):
    values = fitted.lookup(some, WHERE, order=2).value
    for o in (0, ORDERS - 1):
        one = fitted.cache(some, o, order=2)
        assert one.count == int(fitted.size[o])
        np.testing.assert_allclose(values[o], one(WHERE).value, rtol=1e-12)


def test_normals_that_go_around_and_candidates_in_any_order_are_looked_up_as_sorted_ones():
    """Half a turn of a circle across the place where the angle of its normal jumps."""
    s = np.linspace(2.0, 4.0, 41)
    angle = np.arctan2(np.sin(s), np.cos(s))
    known = {"value": np.sin(3.0 * s), "gradient": 3.0 * np.cos(3.0 * s)[:, None]}

    def found(order, n):
        some = Candidates.of(s[order], *(a[order] for a in known.values()), tilt=n[order])
        visits = np.argsort(order)[random_orders(41, 2)]
        fitted = fit(some, lambda R: segments(np.full(41, R)), visits, 6, low=0.01, high=1.0)
        return fitted.size, fitted.lookup(some, np.linspace(2.03, 3.97, 30)[:, None])

    plain = np.arange(41)
    size, smooth = found(plain, s)
    assert np.all(smooth.covered)
    for order, n in ((plain, angle), (plain[::-1], s), (random_orders(41, 1, 5)[0], angle)):
        again, other = found(order, n)
        assert again.tolist() == size.tolist()
        assert np.all(other.covered)
        np.testing.assert_allclose(other.value, smooth.value, rtol=0.0, atol=1e-12)


def test_the_order_of_insertion_matters_and_its_spread_is_seen(some, fitted):
    values = fitted.lookup(some, WHERE).value
    error = rms(values, scene_a_columns(WHERE[:, 0])[:, 0])
    assert error.shape == (ORDERS,)
    assert 0.0 < error.std() < error.mean()
    assert error.max() < 0.02


def test_giving_up_early_gives_as_many_as_said():
    region = ValidityRegion(jnp.asarray(LEANING))
    assert fill(flat(PLANE), region, VISITS[0], most=7).sum() == 7


@pytest.mark.smoke
@pytest.mark.parametrize("dims", [1, 2])
def test_bad_input_is_one_sentence(dims):
    places = X[:, None] if dims == 1 else PLANE
    visits = random_orders(len(places), 3, 2)

    def regions(r):
        return circular_regions(np.full(len(places), r), 1e-4, 9.0, dims)

    with pytest.raises(ValueError, match=r"^Argument `high` must be a threshold on its side of 3 "):
        fit(flat(places), regions, visits, 3, low=0.01, high=0.02)
    low = 0.1 if dims == 1 else 0.5
    with pytest.raises(ValueError, match=r"^Argument `low` must be a threshold on its side of 90 "):
        fit(flat(places), regions, visits, 90, low=low, high=1.0)
    with pytest.raises(ValueError, match=r"^Argument `target` must be positive, but is 0.$"):
        fit(flat(places), regions, visits, 0, low=0.1, high=1.0)
    with pytest.raises(ValueError, match=r"^Argument `region` must have shape"):
        fill(flat(places), circular_regions(np.ones(3), 0.1, 2.0, dims), visits[0])


def test_every_order_comes_as_often():
    """All 24 orders of four, and the first of many."""
    orders = random_orders(4, 24 * 400)
    counts = np.unique(orders @ (64, 16, 4, 1), return_counts=True)[1]
    assert len(counts) == 24
    assert chi_square(counts, np.full(24, 400.0)) > LEVEL
    sometimes_sorted = np.where(np.arange(len(orders))[:, None] % 10, orders, np.arange(4))
    counts = np.unique(sometimes_sorted @ (64, 16, 4, 1), return_counts=True)[1]
    assert chi_square(counts, np.full(24, 400.0)) < LEVEL


# --- what is no choice ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        ([0, 3], "type int64 and shape"),
        ([True, False], r"type bool and shape \(2,\)"),
        ([True] * 9, r"type bool and shape \(9,\)"),
    ],
)
def test_numbers_of_records_are_not_taken_for_truth_values(chosen, words):
    """They once were: of the numbers 0 and 3 the second candidate became the only record."""
    x = np.linspace(0.0, 1.0, 5)[:, None]
    region = circular_regions(np.full(5, 0.3), 0.1, 1.0)
    with pytest.raises(ValueError, match="`chosen` must hold 5 truth values.*" + words):
        Cache.of(flat(x), region, np.array(chosen))


@pytest.mark.parametrize("count", [4, 6])
def test_a_cache_refuses_regions_of_other_candidates(count):
    """Of four regions the last one once served the fifth candidate too."""
    x = np.linspace(0.0, 1.0, 5)[:, None]
    with pytest.raises(ValueError, match="`region` must have shape"):
        Cache.of(flat(x), circular_regions(np.full(count, 0.3), 0.1, 1.0))


@pytest.mark.parametrize(
    ("visits", "words"),
    [
        ([0, 9], "from 0 to 4, but holds 9"),
        ([-1, 0], "from 0 to 4, but holds -1"),
        ([0.0, 1.0], "in a row, but is of type float64"),
        ([True] * 5, "in a row, but is of type bool"),
        (random_orders(5, 2), r"in a row, but is of type int64 and shape \(2, 5\)"),
    ],
)
def test_visits_are_numbers_of_candidates(visits, words):
    x = np.linspace(0.0, 1.0, 5)[:, None]
    with pytest.raises(ValueError, match="`visits` must hold numbers.*" + words):
        fill(flat(x), circular_regions(np.full(5, 0.3), 0.1, 1.0), visits)


def test_orders_of_a_fit_are_there_and_visit_candidates():
    x = np.linspace(0.0, 1.0, 5)[:, None]

    def found(visits):
        return fit(
            flat(x),
            lambda R: circular_regions(np.full(5, R), 1e-3, 2.0),
            visits,
            3,
            low=0.01,
            high=1.0,
        )

    with pytest.raises(ValueError, match="`visits` must hold at least one order"):
        found(np.zeros((0, 5), int))
    with pytest.raises(ValueError, match="from 0 to 4, but holds 5"):
        found([[0, 1, 2, 3, 5]])


def test_nobody_visited_makes_no_record():
    x = np.linspace(0.0, 1.0, 5)[:, None]
    assert not np.any(fill(flat(x), circular_regions(np.full(5, 0.3), 0.1, 1.0), []))


@pytest.mark.parametrize(
    ("matrix", "expected"),
    [
        (np.zeros((2, 2)), [True, False, False]),
        (np.diag([0.0, 4.0]), [True, False, True]),
        (np.diag([4.0, 0.0]), [True, True, False]),
    ],
)
def test_a_region_without_an_end_covers_all_along_it(matrix, expected):
    """In a plane; a strip's width was once zero over zero, and covered nothing."""
    x = np.array([(0.0, 0.0), (0.5, 0.0), (0.0, 0.5)])
    region = ValidityRegion(np.broadcast_to(matrix, (3, 2, 2)))
    np.testing.assert_array_equal(fill(flat(x), region, [0, 1, 2]), expected)
