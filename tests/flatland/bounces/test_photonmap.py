import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import spread_test, z_test, z_test_of
from firstorder.flatland import (
    Arcs,
    Circles,
    PointLights,
    Receiver,
    Scene,
    Segments,
    box,
    primitive,
)
from firstorder.flatland.bounces import DensityEstimator
from firstorder.flatland.bounces.photonmap import (
    final_gather,
    photon_irradiance,
    photon_map,
    photon_radiance,
)
from firstorder.flatland.bounces.photons import Photons, split_photons, trace_photons
from firstorder.flatland.library._scenes import scene_a
from firstorder.flatland.skies import ConstantSky
from firstorder.sampling import estimate
from firstorder.sampling._density import expected_fixed_radius, expected_k_nearest

RUNS, COUNT = 100, 2000
S = jnp.append(jnp.arange(2, 19) / 20.0, 0.0)  # inside the floor, and one end of it
FLOOR = jnp.zeros(18, int), jnp.ones(18, bool)


def cumulative(x):
    """Share of scene A's two watts that arrives left of x: E integrated by hand."""

    def F(x):
        return np.hypot(x + 0.5, 1.0) - np.hypot(x - 0.5, 1.0)

    return 0.5 * (F(np.clip(x, -1.0, 1.0)) - F(-1.0))


def irradiance_a(x):
    return (0.5 - x) / np.hypot(0.5 - x, 1.0) + (0.5 + x) / np.hypot(0.5 + x, 1.0)


@functools.cache
def hundred_maps():
    scene = scene_a()
    photons = trace_photons(scene, jax.random.key(7), RUNS * COUNT, 0)
    return [photon_map(scene, run) for run in split_photons(photons, RUNS)]


def hundred(how):
    return np.stack([photon_irradiance(m, how, *FLOOR, S) for m in hundred_maps()])


def over(seen, want):
    error = seen.std(0, ddof=1) / np.sqrt(RUNS)
    return z_test(seen.mean(0), error, want, freedom=RUNS - 1)


X = 2.0 * np.asarray(S) - 1.0
END = irradiance_a(-1.0), (irradiance_a(-1.0 + 1e-6) - irradiance_a(-1.0 - 1e-6)) / 2e-6


@pytest.mark.smoke
def test_a_fixed_radius_over_100_runs_is_what_was_predicted():
    """Mean, boundary bias at the end of the floor included, and spread."""
    seen = hundred(DensityEstimator(radius=0.1))
    want = expected_fixed_radius(cumulative, X, 0.1, COUNT)
    assert over(seen, 2.0 * want.mean).passed
    assert spread_test(seen.std(0, ddof=1), 2.0 * want.spread, RUNS).passed
    # At the end half of the light is lost, but for its slope: f / 2 + f' r / 4.
    assert abs(2.0 * want.mean[-1] / END[0] - (0.5 + 0.25 * 0.1 * END[1] / END[0])) < 0.005
    assert not over(seen, irradiance_a(X)).passed


@pytest.mark.parametrize("kept", [False, True])
def test_k_nearest_over_100_runs_are_what_was_predicted(kept):
    k = 10
    seen = hundred(DensityEstimator(k=k, keep_farthest=kept))
    # All places together, each in units of what is expected: the excess is 1 / 9 of the mean.
    right = expected_k_nearest(cumulative, X, k, COUNT, k if kept else k - 1)
    assert over(seen, 2.0 * right.mean).passed
    other = expected_k_nearest(cumulative, X, k, COUNT, k - 1 if kept else k)
    assert over(np.mean(seen / (2.0 * right.mean), -1), 1.0).passed
    assert not over(np.mean(seen / (2.0 * other.mean), -1), 1.0).passed
    assert DensityEstimator(k=k, keep_farthest=kept).excess == (10 / 9 if kept else 1.0)


def test_a_window_cut_at_the_end_has_no_bias_there():
    seen = hundred(DensityEstimator(radius=0.1, cut=True))
    # One-sided: first order in the radius, f' r / 2, and no half.
    share = cumulative(-1.0 + 0.1) / 0.1
    assert over(seen[:, -1:], 2.0 * share).passed
    assert abs(2.0 * share / END[0] - (1.0 + 0.5 * 0.1 * END[1] / END[0])) < 0.01


