"""Bounds of what stands for relief of any shape, against rays that meet it in space one by one."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.bandwidth import _relief_space_rays as rays
from firstorder.bandwidth import (
    Relief,
    ReliefCutoffs,
    brdf_shape_error,
    bump_shape_error,
    flat_shape_error,
    shape_cutoffs,
)

PLACES = 48  # along each side of a cell


def patterns(count, seed, balanced=False):
    """Reliefs of three harmonics on lattices of any angle, seen from anywhere, and light."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        first, angle = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(1.0, 2.0)
        periods = np.stack([[np.cos(t), np.sin(t)] for t in (first, first + angle)], -1)
        periods = periods * 10 ** rng.uniform(-2.0, 0.0) * rng.uniform(0.7, 1.0, 2)
        basis = np.linalg.inv(periods).T  # columns: harmonics with the numbers (1, 0) and (0, 1)
        whole = rng.integers(-2, 3, (3, 2))
        whole[:] = [[1, 0], [0, 1], rng.choice([[1, 1], [2, 1], [1, -1], [2, 0], [0, 2]])]
        phase = rng.uniform(0.0, 2.0 * np.pi, 3)
        if balanced:  # odd, and turned over by half a cell along both sides
            whole[2], phase = rng.choice([[2, 1], [1, 2], [1, -2]]), np.full(3, -0.5 * np.pi)
        k = whole @ basis.T
        relief = rays.Cosines(k, rng.uniform(-1.0, 1.0, 3), phase)
        slope = 10 ** rng.uniform(-3.0, -0.5)
        steep = np.linalg.norm(relief.slope(rays.cell(periods, PLACES)), axis=-1).max()
        relief = relief._replace(a=relief.a * slope / steep)
        view = rng.uniform(-1.0, 1.0)
        reach = abs(view) + 2.0 * np.arctan(slope)
        bands = 10 ** rng.uniform(-1.0, 1.0), 10 ** rng.uniform(-2.0, 1.0)
        if reach < 1.4 and slope * np.tan(reach) < 0.95:
            at = {"view": view, "reach": reach}
            yield periods, relief, rays.to_eye(view, rng.uniform(0.0, 7.0)), at, bands


def numbers(periods, relief, balanced=False):
    """What the bounds are told: the largest of samples, and the lattice of harmonics."""
    h, m, c, rms_h, rms_m = relief.numbers(rays.cell(periods, 200))
    basis = np.linalg.inv(periods).T
    frequency = np.linalg.norm(basis[:, 0])
    across = abs(np.linalg.det(basis)) / frequency
    more = 1.0 + 1e-3  # between the samples
    return Relief(
        h * more,
        m * more,
        c * more,
        frequency,
        across,
        rms_height=rms_h,
        rms_slope=rms_m,
        balanced=balanced,
    )


@functools.cache
def with_numbers(count, seed, balanced=False):
    """Each of the patterns, and what the bounds are told of it."""
    found = patterns(count, seed, balanced)
    return [(*pattern, numbers(*pattern[:2], balanced)) for pattern in found]


def lights(true, replaced, bands, rng):
    """Pairs of frequencies up to the cutoffs: the ones along which rays are farthest apart."""
    (x, w), (x0, w0) = true, replaced
    turn, move = (w - w0).reshape(-1, 3), (x - x0).reshape(-1, 2)
    worst = np.argmax(
        bands[0] * np.linalg.norm(turn, axis=-1) + bands[1] * np.linalg.norm(move, axis=-1)
    )
    pairs = [(move[worst], turn[worst])] + [(rng.normal(size=2), rng.normal(size=3)) for _ in "123"]
    return [(bands[1] * unit(a), bands[0] * unit(b)) for a, b in pairs]


def unit(a):
    return a / max(np.linalg.norm(a), 1e-300)


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("error", "replaced", "over"),
    [(flat_shape_error, rays.flat, 1.3), (bump_shape_error, rays.bumped, 2.2)],
)
def test_no_ray_in_space_errs_by_more_than_the_bound(error, replaced, over):
    rng, ratios = np.random.default_rng(1), []
    for periods, relief, e, at, bands, shape in with_numbers(60, 2):
        found = float(error(shape, *bands, **at))
        u = rays.cell(periods, PLACES)
        true, other = rays.traced(u, relief, e), replaced(u, relief, e)
        measured = max(
            np.abs(rays.wave(true, *pair) - rays.wave(other, *pair)).max()
            for pair in lights(true, other, bands, rng)
        )
        assert measured <= found * (1.0 + 1e-9)
        if found < 0.5:  # beyond, a chord is shorter than its arc
            ratios.append(found / measured)
    assert len(ratios) > 10
    assert np.median(ratios) < over


