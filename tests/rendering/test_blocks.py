"""Nodes beside a shadow's edge, against every pair of nodes."""

import numpy as np
import pytest

from firstorder.rendering._blocks import beside_seen


@pytest.mark.parametrize("wraps", [False, True])
@pytest.mark.parametrize(
    ("rows", "columns", "share"), [(7, 9, 0.06), (5, 6, 0.1), (2, 12, 0.05), (1, 3, 0.3)]
)
def test_hidden_nodes_are_beside_a_visible_one_of_their_row_or_column(wraps, rows, columns, share):
    hidden = np.random.default_rng(1).uniform(size=(4, rows, columns)) > share
    true = np.zeros_like(hidden)
    for k, i, j in np.argwhere(hidden):
        for a in range(rows):
            true[k, i, j] |= abs(a - i) <= 2 and not hidden[k, a, j]
        for b in range(columns):
            apart = abs(b - j)
            apart = min(apart, columns - apart) if wraps else apart
            true[k, i, j] |= apart <= 2 and not hidden[k, i, b]
    np.testing.assert_array_equal(beside_seen(hidden, wraps), true)
    assert 0 < np.sum(true) < np.sum(hidden) or rows == 1
