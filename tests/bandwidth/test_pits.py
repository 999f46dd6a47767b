"""Bounds of what stands for pits, against rays between their walls and light that bounces there."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.bandwidth import _pit_rays as rays
from derivations.bandwidth.pits import corner, trough
from firstorder.bandwidth import PitCutoffs, pit_brdf_error, pit_cutoffs, pit_texture_error


def pits(count, seed):
    """Walls of any shape, caves too, each a mirror or rough, seen from anywhere."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        half = 0.5 * 10 ** rng.uniform(-2.0, 0.0)
        inner = rng.integers(1, 5)
        x = np.sort(rng.uniform(-1.0, 1.0, inner)) * half * rng.choice([1.0, 2.0])
        y = -half * 10 ** rng.uniform(-0.5, 0.5, inner)
        points = np.concatenate([[[-half, 0.0]], np.stack([x, y], -1), [[half, 0.0]]])
        yield points, rng.uniform(-1.0, 1.0), rng.uniform(size=inner + 1) < 0.5, rng


def seen(points, view, rough, albedo, rng, places=41, rays_each=400):
    """Where light leaves a pit of the width D, from each place of its opening: x, angle, weight."""
    u = points[-1, 0] * (2.0 * (np.arange(places) + 0.5) / places - 1.0)
    at = np.repeat(u, rays_each)
    found = rays.followed(at, view, points, albedo, rough, rng)
    return u, *(a.reshape(places, rays_each) for a in found)


@pytest.mark.smoke
def test_light_leaves_a_pit_by_its_opening_and_weighs_no_more_than_the_albedo():
    for points, view, rough, rng in pits(30, 1):
        _, x, theta, weight = seen(points, view, rough, 0.8, rng)
        out = weight > 0.0
        assert np.mean(out) > 0.5
        assert np.all(np.abs(x[out]) <= points[-1, 0] * (1.0 + 1e-9))
        assert np.all(np.abs(theta[out]) <= 0.5 * np.pi)
        assert weight.max() <= 0.8


def test_no_place_errs_by_more_than_the_bound_of_a_texture():
    """Of rough walls by their mean over 400 ways; of a texture nothing but the way is left out."""
    ratios = []
    for points, view, rough, rng in pits(60, 2):
        D, Bx, B, albedo = 2.0 * points[-1, 0], 10 ** rng.uniform(-1, 1), rng.uniform(0, 5), 0.9
        u, x, theta, weight = seen(points, view, rough, albedo, rng)
        light = weight * np.exp(2j * np.pi * B * theta)
        moved = np.mean(light * np.expm1(2j * np.pi * Bx * (x - u[:, None])), -1)
        found = float(pit_texture_error(D, Bx, albedo=albedo))
        assert np.abs(moved).max() <= found * (1.0 + 1e-9)
        ratios.append(found / np.abs(moved).max())
    assert np.median(ratios) < 8.0


def test_no_pixel_errs_by_more_than_the_bound_of_a_brdf():
    ratios = []
    for points, view, rough, rng in pits(40, 3):
        D, albedo = 2.0 * points[-1, 0], 0.9
        gap = rng.integers(0, 80)  # of the plane between pits, which mirrors, in 160ths of a pit
        period = D * (1.0 + gap / 160)
        width = rng.uniform(0.2, 0.8) * period
        Bx, B = 10 ** rng.uniform(-3.0, -0.4) / period, rng.uniform(0.0, 2.0)
        u, x, theta, weight = seen(points, view, rough, albedo, rng, places=160)
        texture = np.mean(weight * np.exp(2j * np.pi * B * theta), -1)
        way = np.exp(2j * np.pi * Bx * (x - u[:, None]))
        light = np.mean(weight * np.exp(2j * np.pi * B * theta) * way, -1)
        between = np.full(gap, albedo * np.exp(-2j * np.pi * B * view))
        light, texture = (np.concatenate([part, between]) for part in (light, texture))
        k = np.fft.fftfreq(light.size, period / light.size)
        kept = np.exp(-2.0 * (np.pi * width * (k + Bx)) ** 2)
        by_pits = np.fft.ifft(np.fft.fft(light) * kept)
        measured = np.abs(by_pits - texture.mean() * kept[0]).max()
        found = float(
            pit_brdf_error(D, 1.0 / period, Bx, width=width, albedo=albedo, share=D / period)
        )
        assert measured <= found * (1.0 + 1e-9)
        if found < 0.5:
            ratios.append(found / measured)
    assert np.median(ratios) < 20.0


