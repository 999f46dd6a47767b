"""Bounds of what stands for relief, against rays that meet the waves one by one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import jv

from derivations.bandwidth import _relief_rays as rays
from firstorder.bandwidth import (
    ReliefCutoffs,
    brdf_relief_error,
    bump_relief_error,
    flat_relief_error,
    relief_cutoffs,
    relief_transfer,
)

U = np.linspace(0.0, 1.0, 801)  # of a period


def configurations(count, seed):
    """Waves that light does not shadow, seen from anywhere: columns of numbers by name."""
    rng = np.random.default_rng(seed)
    f, slope = 10 ** rng.uniform(0.0, 2.0, count), 10 ** rng.uniform(-3.0, -0.3, count)
    view = rng.uniform(-1.0, 1.0, count)
    reach = np.abs(view) + 2.0 * np.arctan(slope)
    bands = 10 ** rng.uniform(-1.0, 1.0, count), 10 ** rng.uniform(-2.0, 1.0, count)
    keep = (reach < 1.5) & (slope * np.tan(np.minimum(reach, 1.5)) < 1.0)
    table = dict(a=slope / (2.0 * np.pi * f), f=f, B=bands[0], Bx=bands[1], view=view, reach=reach)
    return {name: column[keep] for name, column in table.items()}


def rows(table):
    return [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)]


def wave(place, B, Bx):
    """Light of one frequency pair; of its real waves the worst phase is off by a modulus."""
    x, theta = place
    return np.exp(2j * np.pi * (Bx * x + B * theta))


def ray_error(c, replaced):
    """Largest difference of light by waves from light by what replaces them, over a period."""
    at = (U / c["f"], c["a"], c["f"], c["view"])
    light = [wave(by(*at), c["B"], c["Bx"]) for by in (rays.traced, replaced)]
    return np.abs(light[0] - light[1]).max()


def mean_light(c):
    """Share of a flat mirror's distant light that a whole wave sends to the eye."""
    u = np.arange(512) / (512 * c["f"])
    _, theta = rays.traced(u, c["a"], c["f"], c["view"])
    return np.mean(wave((0.0, theta + c["view"]), c["B"], 0.0))


def pixel_error(c, width):
    """Largest difference of what a pixel gets from waves and from their mean, as a BRDF."""

    def light(u):
        return wave(rays.traced(u, c["a"], c["f"], c["view"]), c["B"], c["Bx"])

    middles, seen = rays.averaged(light, width, 1.0 / c["f"], 128)
    blurred = np.exp(-2.0 * (np.pi * width * c["Bx"]) ** 2)
    mirrored = wave((middles, -c["view"]), c["B"], c["Bx"]) * blurred
    return np.abs(seen - mean_light(c) * mirrored).max()


def bound(error, t, **more):
    return np.asarray(
        error(t["a"], t["f"], t["B"], t["Bx"], view=t["view"], reach=t["reach"], **more)
    )


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("error", "replaced"), [(flat_relief_error, rays.flat), (bump_relief_error, rays.bumped)]
)
def test_no_ray_errs_by_more_than_the_bound_and_some_by_as_much(error, replaced):
    table = configurations(150, 1)
    measured = np.array([ray_error(c, replaced) for c in rows(table)])
    found = bound(error, table)
    assert np.all(measured <= found * (1.0 + 1e-9))
    small = found < 0.5  # beyond, a chord is shorter than its arc
    assert np.median((found / measured)[small]) < 1.02
    assert np.max((found / measured)[small]) < 2.0


def test_no_pixel_errs_by_more_than_the_bound_of_a_brdf():
    table = configurations(40, 2)
    width = 10 ** np.random.default_rng(3).uniform(-1.0, -0.3, table["f"].size) / table["f"]
    measured = np.array([pixel_error(c, w) for c, w in zip(rows(table), width, strict=True)])
    found = bound(brdf_relief_error, table, width=width)
    assert np.all(measured <= found * (1.0 + 1e-9) + 1e-12)
    small = (found < 0.5) & (found > 1e-6)
    assert np.median((found / measured)[small]) < 1.5


