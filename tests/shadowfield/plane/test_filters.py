import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.fields import Constant, GaussianProfile
from firstorder.shadowfield import (
    PLANE,
    RayFilter,
    Wedge,
    axis_aligned_filter,
    reconstruct_irradiance,
    sheared_filter,
    to_two_planes,
)
from firstorder.shadowfield.plane import filters

D1, NEAR, FAR = 1.0, 0.25, 0.5  # slopes 1 and 3
HIGH, PIX = 2.0, 16.0


def sheared(d1=D1, near=NEAR, high=HIGH, margin=0.0):
    return sheared_filter(d1, near, FAR, high, PIX, margin)


@pytest.mark.smoke
def test_scale_and_shear_are_those_that_the_paper_prints():
    k = sheared()
    reach = [1.0 / (D1 / d - 1.0) for d in (FAR, NEAR)]
    assert abs(k.primal_scale - 2 * PIX / HIGH / (reach[0] - reach[1])) < 1e-12
    assert abs(k.primal_shear + 0.5 * (reach[0] + reach[1])) < 1e-14


def test_of_blockers_at_a_single_depth_the_footprint_has_no_end_and_the_wedges_shear():
    k = sheared(near=FAR, margin=0.1)
    assert k.width == 0.0
    assert k.primal_scale == np.inf
    assert abs(k.primal_shear + 1.0) < 1e-14  # their lines are 1 / slope = 1 / (D1 / FAR - 1)


def test_the_filter_touches_the_wedge_at_the_lights_band_limit():
    k, wedge = sheared(), Wedge(NEAR, FAR)
    a, b = wedge.slopes(D1)
    ends = sorted((s * HIGH / float(m), s * HIGH) for s in (1, -1) for m in (a, b))
    np.testing.assert_allclose(sorted(np.asarray(k.corners()).tolist()), ends, rtol=0.0, atol=1e-12)
    t = np.linspace(-1.0, 1.0, 41)
    for d2 in np.linspace(NEAR, FAR, 9):
        x, y = wedge.direction(d2, D1)
        assert np.all(k.contains(0.999999 * t * HIGH * x / y, 0.999999 * t * HIGH))
    # A hair wider at the top, and the wedge's ends stick out: it is as small as it can be.
    slim = RayFilter(0.99 * k.width, k.shear, HIGH, PIX)
    assert not slim.contains(HIGH / float(a), HIGH)


@pytest.mark.parametrize("near", [NEAR, FAR])
def test_corners_and_area_are_those_of_what_passes_soft_edges_included(near):
    """By quadrature of the kernel; both once left out the margin, and so did sampling rates."""
    k = sheared(near=near, margin=0.5)
    x = np.linspace(-20.0, 20.0, 40001)
    half = float(np.max(np.asarray(k.corners())[:, 0]) - k.shear * HIGH)
    Omega = np.linspace(-2.0 * half, 2.0 * half, 401)
    weight = (x[1] - x[0]) * np.asarray(k.across(x))
    passed = np.cos(2.0 * np.pi * Omega[:, None] * x) @ weight
    np.testing.assert_allclose(passed[np.abs(Omega) > half], 0.0, rtol=0.0, atol=1e-8)
    assert np.all(passed[np.abs(Omega) < half - k.margin] > 0.4)
    area = 2.0 * HIGH * (Omega[1] - Omega[0]) * np.sum(passed)
    np.testing.assert_allclose(k.area, area, rtol=1e-9)


def test_the_matrix_takes_the_simple_box_to_the_filter():
    k, box = sheared(), axis_aligned_filter(HIGH, PIX)
    rng = np.random.default_rng(0)
    w = rng.uniform(-1.2, 1.2, (400, 2)) * [PIX, HIGH]
    moved = w @ np.asarray(k.frequency_matrix).T
    np.testing.assert_array_equal(box.contains(*w.T), k.contains(*moved.T))
    np.testing.assert_allclose(
        axis_aligned_filter(HIGH, PIX).frequency_matrix, np.eye(2), rtol=0.0, atol=1e-15
    )


