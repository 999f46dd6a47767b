"""Shared shadow rays in space: exact where they should be, better than a pixel's own elsewhere."""

import numpy as np
import pytest
import scipy.integrate
from hypothesis import given, settings
from hypothesis import strategies as st

from firstorder.shadowfield.rendering import sheared_filter
from firstorder.shadowfield.rendering._filter_shape import filter_shape
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.lamp import lamp_frame
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays
from firstorder.shadowfield.rendering.sheared_filter import depths_under_filter, sheared_shadow
from tests.shadowfield.cards import (
    EDGE,
    FENCE,
    HIGH,
    LAMP,
    PIXEL,
    SIDE,
    bad_receivers,
    cards,
    fence_light,
    floor,
    run,
)


@pytest.mark.smoke
def test_free_and_hidden_lamps_are_exact():
    free, _ = run(1)
    np.testing.assert_array_equal(free.visible, 1.0)
    hidden, _ = run(1, (2.0, (-9.0, -9.0), (9.0, 9.0)))
    np.testing.assert_array_equal(hidden.visible, 0.0)


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
@pytest.mark.parametrize("axis", [0, 1])
def test_any_part_of_the_lamp_may_be_hidden(share, axis):
    """A blocker just below the lamp hides the same part of it from every receiver."""
    low, high = np.full(2, -9.0), np.full(2, 9.0)
    high[axis] = -0.8 + 1.6 * share
    found, _ = run(4, (HIGH - 1e-3, tuple(low), tuple(high)))
    np.testing.assert_allclose(found.visible, 1.0 - share, rtol=0.0, atol=2e-3)


def test_a_falloff_weighs_what_is_hidden():
    def falloff(p):
        return np.exp(-np.sum(p**2, 1))

    x = np.linspace(-1.0, 1.0, 4001)
    light = np.exp(-(x**2))
    true = np.sum(light[x > 0.5]) / np.sum(light)
    found, _ = run(4, (HIGH - 1e-3, (-9.0, -9.0), (0.4, 9.0)), falloff=falloff)
    np.testing.assert_allclose(found.visible, true, rtol=0.0, atol=3e-3)


def test_few_shared_rays_beat_a_pixels_own():
    """A fence at two depths: at one ray a pixel, against stratified rays at one and at sixteen."""
    true = fence_light(floor())

    def rms(a):
        return np.sqrt(np.mean((a - true) ** 2))

    found, own = run(1, *FENCE)
    _, many = run(16, *FENCE)
    assert 0.2 < np.mean(true) < 0.8
    assert rms(found.visible) < 0.2 * rms(own)
    assert rms(found.visible) < rms(many)
    assert np.median(found.samples) > 20.0


def inner_error(rays, Omega):
    """Away from the floor's border, beyond which no rays were traced."""
    inner = np.zeros((SIDE, SIDE), bool)
    inner[6:-6, 6:-6] = True
    found, _ = run(rays, *FENCE, Omega=Omega)
    return np.sqrt(np.mean((found.visible - fence_light(floor()))[inner.ravel()] ** 2))


def test_the_error_falls_as_rays_are_added():
    errors = [inner_error(rays, 4.0) for rays in (0.25, 1, 4)]
    assert errors[1] < 0.7 * errors[0]
    assert errors[2] < 0.7 * errors[1]


def test_more_rays_allow_a_higher_band_limit():
    """Two layers of bars hide each other: a low limit blurs them apart, a high one is noisy."""
    assert inner_error(1, 32.0) > 2.0 * inner_error(1, 4.0)
    assert inner_error(32, 32.0) < 0.8 * inner_error(32, 2.0)


def edge_error():
    """Of the penumbra of a straight edge: the share seen is (0.8 + 0.6 x) / 1.6."""
    found, _ = run(4, EDGE)
    return np.sqrt(np.mean((found.visible - (0.8 + 0.6 * floor()[:, 0]) / 1.6) ** 2))


def test_a_straight_edges_penumbra_is_linear():
    assert edge_error() < 0.01


@pytest.mark.parametrize("fault", ["no shear", "shear the other way", "depths from below"])
def test_faults_are_noticed(monkeypatch, fault):
    right, shape = edge_error(), sheared_filter.filter_shape

    def wrong(d1, near, far, *rest):
        if fault == "depths from below":
            near, far = d1 - far, d1 - near
        found = shape(d1, near, far, *rest)
        factor = {"no shear": 0.0, "shear the other way": -1.0}.get(fault, 1.0)
        return found._replace(shear=factor * found.shear)

    monkeypatch.setattr(sheared_filter, "filter_shape", wrong)
    assert 5.0 * right < edge_error() < np.inf


