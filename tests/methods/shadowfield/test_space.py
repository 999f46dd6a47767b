"""Shared shadow rays in space: exact where they should be, better than a pixel's own elsewhere."""

import functools

import numpy as np
import pytest
import scipy.integrate

from firstorder.methods.shadowfield import space
from firstorder.methods.shadowfield.depths import depth_bounds
from firstorder.methods.shadowfield.rays import lamp_frame, trace
from firstorder.methods.shadowfield.space import bounds_under_filter, filter_shape, sheared

HIGH = 4.0
LAMP = lamp_frame((0.0, 0.0, HIGH), (0.0, 0.8, 0.0), (0.8, 0.0, 0.0))
SIDE, PIXEL = 24, 0.05


def floor(side=SIDE, pixel=PIXEL):
    x = pixel * (np.arange(side) - 0.5 * (side - 1))
    X, Y = np.meshgrid(x, x, indexing="ij")
    return np.stack([X, Y, 0.0 * X], -1).reshape(-1, 3)


def cards(*rectangles):
    """Level rectangles (height, low corner, high corner) as `trace` wants blockers."""

    def hidden(a, b):
        first, last = np.full(len(a), np.inf), np.full(len(a), -np.inf)
        for z, low, high in rectangles:
            t = (z - a[:, 2]) / (b[:, 2] - a[:, 2])
            p = a[:, :2] + t[:, None] * (b - a)[:, :2]
            hit = (t > 0.0) & (t < 1.0) & np.all((p >= low) & (p <= high), 1)
            first = np.where(hit, np.minimum(first, 1.0 - t), first)
            last = np.where(hit, np.maximum(last, 1.0 - t), last)
        return first, last

    return hidden


def fence_light(receivers, bars=None):
    """The share of the lamp that is seen past bars that run along y, the fence by default."""
    across = 0.8 * ((2.0 * np.arange(4096) + 1.0) / 4096 - 1.0)
    shares = {}
    for x in np.unique(receivers[:, 0]):
        hidden = np.zeros(len(across), bool)
        for z, low, high in FENCE if bars is None else bars:
            p = across + (HIGH - z) / HIGH * (x - across)
            hidden |= (p >= low[0]) & (p <= high[0])
        shares[x] = 1.0 - np.mean(hidden)
    return np.array([shares[x] for x in receivers[:, 0]])


def run(rays, *rectangles, Omega=1.5, seed=0, receivers=None, **options):
    receivers = floor() if receivers is None else receivers
    table, owner = trace(LAMP, receivers, rays, cards(*rectangles), seed)
    own = np.bincount(owner, table.free, len(receivers)) / np.maximum(
        np.bincount(owner, minlength=len(receivers)), 1
    )
    return sheared(LAMP, table, receivers, Omega, PIXEL, own, **options), own


FENCE = tuple((z, (x, -9.0), (x + 0.12, 9.0)) for z in (2.0, 2.3) for x in np.arange(-2, 2, 0.3))


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
    np.testing.assert_allclose(found.visible, 1.0 - share, atol=2e-3)


def test_a_falloff_weighs_what_is_hidden():
    def falloff(p):
        return np.exp(-np.sum(p**2, 1))

    x = np.linspace(-1.0, 1.0, 4001)
    light = np.exp(-(x**2))
    true = np.sum(light[x > 0.5]) / np.sum(light)
    found, _ = run(4, (HIGH - 1e-3, (-9.0, -9.0), (0.4, 9.0)), falloff=falloff)
    np.testing.assert_allclose(found.visible, true, atol=3e-3)


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


EDGE = (2.5, (-9.0, -9.0), (0.0, 9.0))  # hides the half of the room in which x < 0


def edge_error():
    """Of the penumbra of a straight edge: the share seen is (0.8 + 0.6 x) / 1.6."""
    found, _ = run(4, EDGE)
    return np.sqrt(np.mean((found.visible - (0.8 + 0.6 * floor()[:, 0]) / 1.6) ** 2))


def test_a_straight_edges_penumbra_is_linear():
    assert edge_error() < 0.01


