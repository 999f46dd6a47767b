"""Sparse edges of shadows against a loop over all pairs of neighbours."""

import numpy as np
import pytest

from firstorder.rendering._shadow_edges import beside_seen, edge_weights, shadow_edges


def pairs(seen, wraps):
    """Rows, axes, both nodes and jumps, by a loop."""
    n, rows, columns = seen.shape
    found = set()
    for k, i, j in np.ndindex(n, rows, columns):
        for axis, (a, b) in enumerate(((i + 1, j), (i, j + 1))):
            if axis == 1 and wraps:
                b %= columns
            if a < rows and b < columns and seen[k, a, b] != seen[k, i, j]:
                jump = float(seen[k, a, b]) - float(seen[k, i, j])
                found.add((k, axis, i * columns + j, a * columns + b, jump))
    return found


@pytest.mark.parametrize("wraps", [False, True])
def test_all_pairs_are_found_once(wraps):
    seen = np.random.default_rng(0).random((5, 4, 6)) < 0.5
    edges = shadow_edges(seen, wraps)
    told = list(zip(edges.row, edges.axis, edges.before, edges.after, edges.jump, strict=True))
    assert len(set(told)) == len(told)
    assert set(told) == pairs(seen, wraps)
    assert not np.any(seen.reshape(5, -1)[edges.row, edges.hidden])


def test_what_is_behind_is_on_the_hidden_side():
    seen = np.array([[[True, True, False, False], [True, False, False, True]]])
    edges = shadow_edges(seen, False)
    flat = edges.axis == 1
    told = list(zip(edges.hidden[flat], edges.behind[flat], strict=True))
    assert told == [(2, 3), (5, 6), (6, 5)]


def test_weights_are_those_of_half_way_blockers_and_of_horizons():
    seen = np.array([[True, False, False, True]])
    edges = shadow_edges(seen[:, None], False)
    asked = []

    def half(row, node):
        asked.extend(node)
        return np.full(len(row), 0.5)

    weight = edge_weights(edges, seen, np.ones_like(seen), half, near=True)
    assert weight.tolist() == [-1.0, 1.0]
    assert sorted(asked) == [1, 2]  # each once
    above = np.array([[True, False, True, True]])
    weight = edge_weights(edges, seen, above, half, near=True)
    assert weight.tolist() == [0.0, 1.0]  # a horizon stands still
    weight = edge_weights(edges, seen, above, half, near=False)
    assert weight.tolist() == [0.0, 2.0]  # one over half a metre


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