def test_bounds_cover_the_blockers_of_the_whole_frustum():
    found, _ = run(16, *FENCE)
    some = np.isfinite(found.near)
    np.testing.assert_allclose(found.near[some].min(), HIGH - 2.3, rtol=1e-5)
    np.testing.assert_allclose(found.far[some].max(), HIGH - 2.0, rtol=1e-5)
    assert np.mean(found.near[some] < HIGH - 2.2) > 0.9


def test_receivers_among_the_blockers_take_their_own_rays():
    card = (0.02, (-9.0, -9.0), (0.0, 9.0))
    found, own = run(8, card)
    touched = np.isfinite(found.near)
    np.testing.assert_array_equal(found.own, touched.astype(float))
    np.testing.assert_array_equal(found.visible[touched], own[touched])


def test_the_own_rays_are_blended_in_smoothly():
    """A blocker that comes down to the floor: no jump in the share of own rays."""
    heights = np.linspace(0.06, 0.28, 60)
    shares = [run(1, (z, (-9.0, -9.0), (0.0, 9.0)))[0].own.max() for z in heights]
    assert (shares[0], shares[-1]) == (1.0, 0.0)
    assert np.all(np.diff(shares) <= 0.0)
    assert np.max(-np.diff(shares)) < 0.05


def test_bounds_may_be_given():
    table, owner = trace_shadow_rays(LAMP, floor(), 4, cards(EDGE))
    bounds = blocker_depths(LAMP, table, floor(), PIXEL)
    own = np.bincount(owner, table.free) / 4.0
    here, there = (
        sheared_shadow(LAMP, table, floor(), 1.5, PIXEL, own, bounds=b) for b in (None, bounds)
    )
    np.testing.assert_array_equal(here.visible, there.visible)
    wide = (bounds[0] - 0.5, bounds[1] + 0.5)
    other = sheared_shadow(LAMP, table, floor(), 1.5, PIXEL, own, bounds=wide)
    assert np.median(other.samples) < 0.6 * np.median(here.samples)  # a wider wedge, fewer rays


def test_turned_lamps_and_slanted_floors_give_the_same():
    """Everything turned by one rotation: rays, bounds and answers are the same."""
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    lamp = lamp_frame(turn @ LAMP.center, turn @ (0.0, 0.8, 0.0), turn @ (0.8, 0.0, 0.0))
    block = cards(*FENCE)

    def turned(a, b):
        return block(a @ turn, b @ turn)

    plain, _ = trace_shadow_rays(LAMP, floor(), 1, block)
    other, _ = trace_shadow_rays(lamp, floor() @ turn.T, 1, turned)
    fallback = np.zeros(SIDE**2)
    a = sheared_shadow(LAMP, plain, floor(), 1.5, PIXEL, fallback)
    b = sheared_shadow(lamp, other, floor() @ turn.T, 1.5, PIXEL, fallback)
    np.testing.assert_allclose(a.visible, b.visible, rtol=0.0, atol=2e-3)


def test_receivers_that_no_lamp_can_light_are_nan_and_alone():
    table, owner = trace_shadow_rays(LAMP, floor(), 2, cards(*FENCE))
    own = np.bincount(owner, table.free) / 2.0
    right = sheared_shadow(LAMP, table, floor(), 4.0, PIXEL, own)
    bounds = blocker_depths(LAMP, table, floor(), PIXEL)
    receivers, bad = bad_receivers(floor())
    more = np.insert(own, bad - np.arange(3), np.nan)
    wide = tuple(np.insert(b, bad - np.arange(3), np.nan) for b in bounds)
    for depths in (None, wide):
        found = sheared_shadow(LAMP, table, receivers, 4.0, PIXEL, more, bounds=depths)
        for a, b in zip(found, right, strict=True):
            assert np.all(np.isnan(a[bad]))
            np.testing.assert_array_equal(np.delete(a, bad), b)
    none = sheared_shadow(LAMP, table, receivers[bad], 4.0, PIXEL, np.zeros(3))
    assert np.all(np.isnan(np.stack(none)))


def test_a_fallback_counts_only_where_it_is_asked_for():
    """It may be unknown elsewhere: NaN."""
    card = (0.02, (-9.0, -9.0), (0.0, 9.0))
    found, own = run(8, card)
    table, _ = trace_shadow_rays(LAMP, floor(), 8, cards(card))
    assert 0.2 < np.mean(found.own > 0.0) < 0.8
    unknown = np.where(found.own > 0.0, own, np.nan)
    other = sheared_shadow(LAMP, table, floor(), 1.5, PIXEL, unknown)
    np.testing.assert_array_equal(other.visible, found.visible)


