"""Distant light: irradiance by quadrature, terms against autodiff, shadows that cross a sky."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL, chi_square
from firstorder.checks.tolerance import fitted_order
from firstorder.imaging import Lamp
from firstorder.imaging._area_lights import SurfaceReflectance, lobe_radiance, shadow_edge_terms
from firstorder.imaging._point_shading import oriented_light
from firstorder.imaging._reflection import surface_point
from firstorder.imaging.shading import _shadow_rays
from firstorder.imaging.sky_lights import (
    CosineSkyLight,
    DistantLight,
    _by_luminance,
    _dome,
    distant_lamp,
    sky_light,
)
from firstorder.numerics._vectors import orthonormal_frame
from firstorder.space import Scene, primitive, sphere
from firstorder.space.skies import ConstantSky, GaussianSky, HarmonicSky, _harmonics

SKY = GaussianSky((0.3, 0.2, 1.0), 0.4, 2.0)
UP = jnp.array([0.0, 0.0, 1.0])
MATTE = SurfaceReflectance(1.0)
jitted = eqx.filter_jit(lobe_radiance)
sky_radiance = jax.jit(jax.vmap(SKY))


def floor(x=(0.0, 0.0, 0.0), S=((0.0, 0.0), (0.0, 0.0))):
    return surface_point(jnp.asarray(x), jnp.eye(3), jnp.asarray(S))


@functools.cache
def irradiance():
    """By Gauss and Legendre in z and even azimuths."""
    z, w = np.polynomial.legendre.leggauss(200)
    z, w = 0.5 * (z + 1.0), 0.5 * w
    phi = 2.0 * np.pi * np.arange(400) / 400
    s = np.sqrt(1.0 - z * z)[:, None]
    d = np.stack([s * np.cos(phi), s * np.sin(phi), np.broadcast_to(z[:, None], (200, 400))], -1)
    L = np.asarray(sky_radiance(d.reshape(-1, 3))).reshape(200, 400)
    return np.sum(w[:, None] * z[:, None] * L) * 2.0 * np.pi / 400


def gathered(light):
    diffuse, _ = jitted(light, jnp.ones(len(light.way)), floor(), UP, MATTE)
    np.testing.assert_array_equal(diffuse.SV, 0.0)  # distant light
    return np.pi * float(diffuse.value)


def test_irradiance_comes_out_with_more_nodes():
    """To second order, for a smooth sky in even cells."""
    rows = (8, 16, 32)
    errors = [abs(gathered(_dome(SKY, n)) / irradiance() - 1.0) for n in rows]
    assert fitted_order(rows, errors) < -1.3
    assert errors[-1] < 1.0 / 32**1.3


def test_luminance_gives_each_node_as_much_light():
    """The middles of n rows err by half the integrand's variation over n: here 1.3 of its mean."""
    shifts = (np.stack(np.meshgrid(np.arange(4), np.arange(4)), -1).reshape(-1, 2) + 0.5) / 4 - 0.5
    lights = [_by_luminance(SKY, 8, tuple(s)) for s in shifts]
    errors = np.array([gathered(light) for light in lights]) / irradiance() - 1.0
    assert np.all(np.abs(errors) < 0.5 * 1.3 / 8)
    assert abs(errors.mean()) < 0.5 * 1.3 / 32  # of four shifts times eight rows
    sent = np.asarray(lights[0].radiance) * np.linalg.norm(lights[0].area, axis=1)
    bright = np.asarray(lights[0].radiance) > 0.2
    assert np.ptp(sent[bright]) < 0.2 * np.mean(sent[bright])


def test_luminance_puts_nodes_where_light_is():
    """At equal numbers a small sun is met by many more of its own nodes."""
    sun = GaussianSky((0.0, 0.6, 0.8), 0.05)
    near = [
        np.mean(light(sun, 8).way @ np.array([0.0, 0.6, 0.8]) > 0.98)
        for light in (_dome, _by_luminance)
    ]
    assert near[0] < 0.02
    assert near[1] > 0.9


def test_shifted_nodes_average_to_the_sky():
    """Progressive passes: the mean over shifts errs less than one pass."""
    true = irradiance()
    shifts = (np.stack(np.meshgrid(np.arange(4), np.arange(4)), -1).reshape(-1, 2) + 0.5) / 4 - 0.5
    values = [
        np.pi
        * float(lobe_radiance(_dome(SKY, 4, tuple(s)), jnp.ones(32), floor(), UP, MATTE)[0].value)
        for s in shifts
    ]
    assert abs(np.mean(values) - true) < 0.1 * np.mean(np.abs(np.array(values) - true))


