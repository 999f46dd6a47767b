"""Shadow rays in the lamp's frame: round trips, strata, first and last blockers."""

import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL, chi_square
from firstorder.shadowfield.rendering._below import where_below
from firstorder.shadowfield.rendering.lamp import below, lamp_frame
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays
from tests.samplers import uniform_p_value

LAMP = lamp_frame((0.0, 0.0, 4.0), (0.0, 0.8, 0.0), (0.4, 0.0, 0.0))
FLOOR = np.stack(np.meshgrid(np.linspace(-1, 1, 20), np.linspace(-1, 1, 20), [0.0]), -1).reshape(
    -1, 3
)


def layers(*heights):
    """Endless level sheets over x < 0, as `trace_shadow_rays` wants blockers."""

    def hidden(a, b):
        first, last = np.full(len(a), np.inf), np.full(len(a), -np.inf)
        for z in heights:
            t = (z - a[:, 2]) / (b[:, 2] - a[:, 2])
            hit = a[:, 0] + t * (b - a)[:, 0] < 0.0
            first = np.where(hit, np.minimum(first, 1.0 - t), first)
            last = np.where(hit, np.maximum(last, 1.0 - t), last)
        return first, last

    return hidden


def test_points_come_back_from_the_lamps_frame():
    p = np.random.default_rng(0).normal(size=(10, 3))
    np.testing.assert_allclose(LAMP.world(LAMP.local(p)), p, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(LAMP.local(np.zeros((1, 3)))[0, 2], 4.0)


def test_rays_run_from_the_lamp_to_their_receiver():
    table, owner = trace_shadow_rays(LAMP, FLOOR, 3, layers())
    np.testing.assert_array_equal(owner, np.repeat(np.arange(400), 3))
    assert np.all(abs(table.y) <= LAMP.half + 1e-6)
    np.testing.assert_allclose(table.at(4.0), LAMP.local(FLOOR)[owner, :2], rtol=0.0, atol=1e-6)
    assert np.all(table.free)


def test_feet_are_spread_evenly():
    """Counts in 8 x 8 cells of the lamp differ far less than by chance."""
    table, _ = trace_shadow_rays(LAMP, FLOOR, 16, layers())
    i, j = np.minimum((4.0 * (table.y / LAMP.half + 1.0)).astype(int), 7).T
    counts = np.bincount(8 * i + j, minlength=64)
    assert np.std(counts) < 0.3 * np.sqrt(np.mean(counts))


def test_first_and_last_blockers_both_count():
    table, _ = trace_shadow_rays(LAMP, FLOOR, 1, layers(3.0, 1.0))
    hidden = ~table.free
    assert set(np.round(table.near[hidden], 5)) <= {1.0, 3.0}
    both = (table.near < 2.0) & (table.far > 2.0)
    assert 0.1 < np.mean(both) < 0.9


def test_a_ray_takes_28_bytes_and_says_where_it_starts():
    some = FLOOR + np.linspace(0.0, 1.0, len(FLOOR))[:, None] * (0.0, 0.0, 1.0)
    table, owner = trace_shadow_rays(LAMP, some, 2, layers(2.0))
    assert sum(a.nbytes for a in table) == 28 * len(owner)
    np.testing.assert_array_equal(table.start, (4.0 - some[owner, 2]).astype(np.float32))


def test_less_than_one_ray_a_receiver():
    table, owner = trace_shadow_rays(LAMP, FLOOR, 0.25, layers(2.0))
    assert len(table.y) == len(set(owner.tolist())) == 100


NOWHERE = {
    "nan": (np.nan, 0.0, 0.0),
    "infinite": (0.0, np.inf, 0.0),
    "beside the lamp": (3.0, 0.0, 4.0),
    "above it": (0.0, 0.0, 5.0),
}


@pytest.mark.parametrize("name", NOWHERE)
def test_receivers_that_no_lamp_can_light_are_refused(name):
    """At or above the lamp's plane slopes are infinite, or rays run backwards."""
    some = np.concatenate([FLOOR, [NOWHERE[name]]])
    with pytest.raises(ValueError, match="1 of 401 are not") as error:
        trace_shadow_rays(LAMP, some, 1, layers(2.0))
    assert str(error.value).count(".") == str(error.value).endswith(".")
    with pytest.raises(ValueError, match="1 of 401 are not"):
        trace_shadow_rays(LAMP, some, 0.25, layers(2.0))
    counts = np.ones(401, int)
    counts[-1] = 0  # who asks for no ray of it may keep it
    assert len(trace_shadow_rays(LAMP, some, counts, layers(2.0))[0].y) == 400


def test_answers_are_nan_for_receivers_that_no_lamp_can_light():
    def answer(points, factor, pair):
        assert pair[1] is None
        return points[:, 0] * factor, np.stack([points[:, 1], pair[0]])

    some = np.concatenate([FLOOR[:5], list(NOWHERE.values())])
    np.testing.assert_array_equal(below(LAMP, some), np.arange(9) < 5)
    a, (b, c) = where_below(LAMP, some, answer, np.full(9, 2.0), (np.arange(9.0), None))
    np.testing.assert_array_equal(a, [*2.0 * FLOOR[:5, 0], *4 * [np.nan]])
    np.testing.assert_array_equal(b, [*FLOOR[:5, 1], *4 * [np.nan]])
    np.testing.assert_array_equal(c, [0, 1, 2, 3, 4, *4 * [np.nan]])


def test_edges_must_be_orthogonal():
    with pytest.raises(ValueError, match="must be orthogonal"):
        lamp_frame((0, 0, 1), (1, 0, 0), (1, 1, 0))


def drawn(runs=1000, **how):
    """Of many runs: the foot of one ray on the lamp, and its receiver."""
    some, feet, owners = FLOOR[:8], [], []
    for seed in range(runs):
        table, owner = trace_shadow_rays(LAMP, some, how.get("rays", 1), layers(), seed)
        feet.append(table.y[-1] / LAMP.half)
        owners.append(owner[0])
    return 0.5 * (np.array(feet) + 1.0), np.bincount(owners, minlength=8)


def test_feet_and_receivers_come_evenly():
    """Any ray of the sequence by itself; and any receiver, where one of eight has a ray."""
    feet, _ = drawn()
    assert uniform_p_value(feet) > LEVEL
    assert uniform_p_value(feet**1.4) < LEVEL
    few, owners = drawn(rays=0.125)
    assert uniform_p_value(few) > LEVEL
    assert chi_square(owners, np.full(8, owners.sum() / 8)) > LEVEL


def test_edges_of_a_lamp_in_single_precision_are_orthogonal_to_its_rounding():
    for angle in np.linspace(0.1, 6.2, 40):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0.0], [0.6 * s, 0.6 * c, -0.8], [0.8 * s, 0.8 * c, 0.6]])
        u, v = (turn @ np.diag((0.7, 0.3, 1.0)))[:, :2].T.astype(np.float32)
        found = lamp_frame((0.0, 0.0, 4.0), u, v)
        np.testing.assert_allclose(found.axes @ found.axes.T, np.eye(3), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("center", [(0.0, 0.0), (np.nan, 0.0, 0.0)])
def test_a_lamp_is_somewhere_in_space(center):
    with pytest.raises(ValueError, match=r"^Argument `center` must (have three coord|be finite)"):
        lamp_frame(center, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))


