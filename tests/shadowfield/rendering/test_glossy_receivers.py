"""Glossy receivers against sums over the lamp and rays of the test's own; bounds of factoring."""

import jax.numpy as jnp
import numpy as np
import pytest

from figures.e11.competitors.cell_factoring import likely_factoring, worst_factoring
from firstorder.fields import BoxProfile
from firstorder.shadowfield import PLANE, factoring_bound
from firstorder.shadowfield.rendering import _glossy_receivers as module
from firstorder.shadowfield.rendering._glossy_receivers import (
    cell_light,
    glossy_surface,
    sheared_reflection,
)
from firstorder.shadowfield.rendering.lamp import lamp_frame
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays
from tests.shadowfield.cards import EDGE, FENCE, HIGH, LAMP, PIXEL, bad_receivers, cards, floor

EYE = np.array([0.3, -0.5, 3.5])
SIDE = 12
LOBES = (0.0, 5.0, 20.0, 80.0)


def bell(p):
    return np.exp(-1.3 * np.sum(np.square(p), -1) + 0.4 * p[..., 0])


def surface(points, exponent=30.0, albedo=0.3):
    up = np.tile((0.1, -0.05, 1.0), (len(points), 1))
    return glossy_surface(up, EYE - points, albedo, 0.6, exponent)


def shading(point, places, exponent, albedo=0.3):
    """K rho in the world, by vectors, for one receiver."""
    normal = np.array([0.1, -0.05, 1.0]) / np.linalg.norm([0.1, -0.05, 1.0])
    way = places - point
    far = np.linalg.norm(way, axis=-1)
    w = way / far[..., None]
    v = (EYE - point) / np.linalg.norm(EYE - point)
    half = 2.0 * (normal @ v) * normal - v
    rho = albedo / np.pi
    rho += 0.6 * (exponent + 2) / (2 * np.pi) * np.clip(w @ half, 0.0, None) ** exponent
    return np.clip(w @ normal, 0.0, None) * w[..., 2] / far**2 * rho


def lamp_places(n, lamp=LAMP):
    """Midpoints in [-1, 1]^2 and in the world: edges run along y and then along x."""
    x = (2.0 * np.arange(n) + 1.0) / n - 1.0
    p = np.stack(np.meshgrid(x, x, indexing="ij"), -1)
    offset = np.stack([lamp.half[1] * p[..., 1], lamp.half[0] * p[..., 0], 0 * p[..., 0]], -1)
    return p, lamp.center + offset