@pytest.mark.parametrize("nodes", [_dome, _by_luminance])
def test_shifted_nodes_of_an_even_sky_are_so_far_out_of_the_middles_of_even_cells(nodes):
    light = nodes(ConstantSky(2.0), 4, (0.3, -0.2))
    x, y, z = np.asarray(light.way).T.reshape(3, 4, 8)
    true = 2.0 * (np.arange(4) + 0.5 + 0.3) / 4 - 1.0
    np.testing.assert_allclose(z, np.repeat(true[:, None], 8, 1), rtol=0.0, atol=1e-12)
    turn = 8 * np.arctan2(y, x) / (2.0 * np.pi) - (np.arange(8) + 0.5 - 0.2)
    np.testing.assert_allclose(turn - 8 * np.rint(turn / 8), 0.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(light.area, axis=1), 4.0 * np.pi / 32, rtol=1e-12)


def test_a_bent_surface_turns_under_the_sky():
    """CDV against autodiff of the value as the normal leans."""
    light = _dome(SKY, 12)
    S = jnp.array([[-0.5, 0.2], [0.2, 0.8]])

    @eqx.filter_jit
    def both():
        def value(d):
            n = jnp.append(-(S @ d), 1.0)
            n = n / jnp.sqrt(n @ n)
            cosine = jnp.maximum(light.way @ n, 0.0)
            return jnp.sum(light.radiance * cosine * jnp.sqrt(jnp.sum(light.area**2, -1))) / jnp.pi

        return jax.grad(value)(jnp.zeros(2)), lobe_radiance(
            light, jnp.ones(288), floor(S=S), UP, MATTE
        )[0]

    slope, diffuse = both()
    np.testing.assert_allclose(diffuse.spatial, slope, rtol=1e-12)


@eqx.filter_jit
def hidden_light(x, light, unit=1.0):
    """Light behind a ball over the floor, and what moving shadows say."""
    scene = Scene.of(primitive(sphere(unit * jnp.array([0.1, 0.0, 1.0]), 0.4 * unit)))
    x = jnp.array([*x, 0.0])
    seen, depth = _shadow_rays(scene, x, light, jnp.array(-1))
    seen = seen.astype(x.dtype)
    diffuse, _ = lobe_radiance(light, seen, floor(x), UP, MATTE)
    return diffuse.value, shadow_edge_terms(light, seen, depth, floor(x), UP, MATTE)[0]


def cone_light(x, count=400):
    """Light outside of the ball's cone, in polar coordinates about the cone's axis: no sampling."""
    way = np.array([0.1, 0.0, 1.0]) - np.array([*x, 0.0])
    D = np.linalg.norm(way)
    axis, c0 = way / D, np.sqrt(1.0 - (0.4 / D) ** 2)
    t = np.cross(axis, (0.0, 1.0, 0.0))
    t /= np.linalg.norm(t)
    b = np.cross(axis, t)
    z, w = np.polynomial.legendre.leggauss(count)
    phi = 2.0 * np.pi * np.arange(count) / count
    c = 0.5 * (1.0 - c0) * z + 0.5 * (1.0 + c0)
    s = np.sqrt(1.0 - c * c)
    d = (s[:, None, None] * (np.cos(phi)[:, None] * t + np.sin(phi)[:, None] * b)
         + c[:, None, None] * axis)  # fmt: skip
    L = np.asarray(sky_radiance(d.reshape(-1, 3))).reshape(count, count)
    inside = np.sum(0.5 * (1.0 - c0) * w[:, None] * np.maximum(d[..., 2], 0.0) * L)
    return irradiance() / np.pi - inside * 2.0 / count


@pytest.mark.parametrize("nodes", [_dome, CosineSkyLight])
def test_shadows_move_over_the_sky(nodes):
    """The floor under a ball: the exact gradient is approached as the lattice grows finer."""
    x, h = np.array([0.6, 0.3]), 1e-4
    true = np.array([(cone_light(x + s) - cone_light(x - s)) / (2 * h) for s in h * np.eye(2)])
    rows, errors, value = [16, 64, 256], [], 0.0
    for n in rows:
        value, edges = hidden_light(x, oriented_light(nodes(SKY, n), UP))
        errors.append(np.linalg.norm(edges - true) / np.linalg.norm(true))
    np.testing.assert_allclose(value, cone_light(x), rtol=0.5 / rows[-1])  # half a cell
    # half a cell, of those over the ball's angular radius; rows are 2 / n in the cosine
    assert errors[-1] < 0.5 * (2.0 / rows[-1]) / np.arcsin(0.4 / np.sqrt(1.34))
    assert fitted_order(rows, errors) < -0.8  # edges are known to half a cell


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1e3, 1e9])
def test_shadows_move_alike_in_all_units(unit):
    """In space they move per metre: in proportion to one over the unit, however deep they are."""
    light = oriented_light(CosineSkyLight(SKY, 32), UP)
    value, edges = hidden_light(np.array([0.6, 0.3]), light)
    assert np.linalg.norm(edges) > 1e-3
    scaled, moved = hidden_light(unit * np.array([0.6, 0.3]), light, unit)
    np.testing.assert_allclose(scaled, value, rtol=1e-12)
    np.testing.assert_allclose(unit * moved, edges, rtol=1e-9)