@pytest.mark.parametrize("fault", ["no shear", "shear the other way", "depths from below"])
def test_faults_are_noticed(monkeypatch, fault):
    right, shape = edge_error(), space.filter_shape

    def wrong(d1, near, far, *rest):
        if fault == "depths from below":
            near, far = d1 - far, d1 - near
        found = shape(d1, near, far, *rest)
        factor = {"no shear": 0.0, "shear the other way": -1.0}.get(fault, 1.0)
        return found._replace(shear=factor * found.shear)

    monkeypatch.setattr(space, "filter_shape", wrong)
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
    table, owner = trace(LAMP, floor(), 4, cards(EDGE))
    bounds = depth_bounds(LAMP, table, floor(), PIXEL)
    own = np.bincount(owner, table.free) / 4.0
    here, there = (sheared(LAMP, table, floor(), 1.5, PIXEL, own, bounds=b) for b in (None, bounds))
    np.testing.assert_array_equal(here.visible, there.visible)
    wide = (bounds[0] - 0.5, bounds[1] + 0.5)
    other = sheared(LAMP, table, floor(), 1.5, PIXEL, own, bounds=wide)
    assert np.median(other.samples) < 0.6 * np.median(here.samples)  # a wider wedge, fewer rays


def test_turned_lamps_and_slanted_floors_give_the_same():
    """Everything turned by one rotation: rays, bounds and answers are the same."""
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    lamp = lamp_frame(turn @ LAMP.center, turn @ (0.0, 0.8, 0.0), turn @ (0.8, 0.0, 0.0))
    block = cards(*FENCE)

    def turned(a, b):
        return block(a @ turn, b @ turn)

    plain, _ = trace(LAMP, floor(), 1, block)
    other, _ = trace(lamp, floor() @ turn.T, 1, turned)
    fallback = np.zeros(SIDE**2)
    a = sheared(LAMP, plain, floor(), 1.5, PIXEL, fallback)
    b = sheared(lamp, other, floor() @ turn.T, 1.5, PIXEL, fallback)
    np.testing.assert_allclose(a.visible, b.visible, atol=2e-3)


def bad_receivers(right):
    """The floor, with three receivers put in that no lamp can light; the number of each row."""
    bad = [(np.nan, 0.0, 0.0), (0.0, 0.0, HIGH), (0.1, 0.1, HIGH + 0.5)]
    places = [30, 200, 400]
    return np.insert(right, places, bad, 0), places + np.arange(3)


def test_receivers_that_no_lamp_can_light_are_nan_and_alone():
    table, owner = trace(LAMP, floor(), 2, cards(*FENCE))
    own = np.bincount(owner, table.free) / 2.0
    right = sheared(LAMP, table, floor(), 4.0, PIXEL, own)
    bounds = depth_bounds(LAMP, table, floor(), PIXEL)
    receivers, bad = bad_receivers(floor())
    more = np.insert(own, bad - np.arange(3), np.nan)
    wide = tuple(np.insert(b, bad - np.arange(3), np.nan) for b in bounds)
    for given in (None, wide):
        found = sheared(LAMP, table, receivers, 4.0, PIXEL, more, bounds=given)
        for a, b in zip(found, right, strict=True):
            assert np.all(np.isnan(a[bad]))
            np.testing.assert_array_equal(np.delete(a, bad), b)
    none = sheared(LAMP, table, receivers[bad], 4.0, PIXEL, np.zeros(3))
    assert np.all(np.isnan(np.stack(none)))


def test_a_fallback_counts_only_where_it_is_asked_for():
    """It may be unknown elsewhere: NaN."""
    card = (0.02, (-9.0, -9.0), (0.0, 9.0))
    found, own = run(8, card)
    table, _ = trace(LAMP, floor(), 8, cards(card))
    assert 0.2 < np.mean(found.own > 0.0) < 0.8
    unknown = np.where(found.own > 0.0, own, np.nan)
    other = sheared(LAMP, table, floor(), 1.5, PIXEL, unknown)
    np.testing.assert_array_equal(other.visible, found.visible)