def test_frequencies_and_footprints_are_dual():
    """A phase Omega . u keeps its value when both are moved."""
    k = sheared()
    u, Omega = np.array([0.3, -0.2]), np.array([1.5, 0.7])
    moved = (k.primal_matrix @ u) @ (k.frequency_matrix @ Omega)
    assert abs(moved - u @ Omega) < 1e-14
    on_light = k.light_matrix(D1) @ u
    x, y = k.primal_matrix @ u
    np.testing.assert_allclose(on_light, [y, (x - y) / D1], rtol=0.0, atol=1e-14)


def test_the_steps_to_the_ray_database_are_a_shear_and_a_scale():
    """E11 (11), (12): in the order (v, y), x sheared by -1 per y and scaled by 1 / d1."""
    d1 = 1.7
    steps = np.diag([1.0 / d1, 1.0]) @ np.array([[1.0, -1.0], [0.0, 1.0]])
    np.testing.assert_allclose(np.asarray(to_two_planes(d1).M)[::-1], steps, rtol=0.0, atol=1e-15)


def test_the_footprint_follows_blockers_of_a_middle_depth():
    """Along the filter's middle line the rays meet in one point of a plane in between."""
    k = sheared()
    step_y, step_v = k.light_matrix(D1) @ np.array([1.0, 0.0])
    depth = float(-step_y / step_v)
    assert NEAR < depth < FAR


def test_the_kernel_passes_what_is_inside_and_stops_what_is_outside():
    k = sheared(margin=0.6)
    x, y = np.linspace(-12.0, 12.0, 1201), np.linspace(-40.0, 40.0, 2001)
    weights = (x[1] - x[0]) * (y[1] - y[0])

    def response(Omega_x, Omega_y):
        # Along y the sinc is sharp: only well inside or outside its band is there an answer.
        wave = np.exp(-2j * np.pi * (Omega_x * x[:, None] + Omega_y * y))
        return np.sum(np.asarray(k.kernel(x[:, None], y)) * wave) * weights

    s, half = float(k.shear), 0.5 * float(k.width)
    assert abs(response(s * 0.5 + 0.9 * half, 0.5) - 1.0) < 0.02
    assert abs(response(s * 0.5 + half + 1.3, 0.5)) < 0.02
    assert abs(response(s * 0.5 - half - 1.3, 0.5)) < 0.02


# --- reconstruction ------------------------------------------------------------------------------

LIGHT, SIGMA = GaussianProfile(0.3, "y", PLANE), 0.3
STRIPS = ((0.25, 0.1, 1.4), (0.35, -0.3, 1.5), (0.5, 0.4, 2.0))  # depth, middle, frequency


def dimming(x, y):
    """A sum of smooth bands at three depths: no product, so the wedge is exact."""
    f = np.zeros(np.broadcast(x, y).shape)
    for d2, middle, Omega in STRIPS:
        u = y + (x - y) * d2 / D1 - middle
        f = f + np.exp(-0.5 * (u / 0.35) ** 2) * np.cos(2 * np.pi * Omega * u)
    return f


def truth(x):
    y = np.linspace(-4.5, 4.5, 3001)
    light = np.exp(-0.5 * (y / SIGMA) ** 2) / (SIGMA * np.sqrt(2 * np.pi))
    return np.sum(dimming(x[:, None], y) * light, axis=1) * (y[1] - y[0])


def regular(dx, dy, reach=(7.0, 9.0)):
    x = np.arange(-reach[0], reach[0], dx) + 0.31 * dx
    y = np.arange(-reach[1], reach[1], dy) + 0.17 * dy
    X, Y = (a.ravel() for a in np.meshgrid(x, y, indexing="ij"))
    return (X, Y, dimming(X, Y)), dx * dy


X = np.linspace(-0.8, 0.9, 12)


