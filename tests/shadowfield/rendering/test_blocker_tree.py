"""The tree of places that hide: its faults, which a look at every place must notice."""

import numpy as np
import pytest

from firstorder.shadowfield.rendering import _blocker_tree as module
from tests.shadowfield.rendering import test_depth_bounds as direct

pytestmark = pytest.mark.skipif(not direct.HAVE_NATIVE, reason="no numba")


def test_no_place_and_a_single_one():
    at, half = np.array([[0.0, 0.0, 2.0]]), np.ones(2)
    assert np.isposinf(module.first_and_last(np.zeros((0, 4)), at, half, 0.1)[0][0])
    one = np.array([[0.1, 0.2, 1.0, 1.0]])
    assert [float(a[0]) for a in module.first_and_last(one, at, half, 0.1)] == [1.0, 1.0]


def test_the_order_of_places_changes_nothing():
    rng = np.random.default_rng(4)
    places = np.column_stack([rng.uniform(-1, 1, (500, 2)), rng.uniform(0.2, 1.9, (500, 1))])
    places = np.column_stack([places, places[:, 2]])
    at = np.column_stack([rng.uniform(-1, 1, (200, 2)), rng.uniform(1.0, 2.0, 200)])
    half = np.array([0.1, 0.2])
    found = module.first_and_last(places, at, half, 0.02)
    again = module.first_and_last(places[rng.permutation(500)], at, half, 0.02)
    assert np.mean(np.isfinite(found[0])) > 0.3
    np.testing.assert_array_equal(found, again)


FAULTS = ("small boxes", "own surface", "leaves lost", "point frustum", "narrow lamp")


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_noticed(monkeypatch, fault):
    search, boxes = module._search, module._boxes

    def smaller(places):
        found = boxes(places)
        if fault == "small boxes":
            found[:, module.TOP0] -= 0.5
        if fault == "leaves lost":
            found[-len(found) // 4 :, module.P0] = np.inf
        return found

    def wrong(places, tree, at, half, hair, *found):
        places = places.copy()
        if fault == "own surface":
            places[:, 3] = tree[:, module.LEVEL] = 0.0
        if fault == "point frustum":
            hair = 0.0
        if fault == "narrow lamp":
            half = 0.5 * half
        search(places, tree, at, half, hair, *found)

    assert direct.search_error(direct.rough_floor(150), pixel=0.4) == 0.0
    monkeypatch.setattr(module, "_boxes", smaller)
    monkeypatch.setattr(module, "_search", wrong)
    assert direct.search_error(direct.rough_floor(150), pixel=0.4) > 0.0