# --- nodes by cosine -----------------------------------------------------------------------------

SMOOTH = HarmonicSky([3.0, 0.4, 0.5, -0.3, 0.2, 0.1, 0.3, -0.2, 0.15])
# Irradiance of a harmonic of degree l is A_l times it at the normal (Ramamoorthi and Hanrahan).
A_L = np.array([np.pi] + 3 * [2.0 * np.pi / 3.0] + 5 * [np.pi / 4.0])


def lambert(n):
    return _harmonics(n, 2) @ (A_L * SMOOTH.coefficients)


@eqx.filter_jit
def by_cosine(light, seen, at, n):
    return lobe_radiance(light.about(n), seen, at, n, MATTE)[0]


@pytest.mark.smoke
def test_nodes_by_cosine_converge_to_the_closed_form():
    """With the power 3/2 of the rows, and the gradient of a bent surface as the value."""
    n = jnp.array([0.48, -0.64, 0.6])
    axes = orthonormal_frame(n)
    S = jnp.array([[-0.5, 0.2], [0.2, 0.8]])
    at = surface_point(jnp.zeros(3), axes, S)
    slope = jax.jit(jax.jacfwd(lambda d: lambert(n - axes[:, :2] @ (S @ d))))(jnp.zeros(2))
    true = jax.jit(lambert)(n)
    values, turns, rows = [], [], (4, 8, 16, 32)
    for k in rows:
        found = by_cosine(CosineSkyLight(SMOOTH, k), np.ones(2 * k * k), at, n)
        values.append(abs(np.pi * found.value / true - 1.0))
        turns.append(np.linalg.norm(np.pi * found.spatial - slope) / np.linalg.norm(slope))
    assert fitted_order(rows, values) < -1.4
    assert fitted_order(rows, turns) < -1.4
    assert values[-1] < 32.0**-1.5
    assert turns[-1] < 32.0**-1.5


def test_nodes_by_cosine_are_alike_and_above_the_surface():
    n = jnp.array([0.0, -0.6, -0.8])
    light = CosineSkyLight(SKY, 6, (0.3, -0.4)).about(n)
    middle = CosineSkyLight(SKY, 6).about(n)
    assert float(jnp.min(light.way @ n)) > 0.0
    np.testing.assert_allclose(jnp.sum(light.way**2, -1), 1.0, rtol=1e-12)
    flux = -(middle.area @ n)
    np.testing.assert_allclose(flux, np.pi / 72, rtol=1e-12)
    solid = np.linalg.norm(middle.area, axis=1)
    np.testing.assert_allclose(solid.sum(), 2.0 * np.pi, rtol=1e-12)


def test_shifted_nodes_by_cosine_are_so_far_out_of_the_middles_of_their_cells():
    """Solid angles stay, and what both opposite shifts err in the cosine cancels."""
    n = np.array([0.48, -0.64, 0.6])
    lights = [CosineSkyLight(SKY, 5, (s, s / 3.0)).about(jnp.asarray(n)) for s in (0.3, -0.3)]
    axes = np.asarray(orthonormal_frame(jnp.asarray(n)))
    for light, shift in zip(lights, (0.3, -0.3), strict=True):
        x, y, z = (np.asarray(light.way) @ axes).T.reshape(3, 5, 10)
        ends = np.sqrt(np.arange(6) / 5)
        share = (z - ends[:-1, None]) / np.diff(ends)[:, None]
        np.testing.assert_allclose(share, 0.5 + shift, rtol=1e-12)
        turn = np.arctan2(y, x) / (2.0 * np.pi) * 10 - np.arange(10) - 0.5
        np.testing.assert_allclose(
            turn - np.rint(turn / 10) * 10, shift / 3.0, rtol=0.0, atol=1e-12
        )
        np.testing.assert_allclose(
            np.linalg.norm(light.area, axis=1).sum(), 2.0 * np.pi, rtol=1e-12
        )
    flux = [-(np.asarray(light.area) @ n).sum() / np.pi - 1.0 for light in lights]
    assert abs(flux[0]) > 0.1
    np.testing.assert_allclose(sum(flux), 0.0, rtol=0.0, atol=1e-12)


