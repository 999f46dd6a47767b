"""Filling in machine code: what plain loops do, whatever regions are."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.caching import ValidityRegion, fill, filling, random_orders
from firstorder.caching._fill_rows import Rows
from tests.caching.test_filling import LEANING, NEEDLES, PLANE, N, filled_slowly, flat

LINE = np.sort(np.random.default_rng(2).uniform(-1.0, 1.0, (150, 1)), axis=0)
SHORT = 1.0 / np.random.default_rng(3).uniform(0.02, 0.5, (150, 1, 1))
SCATTERED = np.random.default_rng(4).normal(size=(N * N, 2)) * [1.0, 0.2]
CASES = {
    "line": (LINE, SHORT),
    "leaning": (PLANE, LEANING),
    "needles": (PLANE, NEEDLES),
    "scattered": (SCATTERED, 0.5 * NEEDLES),
}


def by_rows(places, matrix, visits, tilt=None, most=None):
    rows = Rows.of(flat(places, tilt))
    region = ValidityRegion(jnp.asarray(matrix))
    return rows.filled(region, visits, len(places) if most is None else most)


@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("name", CASES)
def test_it_is_what_plain_loops_do(name, bent):
    places, matrix = CASES[name]
    turns = np.random.default_rng(5).normal(size=places.shape)
    tilt = np.cumsum(turns, axis=0) * 0.02 if bent else None
    for visits in random_orders(len(places), 3, 6):
        ours = by_rows(places, matrix, visits, tilt)
        assert ours.tolist() == filled_slowly(places, matrix, visits, tilt).tolist()


def test_a_normal_that_goes_around_covers_what_it_would_without():
    turns = np.cumsum(np.random.default_rng(8).normal(size=LINE.shape), axis=0) * 0.1
    around = turns + 2.0 * np.pi * np.random.default_rng(9).integers(-1, 2, LINE.shape)
    for visits in random_orders(len(LINE), 3, 6):
        plain, other = (by_rows(LINE, SHORT, visits, tilt) for tilt in (turns, around))
        assert plain.tolist() == other.tolist()


def test_only_the_visited_become_records_and_no_more_than_asked_for():
    visits = random_orders(N * N, 1, 7)[0][:200]
    all_of_them = by_rows(PLANE, LEANING, visits)
    some = by_rows(PLANE, LEANING, visits, most=20)
    assert not np.any(np.delete(all_of_them, visits))
    assert some.sum() == 20
    in_order = [v for v in visits if all_of_them[v]]
    assert sorted(in_order[:20]) == np.flatnonzero(some).tolist()


def test_a_region_without_end_covers_all_and_one_that_is_not_a_number_nothing():
    visits = np.arange(N * N)
    assert by_rows(PLANE, np.zeros((N * N, 2, 2)), visits).sum() == 1
    assert by_rows(PLANE, np.full((N * N, 2, 2), np.nan), visits).all()
    assert by_rows(PLANE, np.full((N * N, 2, 2), np.inf), visits).all()
    one = np.full((N * N, 2, 2), np.nan)
    one[:1] = np.diag([1e-9, 10.0])  # a band along x
    found = by_rows(PLANE, one, visits)
    np.testing.assert_array_equal(~found[1:], (PLANE[:, 1] < PLANE[0, 1] + 0.1)[1:])


def test_a_candidate_on_the_rim_is_outside():
    """On a grid whose pitch is the radius every candidate becomes a record, in any unit."""
    for unit in (1e-9, 1.0, 3e7):
        matrix = np.eye(2)[None].repeat(N * N, 0) * N / unit
        assert by_rows(unit * PLANE, matrix, np.arange(N * N)).all()


def test_many_candidates_are_filled_by_it(monkeypatch):
    """With numba or without, the records are the same."""
    side = int(np.ceil(filling.MANY**0.5))
    grid = (np.arange(side) + 0.5) / side
    places = np.stack(np.meshgrid(grid, grid), -1).reshape(-1, 2)
    matrix = np.random.default_rng(8).uniform(5.0, 20.0, (len(places), 1, 1)) * np.eye(2)
    visits = random_orders(len(places), 1, 9)[0]
    found = {}
    for native in (True, False):
        monkeypatch.setattr(filling, "HAVE_NATIVE", native)
        found[native] = fill(flat(places), ValidityRegion(jnp.asarray(matrix)), visits)
    assert 50 < found[True].sum() < 500
    np.testing.assert_array_equal(found[True], found[False])


def test_regions_that_are_not_as_many_as_candidates_are_refused():
    with pytest.raises(ValueError, match="Argument `region` must have shape"):
        fill(flat(PLANE), ValidityRegion(jnp.asarray(LEANING[1:])), np.arange(N * N))