def test_a_furnace_shows_no_more_than_the_albedo_and_more_bounces_than_one():
    half, u = 0.6, np.linspace(-0.65, 0.65, 20)  # nothing ends at the bottom
    one = rays.groove_light(u, 0.0, half, 0.8, lambda x, theta: 1.0 + 0.0 * x).real
    assert np.all(one < 0.8)
    assert one.min() > 0.8 * 0.5  # a wall sees less than half of the other
    white = rays.groove_light(u, 0.0, half, 1.0, lambda x, theta: 1.0 + 0.0 * x).real
    np.testing.assert_allclose(white, 1.0, rtol=1e-5)


@pytest.mark.parametrize("half", [0.3, 0.7])
def test_no_groove_that_lights_itself_errs_by_more_than_the_bound(half):
    """Forwards: walls get light by the opening and from each other, and the eye sees them."""
    D, albedo = 2.0 * np.tan(half), 0.9
    u = 0.5 * D * np.linspace(-0.99, 0.99, 40)
    for view in (0.0, 0.25):
        for Bx, B in ((0.05 / D, 0.0), (0.2 / D, 1.0), (0.5 / D, 3.0)):

            def light(x, theta, B=B, Bx=Bx):
                return np.exp(2j * np.pi * (Bx * x + B * theta))

            by_walls = rays.groove_light(u, view, half, albedo, light)
            texture = rays.groove_light(
                u, view, half, albedo, lambda x, theta, B=B: np.exp(2j * np.pi * B * theta)
            ) * np.exp(2j * np.pi * Bx * u)
            measured = np.abs(by_walls - texture).max()
            found = float(pit_texture_error(D, Bx, albedo=albedo))
            assert 0.02 * found < measured <= found


def test_mirrors_at_a_right_angle_reach_the_bound():
    D, Bx = 0.2, 1.3
    u = 0.5 * D * np.linspace(-0.9999, 0.9999, 40)
    x, theta, _ = rays.followed(u, 0.0, corner(D))
    np.testing.assert_allclose(x, -u, atol=1e-12, rtol=0.0)
    np.testing.assert_allclose(theta, 0.0, atol=1e-12, rtol=0.0)
    measured = np.abs(np.expm1(2j * np.pi * Bx * (x - u))).max()
    np.testing.assert_allclose(pit_texture_error(D, Bx), measured, rtol=1e-3)
    x, *_ = rays.followed(u[:1], 0.6, trough(D, 0.6))
    np.testing.assert_allclose(x - u[0], D, rtol=1e-4)


def test_boxes_of_mirrors_in_space_keep_their_bound_by_their_diagonal():
    rng, ratios = np.random.default_rng(5), []
    for _ in range(60):
        sides, depth = rng.uniform(0.1, 1.0, 2), 10 ** rng.uniform(-1.0, 1.0)
        view, azimuth = rng.uniform(0.0, 1.2), rng.uniform(0.0, 6.3)
        e = np.append(np.sin(view) * np.array([np.cos(azimuth), np.sin(azimuth)]), np.cos(view))
        u = rng.uniform(size=(2000, 2)) * sides
        x, w = rays.box(u, e, sides, depth)
        assert np.all((x >= 0.0) & (x <= sides))
        np.testing.assert_allclose(np.linalg.norm(w, axis=-1), 1.0)
        Bx, D = 10 ** rng.uniform(-1.0, 0.5), np.hypot(*sides)
        found = float(pit_texture_error(D, Bx))
        apart = x - u
        worst = apart[np.argmax(np.linalg.norm(apart, axis=-1))]
        Omega_x = Bx * worst / np.linalg.norm(worst)
        measured = np.abs(np.expm1(2j * np.pi * apart @ Omega_x)).max()
        assert measured <= found
        ratios.append(found / measured)
    assert np.median(ratios) < 2.5