def test_parallax_changes_what_a_pixel_gets_in_second_order_only():
    """Light that hardly turns with its angle: all of the error is the parallax of a lamp."""
    c = dict(f=40.0, B=0.02, Bx=3.0, view=0.5, reach=0.6)
    heights = np.array([2e-4, 4e-4])
    found = [pixel_error(c | {"a": a}, 0.05) for a in heights]
    assert abs(np.log2(found[1] / found[0]) - 2.0) < 0.05
    table = {name: np.full(2, value) for name, value in c.items()} | {"a": heights}
    assert np.all(found <= bound(brdf_relief_error, table, width=0.05))


def test_all_normals_alike_are_wrong_by_the_slope_however_fine_the_waves():
    """What the eye sees of a facet counts: the error of a BRDF that forgets it does not fall."""
    c = dict(B=0.5, Bx=0.0, view=1.0)
    off = []
    for f in (1e2, 1e4):
        mean = mean_light(c | {"f": f, "a": 0.2 / (2.0 * np.pi * f)})
        off.append(abs(complex(relief_transfer(c["B"], 0.2)) - mean))
    np.testing.assert_allclose(off[0], off[1], rtol=1e-6)
    first = 0.2 * np.tan(1.0) * jv(1, 4.0 * np.pi * c["B"] * 0.2)
    np.testing.assert_allclose(off[0], first, rtol=0.2**2)


def test_bumps_seen_from_the_side_err_by_their_slope_however_small_the_waves():
    fine = configurations(60, 5)
    fine["Bx"] = 0.0 * fine["Bx"]
    errors = [ray_error(c | {"f": k * c["f"], "a": c["a"] / k}, rays.bumped)
              for c in rows(fine)[:4] for k in (1.0, 100.0)]  # fmt: skip
    np.testing.assert_allclose(errors[::2], errors[1::2], rtol=1e-6)


@pytest.mark.parametrize("share", [0.02, 0.3])
def test_at_its_cutoff_each_bound_is_the_share(share):
    t = configurations(60, 6)
    width = 0.3 / t["f"]
    cut = relief_cutoffs(
        share, t["f"], t["B"], t["Bx"], width=width, view=t["view"], reach=t["reach"]
    )
    steep = np.tan(t["reach"])
    for amplitude, error, more in (
        (cut.flat, flat_relief_error, {}),
        (cut.bumps, bump_relief_error, {}),
        (cut.brdf, brdf_relief_error, {"width": width}),
    ):
        at = t | {"a": np.asarray(amplitude) * (1.0 - 1e-12)}
        found, limit = bound(error, at, **more), 2.0 * np.pi * t["f"] * at["a"] * steep
        free = (limit < 0.999) & (at["a"] > 0.0)
        assert np.sum(free) > 10
        np.testing.assert_allclose(found[free], share, rtol=1e-9)
        assert np.all(found[at["a"] > 0.0] <= share * (1.0 + 1e-9))


def test_from_the_pixels_frequency_on_a_brdf_does_for_any_slope():
    found = relief_cutoffs(0.1, 1.0, 5.0, 2.0, width=0.01, view=0.0, reach=0.0)
    steep = dict(width=0.01, view=0.0, reach=0.0)
    left = [float(brdf_relief_error(1.0, k * found.frequency, 50.0, 0.0, **steep))
            for k in (1.0, 0.9)]  # fmt: skip
    near = float(brdf_relief_error(1e-9, found.frequency, 1e9, 2.0, **steep))
    assert left[0] < near <= 0.1 < left[1]
    assert near > 0.0999


@pytest.mark.parametrize("amplitude", [0.0, 1e-6])
def test_waves_no_finer_than_the_light_are_no_brdf_however_low(amplitude):
    """A pixel leaves what waves and light beat together, as slowly as their frequencies differ."""
    found = [
        float(brdf_relief_error(amplitude, f, 1.0, 1.0, width=0.01, view=0.2, reach=0.3))
        for f in (0.5, 1.0, 2.0)
    ]
    assert found[:2] == [2.0, 2.0]
    assert (found[2] > 0.0) == (amplitude > 0.0)
    assert found[2] < 2e-3


