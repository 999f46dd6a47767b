"""Baselines of sheared filtering: unbiased rays, their slope, the axis-aligned filter summed."""

import numpy as np
import pytest

from figures.e11.competitors import baselines
from figures.e11.competitors.baselines import (
    PixelSums,
    axis_aligned,
    axis_aligned_sigma,
    on_lamp,
    own_rays,
    pixel_sums,
    strata,
    stratified,
)
from firstorder.checks.statistics import LEVEL, chi_square, error_slope, z_test
from firstorder.shadowfield.rendering.lamp import lamp_frame
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays
from tests.samplers import COUNT, biased, uniform_p_value

HIGH, HALF = 4.0, 0.8
LAMP = lamp_frame((0.0, 0.0, HIGH), (0.0, HALF, 0.0), (HALF, 0.0, 0.0))


def floor(side, pixel=0.05):
    x = pixel * (np.arange(side) - 0.5 * (side - 1))
    return np.stack(np.meshgrid(x, x, [0.0], indexing="ij"), -1)[:, :, 0]


def below(height, inside):
    """A level sheet with a pattern: whether it hides, from x and y on it."""

    def hidden(a, b):
        t = (height - a[:, 2]) / (b[:, 2] - a[:, 2])
        p = a[:, :2] + t[:, None] * (b - a)[:, :2]
        hit = inside(p[:, 0], p[:, 1])
        return np.where(hit, 1.0 - t, np.inf), np.where(hit, 1.0 - t, -np.inf)

    return hidden


def slanted(x, y):
    return x + 0.37 * y < 0.04


SLANTED = below(2.0, slanted)


def gauss(p):
    """Two standard deviations to the edge, as E11 has it."""
    return np.exp(-2.0 * np.sum(p**2, 1))


def true_share(x, height, inside, light, n=1500):
    """By midpoints over the lamp from one receiver."""
    s = (2.0 * np.arange(n) + 1.0) / n - 1.0
    p = np.stack(np.meshgrid(s, s, indexing="ij"), -1).reshape(-1, 2)
    t = height / HIGH
    at = x[:2] + t * (HALF * p[:, ::-1] - x[:2])  # the lamp's first axis is y
    weight = light(p)
    return np.sum(weight * ~inside(at[:, 0], at[:, 1])) / np.sum(weight)


# --- stratified rays -----------------------------------------------------------------------------


@pytest.mark.smoke
@pytest.mark.parametrize("rays", [1, 6, 64])
@pytest.mark.parametrize("light", [None, gauss])
def test_stratified_rays_are_unbiased(rays, light):
    """The mean over 4,000 receivers at one place, of any number of rays."""
    x = np.array([0.07, -0.1, 0.0])
    found = stratified(LAMP, np.tile(x, (4000, 1)), rays, SLANTED, 3, light)
    share = light or (lambda p: np.ones(len(p)))
    true = true_share(x, 2.0, slanted, share)
    test = z_test(found.mean(), found.std(ddof=1) / np.sqrt(len(found)), true)
    assert test.passed, (found.mean(), true)
    assert 0.2 < true < 0.8


def test_the_error_of_an_edge_falls_with_the_power_of_three_quarters():
    x = floor(24, 0.01).reshape(-1, 3)
    true = np.array([true_share(p, 2.0, slanted, lambda q: np.ones(len(q)), 400) for p in x[::9]])
    rays = [4, 16, 64, 256, 1024]
    off = [stratified(LAMP, x, n, SLANTED, n)[::9] - true for n in rays]
    slope = error_slope(rays, [np.sqrt(np.mean(e**2)) for e in off])
    assert abs(slope.slope + 0.75) < 0.08, slope


def test_rays_one_at_a_time_are_unbiased_and_depend_on_nothing_else():
    x = np.array([0.07, -0.1, 0.0])
    at = np.tile(x, (4000, 1))
    shade = own_rays(LAMP, at, SLANTED, 5, gauss)
    who, number = np.repeat(np.arange(4000), 5), np.tile(np.arange(5), 4000)
    found = shade(who, number).reshape(4000, 5)
    true = true_share(x, 2.0, slanted, gauss)
    for part in (found[:, :1], found[:, 3:], found):
        mean = part.mean(1)
        assert z_test(mean.mean(), mean.std(ddof=1) / np.sqrt(4000), true).passed
    assert np.std(found.mean(1)) < 0.75 * np.std(found[:, 0]) / np.sqrt(5)  # better than chance
    some = np.array([7, 4999, 123])
    np.testing.assert_array_equal(shade(who[some], number[some]), found.ravel()[some])


