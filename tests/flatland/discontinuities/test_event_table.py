"""Rows of event tables stay together, whatever is taken of them or put behind them."""

import dataclasses

import numpy as np

from firstorder.flatland.discontinuities._critical_lines import LineEnds
from firstorder.flatland.discontinuities._event_table import KINDS, VisualEvents, joined


def table(numbers):
    """A row for each number, which stands in all of its columns."""
    k = np.asarray(numbers)
    s = k.astype(float)
    edges = LineEnds(np.stack([s, s], -1), k, s, k % 2 == 0)
    kind = np.array(KINDS)[k]
    return VisualEvents(k, s, k % 2 == 0, kind, edges, edges, k % 2 == 1, s, 10.0 * s, 100.0 * s)


def assert_same(a, b):
    for field in dataclasses.fields(a):
        one, two = getattr(a, field.name), getattr(b, field.name)
        if isinstance(one, LineEnds):
            assert_same(one, two)
        else:
            np.testing.assert_array_equal(one, two)


def test_rows_are_taken_whole():
    some = table([0, 1, 2, 3]).take(np.array([True, False, False, True]))
    assert len(some) == 2
    assert_same(some, table([0, 3]))
    assert_same(table([0, 1, 2]).take(np.array([2, 0, 1])), table([2, 0, 1]))


def test_tables_are_put_one_behind_the_other():
    both = joined([table([3, 1]), table([0])])
    assert len(both) == 3
    assert_same(both, table([3, 1, 0]))


def test_tables_are_equal_by_their_rows():
    one = table([3, 1])
    assert one == table([3, 1])
    assert hash(one) == hash(table([3, 1]))
    assert one != table([1, 3])
    assert one != "a table"
    for name in ("jump_E2", "far"):
        assert one != dataclasses.replace(one, **{name: getattr(table([3, 2]), name)})