def test_no_known_blocker_means_light():
    """Without rays, or with none near, a receiver counts as lit: own is 0, not 1."""
    table, _ = trace(LAMP, floor(), 1, cards((2.0, (-9.0, -9.0), (9.0, 9.0))))
    empty = type(table)(*(a[:0] for a in table))
    far_off = floor() + np.array([50.0, 0.0, 0.0])
    for rays, at in ((empty, floor()), (table, far_off)):
        found = sheared(LAMP, rays, at, 1.5, PIXEL, np.zeros(len(at)))
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


# --- rays of others, which start elsewhere -------------------------------------------------------

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
    own = [trace(LAMP, points, rays, block, k)[0] for k, points in enumerate(levels)]
    both = type(own[0])(*(np.concatenate(a) for a in zip(*own, strict=True)))
    for points, table, true in zip(levels, own, level_truths(slope), strict=True):
        none = np.zeros(len(points))
        for some in (table, both):
            seen = sheared(LAMP, some, points, 2.0, PIXEL, none)
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
    right = space.gather

    def wrong(lamp, table, *about):
        if fault == "starts anywhere":
            table = table._replace(start=np.full_like(table.start, HIGH))
        else:
            near = np.where(table.free, np.inf, 0.0).astype(np.float32)
            table = table._replace(near=near)
        return right(lamp, table, *about)

    monkeypatch.setattr(space, "gather", wrong)
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
    table, _ = trace(LAMP, ground, 4, plate)
    assert not np.any(table.free)
    found = sheared(LAMP, table, on, 2.0, PIXEL, np.zeros(len(on)))
    np.testing.assert_array_equal(found.visible, 1.0)
    np.testing.assert_array_equal(found.own, 0.0)


# --- bounds of all that a filter looks at --------------------------------------------------------


SHEETS = ((2.0, (-9.0, -9.0), (-0.3, 9.0)), (3.2, (0.5, -9.0), (9.0, 9.0)))  # one from each side


def test_bounds_under_the_filter_are_those_of_the_first_frustum_as_wide_as_it():
    table, _ = trace(LAMP, floor(), 4, cards(*SHEETS))
    at, limit, side = floor()[::5], 6.0, 1
    d1 = LAMP.local(at)[:, 2]
    expected, left = np.full((2, len(at)), np.nan), np.ones(len(at), bool)
    sides = []
    while np.any(left):
        both = np.stack(depth_bounds(LAMP, table, at, side * PIXEL))
        expected[:, left] = both[:, left]
        sigma = filter_shape(d1, *both, limit, PIXEL, 0.8).sigma
        more = np.isfinite(sigma) & (sigma > side * PIXEL) & (side < 16)
        sides += [side] * np.sum(left & ~more)
        left &= more
        side *= 2
    found = bounds_under_filter(LAMP, table, at, limit, PIXEL, 16)
    np.testing.assert_array_equal(np.stack(found), expected)
    assert len(set(sides)) > 2


def beside_error(rays, bounds):
    """The mean of runs off the truth, in which noise averages out."""
    points, seen = floor(), []
    true = fence_light(points, SHEETS)
    for seed in range(4):
        table, _ = trace(LAMP, points, rays, cards(*SHEETS), seed)
        both = bounds(LAMP, table, points, 4.0, PIXEL)
        none = np.zeros(len(points))
        seen.append(sheared(LAMP, table, points, 4.0, PIXEL, none, 8, None, both).visible)
    return np.sqrt(np.mean((np.mean(seen, 0) - true) ** 2))


def test_bounds_under_the_filter_lower_what_rays_do_not():
    """Blockers beside a pixel's frustum, at other depths than those within."""

    def plain(lamp, table, points, limit, pixel):
        return depth_bounds(lamp, table, points, pixel)

    few, many = (beside_error(rays, plain) for rays in (4, 16))
    assert many > 0.95 * few
    assert beside_error(16, bounds_under_filter) < 0.3 * many