def test_strata_are_met_one_ray_each():
    seen = []

    def record(a, b):
        seen.append(LAMP.local(b)[:, :2] / HALF)
        return np.full(len(a), np.inf), np.full(len(a), -np.inf)

    assert stratified(LAMP, np.zeros((5, 3)), 12, record).tolist() == [1.0] * 5
    a, b = strata(12)
    cell = (0.5 * (seen[0] + 1.0) * (a, b)).astype(int)
    number = (cell[:, 0] * b + cell[:, 1]).reshape(5, 12)
    np.testing.assert_array_equal(np.sort(number, 1), np.tile(np.arange(12), (5, 1)))


def test_places_are_as_dense_as_the_light():
    """Moments of the cut Gaussian, by quadrature; and no light, no place."""
    s = (np.arange(500) + 0.5) / 500
    u = np.stack(np.meshgrid(s, s, indexing="ij"), -1).reshape(-1, 2)
    y = on_lamp(u, lambda p: gauss(p) * (1.0 + 0.5 * p[:, 0]) * (p[:, 1] > 0.0))
    x = np.linspace(-1.0, 1.0, 20001)
    one, half = np.exp(-2.0 * x**2), np.exp(-2.0 * x[x > 0] ** 2)
    mean = np.sum(x * one * (1.0 + 0.5 * x)) / np.sum(one * (1.0 + 0.5 * x))
    np.testing.assert_allclose(y[:, 0].mean(), mean, rtol=0.0, atol=1e-3)
    np.testing.assert_allclose(
        y[:, 1].mean(), np.sum(x[x > 0] * half) / np.sum(half), rtol=0.0, atol=1e-3
    )
    assert np.all(y[:, 1] >= -1e-12)


@pytest.mark.parametrize("light", [lambda p: 0.0 * p[:, 0], lambda p: p[:, 0]])
def test_light_must_be_positive(light):
    with pytest.raises(ValueError, match="positive somewhere and negative nowhere"):
        on_lamp(np.zeros((1, 2)), light)


def test_who_has_a_quicker_warp_may_bring_it():
    """The same rays as by `on_lamp`, and others than without."""
    points = floor(6).reshape(-1, 3)
    by_light, by_warp, even = (
        stratified(LAMP, points, 64, SLANTED, 3, light, warp)
        for light, warp in ((gauss, None), (None, lambda u: on_lamp(u, gauss)), (None, None))
    )
    np.testing.assert_array_equal(by_warp, by_light)
    assert np.mean(by_light != even) > 0.5


# --- the axis-aligned filter ---------------------------------------------------------------------


def random_sums(shape, seed=0):
    rng = np.random.default_rng(seed)
    weight = rng.random(shape) + 0.1
    return PixelSums(weight * rng.random(shape), weight, weight**2 * 0.7)


def direct(sums, position, sigma):
    """The filter as a double sum, pixel by pixel."""
    x, shape = position.reshape(-1, 3), sigma.shape
    found, count = np.empty(len(x)), np.empty(len(x))
    for k, s in enumerate(sigma.ravel()):
        w = np.exp(-0.5 * np.sum((x - x[k]) ** 2, 1) / s**2)
        found[k] = np.sum(w * sums.seen.ravel()) / np.sum(w * sums.weight.ravel())
        count[k] = np.sum(w * sums.weight.ravel()) ** 2 / np.sum(w**2 * sums.squares.ravel())
    return found.reshape(shape), count.reshape(shape)


@pytest.mark.parametrize("shape", [(12, 9), (1, 7)])
def test_two_passes_are_the_double_sum_on_a_level_floor(shape):
    at = floor(12)[: shape[0], : shape[1]]
    sums, sigma = random_sums(shape), np.full(shape, 0.12)
    found, count = axis_aligned(sums, at, sigma)
    true, many = direct(sums, at, sigma)
    np.testing.assert_allclose(found, true, rtol=1e-12)
    np.testing.assert_allclose(count, many, rtol=1e-12)