# --- where the flux goes -------------------------------------------------------------------------


def test_all_flux_of_a_closed_room_is_absorbed(key):
    """Landed flux is that of a geometric series, each wall by what it sees."""
    rho, I = 0.5, 0.7  # noqa: E741
    scene = Scene.of(
        primitive(box((0.0, 0.0), (1.0, 1.0), inward=True), albedo=rho),
        points=PointLights((0.5, 0.5), I),
    )
    photons = trace_photons(scene, key, 20_000, 24)
    landed = np.asarray(jnp.sum(photons.flux, 0)) / (2.0 * np.pi * I) * 20_000
    assert z_test_of(estimate(landed), 1.0 / (1.0 - rho), truth_error=2.0 * rho**24).passed
    assert not z_test_of(estimate(landed), 1.0).passed
    first = np.bincount(np.asarray(photons.index[0]), minlength=4)
    assert np.all(np.abs(first - 5000) < 5.0 * np.sqrt(20_000 * 3 / 16))


def test_every_kind_of_light_sends_its_flux(key):
    """A lamp that is an arc, a circle and the sky: photons against irradiance in closed form."""
    ring = Circles((0.0, 0.0), 1.0)
    center = primitive(Circles((0.0, 0.0), 0.1), emission=2.0)
    scene = Scene.of(primitive(ring), center, environment=ConstantSky(0.5))
    photons = trace_photons(scene, key, 20_000, 0)
    m = photon_map(scene, photons)
    front = jnp.ones(1, bool)
    how = DensityEstimator(radius=0.5)
    inner = photon_irradiance(m, how, jnp.zeros(1, int), ~front, jnp.array([0.01]))
    outer = photon_irradiance(m, how, jnp.zeros(1, int), front, jnp.array([0.99]))
    # Seen from inside the small lamp spans 2 asin(0.1); from outside the whole sky arrives.
    for E, truth in ((inner, 2.0 * 2.0 * 0.1), (outer, 0.5 * 2.0)):
        total = 0.4 * np.pi + 0.5 * 2.0 * np.pi * 1.01 * 2.0  # generous: flux thrown
        spread = np.sqrt(total / 20_000 * truth)
        assert abs(float(E[0]) - truth) < 5.0 * spread


def test_the_map_of_a_bowl_follows_its_arc(key):
    """An arc lit from its centre: even irradiance `I / R`, over a closed form of the arc length."""
    bowl = primitive(Arcs((0.0, 0.0), 2.0, 0.5 * np.pi, np.pi))
    scene = Scene.of(bowl, points=PointLights((0.0, 0.0), 3.0))
    photons = trace_photons(scene, key, 40_000, 0)
    m = photon_map(scene, photons)
    s = jnp.linspace(0.1, 0.9, 9)
    E = photon_irradiance(m, DensityEstimator(radius=0.3), jnp.zeros(9, int), jnp.ones(9, bool), s)
    flux = 6.0 * np.pi / 40_000
    spread = np.sqrt(flux * 1.5 / 0.6)
    assert z_test(E, spread, 1.5).passed


