"""Strips of candidates, against every pair looked at, and a filling one by one."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import caching
from firstorder.caching import _strips as module
from firstorder.caching._strips import Strips
from firstorder.caching.candidates import Candidates
from firstorder.caching.regions import ValidityRegion

RNG = np.random.default_rng(7)


def held(matrix):
    return ValidityRegion(jnp.asarray(matrix))


def candidates(d, tilted, count=40):
    x = RNG.uniform(-1.0, 1.0, (count, d))
    tilt = RNG.uniform(-0.5, 0.5, (count, d)) if tilted else None
    none = np.zeros((count, d))
    return Candidates.of(x, np.ones(count), none, none[..., None] * none[:, None], tilt=tilt)


def region(d, count=40):
    """Ellipses that lean and are long, of one to three tenths."""
    if d == 1:
        return held(1.0 / RNG.uniform(0.1, 0.3, (count, 1, 1)))
    turn = RNG.uniform(0.0, np.pi, count)
    c, s = np.cos(turn), np.sin(turn)
    axes = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], 1)
    return held(axes / RNG.uniform(0.1, 0.5, (count, 2))[..., None])


def distances(x, M, tilt, i):
    """Distance of all candidates from one, by the region of that one."""
    e = np.linalg.norm((x - x[i]) @ M[i].T, axis=1)
    if tilt is None:
        return e
    turn = np.linalg.norm(tilt - tilt[i], axis=1)
    return e + np.where(turn < 0.5 * np.pi, np.sin(turn), 1.0)


CASES = [(1, False), (1, True), (2, False), (2, True)]


def case(d, tilted):
    all_of_it, where = candidates(d, tilted), region(d)
    x, M = np.asarray(all_of_it.position), np.asarray(where.matrix)
    tilt = np.asarray(all_of_it.tilt) if tilted else None
    return all_of_it, where, x, M, tilt


@pytest.mark.parametrize(("d", "tilted"), CASES)
def test_a_strip_holds_all_that_its_record_covers(d, tilted):
    all_of_it, where, x, M, tilt = case(d, tilted)
    strips = Strips(all_of_it, where)
    np.testing.assert_array_equal(strips.rank, np.argsort(x[:, 0]))
    np.testing.assert_array_equal(strips.place[strips.rank], np.arange(40))
    narrow = 0
    for i in range(40):
        strip, covered = strips.covered_by(int(strips.place[i]))
        found = np.zeros(40, bool)
        found[strips.rank[strip]] = covered
        np.testing.assert_array_equal(found, distances(x, M, tilt, i) < 1.0 - 1e-14)
        # No wider than the region: half an extent to both sides.
        half = np.linalg.norm(np.linalg.inv(M[i])[0])
        beside = np.abs(x[:, 0] - x[i, 0]) <= 1.001 * half
        assert (strip.stop - strip.start) <= beside.sum()
        narrow += strip.stop - strip.start < 40
    assert narrow > 20
    few = Strips(all_of_it, held(0.8 * np.tile(np.eye(d), (40, 1, 1))))  # 1.25 m of 2
    assert few.first[-1] > 0


@pytest.mark.parametrize(("d", "tilted"), CASES)
@pytest.mark.parametrize("most", [3, 1000])
def test_a_filling_takes_what_no_record_before_covers(d, tilted, most):
    all_of_it, where, x, M, tilt = case(d, tilted)
    visits = RNG.permutation(40)[:30]
    records, covered = [], np.ones(40, bool)
    covered[visits] = False
    for i in visits:
        if covered[i] or len(records) == most:
            continue
        records.append(i)
        covered |= distances(x, M, tilt, i) < 1.0 - 1e-14
    true = np.zeros(40, bool)
    true[records] = True
    found = Strips(all_of_it, where).filled(visits, most)
    np.testing.assert_array_equal(found, true)
    assert found.sum() == min(most, len(records))


@pytest.mark.parametrize("d", [1, 2])
def test_a_region_without_an_end_spans_everything(d):
    all_of_it = candidates(d, False, 9)
    M = np.zeros((9, d, d))
    if d == 2:
        M[:, 1, 1] = 4.0  # a strip along x
    strips = Strips(all_of_it, held(M))
    assert strips.first == [0] * 9
    assert strips.last == [9] * 9
    found = strips.filled(np.arange(9), 9)
    if d == 1:
        assert found.tolist() == [True, *[False] * 8]
    else:
        assert found.sum() > 1


def test_equal_places_stay_in_order_and_lie_in_each_others_strips():
    x = np.array([[0.5], [0.0], [0.5], [0.5]])
    none = np.zeros((4, 1))
    all_of_it = Candidates.of(x, np.ones(4), none, none[..., None])
    strips = Strips(all_of_it, held(np.full((4, 1, 1), 1e6)))
    assert strips.rank.tolist() == [1, 0, 2, 3]
    assert strips.first == [0, 1, 1, 1]
    assert strips.last == [1, 4, 4, 4]
    assert strips.filled(np.array([2, 0, 1, 3]), 9).tolist() == [False, True, True, False]


def test_normals_that_are_all_the_same_turn_nothing():
    x = RNG.uniform(-1.0, 1.0, (5, 2))
    none = np.zeros((5, 2))
    same = Candidates.of(x, np.ones(5), none, np.zeros((5, 2, 2)), tilt=none + 0.3)
    assert Strips(same, held(np.tile(np.eye(2), (5, 1, 1)))).tilt is None


def test_a_turn_counts_by_its_sine_and_whole_from_a_right_angle_on():
    angles = np.array([0.0, 0.3, -0.3, 1.5, 1.7, -2.0, 3.0, 2.0 * np.pi - 0.3])
    true = [0.0, np.sin(0.3), np.sin(0.3), np.sin(1.5), 1.0, 1.0, 1.0, np.sin(0.3)]
    np.testing.assert_allclose(module._turned(angles[None]), true, rtol=0.0, atol=1e-12)
    both = np.array([[0.3, 0.0, 1.2, 3.0], [0.0, -0.4, 1.2, 0.0]])
    true = [np.sin(0.3), np.sin(0.4), 1.0, 1.0]
    np.testing.assert_allclose(module._turned(both), true, rtol=1e-12)
    np.testing.assert_allclose(module._length(np.array([[3.0, -1.0], [4.0, 0.0]])), [5.0, 1.0])
    np.testing.assert_allclose(module._length(np.array([[3.0, -1.0]])), [3.0, 1.0])


def test_the_most_records_are_a_number_of_them():
    line = caching.Candidates.from_function(jnp.cos, jnp.linspace(0.0, 1.0, 3))
    region = caching.circular_regions(jnp.full(3, 0.3), 0.1, 1.0)
    with pytest.raises(ValueError, match="Argument `most` must"):
        caching.fill(line, region, [0, 1, 2], -1)


@pytest.mark.parametrize("counts", [(-1, 2), (4, 0)])
def test_orders_of_nothing_are_none(counts):
    with pytest.raises(ValueError, match="must be a positive integer"):
        caching.random_orders(*counts)