def test_widths_that_change_slowly_leave_it_nearly_so():
    at = floor(24)
    sums = random_sums((24, 24))
    sigma = 0.1 + 0.08 * at[..., 0]  # by a factor of 2.3 over the floor
    found, _ = axis_aligned(sums, at, sigma)
    true, _ = direct(sums, at, sigma)
    spread = np.std(true)
    assert 1e-4 * spread < np.sqrt(np.mean((found - true) ** 2)) < 0.15 * spread


def test_only_receivers_count_and_where_nothing_hides_all_is_seen():
    at, sums = floor(8), random_sums((8, 8))
    surface, sigma = np.ones((8, 8), bool), np.full((8, 8), 0.1)
    surface[:, 5:] = False
    sigma[:2] = np.inf
    dirty = sums._replace(seen=np.where(surface, sums.seen, np.nan))
    found, count = axis_aligned(dirty, at, sigma, surface)
    np.testing.assert_array_equal(found[:2, :5], 1.0)
    assert np.all(np.isnan(found[:, 5:]))
    assert np.all(count[:, 5:] == 0.0)
    inner, _ = direct(PixelSums(*(a[:, :5] for a in sums)), at[:, :5], np.full((8, 5), 0.1))
    np.testing.assert_allclose(found[2:, :5], inner[2:], rtol=1e-12)


def test_pixels_without_rays_borrow_and_nothing_near_is_no_number():
    at, zero = floor(6), np.zeros((6, 6))
    weight = zero.copy()
    weight[0, 0] = 2.0
    sums = PixelSums(0.25 * weight, weight, weight**2 / 2.0)
    found, count = axis_aligned(sums, at, np.full((6, 6), 0.1))
    np.testing.assert_allclose(found, 0.25)
    np.testing.assert_allclose(count, 2.0)  # one pixel's two rays of weight one
    assert np.all(np.isnan(axis_aligned(PixelSums(zero, zero, zero), at, zero + 0.1)[0]))


@pytest.mark.parametrize("d2", [0.3, 0.9])
def test_bars_at_the_band_limit_are_damped_by_the_root_of_e(d2):
    """Bars whose frequency along the lamp is the limit, seen by receivers of one foot."""
    d1, Omega_y = 1.0, 4.0
    # With x held, a foot that moves by dy moves its ray on the bars' plane by (1 - d2/d1) dy;
    # with y held, receivers that move by dx move it by d2/d1 dx.
    bars = Omega_y / (1.0 - d2 / d1)
    x = np.arange(200) * 0.05 / (bars * d2 / d1)
    seen = 0.5 + 0.5 * np.cos(2.0 * np.pi * bars * (d2 / d1 * x))
    sigma = axis_aligned_sigma(np.full(200, d1), np.full(200, d2), Omega_y, 1e-9)[None]
    one = np.ones((1, 200))
    at = np.stack([x, 0.0 * x, 0.0 * x], -1)[None]
    found, _ = axis_aligned(PixelSums(seen[None], one, one), at, sigma)
    damped = 0.5 + np.exp(-0.5) * (seen - 0.5)
    np.testing.assert_allclose(found[0, 30:-30], damped[30:-30], rtol=0.0, atol=1e-6)


def test_rays_add_up_by_pixel_and_light():
    at = floor(5).reshape(-1, 3)
    table, owner = trace_shadow_rays(LAMP, at, 3, SLANTED)
    sums = pixel_sums(LAMP, table, owner, len(at), gauss)
    for k in (0, 7, 24):
        light = gauss(table.y[owner == k] / HALF)
        np.testing.assert_allclose(sums.seen[k], np.sum(light[table.free[owner == k]]))
        np.testing.assert_allclose([sums.weight[k], sums.squares[k]],
                                   [light.sum(), (light**2).sum()])  # fmt: skip
    assert sums.mean[7] == sums.seen[7] / sums.weight[7]
    none = pixel_sums(LAMP, RayTable(*(a[:0] for a in table)), owner[:0], 2)
    np.testing.assert_array_equal(none.mean, 1.0)