def test_less_noise_by_cosine_than_evenly():
    """As many rays: half of the even ones go below the floor."""
    x, errors = np.array([0.6, 0.3]), {}
    for nodes in (_dome, CosineSkyLight):
        shifts = np.random.default_rng(3).uniform(-0.5, 0.5, (8, 2))
        found = [hidden_light(x, oriented_light(nodes(SKY, 16, tuple(s)), UP))[0] for s in shifts]
        errors[nodes] = np.sqrt(np.mean((np.array(found) / cone_light(x) - 1.0) ** 2))
    assert errors[CosineSkyLight] < 0.5 * errors[_dome]  # 0.36 over 32 shifts


def test_kinds_of_nodes_have_names():
    assert isinstance(sky_light(SKY, "cosine", 4), CosineSkyLight)
    assert [type(sky_light(SKY, k, 4)) for k in ("even", "luminance")] == [
        DistantLight,
        DistantLight,
    ]
    with pytest.raises(ValueError, match="must be even, cosine or luminance, but is 'blue'"):
        sky_light(SKY, "blue", 4)
    with pytest.raises(ValueError, match="`rows` must be a positive integer, but is 0"):
        CosineSkyLight(SKY, 0)


def test_a_lamp_taken_for_distant_is_right_at_its_place_and_errs_by_sv():
    lamp = Lamp((0.0, 0.0, 4.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0), 3.0, 6)
    at, step = jnp.array([0.5, 0.0, 0.0]), 1e-4
    far = distant_lamp(lamp, at)
    here, there = (
        lobe_radiance(light, jnp.ones(36), floor(at), UP, MATTE)[0] for light in (lamp, far)
    )
    np.testing.assert_allclose(here.value, there.value, rtol=1e-14)
    moved = floor(at + jnp.array([step, 0.0, 0.0]))
    near, still = (
        lobe_radiance(light, jnp.ones(36), moved, UP, MATTE)[0].value for light in (lamp, far)
    )
    np.testing.assert_allclose(near - still, here.SV[0] * step, rtol=1e-3)


def test_bad_skies_are_refused():
    with pytest.raises(ValueError, match="`rows` must be a positive integer, but is 0"):
        _dome(SKY, 0)
    with pytest.raises(ValueError, match="`sky` must send light, but is dark"):
        _by_luminance(lambda w: 0.0 * w[0], 4)


@functools.cache
def bright_nodes():
    return np.asarray(_by_luminance(SKY, 32).way)


@functools.cache
def sky_table(width):
    """A sky like `SKY`, of some width: directions, and the radiance from there."""
    fine = _dome(GaussianSky((0.3, 0.2, 1.0), width, 2.0), 64)
    return np.asarray(fine.way), np.asarray(fine.radiance)


def luminance_p_value(width, floor):
    """Chi-square of the nodes of a bright sky, in cells of height and azimuth, by a density.

    Args:
        width: of the sky that the nodes should follow.
        floor: share of them that should be spread evenly.
    """
    nodes = bright_nodes()
    azimuth = np.arctan2(nodes[:, 1], nodes[:, 0])
    counts = np.histogram2d(nodes[:, 2], azimuth, (8, 8), ((-1, 1), (-np.pi, np.pi)))[0]
    w, L = sky_table(width)
    sums = np.histogram2d(
        w[:, 2], np.arctan2(w[:, 1], w[:, 0]), (8, 8), ((-1, 1), (-np.pi, np.pi)), weights=L
    )[0]
    share = (1.0 - floor) * sums / sums.sum() + floor / sums.size
    return chi_square(counts, counts.sum() * share)


def test_directions_of_a_bright_sky_come_by_its_luminance():
    """Nodes of a lattice are more even than chance, never less."""
    assert luminance_p_value(0.4, 0.02) > LEVEL
    assert luminance_p_value(0.45, 0.02) < LEVEL
    assert luminance_p_value(0.4, 0.2) < LEVEL


@pytest.mark.parametrize("side", [-0.5, 0.5])
def test_nodes_shifted_to_the_end_of_their_cells_are_unit_vectors(side):
    """The sum of all weights may be a rounding short of their last partial sum."""
    with jax.enable_x64(False):
        sky = GaussianSky((0.0, 0.0, -1.0), 0.5)
        for kind in ("even", "luminance"):
            way = sky_light(sky, kind, 8, (side, side)).way
            np.testing.assert_allclose(jnp.linalg.norm(way, axis=-1), 1.0, rtol=1e-6)


def test_a_number_is_no_sky_but_a_constant_sky_is():
    with pytest.raises(ValueError, match="`sky` must be a function of a direction"):
        sky_light(1.0, "even", 4)


@pytest.mark.parametrize("sky", [lambda w: 0.5 + w[2], lambda w: w[2] / 0.0])
def test_nodes_by_luminance_want_light_that_is_not_negative(sky):
    with pytest.raises(ValueError, match="`sky` must not be negative"):
        sky_light(sky, "luminance", 4)
