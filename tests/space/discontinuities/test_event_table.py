"""Tables of events in space: rows stay rows, joined tables are in order of x."""

import dataclasses

import numpy as np
import pytest

from firstorder.space.discontinuities import _event_table as module
from firstorder.space.discontinuities._event_table import EventsAlong, joined


def table(x):
    """Every column says which row it is, in its own way."""
    x = np.asarray(x, float)
    names = np.array([module.KINDS[int(10 * v) % len(module.KINDS)] for v in x], dtype=object)
    return EventsAlong(
        x, np.stack([x, 2 * x, 3 * x], -1), names, (10 * x).astype(int), np.stack([x, x, -x], -1),
        4 * x, 5 * x, x > 0.35, 6 * x, 7 * x, 8 * x, 9 * x,
    )  # fmt: skip


def same(a, b):
    for field in dataclasses.fields(EventsAlong):
        np.testing.assert_array_equal(getattr(a, field.name), getattr(b, field.name))


def test_some_rows_by_number_by_mask_and_by_slice():
    whole = table([0.1, 0.2, 0.3, 0.4])
    assert len(whole) == 4
    same(whole.take([2, 0]), table([0.3, 0.1]))
    same(whole.take(np.array([True, False, False, True])), table([0.1, 0.4]))
    same(whole.take(slice(1, 3)), table([0.2, 0.3]))


def test_joined_tables_are_in_order_and_equal_places_as_they_came():
    same(joined([table([0.3, 0.9]), table([]), table([0.1, 0.5])]), table([0.1, 0.3, 0.5, 0.9]))
    one, two = (
        table([0.2, 0.4]),
        dataclasses.replace(table([0.2, 0.4]), near=np.array([-1.0, -2.0])),
    )
    np.testing.assert_array_equal(joined([one, two]).near, [0.8, -1.0, 1.6, -2.0])
    np.testing.assert_array_equal(joined([two, one]).near, [-1.0, 0.8, -2.0, 1.6])


def test_each_kind_has_the_order_of_the_derivative_that_jumps():
    assert module.ORDERS[module.TOUCH] == 2
    assert [module.ORDERS[k] for k in module.KINDS] == [0, 1, 2, 2, 2]


def test_a_table_stays_as_it_is():
    with pytest.raises(dataclasses.FrozenInstanceError):
        table([0.1]).x = np.zeros(1)