def test_no_known_blocker_means_light():
    """Without rays, or with none near, a receiver counts as lit: own is 0, not 1."""
    table, _ = trace_shadow_rays(LAMP, floor(), 1, cards((2.0, (-9.0, -9.0), (9.0, 9.0))))
    empty = type(table)(*(a[:0] for a in table))
    far_off = floor() + np.array([50.0, 0.0, 0.0])
    for rays, at in ((empty, floor()), (table, far_off)):
        found = sheared_shadow(LAMP, rays, at, 1.5, PIXEL, np.zeros(len(at)))
        assert np.all((found.visible == 1.0) & (found.samples == 0.0) & (found.own == 0.0))


def test_the_widest_filter_keeps_84_percent_of_the_rays():
    """Slid by a Gaussian as wide as half the lamp, against all slides that stay on it.

    Of those slid by s half lamps a share 1 - |s|/2 stays. `filter_shape` says 1.833 of 2 effective
    rays on either axis; its last digit is the tolerance.
    """

    def effective(width):
        def sums(power):
            return (
                2.0
                * scipy.integrate.quad(
                    lambda s: np.exp(-0.5 * power * (s / width) ** 2) * (1.0 - 0.5 * s), 0.0, 2.0
                )[0]
            )

        return sums(1) ** 2 / sums(2)

    assert abs(effective(1.0) - 1.833) < 5e-4
    assert abs(effective(1e6) - 2.0) < 1e-9
    assert round((effective(1.0) / 2.0) ** 2, 2) == 0.84


def test_shapes_at_a_single_depth_stay_on_the_lamp():
    one = np.ones(1)
    shape = filter_shape(one, 0.5 * one, 0.5 * one, 2.0, 0.01, extent=0.3)
    np.testing.assert_allclose(shape.sigma, 0.3)
    np.testing.assert_allclose(shape.shear, 1.0)


# --- bounds of what lies under a filter ----------------------------------------------------------


SHEETS = ((2.0, (-9.0, -9.0), (-0.3, 9.0)), (3.2, (0.5, -9.0), (9.0, 9.0)))  # one from each side


def test_bounds_under_the_filter_are_those_of_the_first_frustum_as_wide_as_it():
    table, _ = trace_shadow_rays(LAMP, floor(), 4, cards(*SHEETS))
    at, limit, side = floor()[::5], 6.0, 1
    d1 = LAMP.local(at)[:, 2]
    expected, left = np.full((2, len(at)), np.nan), np.ones(len(at), bool)
    sides = []
    while np.any(left):
        both = np.stack(blocker_depths(LAMP, table, at, side * PIXEL))
        expected[:, left] = both[:, left]
        sigma = filter_shape(d1, *both, limit, PIXEL, 0.8).sigma
        more = np.isfinite(sigma) & (sigma > side * PIXEL) & (side < 16)
        sides += [side] * np.sum(left & ~more)
        left &= more
        side *= 2
    found = depths_under_filter(LAMP, table, at, limit, PIXEL, 16)
    np.testing.assert_array_equal(np.stack(found), expected)
    assert len(set(sides)) > 2


def beside_error(rays, bounds):
    """The mean of runs off the truth, in which noise averages out."""
    points, seen = floor(), []
    true = fence_light(points, SHEETS)
    for seed in range(4):
        table, _ = trace_shadow_rays(LAMP, points, rays, cards(*SHEETS), seed)
        both = bounds(LAMP, table, points, 4.0, PIXEL)
        none = np.zeros(len(points))
        seen.append(sheared_shadow(LAMP, table, points, 4.0, PIXEL, none, 8, None, both).visible)
    return np.sqrt(np.mean((np.mean(seen, 0) - true) ** 2))


def test_bounds_under_the_filter_lower_what_rays_do_not():
    """Blockers beside a pixel's frustum, at other depths than those within."""

    def plain(lamp, table, points, limit, pixel):
        return blocker_depths(lamp, table, points, pixel)

    few, many = (beside_error(rays, plain) for rays in (4, 16))
    assert many > 0.95 * few
    assert beside_error(16, depths_under_filter) < 0.3 * many


# --- properties ----------------------------------------------------------------------------------

SPOTS = floor(6, 0.2)


