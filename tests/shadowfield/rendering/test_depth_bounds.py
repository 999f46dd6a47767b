"""Bounds of blockers' depths, against a look at every place from every receiver."""

import numpy as np
import pytest

from firstorder.numerics._native import HAVE_NATIVE
from firstorder.shadowfield.rendering import depth_bounds as depths
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths, smooth_depths
from firstorder.shadowfield.rendering.lamp import lamp_frame
from firstorder.shadowfield.rendering.ray_table import RayTable

LAMP = lamp_frame((0.0, 0.0, 4.0), (0.0, 0.8, 0.0), (0.5, 0.0, 0.0))
PIXEL = 0.05


def rough_floor(count=400):
    rng = np.random.default_rng(1)
    return np.column_stack([rng.uniform(-1.5, 1.5, (count, 2)), rng.uniform(-0.5, 1.5, count)])


def random_table(count=600):
    """Rays with blockers anywhere, first before last; some free, some that meet only one thing."""
    rng = np.random.default_rng(2)
    y, v = rng.uniform(-0.5, 0.5, (count, 2)), rng.uniform(-0.4, 0.4, (count, 2))
    near, far = np.sort(rng.uniform(0.3, 4.0, (2, count)), 0)
    far[200:300] = near[200:300]
    start = far * rng.uniform(1.0, 1.1, count)  # some end a hair below what hides them
    near[:200], far[:200] = np.inf, -np.inf
    return RayTable(*(a.astype(np.float32) for a in (y, v, near, far, start)))


def every_place(table, receivers, pixel):
    """The frustum's definition, one receiver and place at a time."""
    found = []
    for x in LAMP.local(receivers):
        low, high = np.inf, -np.inf
        for z in (table.near, table.far):
            for y, v, depth, start in zip(table.y, table.v, z, table.start, strict=True):
                t = depth / x[2]
                below = start >= 1.02 * x[2]  # there it started, and meets the receiver's level
                if not np.isfinite(depth) or t >= (0.98 if below else 1.0):
                    continue
                edge = LAMP.half * (1.0 - t) + 0.5 * pixel * t
                if np.all(abs(y + v * np.float64(depth) - t * x[:2]) <= edge):
                    low, high = min(low, depth), max(high, depth)
        found.append((low, high))
    return np.array(found).T


def search_error(receivers, pixel=PIXEL):
    table = random_table()
    true = every_place(table, receivers, pixel)
    found = np.stack(blocker_depths(LAMP, table, receivers, pixel))
    assert np.mean(np.isfinite(true[0])) > 0.5
    return np.mean(found != true)


WAYS = [
    pytest.param(False, id="groups"),
    pytest.param(True, id="tree", marks=pytest.mark.skipif(not HAVE_NATIVE, reason="no numba")),
]


@pytest.mark.smoke
@pytest.mark.parametrize("tree", WAYS)
@pytest.mark.parametrize("pixel", [PIXEL, 0.4])
def test_the_search_finds_what_every_place_says(monkeypatch, pixel, tree):
    monkeypatch.setattr(depths, "HAVE_NATIVE", tree)
    assert search_error(rough_floor(150), pixel) == 0.0


@pytest.mark.parametrize("tree", WAYS)
@pytest.mark.parametrize("unit", [2.0**-40, 2.0**40])
def test_places_on_a_side_of_the_frustum_are_in_it_in_any_unit(monkeypatch, unit, tree):
    """A side that is half a lamp off rounds one way for one place, and other ways for a bound."""
    monkeypatch.setattr(depths, "HAVE_NATIVE", tree)
    rng = np.random.default_rng(4)
    x, z = rng.uniform(-40.0, 40.0, (400, 2)), rng.uniform(0.5, 2.5, 400)
    t = z[:, None] / 3.0
    place = x * t + LAMP.half * (1.0 - t) + 0.5 * PIXEL * t
    places, at = np.column_stack([place, z, z]), np.column_stack([x, np.full(400, 3.0)])

    def met(unit):
        up, v, u = (unit * np.array(a) for a in ((0.0, 0.0, 4.0), (0.0, 0.8, 0.0), (0.5, 0.0, 0.0)))
        lamp, rows = lamp_frame(up, v, u), [slice(k, k + 1) for k in range(400)]
        alone = [depths._bounds(lamp, unit * places[k], unit * at[k], PIXEL * unit) for k in rows]
        return np.isfinite([near[0] for near, _ in alone])

    assert 0.2 < np.mean(met(1.0)) < 0.8
    np.testing.assert_array_equal(met(unit), met(1.0))


FAULTS = ("point frustum", "half the places", "only the first few", "own surface", "no contact")


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_noticed(monkeypatch, fault):
    monkeypatch.setattr(depths, "HAVE_NATIVE", False)
    first, groups, places = depths._first, depths.narrowed, depths._places

    def reached(table):
        """Places as if rays ended where they are hidden, or far below."""
        far_below = np.float32(9.0 if fault == "no contact" else 0.0)
        return places(table._replace(start=far_below + 0.0 * table.start))

    if fault in ("own surface", "no contact"):
        monkeypatch.setattr(depths, "_places", reached)
    if fault == "point frustum":
        monkeypatch.setattr(depths, "_first", lambda *a: first(*a[:3], 0.0, a[4]))
    if fault == "only the first few":
        monkeypatch.setattr(depths, "_first", lambda lamp, at, p, *a: first(lamp, at, p[:20], *a))
    if fault == "half the places":

        def fewer(*about):
            yield from ((rows, some[::2]) for rows, some in groups(*about))

        monkeypatch.setattr(depths, "narrowed", fewer)
    assert search_error(rough_floor(150), pixel=0.4) > 0.0