def by_cells(points, exponent, n, cells, falloff=bell):
    """The direct sum over n x n places, told by cell."""
    p, places = lamp_places(n)
    area = 4.0 * np.prod(LAMP.half) / n**2
    found = []
    for point in points:
        k = shading(point, places, exponent) * falloff(p) * area
        found.append(k.reshape(cells, n // cells, cells, n // cells).sum((1, 3)).ravel())
    return np.array(found)


def summed(points, exponent, cells):
    """That sum and how far the midpoint rule, of order 2, may be off."""
    fine, coarse = (by_cells(points, exponent, n, cells) for n in (128, 64))
    return fine, 2.0 * np.max(abs(fine - coarse))


POINTS = floor(SIDE, 0.1)


def no_blocker_error(exponent=30.0):
    """Beyond what the direct sum may itself be off by."""
    true, off = summed(POINTS, exponent, 4)
    found = cell_light(LAMP, POINTS, surface(POINTS, exponent), 4, bell)
    return np.max(abs(found - true)) / off


@pytest.mark.smoke
@pytest.mark.parametrize("exponent", LOBES)
def test_without_blockers_it_is_the_direct_sum(exponent):
    assert no_blocker_error(exponent) < 1.0
    table, _ = trace_shadow_rays(LAMP, POINTS, 1, cards())
    found = sheared_reflection(
        LAMP, table, POINTS, surface(POINTS, exponent), 1.5, PIXEL, 0 * POINTS[:, 0], falloff=bell
    )
    true, off = summed(POINTS, exponent, 4)
    np.testing.assert_allclose(
        found.radiance, true.sum(1), rtol=0.0, atol=true.shape[1] * off
    )  # each so much
    np.testing.assert_array_equal(found.radiance, found.unshadowed)


def test_close_below_the_lamp_it_is_the_direct_sum_too():
    close = POINTS[::5] + np.array([0.0, 0.0, HIGH - 0.7])
    true, off = summed(close, 5.0, 4)
    found = cell_light(LAMP, close, surface(close, 5.0), 4, bell)
    assert off < 0.01 * np.max(true)
    assert np.max(abs(found - true)) < off


def hidden_cells_error():
    """A checkered sheet just below the lamp hides some of its 4 x 4 cells from all receivers."""
    hidden = np.random.default_rng(2).random((4, 4)) < 0.5
    sheet = []
    for i, j in np.argwhere(hidden):
        low = np.array([0.8 * (0.5 * j - 1.0), 0.8 * (0.5 * i - 1.0)])  # i runs along y
        sheet.append((HIGH - 1e-6, tuple(low), tuple(low + 0.4)))
    table, _ = trace_shadow_rays(LAMP, POINTS, 4, cards(*sheet))
    s = surface(POINTS)
    found = sheared_reflection(LAMP, table, POINTS, s, 1.5, PIXEL, 0 * POINTS[:, 0], falloff=bell)
    true, off = summed(POINTS, 30.0, 4)  # off in each of the cells that are left
    error = np.max(abs(found.radiance - true[:, ~hidden.ravel()].sum(1)))
    return error / (np.sum(~hidden) * off)


def test_any_cells_may_be_hidden():
    assert hidden_cells_error() < 1.0


@pytest.mark.parametrize("fault", ["not mirrored", "cells turned", "no cosine of the lamp"])
def test_faults_are_noticed(monkeypatch, fault):
    right = module.integrand

    def wrong(lamp, receivers, s, cells, g, falloff):
        if fault == "not mirrored":
            s = s._replace(to_eye=2 * np.sum(s.normal * s.to_eye, 1)[:, None] * s.normal - s.to_eye)
        for k in right(lamp, receivers, s, cells, g, falloff):
            value = k.value
            if fault == "cells turned":
                value = value.transpose(0, 3, 4, 1, 2)
            if fault == "no cosine of the lamp":
                value = value / lamp.local(receivers)[:, 2][:, None, None, None, None]
            yield k._replace(value=value)

    monkeypatch.setattr(module, "integrand", wrong)
    assert 10.0 < no_blocker_error() < np.inf
    assert 10.0 < hidden_cells_error() < np.inf


# --- against stratified rays of each receiver's own ----------------------------------------------


def brute(points, exponent, n, blockers, seed=5):
    """n x n stratified rays for each receiver: mean, and its standard error from two halves."""
    rng = np.random.default_rng(seed)
    halves = []
    for _ in range(2):
        values = []
        for point in points:
            u = 2.0 * (np.indices((n, n)).reshape(2, -1).T + rng.random((n * n, 2))) / n - 1.0
            ends = LAMP.center + np.column_stack([0.8 * u[:, 1], 0.8 * u[:, 0], np.zeros(n * n)])
            free = np.isinf(blockers(np.repeat(point[None], n * n, 0), ends)[0])
            values.append(4 * 0.64 * np.mean(shading(point, ends, exponent) * bell(u) * free))
        halves.append(np.array(values))
    mean = np.mean(halves, 0)
    return mean, 0.5 * np.sqrt(np.mean((halves[0] - halves[1]) ** 2))


def shared(points, blockers, rays, cells=4, exponent=30.0, Omega=4.0, seed=0):
    table, _ = trace_shadow_rays(LAMP, points, rays, blockers, seed)
    none = np.zeros(len(points))
    s = surface(points, exponent)
    return sheared_reflection(LAMP, table, points, s, Omega, PIXEL, none, cells, bell)


@pytest.mark.parametrize("exponent", LOBES)
def test_a_penumbra_is_within_noise_and_what_cells_leave_out(exponent):
    """Behind a straight edge, whose single depth the filter does not blur."""
    points = floor(SIDE, 0.1)
    true, error = brute(points, exponent, 24, cards(EDGE))
    found = shared(points, cards(EDGE), 64, 4, exponent)
    light = cell_light(LAMP, points, surface(points, exponent), 4, bell)
    # Each cell's share has n rays of the receiver's, no more spread than tosses of a coin.
    noise = np.sqrt(np.sum(light**2, 1) * 16.0 / found.samples) * 0.5
    left_out = worst_factoring(LAMP, points, surface(points, exponent), 4, bell)
    uneven = 2.0 * _unevenness() * np.sum(light, 1)  # of light in cells whose rays are even
    assert np.all(abs(found.radiance - true) <= left_out + uneven + 4.0 * (noise + error))
    one = shared(points, cards(EDGE), 64, 1, exponent)
    rms = [np.sqrt(np.mean((a.radiance - true) ** 2)) for a in (one, found)]
    assert rms[1] < 0.5 * rms[0]


def _unevenness():
    """Half the mean of |l / mean l - 1| in the cell where it is largest."""
    p, _ = lamp_places(64)
    light = bell(p).reshape(4, 16, 4, 16)
    mean = light.mean((1, 3), keepdims=True)
    return 0.5 * np.max(abs(light / mean - 1.0).mean((1, 3)))


def test_the_error_falls_as_rays_are_added():
    """Where cells and filter are fine enough that rays are what lacks: two layers of bars."""
    points = floor()
    inner = np.all(abs(points[:, :2]) < 0.3, 1)
    true, error = brute(points[inner], 30.0, 24, cards(*FENCE))

    def rms(rays):
        runs = [shared(points, cards(*FENCE), rays, 8, 30.0, 8.0, seed) for seed in range(3)]
        return np.sqrt(np.mean([(a.radiance[inner] - true) ** 2 for a in runs]))

    found = np.array([rms(rays) for rays in (0.25, 1, 4, 16)])
    assert np.all(found[1:] < 0.8 * found[:-1])
    assert error < 0.5 * found[3]


def test_receivers_among_blockers_take_what_they_are_given():
    card = cards((0.02, (-9.0, -9.0), (0.0, 9.0)))
    points = floor()
    table, _ = trace_shadow_rays(LAMP, points, 4, card)
    own = np.arange(len(points), dtype=float)
    found = sheared_reflection(LAMP, table, points, surface(points), 1.5, PIXEL, own)
    touched = found.own == 1.0
    assert 0 < touched.sum() < len(points)
    np.testing.assert_array_equal(found.radiance[touched], own[touched])


def test_receivers_that_no_lamp_can_light_are_nan_and_alone():
    """And a fallback may be unknown where it is not asked for."""
    blockers = cards((0.02, (-9.0, -9.0), (0.0, 9.0)))
    table, _ = trace_shadow_rays(LAMP, floor(), 4, blockers)
    right = sheared_reflection(
        LAMP, table, floor(), surface(floor()), 1.5, PIXEL, np.ones(len(floor()))
    )
    assert 0.2 < np.mean(right.own > 0.0) < 0.8
    points, bad = bad_receivers(floor())
    known = np.insert(np.where(right.own > 0.0, 1.0, np.nan), bad - np.arange(3), np.nan)
    s = surface(np.nan_to_num(points))
    found = sheared_reflection(LAMP, table, points, s, 1.5, PIXEL, known)
    for a, b in zip(found, right, strict=True):
        assert np.all(np.isnan(a[bad]))
        np.testing.assert_array_equal(np.delete(a, bad), b)
    cells = module.cell_visibility(LAMP, table, points, 1.5, PIXEL).cells
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(cells).any(1)), bad)


