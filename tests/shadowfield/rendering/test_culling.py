"""Groups of near receivers: everybody is in one, and nobody's candidates get lost."""

import numpy as np
import pytest

from firstorder.shadowfield.rendering._culling import narrowed


@pytest.mark.smoke
def test_every_point_is_in_one_group_with_all_that_is_near():
    rng = np.random.default_rng(0)
    at, other = rng.random((300, 3)), rng.random((500, 3))

    def keep(rows, c):
        low, high = at[rows].min(0) - 0.1, at[rows].max(0) + 0.1
        return np.all((other[c] >= low) & (other[c] <= high), 1)

    seen = []
    for rows, some in narrowed(at, len(other), keep, 16):
        assert len(rows) <= 16
        seen.extend(rows)
        for k in rows:
            near = np.flatnonzero(np.all(abs(other - at[k]) <= 0.1, 1))
            assert set(near) <= set(some)
    assert sorted(seen) == list(range(300))


def test_nothing_has_no_groups():
    assert list(narrowed(np.zeros((0, 3)), 5, lambda rows, c: c >= 0, 4)) == []