@pytest.mark.parametrize(("balanced", "over"), [(True, 8.0), (False, 8.0)])
def test_no_pixel_in_space_errs_by_more_than_the_bound_of_a_brdf(balanced, over):
    rng, ratios = np.random.default_rng(3), []
    for periods, relief, e, at, bands in patterns(80, 4, balanced):
        shape = numbers(periods, relief, balanced)
        width = rng.uniform(0.1, 0.5) / float(jnp.minimum(shape.frequency, shape.frequency_across))
        found = float(brdf_shape_error(shape, *bands, width=width, **at))
        u = rays.cell(periods, PLACES)
        true, measured = rays.traced(u, relief, e), 0.0
        for Omega_x, Omega in lights(true, rays.flat(u, relief, e), bands, rng):
            light = rays.wave(true, Omega_x, Omega) * np.exp(-2j * np.pi * u @ Omega_x)
            mean = rays.wave(true, 0.0 * Omega_x, Omega).mean()
            measured = max(measured, rays.pixels(light, periods, Omega_x, width, mean))
        assert measured <= found * (1.0 + 1e-9) + 1e-12
        if 1e-6 < found < 0.5:
            ratios.append(found / measured)
    assert len(ratios) > 10
    assert np.median(ratios) < over


@pytest.mark.parametrize("balanced", [True, False])
@pytest.mark.parametrize("view", [0.0, 0.4])
def test_the_bound_of_a_brdf_is_what_is_written(balanced, view):
    """The formula of the docstring, in NumPy: most of its terms are seldom met at once."""
    rng = np.random.default_rng(8)
    for _ in range(40):
        h, m, B, Bx = 10 ** rng.uniform([-6, -4, -2, -2], [-2, -1, 1, 1])
        f, across, w, reach = 20.0 * rng.uniform(1, 2), 20.0, 10 ** rng.uniform(-2.5, -1), 0.6
        p = 2.0 * np.pi * Bx * h * (np.tan(view) + np.tan(reach))
        slope = m if balanced or view == 0.0 else np.sqrt(2.0) * m
        n = 4.0 * np.pi * B * slope
        drift = 4.0 * np.pi * Bx * h * slope / np.cos(reach) ** 2
        mean = p**2 / 2.0 if balanced else min(p, p**2 / 2.0 + n * p + drift)
        s = np.hypot(n, p) if balanced else n + p
        q = np.exp(-2.0 * (np.pi * w * (np.array([f, across]) - Bx)) ** 2)
        t, u = 2.0 * q**2 / (1.0 - q**6)
        expected = min(2.0, mean + min(1.0, s) * np.sqrt(t + u + t * u))
        shape = Relief(
            9.0 * h, 2.0 * m, 1.0, f, across, rms_height=h, rms_slope=m, balanced=balanced
        )
        found = brdf_shape_error(shape, B, Bx, width=w, view=view, reach=reach)
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_slopes_that_face_the_eye_count_up_to_twice():
    """A saw whose short sides face the eye: their mean square over what is seen, and over all."""
    n = np.arange(1, 12)
    k, a = np.stack([n, 0 * n], -1) * 1.0, 0.1 * np.exp(-0.05 * n**2) / n
    relief = rays.Cosines(k, a, np.full(n.size, 0.5 * np.pi))
    x = np.linspace(0.0, 1.0, 4000, endpoint=False)[:, None] * np.array([1.0, 0.0])
    steep = np.abs(relief.slope(x)).max()
    relief = relief._replace(a=a / steep)
    shares = []
    for sign in (1.0, -1.0):
        e = rays.to_eye(sign * np.arctan(0.99), 0.0)
        seen = np.mean(relief.slope(rays.met(x, relief, e))[:, 0] ** 2)
        shares.append(seen / np.mean(relief.slope(x)[:, 0] ** 2))
    assert 1.5 < max(shares) < 2.0
    assert min(shares) < 0.7


@pytest.mark.smoke
def test_the_bound_of_a_brdf_is_nearly_reached_by_two_equal_waves():
    """The filter's squares are summed over harmonics, and light varies one way: a root of two."""
    f, B, e = 30.0, 0.4, rays.to_eye(0.0, 0.0)
    relief = rays.Cosines(f * np.eye(2), np.full(2, 1e-5), np.full(2, -0.5 * np.pi))
    periods, Omega = np.eye(2) / f, B * np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    shape = numbers(periods, relief, balanced=True)
    light = rays.wave(rays.traced(rays.cell(periods, 64), relief, e), np.zeros(2), Omega)
    measured = rays.pixels(light, periods, np.zeros(2), 0.4 / f, light.mean())
    found = float(brdf_shape_error(shape, B, 0.0, width=0.4 / f, view=0.0, reach=0.01))
    np.testing.assert_allclose(found / measured, np.sqrt(2.0), rtol=1e-2)


