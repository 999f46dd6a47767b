"""Rays of others, which start elsewhere: where they count, and what they know there."""

import functools

import numpy as np
import pytest

from firstorder.shadowfield.rendering import sheared_filter
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow
from tests.shadowfield.cards import HIGH, LAMP, PIXEL, SIDE, cards, floor, run

TOP = 1.5
CARD = (TOP, (-0.4, -0.3), (0.3, 0.4))
SLATS = tuple((2.6, (x, -9.0), (x + 0.15, 9.0)) for x in np.arange(-3.0, 3.0, 0.4))


def two_levels(slope=0.0, top=TOP, side=SIDE):
    """Ground as a camera far above sees it, and the card over it; the ground may be tilted."""
    whole = floor(side)
    on = np.all((whole[:, :2] >= CARD[1]) & (whole[:, :2] <= CARD[2]), 1)
    ground, card = whole[~on].copy(), whole[on].copy()
    ground[:, 2] = slope * (ground[:, 0] - 0.7)
    card[:, 2] = top + 1e-4
    return ground, card


def brute_force(receivers, blockers, n=48):
    """Share of the lamp by n x n places in its middle, from each receiver."""
    x = 0.8 * ((2.0 * np.arange(n) + 1.0) / n - 1.0)
    places = np.stack([*np.meshgrid(x, x), np.full((n, n), HIGH)], -1).reshape(-1, 3)
    ends = np.tile(places, (len(receivers), 1))
    free = np.isinf(blockers(np.repeat(receivers, n * n, 0), ends)[0])
    return free.reshape(len(receivers), -1).mean(1)


@functools.cache
def level_truths(slope):
    """Of the ground and of the card."""
    return [brute_force(points, cards(CARD, *SLATS)) for points in two_levels(slope)]


def level_errors(slope, rays=4):
    """Of the ground and of the card: with rays of their own, and with those of both."""
    block, found = cards(CARD, *SLATS), []
    levels = two_levels(slope)
    own = [trace_shadow_rays(LAMP, points, rays, block, k)[0] for k, points in enumerate(levels)]
    both = type(own[0])(*(np.concatenate(a) for a in zip(*own, strict=True)))
    for points, table, true in zip(levels, own, level_truths(slope), strict=True):
        none = np.zeros(len(points))
        for some in (table, both):
            seen = sheared_shadow(LAMP, some, points, 2.0, PIXEL, none)
            assert np.all(seen.own == 0.0)
            found.append(np.sqrt(np.mean((seen.visible - true) ** 2)))
    return found


@pytest.mark.parametrize("slope", [0.0, 0.4])
def test_rays_of_another_level_do_no_harm(slope):
    """A card over ground: rays of each serve the other as far as they know what hides it.

    The ground's rays know all about the card, which gains; those of the card say nothing that the
    ground did not know.
    """
    ground, ground_both, card, card_both = level_errors(slope)
    assert max(ground, card) < 0.05
    assert ground_both < 1.1 * ground
    assert card_both < 0.7 * card  # .68 and .62 with these seeds


@pytest.mark.parametrize("fault", ["starts anywhere", "hidden by what is below"])
def test_levels_that_are_mixed_are_noticed(monkeypatch, fault):
    right = sheared_filter.gather

    def wrong(lamp, table, *about):
        if fault == "starts anywhere":
            table = table._replace(start=np.full_like(table.start, HIGH))
        else:
            near = np.where(table.free, np.inf, 0.0).astype(np.float32)
            table = table._replace(near=near)
        return right(lamp, table, *about)

    monkeypatch.setattr(sheared_filter, "gather", wrong)
    ground, ground_both, card, card_both = level_errors(0.0)
    assert (ground_both > 2.0 * ground) if fault == "starts anywhere" else (card_both > 5.0 * card)


@pytest.mark.parametrize("gap", [0.005, 0.01, 0.019])
def test_contact_shadows_are_left_to_own_rays(gap):
    """A card that nearly lies on the ground, nearer than levels are told apart."""
    card = (gap * HIGH, (-0.4, -0.3), (0.3, 0.4))
    found, own = run(8, card)
    true = brute_force(floor(), cards(card), 12)
    dark = true < 1.0
    assert np.mean(found.own[dark]) > 0.9
    np.testing.assert_array_equal(found.visible[found.own == 1.0], own[found.own == 1.0])


def test_a_slanted_thing_does_not_hide_itself_from_rays_from_below():
    """Rays of the ground meet it just above those of its own places that lie a bit deeper."""
    slope, ground = 0.5, floor(40)

    def plate(a, b):
        """The plane z = 1.5 + slope x, without end."""
        up = (a[:, 2] - 1.5 - slope * a[:, 0], b[:, 2] - 1.5 - slope * b[:, 0])
        hit, t = up[0] < 0.0, up[1] / (up[1] - up[0])
        return np.where(hit, t, np.inf), np.where(hit, t, -np.inf)

    on = floor()
    on[:, 2] = 1.5 + slope * on[:, 0] + 1e-4
    table, _ = trace_shadow_rays(LAMP, ground, 4, plate)
    assert not np.any(table.free)
    found = sheared_shadow(LAMP, table, on, 2.0, PIXEL, np.zeros(len(on)))
    np.testing.assert_array_equal(found.visible, 1.0)
    np.testing.assert_array_equal(found.own, 0.0)