def fenced(hidden=True, scale=1.0, turn=0.0, falloff=None, order=None):
    """The share that a few receivers see past the fence, of rays of the whole floor.

    Args:
        hidden: whether the bars hide, or what is beside them does.
        scale: of all lengths.
        turn: of lamp and receivers about the vertical [rad]; rays are traced in their frame.
        falloff: of the light.
        order: seed of another order of the rays.
    """
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    u, v = (scale * R @ np.array(e) for e in ((0.0, 0.8, 0.0), (0.8, 0.0, 0.0)))
    lamp = lamp_frame((0.0, 0.0, scale * HIGH), u, v)
    bars = cards(*FENCE)

    def blockers(a, b):
        first, last = bars(a @ R / scale, b @ R / scale)
        free, nearest, farthest = np.isinf(first), 1.7 / HIGH, 2.0 / HIGH
        if hidden:
            return first, last
        return np.where(free, nearest, np.inf), np.where(free, farthest, -np.inf)

    table, _ = trace_shadow_rays(lamp, scale * floor() @ R.T, 1, blockers)
    if order is not None:
        rows = np.random.default_rng(order).permutation(len(table.y))
        table = type(table)(*(a[rows] for a in table))
    near, far = (np.full(len(SPOTS), scale * z) for z in (1.7, 2.0))
    return sheared_shadow(
        lamp, table, scale * SPOTS @ R.T, 1.5 / scale, scale * PIXEL, np.ones(len(SPOTS)),
        falloff=falloff, bounds=(near, far),
    ).visible  # fmt: skip


SINGLE = 2e-4  # rays are kept in single precision: some pass the rim of a cell or of the reach


@settings(max_examples=5)
@given(st.floats(0.2, 5.0), st.floats(-3.0, 3.0))
def test_shadows_know_no_unit_of_length_and_no_compass(scale, turn):
    assert np.ptp(fenced()) > 0.1
    np.testing.assert_allclose(fenced(scale=scale, turn=turn), fenced(), rtol=0.0, atol=SINGLE)


def test_what_is_seen_and_what_is_hidden_add_up_to_the_lamp():
    np.testing.assert_allclose(fenced() + fenced(hidden=False), 1.0, rtol=0.0, atol=SINGLE)


@settings(max_examples=5)
@given(st.integers(0, 1000))
def test_the_order_of_rays_does_not_matter(seed):
    np.testing.assert_allclose(fenced(order=seed), fenced(), rtol=0.0, atol=SINGLE)


def one_side(p):
    return 1.0 + p[:, 0]


def both_ways(p):
    return 2.0 + p[:, 1] ** 2


@settings(max_examples=5)
@given(st.floats(0.1, 5.0), st.floats(0.1, 5.0))
def test_lights_on_the_lamp_add(a, b):
    """Each by what it sends: its mean over the lamp."""
    whole = a * 1.0 + b * (2.0 + 1.0 / 3.0)
    parts = a * fenced(falloff=one_side) + b * (2.0 + 1.0 / 3.0) * fenced(falloff=both_ways)
    found = fenced(falloff=lambda p: a * one_side(p) + b * both_ways(p))
    np.testing.assert_allclose(found, parts / whole, rtol=0.0, atol=1e-3)


BAD = {
    "pixel": (dict(pixel=np.nan), "`pixel` must not be negative, but is nan"),
    "cells": (dict(cells=0), "`cells` must be a positive integer, but is 0"),
    "fallback": (dict(fallback=np.zeros(3)), r"`fallback` must have shape \(\d+,\), but has \(3,"),
    "few weights": (dict(weights=np.ones(3)), r"`weights` must have shape \(\d+,\), but has \(3,"),
    "bounds of nothing": (
        dict(bounds=(np.full(len(floor()), np.nan),) * 2),
        "`bounds` must hold the first and the last depth, .*, but holds nan and nan",
    ),
    "bounds out of order": (
        dict(bounds=(np.full(len(floor()), 0.6), np.full(len(floor()), 0.5))),
        "`bounds` must hold the first and the last depth, .*, but holds 0.6 and 0.5",
    ),
    "dark": (dict(falloff=lambda y: np.zeros(len(y))), "`falloff` must be positive somewhere"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_makes_no_shadow_is_one_sentence(name):
    given, words = BAD[name]
    table, _ = trace_shadow_rays(LAMP, floor(), 1, cards(EDGE))
    right = dict(Omega_y=1.5, pixel=PIXEL, fallback=np.zeros(len(floor())))
    with pytest.raises(ValueError, match=f"^Argument {words}"):
        sheared_shadow(LAMP, table, floor(), **(right | given))


def test_a_table_without_rays_leaves_all_to_the_fallback():
    none = RayTable(*(a[:0] for a in trace_shadow_rays(LAMP, floor(), 1, cards(EDGE))[0]))
    bounds = np.full(len(floor()), 0.5), np.full(len(floor()), 0.6)
    half = np.full(len(floor()), 0.5)
    found = sheared_shadow(LAMP, none, floor(), 1.5, PIXEL, half, bounds=bounds)
    np.testing.assert_array_equal(found.visible, half)