@pytest.mark.smoke
def test_a_sheared_filter_rebuilds_the_shadow_from_few_rays_and_a_simple_one_does_not():
    """Both on the same rays: 4.5 a metre along the receiver, where pixels ask for 32."""
    k = sheared(margin=0.7)
    samples, cell = regular(1 / 4.5, 1 / 13.0)
    shadow = truth(X)
    scale = np.max(np.abs(truth(np.linspace(-1.5, 1.5, 301))))
    good = reconstruct_irradiance(k, LIGHT, X, samples, cell)
    poor = reconstruct_irradiance(axis_aligned_filter(HIGH, PIX), LIGHT, X, samples, cell)
    # The kernel's taper (deviation 6 / (2 pi margin)) is cut 7 m away: exp(-13).
    assert np.max(np.abs(good - shadow)) < 2e-6 * scale
    assert np.max(np.abs(poor - shadow)) > 0.1 * scale


def test_enough_rays_serve_the_simple_filter_too():
    samples, cell = regular(1 / 32.0, 1 / 13.0, (7.0, 3.5))
    found = reconstruct_irradiance(axis_aligned_filter(HIGH, PIX, 1.0), LIGHT, X, samples, cell)
    assert np.max(np.abs(found - truth(X))) < 1e-6


def test_scattered_rays_are_weighed_against_each_other():
    """Where nothing stands in the way all of the light arrives, whatever the rays."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-4, 4, 5000), rng.uniform(-4, 4, 5000)
    share = reconstruct_irradiance(sheared(margin=0.7), LIGHT, X, (x, y, np.ones(5000)))
    np.testing.assert_allclose(share, 1.0, rtol=0.0, atol=1e-12)


FAULTS = {
    "sheared the other way": lambda k: RayFilter(k.width, -k.shear, HIGH, PIX, k.margin),
    "twice the shear": lambda k: RayFilter(k.width, 2.0 * k.shear, HIGH, PIX, k.margin),
    "six times the width": lambda k: RayFilter(6.0 * k.width, k.shear, HIGH, PIX, k.margin),
    "no margin": lambda k: RayFilter(k.width, k.shear, HIGH, PIX, 0.0),
    "width for half width": lambda k: RayFilter(0.5 * k.width, k.shear, HIGH, PIX, 0.25 * k.margin),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_filter_shows(fault):
    samples, cell = regular(1 / 4.5, 1 / 13.0)
    found = reconstruct_irradiance(FAULTS[fault](sheared(margin=0.7)), LIGHT, X, samples, cell)
    assert np.all(np.isfinite(found))
    scale = np.max(np.abs(truth(X)))
    assert np.max(np.abs(found - truth(X))) > 1e-3 * scale


@pytest.mark.smoke
def test_where_there_is_no_sheared_filter_it_says_so():
    with pytest.raises(ValueError, match="a receiver among the blockers has no sheared filter"):
        sheared(d1=0.4)
    with pytest.raises(
        ValueError, match=r"^Argument `margin` must be positive for blockers at a si"
    ):
        sheared(near=FAR)
    with pytest.raises(ValueError, match=r"^Argument `Omega_y_max` must be positive, but is 0.0.$"):
        sheared(high=0.0)
    assert np.isfinite(sheared(near=FAR, margin=0.5).area)
    traced = jax.jit(lambda d1: filters.sheared_filter(d1, NEAR, FAR, HIGH, PIX).width)
    assert np.isnan(traced(0.4))
    slope = jax.grad(lambda d1: filters.sheared_filter(d1, NEAR, FAR, HIGH, PIX).width)(1.0)
    assert slope < 0.0
    assert jnp.isfinite(slope)
    with pytest.raises(ValueError, match=r"^Argument `margin` must not be negative, but is -1.0.$"):
        axis_aligned_filter(HIGH, PIX, margin=-1.0)


def test_traced_band_limits_and_margins_that_are_refused_make_no_filter():
    for make in (
        jax.jit(functools.partial(sheared_filter, D1, NEAR, FAR)),
        jax.jit(axis_aligned_filter),
    ):
        assert np.isfinite(make(HIGH, PIX, 0.5).width)
        for numbers in ((-HIGH, PIX, 0.5), (HIGH, -PIX, 0.5), (HIGH, PIX, -0.5)):
            assert np.isnan(make(*numbers).width)


# --- properties ----------------------------------------------------------------------------------

MANY = np.random.default_rng(12)
FEET = MANY.uniform(-1.0, 1.0, 200), MANY.uniform(-1.0, 1.0, 200)
SEEN = MANY.random((2, 200))
NEARBY = st.floats(-0.5, 0.5)
MIXED = st.tuples(st.floats(0.0, 5.0), st.floats(0.0, 5.0))


@functools.partial(jax.jit, static_argnums=0)
def _filtered(normalised, x, feet, seen, scale, L):
    """The filter's answer at a place, all lengths in another unit, the light L times as bright."""
    k = sheared_filter(
        scale * D1, scale * NEAR, scale * FAR, HIGH / scale, PIX / scale, 0.6 / scale
    )
    light = GaussianProfile(scale * SIGMA, "y", PLANE, weight=L * scale)  # as high in any unit
    samples = scale * feet[0], scale * feet[1], seen
    area = 1.0 if normalised else 1e-2 * scale**2
    cell = None if normalised else 1.0
    return area * reconstruct_irradiance(k, light, scale * x[None], samples, cell)[0]