def test_receivers_that_are_nowhere_leave_the_others_alone():
    """One in a group of neighbours without a place, at the lamp's height, or above it."""
    right = np.stack(blocker_depths(LAMP, random_table(), rough_floor(100), PIXEL))
    assert np.mean(np.isfinite(right[0])) > 0.5
    for bad in ((np.nan, 0.0, 0.0), (0.1, 0.1, 4.0), (0.1, 0.1, 4.2)):
        receivers = np.insert(rough_floor(100), 50, bad, 0)
        found = np.stack(blocker_depths(LAMP, random_table(), receivers, PIXEL))
        assert np.all(np.isnan(found[:, 50]))
        np.testing.assert_array_equal(np.delete(found, 50, 1), right)


def test_free_rays_bound_nothing():
    table = random_table()
    free = RayTable(*(a[:200] for a in table))
    near, far = blocker_depths(LAMP, free, rough_floor(20), PIXEL)
    assert np.all(np.isposinf(near))
    assert np.all(np.isneginf(far))


@pytest.mark.parametrize("tree", WAYS)
def test_receivers_in_light_have_no_bounds(monkeypatch, tree):
    """Beside others in shadow."""
    monkeypatch.setattr(depths, "HAVE_NATIVE", tree)
    table, receivers = random_table(), rough_floor(60)
    low = np.flatnonzero((table.near > 1.5) & ~table.free)[:8]
    few = RayTable(*(a[low] for a in table))
    true = every_place(few, receivers, PIXEL)
    assert 0.1 < np.mean(np.isfinite(true[0])) < 0.9
    np.testing.assert_array_equal(blocker_depths(LAMP, few, receivers, PIXEL), true)


def test_smoothed_bounds_are_bounds_without_jumps():
    near, far = np.full((40, 30), np.inf), np.full((40, 30), -np.inf)
    near[:20, :25], far[:20, :25] = 2.0, 3.0
    near[10:20, :25] = 1.0
    low, high = smooth_depths(near, far, 3)
    assert np.all(low <= near)
    assert np.all(high >= far)
    np.testing.assert_array_equal(np.isfinite(low), np.isfinite(high))
    assert np.max(abs(np.diff(low[:23, 5]))) < 0.35  # of a jump of 1
    assert not np.any(np.isfinite(low[24:]))


def test_smoothed_bounds_of_images_with_holes():
    """Pixels that show no receiver stay NaN, and bound no others."""
    near, far = np.full((20, 20), 2.0), np.full((20, 20), 3.0)
    near[5, 5] = far[5, 5] = np.nan
    low, high = smooth_depths(near, far, 2)
    np.testing.assert_allclose(np.delete(low, 105), 2.0)
    np.testing.assert_allclose(np.delete(high, 105), 3.0)
    assert np.isnan(low[5, 5])
    assert np.isnan(high[5, 5])


@pytest.mark.smoke
@pytest.mark.parametrize(("near", "far", "words"), [
    (np.ones(9), np.ones(9), r"`near` must be an image, but has shape \(9,\)"),
    (np.ones((3, 3)), np.ones((3, 4)), r"`far` must have shape \(3, 3\)"),
])  # fmt: skip
def test_depths_are_smoothed_over_images(near, far, words):
    """Receivers in a row would be smoothed across the image's border."""
    with pytest.raises((TypeError, ValueError), match=f"^Argument {words}|type hint"):
        smooth_depths(near, far, 1)


def test_smooth_depths_look_as_far_to_either_side():
    near, far = np.full((11, 13), np.inf), np.full((11, 13), -np.inf)
    near[5, 6], far[5, 6] = 0.5, 0.75
    for found, depth in zip(smooth_depths(near, far, 2), (0.5, 0.75), strict=True):
        rows, columns = np.nonzero(np.isfinite(found))
        np.testing.assert_allclose(found[rows, columns], depth)  # a mean of one
        assert (rows.min(), rows.max(), columns.min(), columns.max()) == (3, 7, 4, 8)


def test_pixels_that_are_nowhere_take_nothing_from_their_neighbours():
    """`blocker_depths` gives NaN for them, which a filter of the least passed on."""
    rng = np.random.default_rng(6)
    near = np.where(rng.random((9, 7)) < 0.4, np.inf, rng.uniform(0.2, 0.5, (9, 7)))
    far, nowhere = np.where(np.isinf(near), -np.inf, near + 0.1), rng.random((9, 7)) < 0.3
    expected = smooth_depths(np.where(nowhere, np.inf, near), np.where(nowhere, -np.inf, far), 1)
    found = smooth_depths(np.where(nowhere, np.nan, near), np.where(nowhere, np.nan, far), 1)
    for ours, theirs in zip(found, expected, strict=True):
        np.testing.assert_array_equal(ours, np.where(nowhere, np.nan, theirs))