# --- bounds --------------------------------------------------------------------------------------


def factored_errors(V, exponent, cells, albedo=0.3, n=32):
    """Of shading times visibility on places of the test's own, visibility V over n x n places."""
    p, places = lamp_places(n)
    area = 4.0 * np.prod(LAMP.half) / n**2
    shape = (cells, n // cells, cells, n // cells)
    light, V = bell(p).reshape(shape), V.reshape(shape)
    W = light.sum((1, 3))
    seen = (light * V).sum((1, 3)) / W
    found = []
    for point in POINTS[::7]:
        k = (shading(point, places, exponent, albedo) * bell(p)).reshape(shape)
        found.append(area * (np.sum(k.sum((1, 3)) * seen) - np.sum(k * V)))
    return np.array(found), np.tile(seen.ravel(), (len(found), 1))


@pytest.mark.parametrize("exponent", LOBES)
@pytest.mark.parametrize("cells", [1, 4])
def test_no_blocker_is_worse_than_the_bounds(exponent, cells):
    points, rng = POINTS[::7], np.random.default_rng(0)
    s = surface(points, exponent)
    worst = worst_factoring(LAMP, points, s, cells, bell, 32 // cells)
    p, _ = lamp_places(32)
    for k in range(12):
        direction = rng.normal(size=2)
        V = (p @ direction > rng.normal()).astype(float) if k % 2 else rng.integers(0, 2, (32, 32))
        off, seen = factored_errors(V, exponent, cells)
        likely = likely_factoring(LAMP, points, s, seen, bell, 32 // cells)
        assert np.all(abs(off) <= worst * (1 + 1e-9))
        assert np.all(abs(off) <= likely + 1e-9 * worst)


def test_the_worst_blocker_reaches_the_bound():
    """One that lets through where shading is above its mean: both bounds' extremes."""
    p, places = lamp_places(32)
    light = bell(p)
    k = shading(POINTS[0], places, 20.0)
    V = (k > np.sum(k * light) / np.sum(light)).astype(float)
    off, _ = factored_errors(V, 20.0, 1)
    bound = worst_factoring(LAMP, POINTS[:1], surface(POINTS[:1], 20.0), 1, bell, 32)
    np.testing.assert_allclose(abs(off[0]), bound[0], rtol=1e-10)
    assert abs(off[0]) > 0.2 * np.sum(k * light) * 4 * 0.64 / 32**2


def test_bounds_shrink_with_cells():
    """As their edge: what is left out is a covariance of two that vary inside a cell."""
    found = [
        worst_factoring(LAMP, POINTS, surface(POINTS, 20.0), c, bell, 64 // c).mean()
        for c in (2, 4, 8, 16)
    ]
    slope = np.polyfit(np.log([2, 4, 8, 16]), np.log(found), 1)[0]
    assert -1.2 < slope < -0.8


def test_bars_before_a_long_lamp_are_flatlands():
    """Summed along an endless lamp, K / pi is half of flatland's form factor."""
    d, half, x = 2.0, 0.7, 0.9
    n = 64
    # A thin strip of the lamp, before receivers as far aside as strips are from one receiver.
    strip = lamp_frame((0.0, 0.0, d), (0.0, 24.0, 0.0), (half / n, 0.0, 0.0))
    y = half * ((2.0 * np.arange(n) + 1.0) / n - 1.0)
    points = np.column_stack([x - y, 0 * y, 0 * y])
    up = np.tile((0.0, 0.0, 1.0), (n, 1))
    strips = cell_light(strip, points, glossy_surface(up, up, albedo=1.0), 1, nodes=120)[:, 0]
    worst = 0.5 * np.sum(abs(strips - np.mean(strips)))
    flat = factoring_bound(BoxProfile(half, "y", PLANE), d, -half, half, jnp.array([x]), n)
    np.testing.assert_allclose(worst, 0.5 * flat[0], rtol=1e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"albedo": -0.1}, "`albedo` must not be negative"),
        ({"exponent": -1.0}, "`exponent` must not be negative"),
        ({"normal": np.zeros((1, 3))}, "`normal` must be positive"),
    ],
)
def test_bad_surfaces_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        glossy_surface(**({"normal": np.ones((1, 3)), "to_eye": np.ones((1, 3))} | change))


def test_a_lobe_without_exponent_ends_at_the_horizon_of_the_mirrored_eye():
    """As one with hardly any; the power 0^0 brought light from behind that horizon."""
    lamp = lamp_frame((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    here, up, eye = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), np.array([[-1.0, 0.0, 0.05]])
    flat, nearly = (
        cell_light(lamp, here, glossy_surface(up, eye, specular=1.0, exponent=e), 4)
        for e in (0.0, 1e-9)
    )
    np.testing.assert_allclose(flat, nearly, rtol=1e-6)
    assert flat.min() < 0.1 * flat.max()


def test_a_surface_belongs_to_its_receivers():
    table = trace_shadow_rays(LAMP, POINTS, 1, cards())[0]
    other, none = surface(POINTS[:1]), np.zeros(len(POINTS))
    with pytest.raises((TypeError, ValueError), match=r"`surface` must have shape|type hint"):
        sheared_reflection(LAMP, table, POINTS, other, 1.0, PIXEL, none)
    with pytest.raises(TypeError, match=r"`surface` must be a surface of `glossy_s|type hint"):
        sheared_reflection(LAMP, table, POINTS, (POINTS, POINTS), 1.0, PIXEL, none)


def test_bad_input_is_refused():
    s = surface(POINTS)
    with pytest.raises(ValueError, match="`cells` must be a positive integer"):
        cell_light(LAMP, POINTS, s, 0)
    with pytest.raises(ValueError, match="`receivers` must be finite"):
        cell_light(LAMP, np.nan * POINTS, s, 1)
    with pytest.raises(ValueError, match="`seen` must have shape"):
        likely_factoring(LAMP, POINTS, s, np.ones((len(POINTS), 3)))


@pytest.mark.parametrize("count", [0, 2])
def test_where_no_receiver_is_below_the_lamp_nothing_is_reflected(count):
    def free(a, b):
        return np.full(len(a), np.inf), np.full(len(a), -np.inf)

    lamp = lamp_frame((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
    table, _ = trace_shadow_rays(lamp, np.zeros((1, 3)), 4, free)
    up, above = np.tile([0.0, 0.0, 1.0], (count, 1)), np.tile([0.0, 0.0, 3.0], (count, 1))
    surface = glossy_surface(up, up, albedo=0.5)
    found = sheared_reflection(lamp, table, above, surface, 1.0, 0.1, np.ones(count))
    assert found.radiance.shape == (count,)
    assert np.all(np.isnan(found.radiance))