def answer(x, seen, shift=0.0, scale=1.0, L=1.0, normalised=False):
    feet = FEET[0] + shift, FEET[1]
    given = (x + shift, feet, seen, scale, L)
    return float(_filtered(normalised, *jax.tree.map(jnp.asarray, given)))


@given(NEARBY, MIXED)
def test_the_filter_is_linear_in_what_is_seen(x, weights):
    parts = [answer(x, seen) for seen in SEEN]
    np.testing.assert_allclose(
        answer(x, weights @ SEEN), weights @ np.array(parts), rtol=0.0, atol=1e-12
    )


@given(NEARBY, st.floats(-2.0, 2.0))
def test_what_is_seen_alike_everywhere_passes(x, value):
    """Its share of the light, however the samples lie."""
    assert abs(answer(x, np.full(200, value), normalised=True) - value) < 1e-12


@given(NEARBY, st.floats(-3.0, 3.0), st.floats(0.1, 10.0), st.floats(0.1, 10.0))
def test_the_filter_knows_no_place_no_unit_and_no_brightness(x, shift, scale, L):
    """Moved along the receiver nothing changes; h has the unit of light times a length."""
    rest, share = answer(x, SEEN[0]), answer(x, SEEN[0], normalised=True)
    moved = answer(x, SEEN[0], shift=shift, scale=scale, L=L)
    np.testing.assert_allclose(moved, L * scale * rest, rtol=1e-9, atol=1e-10 * L * scale)
    again = answer(x, SEEN[0], shift=shift, scale=scale, L=L, normalised=True)
    np.testing.assert_allclose(again, share, rtol=1e-7, atol=1e-9)


def test_samples_are_as_many_places_as_values():
    k, even, x = axis_aligned_filter(1.0, 4.0), Constant(1.0, PLANE), np.zeros(3)
    with pytest.raises(
        ValueError, match=r"^Argument `samples` must have shape \(3,\), but has \(2,"
    ):
        reconstruct_irradiance(k, even, np.zeros(1), (x, x, np.ones(2)))
    with pytest.raises(ValueError, match=r"^Argument `cell` must be positive, but is -1.0"):
        reconstruct_irradiance(k, even, np.zeros(1), (x, x, x), -1.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"width": -2.0}, "`width` must not be negative, but is -2.0"),
        ({"shear": np.nan}, "`shear` must be finite, but is nan"),
        ({"Omega_y_max": 0.0}, "`Omega_y_max` must be positive, but is 0.0"),
        ({"Omega_pix": -8.0}, "`Omega_pix` must be positive, but is -8.0"),
        ({"margin": -1.0}, "`margin` must not be negative, but is -1.0"),
        ({"width": 2j}, "`width` must be real"),
        ({"shear": np.ones(2)}, "`shear` must be one number"),
    ],
)
def test_a_filter_is_made_of_numbers_that_make_one(given, words):
    right = dict(width=2.0, shear=0.5, Omega_y_max=4.0, Omega_pix=8.0)
    with pytest.raises((ValueError, TypeError), match=f"^Argument {words}|type hint"):
        filters.RayFilter(**right | given)
