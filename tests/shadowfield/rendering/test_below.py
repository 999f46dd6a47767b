"""Answers for some of many receivers."""

import numpy as np
import pytest

from firstorder.shadowfield import (
    band_limit_sweep,
    blocker_depths,
    depths_under_filter,
    glossy_surface,
    lamp_frame,
    layered_shadow,
    sheared_reflection,
    sheared_shadow,
    trace_shadow_rays,
)
from firstorder.shadowfield.rendering._below import where_below
from tests.shadowfield.cards import EDGE, PIXEL, cards, floor

LAMP = lamp_frame((0.0, 0.0, 2.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
TABLE = trace_shadow_rays(LAMP, floor(), 1, cards(EDGE))[0]
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


LAMPS = {
    "the pair of a trace": (LAMP, (1, 2), "`table` must be a table of `trace_shadow_rays`, but is"),
    "no lamp": ((0.0, 0.0, 2.0), None, "`lamp` must be a lamp of `lamp_frame`, but is a tuple"),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", LAMPS)
def test_lamps_and_tables_of_another_kind_are_one_sentence(name):
    """With the import hook it is beartype that says it."""
    lamp, table, words = LAMPS[name]
    table = TABLE if table is None else table
    at, none, limits = floor(), np.zeros(len(floor())), np.array([1.0, 2.0])
    image = np.arange(len(at)), int(np.ceil(np.sqrt(len(at))))
    up = np.tile([[0.0, 0.0, 1.0]], (len(at), 1))
    for ask in (
        lambda: sheared_shadow(lamp, table, at, 1.5, PIXEL, none),
        lambda: depths_under_filter(lamp, table, at, 1.5, PIXEL),
        lambda: blocker_depths(lamp, table, at, PIXEL),
        lambda: layered_shadow(lamp, table, at, 1.0, 1.5, PIXEL),
        lambda: band_limit_sweep(lamp, table, at, limits, PIXEL, none, image),
        lambda: sheared_reflection(lamp, table, at, glossy_surface(up, up), 1.5, PIXEL, none),
    ):
        with pytest.raises(TypeError, match=f"^Argument {words}|violates type hint"):
            ask()


@pytest.mark.smoke
def test_a_column_of_another_length_is_no_table():
    wrong = TABLE._replace(near=TABLE.near[:-1])
    with pytest.raises((TypeError, ValueError), match=r"`table.y` must have shape|type hint"):
        blocker_depths(LAMP, wrong, floor(), PIXEL)


@pytest.mark.smoke
@pytest.mark.parametrize("wrong", [np.zeros(3), np.zeros((4, 2)), np.full((4, 3), 1j)])
def test_receivers_are_rows_of_three_real_coordinates(wrong):
    words = r"`receivers` must (have shape \(m, 3\), but has|be real)|type hint"
    for ask in (
        lambda: blocker_depths(LAMP, TABLE, wrong, PIXEL),
        lambda: sheared_shadow(LAMP, TABLE, wrong, 1.5, PIXEL, np.zeros(len(wrong))),
    ):
        with pytest.raises((TypeError, ValueError), match=words):
            ask()
