"""The loop over rows of rays: its faults, which the direct sums must notice."""

import numpy as np
import pytest

from firstorder.shadowfield.rendering import _row_sums as module
from firstorder.shadowfield.rendering import _weighted_sums as sums
from tests.shadowfield.rendering import test_weighted_sums as direct

pytestmark = pytest.mark.skipif(not direct.HAVE_NATIVE, reason="no numba")


def faulty(fault):
    """The loop with a fault in what it is given: a wrong twin of one line of it."""
    right = module.sum_rows

    def wrong(rays, first, low, step, at, half, reach, cells, *found):
        rays, at, first = rays.copy(), at.copy(), first.copy()
        if fault == "short reach":
            reach = reach - 1.0
        if fault == "row lost":
            first[0] = first[1]
        if fault == "rows shifted":
            low = low + 2.0 * step
        if fault == "sheared the other way":
            at[:, 4] *= -1.0
        if fault == "no level":
            at[:, 5] = 0.0
        if fault == "hidden rays are free":
            rays[4] = np.inf
        if fault == "all weigh alike":
            rays[6] = 1.0
        if fault == "lamp too wide":
            half = 1.1 * half
        right(rays, first, low, step, at, half, reach, cells, *found)

    return wrong


FAULTS = ("short reach", "row lost", "rows shifted", "sheared the other way", "no level")
MORE = ("hidden rays are free", "all weigh alike", "lamp too wide")


@pytest.mark.parametrize("fault", FAULTS + MORE)
def test_faults_are_noticed(monkeypatch, fault):
    monkeypatch.setattr(sums, "PRECISION", np.float64)
    monkeypatch.setattr(module, "sum_rows", faulty("none"))
    assert direct.largest_error() < 5e-8
    monkeypatch.undo()
    monkeypatch.setattr(sums, "PRECISION", np.float64)
    monkeypatch.setattr(module, "sum_rows", faulty(fault))
    assert direct.largest_error() > 1e-3


def test_the_exponential_is_as_close_as_it_says():
    """Of squares of distances up to the reach, in double precision."""
    q = np.linspace(0.0, 9.0, 2000)
    found = q.copy()
    total = module._weights(np.ones_like(q), 3.0, found)
    assert np.max(abs(found - np.exp(-0.5 * q))) < 4e-8
    assert abs(total / np.sum(np.exp(-q)) - 1.0) < 1e-7