WRONG_BLOCKERS = {
    "one array": (lambda a, b: np.full(len(a), 0.5), "must give two arrays"),
    "another length": (lambda a, b: (np.ones(1), np.ones(1)), r"must have shape \(1200,\)"),
    "no numbers": (lambda a, b: (np.full(len(a), np.nan),) * 2, "does not for 1200 of 1200 rays"),
    "last and first": (lambda a, b: layers()(a, b)[::-1], "does not for 1200 of 1200 rays"),
}


@pytest.mark.parametrize("name", WRONG_BLOCKERS)
def test_blockers_give_two_shares_for_each_ray(name):
    """Of what is none of these every ray would be hidden."""
    blockers, words = WRONG_BLOCKERS[name]
    with pytest.raises((TypeError, ValueError), match=rf"^Argument `blockers` .*{words}|type hint"):
        trace_shadow_rays(LAMP, FLOOR, 3, blockers)


def test_rays_for_each_receiver_are_a_whole_number():
    with pytest.raises(ValueError, match=r"^Argument `rays` must be an integer, but is 2\.5\."):
        trace_shadow_rays(LAMP, FLOOR, 2.5, layers())
    assert len(trace_shadow_rays(LAMP, FLOOR, 2.0, layers())[0].y) == 800


def test_receivers_are_rows_of_three_coordinates():
    lamp = lamp_frame((0, 0, 2), (0, 0.5, 0), (0.5, 0, 0))
    either, words = (ValueError, TypeError), r"`receivers` must have shape \(m, 3\)|type hint"
    for wrong in (np.zeros(3), np.zeros((4, 2))):
        with pytest.raises(either, match=words):
            trace_shadow_rays(lamp, wrong, 4, lambda a, b: (a, b))
    with pytest.raises(ValueError, match="`rays` must be finite"):
        trace_shadow_rays(lamp, np.zeros((1, 3)), np.inf, lambda a, b: (a, b))