def test_pixels_by_harmonics_are_pixels_by_rays():
    """The oracle above, against rays over the pixel summed one by one."""
    periods, relief, e, *_ = next(patterns(5, 9))
    size = np.sqrt(abs(np.linalg.det(periods)))
    width, pair = 0.2 * size, (np.array([0.3, 0.1]) / size, np.array([0.4, -0.2, 0.3]))
    u = rays.cell(periods, 96)
    light = rays.wave(rays.traced(u, relief, e), *pair) * np.exp(-2j * np.pi * u @ pair[0])
    by_rays = rays.pixel_by_rays(relief, e, pair, width, np.zeros(2), size / 48.0)
    k = np.stack(np.meshgrid(*2 * [np.fft.fftfreq(96, 1 / 96)], indexing="ij"), -1)
    k = k @ np.linalg.inv(periods)
    kept = np.exp(-2.0 * (np.pi * width) ** 2 * np.sum((k + pair[0]) ** 2, -1))
    assert abs(np.sum(np.fft.fft2(light) / 96**2 * kept) - by_rays) < 1e-6
    assert np.abs(by_rays) > 0.1


def test_heights_that_the_eye_sees_keep_their_mean_and_their_mean_square():
    for periods, relief, e, *_ in patterns(20, 5):
        x = rays.cell(periods, 128)
        seen = relief.height(rays.met(x, relief, e))
        true = relief.height(x)
        size = np.sqrt(np.mean(true**2))
        assert abs(np.mean(seen)) < 1e-6 * size
        np.testing.assert_allclose(np.sqrt(np.mean(seen**2)), size, rtol=1e-6)


def test_relief_that_is_not_balanced_errs_in_first_order_of_its_parallax():
    """Heights all up, steep against a fast lobe: what lies high is steep, and not what lies low."""
    k = 40.0 * np.array([[1.0, 0.0], [2.0, 0.0]])
    e, pair = rays.to_eye(0.7, 0.0), (np.array([0.5, 0.0]), 12.0 * np.array([0.7, 0.0, 0.7]))
    periods, found = np.eye(2) / 40.0, []
    u = rays.cell(periods, 64)
    for height in (1.0, 2.0):
        a = 3e-4 * np.array([1.0, 0.4])
        relief = rays.Cosines(k, a, np.zeros(2))
        x, w = rays.traced(u, relief, e)
        moved = height * 1e-3 * (x - u)  # the same slopes, the parallax in proportion
        mean = np.mean(np.exp(2j * np.pi * (w @ pair[1])) * np.expm1(2j * np.pi * moved @ pair[0]))
        found.append(abs(mean))
    assert abs(np.log2(found[1] / found[0]) - 1.0) < 1e-3


@pytest.mark.parametrize("balanced", [True, False])
@pytest.mark.parametrize("share", [0.02, 0.3])
def test_at_its_cutoff_each_bound_is_the_share(share, balanced):
    checked = 0
    for *_, at, bands, unit in with_numbers(60, 6, balanced):
        width = 0.5 / float(jnp.minimum(unit.frequency, unit.frequency_across))
        cut = shape_cutoffs(share, unit, *bands, width=width, **at)
        assert isinstance(cut, ReliefCutoffs)
        for factor, error, more in (
            (cut.flat, flat_shape_error, {}),
            (cut.bumps, bump_shape_error, {}),
            (cut.brdf, brdf_shape_error, {"width": width}),
        ):
            s = float(factor) * (1.0 - 1e-9)
            high = jax.tree.map(lambda a: a, unit)
            high = Relief(
                s * unit.height,
                s * unit.slope,
                s * unit.curvature,
                unit.frequency,
                unit.frequency_across,
                rms_height=s * unit.rms_height,
                rms_slope=s * unit.rms_slope,
                balanced=balanced,
            )
            found = float(error(high, *bands, **at, **more))
            assert s == 0.0 or found <= share * (1.0 + 1e-9)
            steepest = s * float(unit.slope) * max(np.tan(at["reach"]), abs(np.tan(at["view"])))
            if s > 0.0 and steepest < 0.999:
                np.testing.assert_allclose(found, share, rtol=1e-6)
                checked += 1
    assert checked > 30