@pytest.fixture(scope="module")
def edge():
    at = floor(48, 0.04)
    table, owner = trace_shadow_rays(LAMP, at.reshape(-1, 3), 4, SLANTED)
    sums = pixel_sums(LAMP, table, owner, 48 * 48)
    far = np.full((48, 48), HIGH - 2.0)
    true = np.array([true_share(p, 2.0, slanted, lambda q: np.ones(len(q)), 300)
                     for p in at[16:32:3, 16:32:3].reshape(-1, 3)]).reshape(6, 6)  # fmt: skip
    return at, sums, far, true


def edge_error(edge, Omega_y):
    at, sums, far, true = edge
    sigma = axis_aligned_sigma(np.full((48, 48), HIGH), far, Omega_y, 0.04)
    found, _ = axis_aligned(sums, at, sigma)
    return np.sqrt(np.mean((found[16:32:3, 16:32:3] - true) ** 2))


def test_the_filter_takes_noise_out_of_a_penumbra(edge):
    _, sums, _, true = edge
    own = np.sqrt(np.mean((sums.mean.reshape(48, 48)[16:32:3, 16:32:3] - true) ** 2))
    assert edge_error(edge, 1.5) < 0.35 * own


def test_too_low_a_band_limit_blurs(edge):
    assert edge_error(edge, 0.1) > 3.0 * edge_error(edge, 1.5)


def test_widths_must_be_positive():
    with pytest.raises(ValueError, match="`sigma` must be positive"):
        axis_aligned(random_sums((3, 3)), floor(3), np.zeros((3, 3)))


@pytest.mark.parametrize("fault", ["without strata", "second pass alone", "squares forgotten"])
def test_faults_are_noticed(monkeypatch, fault):
    """The checks above, with something wrong."""
    if fault == "without strata":
        monkeypatch.setattr(baselines, "strata", lambda n: (1, 1))
        with pytest.raises(AssertionError):
            test_the_error_of_an_edge_falls_with_the_power_of_three_quarters()
        return
    right = baselines._pass

    def wrong(parts, position, sigma, ok, axis):
        if fault == "second pass alone" and axis == 1:
            return parts
        done = right(parts, position, sigma, ok, axis)
        return [*done[:2], parts[2]] if fault == "squares forgotten" else done

    monkeypatch.setattr(baselines, "_pass", wrong)
    with pytest.raises(AssertionError):
        test_two_passes_are_the_double_sum_on_a_level_floor((12, 9))


def lopsided(p):
    return (1.5 + p[:, 0]) * np.exp(-((p[:, 1] - 0.2) ** 2))


def lamp_p_value(places, falloff):
    """Chi-square of places in [-1, 1]^2 by the light there, in 16 x 16 cells."""
    x = (2.0 * np.arange(256) + 1.0) / 256 - 1.0
    fine = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    light = falloff(fine).reshape(16, 16, 16, 16).sum((1, 3))
    counts = np.histogram2d(*places.T, 16, ((-1, 1), (-1, 1)))[0]
    return chi_square(counts, counts.sum() * light / light.sum())


def test_places_come_by_the_light_of_the_lamp():
    """Of uniform numbers, and of one ray of `stratified` and of `own_rays` in many runs."""
    even = lambda p: np.ones(len(p))  # noqa: E731
    u = np.random.default_rng(8).random((COUNT, 2))
    assert lamp_p_value(on_lamp(u, lopsided), lopsided) > LEVEL
    assert lamp_p_value(on_lamp(u, lopsided), even) < LEVEL
    assert lamp_p_value(on_lamp(biased(u, 1), lopsided), lopsided) < LEVEL
    seen = []

    def record(a, b):
        seen.append(LAMP.local(b)[:, :2] / HALF)
        return np.full(len(a), np.inf), np.full(len(a), -np.inf)

    points = np.zeros((8000, 3))
    stratified(LAMP, points, 4, record)
    own_rays(LAMP, points, record)(np.arange(8000), np.full(8000, 5))
    first, own = np.concatenate(seen[:-1])[::4], seen[-1]
    assert uniform_p_value(first + 1.0) > LEVEL  # the stratum at the lower corner
    assert uniform_p_value(0.5 * (own + 1.0)) > LEVEL
    assert uniform_p_value((0.5 * (own + 1.0)) ** 1.1) < LEVEL