def test_the_bound_of_a_brdf_is_what_is_written():
    """The formula of the docstring, in NumPy."""
    rng = np.random.default_rng(8)
    for _ in range(40):
        D, Bx = 10 ** rng.uniform([-3, -2], [0, 1])
        f, across, w = 20.0 * rng.uniform(1, 2), 20.0, 10 ** rng.uniform(-2.5, -1)
        albedo, share = rng.uniform(size=2)
        q = np.exp(-2.0 * (np.pi * w * (np.array([f, across]) - Bx)) ** 2)
        t, u = 2.0 * q**2 / (1.0 - q**6)
        chord = 2.0 * np.sin(min(np.pi * Bx * D, 0.5 * np.pi))
        expected = albedo * min(2.0, share * chord + np.sqrt(t + u + t * u))
        found = pit_brdf_error(
            D, f, Bx, width=w, frequency_across=across, albedo=albedo, share=share
        )
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_deep_pits_that_are_fine_for_a_pixel_are_a_brdf():
    fine = {"width": 0.01, "albedo": 0.7}
    errors = [float(pit_brdf_error(D, 1.0 / D, 0.05, **fine)) for D in (0.1, 0.01, 1e-3)]
    assert errors[0] > 1.0
    assert errors[1] < 0.01
    np.testing.assert_allclose(errors[2], 0.7 * 2.0 * np.sin(np.pi * 0.05 * 1e-3), rtol=1e-12)
    some = [float(pit_brdf_error(0.01, 1e4, 1.0, share=s, width=1.0)) for s in (0.5, 1.0)]
    np.testing.assert_allclose(some[0] / some[1], 0.5, rtol=1e-12)


@pytest.mark.parametrize("albedo", [1.0, 0.4])
@pytest.mark.parametrize("share", [0.02, 0.3])
def test_at_its_cutoff_each_bound_is_the_share(share, albedo):
    given = {"width": 0.01, "albedo": albedo}
    for across in (np.inf, 70.0):
        cut = pit_cutoffs(share, 80.0, 0.7, frequency_across=across, **given)
        assert isinstance(cut, PitCutoffs)
        found = float(pit_texture_error(cut.texture, 0.7, albedo=albedo))
        np.testing.assert_allclose(found, share, rtol=1e-9)
        found = float(pit_brdf_error(cut.brdf, 80.0, 0.7, frequency_across=across, **given))
        np.testing.assert_allclose(found, share, rtol=1e-9)
        steep = float(
            pit_brdf_error(
                0.0,
                cut.frequency,
                0.7,
                **given,
                frequency_across=min(across, float(cut.frequency))
                if np.isfinite(across)
                else across,
            )
        )
        assert steep <= share * (1.0 + 1e-9)
        assert steep > 0.99 * share


@pytest.mark.parametrize("across", [np.inf, 70.0])
def test_the_more_may_err_the_coarser_are_pits_that_a_pixel_averages(across):
    share = np.linspace(0.02, 0.98, 49)
    given = {"width": 0.01, "albedo": 0.5, "frequency_across": across}
    f = np.asarray(pit_cutoffs(share, 80.0, 0.7, **given).frequency)
    assert np.all(np.diff(f) <= 0.0)
    assert np.all(pit_brdf_error(0.0, f, 0.7, **given) <= share)