@pytest.mark.parametrize("across", [np.inf, 1.0])
def test_from_the_pixels_frequency_on_a_brdf_does_for_any_slope(across):
    def error(f):
        steep = Relief(0.0, 1e9, 0.0, f, f * across)
        return float(brdf_shape_error(steep, 50.0, 2.0, width=0.01, view=0.0, reach=0.0))

    flat = Relief(0.0, 0.0, 0.0, 1.0, across)
    found = shape_cutoffs(0.1, flat, 5.0, 2.0, width=0.01, view=0.0, reach=0.0).frequency
    assert 0.0999 < error(float(found)) <= 0.1 < error(0.99 * float(found))


def test_grooves_leave_less_than_the_same_in_rows():
    at = {"width": 0.01, "view": 0.1, "reach": 0.3}
    alone, rows = (
        float(brdf_shape_error(Relief(1e-4, 0.1, 9.0, 60.0, f), 1.0, 0.0, **at))
        for f in (np.inf, 60.0)
    )
    np.testing.assert_allclose(rows / alone, np.sqrt(2.0), rtol=1e-3)


def test_bumps_seen_from_above_and_reliefs_without_end_have_their_bounds():
    dents = Relief(1e-4, 0.01, 2.0)
    assert bump_shape_error(dents, 9.0, 0.0, view=0.0, reach=0.1) == 0.0
    assert brdf_shape_error(dents, 1e-6, 0.0, width=1.0, view=0.0, reach=0.1) == 2.0  # no period
    still = Relief(1e-4, 0.01, 2.0, 9.0, 3.0)
    far = {"width": 9.0, "view": 0.0, "reach": 0.1}
    assert brdf_shape_error(still, 1.0, 1.0, **far) < 1e-3
    assert brdf_shape_error(still, 1.0, 3.0, **far) == 2.0  # as coarse as the light


def test_light_that_shadows_the_relief_is_refused_by_the_largest_error():
    for error, more in (
        (flat_shape_error, {}),
        (bump_shape_error, {}),
        (brdf_shape_error, {"width": 1.0}),
    ):
        low, high = (
            float(error(Relief(1e-6, m, 0.0, 50.0), 1e-3, 0.0, view=0.1, reach=1.0, **more))
            for m in (0.64, 0.65)
        )  # tan(1) = 1.557
        assert low < 0.02
        assert high == 2.0


@pytest.mark.smoke
def test_what_is_out_of_range_is_one_sentence_or_nan():
    dents = Relief(1e-4, 0.01, 2.0, 50.0, 50.0)
    with pytest.raises(ValueError, match=r"Argument `view` must lie in \(-1.5708, 1.5708\)"):
        flat_shape_error(dents, 1.0, 0.0, view=1.6, reach=0.1)
    with pytest.raises(ValueError, match="Argument `reach` must"):
        bump_shape_error(dents, 1.0, 0.0, view=0.0, reach=1.6)
    with pytest.raises(ValueError, match="Argument `cutoff_x` must not be negative"):
        brdf_shape_error(dents, 1.0, -1.0, width=1.0, view=0.0, reach=0.1)
    with pytest.raises(ValueError, match="Argument `width` must be positive"):
        brdf_shape_error(dents, 1.0, 0.0, width=0.0, view=0.0, reach=0.1)
    with pytest.raises(ValueError, match=r"Argument `share` must lie in \(0, 1\)"):
        shape_cutoffs(1.0, dents, 1.0, 0.0, width=1.0, view=0.0, reach=0.1)
    with pytest.raises(TypeError, match="relief"):
        flat_shape_error(0.1, 1.0, 0.0, view=0.0, reach=0.1)

    @jax.jit
    def bounds(cutoff, width, view, reach, share):
        at = {"width": width, "view": view, "reach": reach}
        return brdf_shape_error(dents, cutoff, 0.0, **at), *shape_cutoffs(
            share, dents, cutoff, 0.0, **at
        )

    good = [1.0, 1.0, 0.1, 0.3, 0.1]
    assert not np.any(np.isnan(bounds(*good)))
    for place, wrong in enumerate((-1.0, -1.0, 1.6, 1.6, 1.5)):
        given = [*good]
        given[place] = wrong
        found = np.array(bounds(*given))
        assert np.all(np.isnan(found if place < 4 else found[1:]))


def test_gradients_are_finite_without_relief_and_where_a_pixel_leaves_nothing():
    def error(h, f, across):
        relief = Relief(h, 10.0 * h, 90.0 * h, f, across)
        return brdf_shape_error(relief, 1.0, 0.5, width=1.0, view=0.3, reach=0.4)

    kinds = (1e-4, 90.0, 90.0), (0.0, 1.0, 1.0), (1e-4, 90.0, np.inf), (0.0, 0.0, 1.0)
    for given in (*kinds, (1e-4, 0.1, 90.0)):
        slopes = jax.jit(jax.grad(error, (0, 1)))(*given)
        assert np.all(np.isfinite(slopes))