def test_light_that_shadows_the_waves_is_refused_by_the_largest_error():
    for error, more in (
        (flat_relief_error, {}),
        (bump_relief_error, {}),
        (brdf_relief_error, {"width": 1.0}),
    ):
        low, high = (
            float(error(a, 1.0, 1e-3, 0.0, view=0.1, reach=1.0, **more)) for a in (0.1, 0.11)
        )
        assert low < 0.02  # 2 pi 0.1 tan(1) = 0.98
        assert high == 2.0


@pytest.mark.smoke
def test_what_is_out_of_range_is_one_sentence_or_nan():
    with pytest.raises(ValueError, match="Argument `frequency` must be positive"):
        flat_relief_error(0.1, 0.0, 1.0, 0.0, view=0.0, reach=0.1)
    with pytest.raises(ValueError, match=r"Argument `share` must lie in \(0, 1\)"):
        relief_cutoffs(2.0, 1.0, 1.0, 0.0, width=1.0, view=0.0, reach=0.1)
    assert abs(relief_transfer(34.3, 0.5)) < 1.0  # 4 pi Omega arctan(m) = 199.8
    with pytest.raises(ValueError, match=r"4 pi Omega arctan\(slope\)"):
        relief_transfer(34.4, 0.5)
    with pytest.raises(ValueError, match=r"slope \* \|tan\(view\)\|"):
        relief_transfer(1.0, 0.9, 1.0)
    traced = jax.jit(lambda w: brdf_relief_error(0.1, 1.0, 1.0, 0.0, width=w, view=0.0, reach=0.1))
    assert jnp.isnan(traced(-1.0))
    assert jnp.isnan(jax.jit(relief_transfer)(1.0, 0.9, 1.0))
    for below in (-1.7, 1.7):  # the base's horizon
        with pytest.raises(ValueError, match=r"Argument `view` must lie in \(-1.5708, 1.5708\)"):
            relief_transfer(1.0, 0.01, below)
        assert jnp.isnan(jax.jit(relief_transfer)(1.0, 0.01, below))


def test_gradients_are_finite_where_a_pixel_leaves_nothing_and_where_there_are_no_waves():
    def error(a, f):
        return brdf_relief_error(a, f, 1.0, 0.5, width=1.0, view=0.3, reach=0.4)

    slopes = jax.jit(jax.vmap(jax.grad(error, (0, 1))))(
        jnp.array([1e-4, 0.0]), jnp.array([90.0, 1.0])
    )
    assert np.all(np.isfinite(slopes))


@pytest.mark.parametrize("amplitude", [0.0, 1e-3])
def test_what_a_small_pixel_sees_of_no_modulation_is_nothing(amplitude):
    at = (amplitude, 1.0, 0.0 if amplitude else 2.0, 0.0)
    assert brdf_relief_error(*at, width=1e-12, view=0.3, reach=0.5) == 0.0


def test_gradients_are_finite_where_waves_are_no_finer_than_the_light():
    def error(a):
        return brdf_relief_error(a, 1.0, 2.0, 3.0, width=0.1, view=0.3, reach=0.5)

    assert jax.grad(error)(1e-3) == 0.0


def test_nothing_limits_waves_under_light_that_is_the_same_everywhere():
    found = relief_cutoffs(0.1, 1.0, 0.0, 0.0, width=1.0, view=0.3, reach=0.0)
    assert isinstance(found, ReliefCutoffs)
    assert np.isposinf(found.flat)
    assert np.isposinf(found.bumps)
    np.testing.assert_allclose(found.brdf, 1.0 / (2.0 * np.pi * np.tan(0.3)))


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("view", lambda: flat_relief_error(0.1, 1.0, 1.0, 0.0, view=0.5 * np.pi, reach=0.1)),
        ("reach", lambda: flat_relief_error(0.1, 1.0, 1.0, 0.0, view=0.0, reach=0.5 * np.pi)),
        ("share", lambda: relief_cutoffs(0, 1.0, 1.0, 0.0, width=1.0, view=0.0, reach=0.1)),
        ("share", lambda: relief_cutoffs(1, 1.0, 1.0, 0.0, width=1.0, view=0.0, reach=0.1)),
        ("view", lambda: relief_transfer(1.0, 0.1, 0.5 * np.pi)),
    ],
)
def test_the_end_of_an_open_range_is_refused_as_what_is_beyond(name, call):
    with pytest.raises(ValueError, match=f"Argument `{name}` must"):
        call()