def test_final_gathering_removes_noise_as_predicted(key):
    """Scene C without its reflections of reflections: one reflection is gathered in closed form.

    Direct view: photons in a window. Gathered: each photon counts by the irradiance `rho / 2 G`
    that it gives the receiver, averaged over its window; both are sums over independent photons.
    """
    rho, count, r = 0.5, 1000, 0.05
    scene = Scene.of(
        primitive(box((0.0, 0.0), (1.0, 1.0), inward=True), albedo=rho),
        points=PointLights((0.5, 0.5), 1.0),
    )
    how = DensityEstimator(radius=r)
    x = 0.4
    at = Receiver([[x, 0.0]], [0.0], jnp.zeros(1, int))
    viewed, collected = [], []
    for run in split_photons(trace_photons(scene, key, RUNS * count, 0), RUNS):
        m = photon_map(scene, run)
        viewed.append(
            photon_irradiance(m, how, jnp.zeros(1, int), jnp.ones(1, bool), jnp.array([x]))
        )
        collected.append(final_gather(scene, at, photons=m, how=how, rays=512))
    viewed, collected = np.asarray(viewed)[:, 0], np.asarray(collected)[:, 0]

    flux, t = 2.0 * np.pi / count, (np.arange(4000) + 0.5) / 4000

    def share(t):  # of all photons that land on a wall before t
        return (np.arctan((t - 0.5) / 0.5) + 0.25 * np.pi) / (2.0 * np.pi)

    p = share(x + r) - share(x - r)
    direct = np.sqrt(count * p * (1.0 - p)) * flux / (2.0 * r)
    density = 0.5 / ((t - 0.5) ** 2 + 0.25) / (2.0 * np.pi)
    walls = [  # sine of the angle at the receiver, of a point of each other wall
        lambda t: (t - x) / np.hypot(t - x, 1.0),
        lambda t: (1.0 - x) / np.hypot(1.0 - x, t),
        lambda t: -x / np.hypot(x, t),
    ]
    mean = square = 0.0
    for sine in walls:
        ends = np.clip(t + r, 0.0, 1.0), np.clip(t - r, 0.0, 1.0)
        w = 0.5 * rho * np.abs(sine(ends[0]) - sine(ends[1])) / (2.0 * r)
        mean, square = mean + np.mean(density * w), square + np.mean(density * w**2)
    gathering = np.sqrt(count * (square - mean**2)) * flux
    assert spread_test(viewed.std(ddof=1), direct, RUNS).passed
    assert spread_test(collected.std(ddof=1), gathering, RUNS).passed
    assert gathering < 0.2 * direct
    # Direct light is exact there; the rest is the photons'.
    exact = 0.5 / ((x - 0.5) ** 2 + 0.25)
    error = collected.std(ddof=1) / np.sqrt(RUNS)
    assert z_test(collected.mean(), error, exact + count * flux * mean, truth_error=2e-3).passed


def test_radiance_is_the_brdf_times_irradiance_if_it_is_even():
    m, out = hundred_maps()[0], (jnp.zeros(18), jnp.ones(18))

    def diffuse(out, into):
        return 0.4 * jnp.ones_like(into[0])

    for how in (
        DensityEstimator(k=20),
        DensityEstimator(k=20, keep_farthest=True),
        DensityEstimator(radius=0.02),
        DensityEstimator(radius=0.02, cut=True),
    ):
        L = photon_radiance(m, how, diffuse, *FLOOR, S, out)
        np.testing.assert_allclose(L, 0.4 * photon_irradiance(m, how, *FLOOR, S), rtol=1e-9)
    wide = photon_radiance(m, DensityEstimator(radius=0.5), diffuse, *FLOOR, S, out, most=16)
    assert bool(jnp.all(jnp.isnan(wide)))


def test_light_is_gathered_at_one_receiver_or_many(key):
    scene, how = scene_a(), DensityEstimator(k=20)
    row = Receiver(np.stack([X, 0.0 * X], -1), 0.0 * X, jnp.zeros(18, int))
    one = jax.tree.map(lambda leaf: leaf[0], row)
    E, first = (
        final_gather(scene, at, photons=hundred_maps()[0], how=how, rays=8) for at in (row, one)
    )
    assert first.shape == ()
    assert abs(first - E[0]) < 1e-12


# --- manners -------------------------------------------------------------------------------------


def test_an_empty_map_is_dark():
    scene = scene_a()
    nothing = eqx.tree_at(
        lambda p: p.index, trace_photons(scene, jax.random.key(0), 4, 0), -jnp.ones((1, 4), int)
    )
    m = photon_map(scene, nothing)
    for how in (DensityEstimator(k=3), DensityEstimator(radius=0.1)):
        assert photon_irradiance(m, how, *FLOOR, S).tolist() == [0.0] * 18


def test_bad_arguments_are_one_sentence(key):
    with pytest.raises(ValueError, match="Just one of the arguments `k` and `radius`"):
        DensityEstimator()
    with pytest.raises(ValueError, match="Just one of the arguments `k` and `radius`"):
        DensityEstimator(k=5, radius=0.1)
    with pytest.raises(ValueError, match="`k` must be at least 2"):
        DensityEstimator(k=1)
    with pytest.raises(ValueError, match="`count` must be a positive integer"):
        trace_photons(scene_a(), key, 0)
    with pytest.raises(ValueError, match="`runs` must divide 200000 photons, but is 7"):
        split_photons(trace_photons(scene_a(), key, RUNS * COUNT, 0), 7)


