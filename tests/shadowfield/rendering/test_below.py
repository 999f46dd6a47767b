"""Answers for some of many receivers."""

import numpy as np

from firstorder.shadowfield.rendering._below import where_below
from firstorder.shadowfield.rendering.lamp import lamp_frame

LAMP = lamp_frame((0.0, 0.0, 2.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
SOME = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 3.0], [5.0, 0.0, 1.0], [np.nan, 0.0, 0.0]])


def answer(receivers, twice, pair):
    """A number for each, and two rows of them."""
    return receivers[:, 0] * twice, (np.stack([pair[0], receivers[:, 0]]), None)


def test_receivers_above_a_lamp_have_nan_and_are_not_asked_about():
    each = np.array([2.0, 20.0, 3.0, 30.0]), (np.arange(4.0), None)
    one, (rows, none) = where_below(LAMP, SOME, answer, *each)
    np.testing.assert_array_equal(one, [2.0, np.nan, 15.0, np.nan])
    np.testing.assert_array_equal(rows, [[0.0, np.nan, 2.0, np.nan], [1.0, np.nan, 5.0, np.nan]])
    assert none is None


def test_where_all_are_below_the_answer_is_as_it_is():
    def same(receivers):
        return receivers

    receivers = SOME[[0, 2]]
    assert where_below(LAMP, receivers, same) is receivers