def test_nothing_limits_pits_that_are_black_enough_or_light_that_is_alike():
    assert np.isposinf(pit_cutoffs(0.5, 80.0, 0.7, width=1.0, albedo=0.2).texture)
    assert np.isposinf(pit_cutoffs(0.1, 80.0, 0.0, width=1.0).brdf)
    for albedo in (0.0, 1e-320):
        black = pit_cutoffs(0.1, 80.0, 0.7, width=1.0, albedo=albedo)
        assert np.isposinf(black.texture)
        assert np.isposinf(black.brdf)
    assert pit_cutoffs(0.1, 8.0, 0.0, width=1e-3).brdf == 0.0  # a pixel that sees each
    for width, albedo in ((1e-3, 0.0), (1e-3, 0.2), (0.03, 0.2)):  # and one that need not
        assert np.isposinf(pit_cutoffs(0.5, 8.0, 0.7, width=width, albedo=albedo).brdf)
    assert pit_brdf_error(1.0, 2.0, 2.0, width=1.0, albedo=0.3) == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("words", "call"),
    [
        ("`opening` must not be negative", lambda: pit_texture_error(-1.0, 1.0)),
        ("`cutoff_x` must not be negative", lambda: pit_texture_error(1.0, -1.0)),
        (r"`albedo` must lie in \[0, 1\]", lambda: pit_texture_error(1.0, 1.0, albedo=1.1)),
        ("`frequency` must not be negative", lambda: pit_brdf_error(1.0, -1.0, 1.0, width=1.0)),
        ("`width` must be positive", lambda: pit_brdf_error(1.0, 1.0, 1.0, width=0.0)),
        (
            r"`share` must lie in \[0, 1\]",
            lambda: pit_brdf_error(1.0, 1.0, 1.0, width=1.0, share=2.0),
        ),
        (
            "`frequency_across` must be positive",
            lambda: pit_brdf_error(1.0, 1.0, 1.0, width=1.0, frequency_across=0.0),
        ),
        (r"`share` must lie in \(0, 1\)", lambda: pit_cutoffs(1.0, 1.0, 1.0, width=1.0)),
    ],
)
def test_what_is_no_pit_is_one_sentence(words, call):
    with pytest.raises(ValueError, match=f"Argument {words}"):
        call()


@pytest.mark.smoke
def test_traced_numbers_of_no_pit_give_nan():
    @jax.jit
    def bounds(opening, f, Bx, width, albedo, share, across):
        more = {"width": width, "albedo": albedo, "frequency_across": across}
        return jnp.stack(
            [
                pit_brdf_error(opening, f, Bx, share=share, **more),
                *pit_cutoffs(share, f, Bx, **more),
            ]
        )

    good = [0.1, 20.0, 1.0, 0.1, 0.5, 0.5, 20.0]
    assert np.all(np.isfinite(bounds(*good)))
    for place, wrong in enumerate((-0.1, -1.0, -1.0, 0.0, 1.5, 1.5, 0.0)):
        given = [*good]
        given[place] = wrong
        found = bounds(*given)
        assert jnp.isnan(found[0])
        assert place == 0 or np.all(np.isnan(found[1:]))


@pytest.mark.parametrize("across", [1.0, 100.0, np.inf])
def test_a_row_that_no_pixel_averages_is_bounded_by_twice_the_albedo(across):
    """However little the rows beside it leave."""

    def error(width):
        given = {"width": width, "frequency_across": across, "albedo": 0.5}
        return pit_brdf_error(0.01, 1.0, 2.0, **given)

    assert jax.value_and_grad(error)(1.0) == (1.0, 0.0)


def test_gradients_are_finite_at_the_ends():
    def both(opening, share, albedo):
        found = pit_cutoffs(share, 80.0, 0.7, width=0.01, albedo=albedo)
        return pit_texture_error(opening, 0.7, albedo=albedo) + found.texture + found.brdf

    for given in ((0.0, 0.1, 0.5), (9.0, 0.1, 1.0), (0.1, 1e-9, 1.0)):
        assert np.all(np.isfinite(jax.grad(both, (0, 1, 2))(*given)))