def test_a_window_wider_than_a_closed_curve_goes_around_it_once():
    s = jnp.linspace(0.003, 0.997, 100)
    same = jnp.ones(100)
    photons = Photons(jnp.zeros(100, int), same > 0, s, 0.5 * same, 0.0 * same, same)
    there = photon_map(Scene.of(primitive(Circles((0.3, 0.1), 0.8))), photons)
    where, places = (jnp.zeros(3, int), jnp.ones(3, bool)), jnp.array([0.1, 0.5, 0.9])
    E = photon_irradiance(there, DensityEstimator(radius=7.0), *where, places)
    np.testing.assert_allclose(E, 50.0 / (1.6 * np.pi), rtol=1e-12)  # all flux over the length


def landed(index, front, s):
    """Photons of one watt that came along the normal."""
    s = jnp.asarray(s)
    rows = jnp.full(s.shape, index), jnp.full(s.shape, front)
    one = jnp.ones_like(s)
    return Photons(*rows, s, one, 0.0 * s, one)


@pytest.mark.parametrize("k", [7, 12, 100])
@pytest.mark.parametrize("kept", [False, True])
def test_no_photon_of_a_closed_curve_is_nearest_twice(k, kept):
    """Eight around a circle: of all places between two of them none is brighter than another."""
    there = photon_map(
        Scene.of(primitive(Circles((0.3, 0.1), 0.8))), landed(0, True, (np.arange(8) + 0.5) / 8)
    )
    where = jnp.zeros(8, int), jnp.ones(8, bool)
    how = DensityEstimator(k=k, keep_farthest=kept)
    count = min(k, 8)
    # Between two photons the nearest are half a gap away, and two more a gap farther each time.
    wide = 2.0 * (np.ceil(count / 2) - 0.5) * 1.6 * np.pi / 8
    E = photon_irradiance(there, how, *where, jnp.arange(8) / 8)
    np.testing.assert_allclose(E, (count - (not kept)) / wide, rtol=1e-12)


def test_one_photon_as_far_as_another_counts_in_radiance_as_in_irradiance():
    """Of two at one distance once both were left out as the farthest."""
    floor = Scene.of(primitive(Circles((0.0, 0.0), 1.0)))
    there = photon_map(floor, landed(0, True, [0.25, 0.25, 0.5, 0.5]))
    how, where = DensityEstimator(k=2), (jnp.zeros(2, int), jnp.ones(2, bool))
    s, out = jnp.array([0.125, 0.25]), (jnp.zeros(2), jnp.ones(2))
    E = photon_irradiance(there, how, *where, s)
    L = photon_radiance(there, how, lambda out, into: 0.4 + 0.0 * into[0], *where, s, out)
    assert E[0] > 0.0
    np.testing.assert_allclose(L, 0.4 * E, rtol=1e-12)


def test_photons_half_around_stay_on_their_own_side():
    """In single precision their places once rounded to those of the other side."""
    with jax.enable_x64(False):
        half = [np.nextafter(np.float32(0.5), np.float32(0.0))]
        for radius in np.linspace(0.3, 3.0, 20):
            floor = Segments((0.0, 5.0), (300.0, 5.0))
            scene = Scene.of(primitive(floor), primitive(Circles((0.0, 0.0), radius)))
            there = photon_map(scene, landed(1, True, half))
            assert np.diff(there.low).tolist() == [0, 0, 2, 0]


@pytest.mark.parametrize("index", [2, -1])
def test_a_shape_that_is_not_there_has_no_photons(index):
    there = photon_map(Scene.of(primitive(Circles((0.0, 0.0), 1.0))), landed(0, True, [0.5]))
    how, asked = DensityEstimator(k=2), (np.full(1, index), np.ones(1, bool), np.zeros(1))
    words = "^Argument `index` must be the number of a shape, 0 to 0, but is"
    with pytest.raises(ValueError, match=words):
        photon_irradiance(there, how, *asked)
    out = np.zeros(1), np.ones(1)
    with pytest.raises(ValueError, match=words):
        photon_radiance(there, how, lambda out, into: into[0], *asked, out)
