"""A quick round of nasty scenes; `make fuzz` does as many as there is time for."""

import dataclasses

import numpy as np
import pytest

from tests.fuzz import parts, scenes, worlds
from tests.fuzz.flatland import digits, layout
from tests.fuzz.limits import LIMITS, known
from tests.fuzz.report import Tally
from tests.fuzz.space import planes

# Single precision in space is the long mode's: most of what it does not do is known.
QUICK = [("flatland", "float64"), ("flatland", "float32"), ("space", "float64")]


@pytest.fixture(autouse=True)
def _quiet():
    """References divide by zero where nothing is hit."""
    with np.errstate(all="ignore"):
        yield


@pytest.mark.parametrize(("world", "precision"), QUICK)
def test_nasty_scenes_of_every_class_are_answered_well(world, precision):
    tally = Tally()
    for name in worlds.WORLDS[world].classes:
        parts.fuzz_scenes(tally, world, precision, 0, 1, name)
    assert tally.failures == 0, "\n".join(tally.lines)


ROW = 86  # well lit
Z = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def right():
    """A batch as the library answers it."""
    world = worlds.FLATLAND
    s, steps = scenes.drawn(world, "float64", "random", 0, 0)
    return scenes.asked(world, "float64", "random", s, steps)


def kinds(found):
    return {finding.kind for finding in found if finding.row == ROW}


def with_light(a, E):
    light = a.E.copy()
    light[ROW] = E
    return dataclasses.replace(a, E=light)


def with_gradient(a, share):
    gradient = type(a.gradient)(*(b.copy() for b in a.gradient))
    for b in gradient:
        b[ROW] *= share
    return dataclasses.replace(a, gradient=gradient)


def test_numbers_that_are_none_are_seen(right):
    assert kinds(scenes._not_finite(right)) == set()
    assert kinds(scenes._not_finite(with_light(right, np.nan))) == {"nan"}
    assert kinds(scenes._not_finite(with_gradient(right, np.nan))) == {"gradient"}
    turned = with_gradient(right, np.inf).gradient
    assert kinds(scenes._not_finite(dataclasses.replace(right, turned=turned))) == {"hessian"}


def test_light_out_of_bounds_is_seen(right):
    assert kinds(scenes._out_of_bounds(right)) == set()
    for E in (-1e-9, 2.0 + 1e-9):
        assert kinds(scenes._out_of_bounds(with_light(right, E))) == {"bounds"}
    for share in (-1.0, 1e3):
        assert kinds(scenes._out_of_bounds(with_gradient(right, share))) == {"share"}


def test_light_that_rays_do_not_see_is_seen(right):
    assert kinds(scenes._against_rays(right, ROW)) == set()
    assert right.E[ROW] > 0.1
    assert kinds(scenes._against_rays(with_light(right, 1.1 * right.E[ROW]), ROW)) == {"rays"}


@pytest.mark.parametrize("change", worlds.FLATLAND.changes)
def test_light_that_a_change_changes_is_seen(right, change):
    def found(a):
        return kinds(scenes._not_invariant(a, change, np.random.default_rng(0)))

    assert found(right) == set()
    assert found(with_light(right, right.E[ROW] * (1.0 + 1e-8))) == {change.__name__}


def test_derivatives_that_are_off_are_seen(right):
    assert kinds(scenes._against_digits(right, ROW)) == set()
    assert kinds(scenes._against_differences(right)) == set()
    off = with_gradient(right, 1.001)
    assert kinds(scenes._against_digits(off, ROW)) == {"first digits"}
    assert kinds(scenes._against_differences(off)) == {"differences"}
    assert kinds(scenes._broken_sums(off)) == {"light of emission"}
    turned = type(right.turned)(*(1.001 * b for b in right.turned))
    assert kinds(scenes._against_digits(dataclasses.replace(right, turned=turned), ROW)) == {
        "second digits"
    }


def test_gradients_that_a_shift_or_a_unit_changes_are_seen(right):
    off = with_gradient(right, 1.0)
    off.gradient.segments[ROW, layout.LAMP, 0, 0] += 1e-8
    assert kinds(scenes._broken_sums(off)) == {"shifted gradient", "scaled gradient"}
    assert kinds(scenes._broken_sums(right)) == set()


def test_a_batch_is_drawn_again_to_the_bit():
    for world in worlds.WORLDS.values():
        one, other = (scenes.drawn(world, "float32", "horizon", 3, 5) for _ in range(2))
        for a, b in zip((*one[0], *one[1]), (*other[0], *other[1]), strict=True):
            np.testing.assert_array_equal(a, b)


def test_rays_and_digits_agree_where_nothing_is_nasty():
    s, _ = scenes.drawn(worlds.FLATLAND, "float64", "random", 1, 0)
    eps = float(np.finfo(float).eps)
    for row in range(6):
        E, bound = worlds.FLATLAND.by_rays(s, row, eps, 1 << 14)
        assert abs(E - digits.exact(s, row, eps)[0]) <= bound


def test_references_know_a_lamp_above_a_receiver(right):
    """In flatland from -1 to 1, one above, where E is the square root of 2."""
    s = type(right.scenes)(*(a[:1].copy() for a in right.scenes))
    s.segments[:] = [[[1, 1], [-1, 1]], *(np.array([[k, -9], [k + 1, -9]]) for k in range(3))]
    s.circles[:], s.arc[:], s.at[:] = [5.0, -9.0, 1.0], [-5.0, -9.0, 1.0, 0.0, 1.0], 0.0
    assert digits.exact(s, 0, right.eps)[0] == pytest.approx(np.sqrt(2.0), rel=1e-15)
    E, bound = worlds.FLATLAND.by_rays(s, 0, right.eps, 1 << 12)
    assert abs(E - np.sqrt(2.0)) <= bound


def test_rays_know_a_plane_that_leans():
    """Of unit radiance, at an angle to the receiver whose cosine is 0.8: `pi (1 + 0.8) / 2`."""
    s = planes.drawn("planes_anyhow", np.random.default_rng(0), 1)
    for places in s.places:
        places[:] = 9.0 * Z
    s.normal[:], s.ups[:] = -Z, [[0.6, 0.0, 0.8], Z]
    s.at[:], s.planes[:, 0] = 0.0, -s.ups[:, 0]
    s.emission[:], s.emission[:, planes.PLANES.start, 0] = 0.0, 1.0
    E, bound = worlds.SPACE.by_rays(s, 0, 1e-16, 1 << 12)
    assert abs(E - 0.9 * np.pi) <= bound < 0.1
    s.emission[:] = s.emission[..., ::-1].copy()
    assert worlds.SPACE.by_rays(s, 0, 1e-16, 1 << 12)[0] == 0.0


def test_what_is_known_is_listed_with_its_reason():
    assert all(limit.reason for limit in LIMITS)
    assert known("flatland", "float64", "random", "rays", 1.0) is None
    limit = known("space", "float64", "near_a_box", "split", 1e-11)
    assert limit is not None
    assert limit.reason.startswith("beside a box")


def test_what_is_wrong_by_more_than_its_limit_is_news():
    asked = "space", "float64", "in_line", "turn"
    assert known(*asked, 1e-12) is not None
    assert known(*asked, 1e-3) is None
