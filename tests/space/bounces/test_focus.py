r"""Photons of light without end, where planes reflect it: against closed forms and NumPy's paths.

In a wedge of two planes under a sky, each place sees the other plane with the same form factor F,
wherever it is: `E = pi L (1 - F) / (1 - albedo F)`. Between parallel planes F is 1. Light from as
far as one likes is a part of both. A ball of radius R and height h over a plane is seen from it
with `F(x) = R^2 h / |x - c|^3`, of which the plane's integral is `2 pi R^2`, and that of its square
`pi R^4 / (2 h^2)`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL, z_test, z_test_of
from firstorder.numerics import orthonormal_frame
from firstorder.sampling import estimate
from firstorder.space import Receiver, Scene, box, ellipsoid, plane, primitive, sphere
from firstorder.space.bounces import (
    DensityEstimator,
    _focus,
    path_irradiance,
    photon_irradiance,
    photon_map,
    photons,
    trace_photons,
)
from firstorder.space.bounces._focus import Ball, aimed, spread
from firstorder.space.bounces._vertices import Vertex, scattered
from tests.samplers import biased, turn_share, uniform_p_value
from tests.space.worlds import rotation

COUNT = 100_000
UP, TURN = np.array([0.0, 0.0, 1.0]), np.asarray(rotation(np.array([0.5, -0.3, 0.8])))
BALL = Ball(jnp.array([0.3, -0.2, 1.5]), jnp.asarray(0.4))


# --- samples -------------------------------------------------------------------------------------


def feet(u):
    """Places on a slanted plane by `spread`, undone: the cosine at which a point sees them."""
    normal = TURN @ UP
    rows = (jnp.asarray(np.tile(a, (len(u), 1))) for a in (TURN @ [2.0, 1.0, -0.5], normal))
    place, density = spread(BALL, *rows, jnp.asarray(u))
    offset = np.asarray(place) - np.asarray(BALL.middle)
    height = -offset @ normal
    size = np.sqrt(0.4**2 + height**2)
    x, y, _ = (offset @ np.asarray(orthonormal_frame(jnp.asarray(normal)))).T
    return np.hypot(x, y), size, turn_share(np.arctan2(y, x)), height, np.asarray(density)


def test_places_on_a_plane_are_even_as_seen_from_above_the_foot(key):
    u = np.asarray(jax.random.uniform(key, (COUNT, 2)))
    r, size, turn, height, density = feet(u)
    cosine = size / np.hypot(r, size)
    np.testing.assert_allclose(height, height[0], rtol=0.0, atol=1e-9 * r.max())
    assert uniform_p_value(np.stack([cosine, turn], -1)) > LEVEL
    np.testing.assert_allclose(density, size / (2.0 * np.pi * np.hypot(r, size) ** 3), rtol=1e-7)
    r, size, turn, *_ = feet(biased(u, 0))
    assert uniform_p_value(np.stack([size / np.hypot(r, size), turn], -1)) < LEVEL


SURFACES = {"diffuse": (0.7, 0.0, 0.0), "glossy": (0.2, 0.6, 9.0)}


def vertices(surface, place, count):
    """Copies of a vertex on a level surface."""
    place, normal, back = (
        jnp.asarray(np.tile(a, (count, 1))) for a in (place, UP, np.array([0.6, 0.0, 0.8]))
    )
    lobes = (jnp.full(count, a) for a in surface)
    none = jnp.full(count, -1)
    return Vertex(place, normal, none, back, *lobes, none)


def scattered_share(surface, rows=1500):
    """Integrals of `f cos` over bins of the angle to the ball's middle, by NumPy's midpoints."""
    albedo, specular, e = surface
    z, phi = (np.arange(rows) + 0.5) / rows, 2.0 * np.pi * (np.arange(2 * rows) + 0.5) / 2 / rows
    z, phi = np.meshgrid(z, phi)
    rho = np.sqrt(1.0 - z * z)
    w = np.stack([rho * np.cos(phi), rho * np.sin(phi), z], -1)
    mirror = np.maximum(w @ np.array([-0.6, 0.0, 0.8]), 0.0)
    f = albedo / np.pi + specular * (e + 2.0) / (2.0 * np.pi) * mirror**e
    return np.histogram(degrees(w, FAR).ravel(), BINS, weights=(f * z).ravel())[0] * (
        2.0 * np.pi / z.size
    )


FAR = np.array([-3.0, 2.0, 0.5])
BINS = np.array([0.0, 6.0, 12.0, 24.0, 48.0, 90.0, 181.0])  # the ball's rim is at 6 degrees


def degrees(w, place):
    axis = np.asarray(BALL.middle) - place
    return np.degrees(np.arccos(np.clip(w @ axis / np.linalg.norm(axis), -1.0, 1.0)))


def weighed(surface, key):
    """Estimates of what `scattered_share` integrates."""
    here = vertices(surface, FAR, COUNT)
    u, yes = jax.random.uniform(key, (COUNT, 3)), jnp.ones(COUNT, bool)
    along, weight = (np.asarray(a) for a in jax.jit(lambda *a: aimed(BALL, *a))(here, yes, u))
    which = np.digitize(degrees(along, FAR), BINS) - 1
    rows = [estimate(jnp.asarray(np.where(which == k, weight, 0.0))) for k in range(len(BINS) - 1)]
    return along, *(np.array([getattr(row, a) for row in rows]) for a in ("mean", "error"))


@pytest.mark.parametrize("name", SURFACES)
def test_directions_about_the_ball_weigh_what_they_are_more_than_others(name, key):
    _, mean, error = weighed(SURFACES[name], key)
    truth = scattered_share(SURFACES[name])
    assert z_test(mean, error, truth, truth_error=1e-3 * truth).passed
    assert not z_test(mean, error, 1.1 * truth).passed


def law(t, rim):
    """Distribution of one less the cosine of the angle to the ball, overhead, as it is derived.

    Half is even in log(t + rim), what is below turned up, and half comes by the cosine.
    """
    about = np.log1p(t / rim) + np.log1p(2.0 / rim) - np.log1p((2.0 - t) / rim)
    return 0.5 * about / np.log1p(2.0 / rim) + 0.5 * t * (2.0 - t)


@pytest.mark.parametrize("distance", [4.0, 0.45])
def test_half_of_the_directions_lie_about_the_ball_evenly_at_every_scale(distance, key):
    u = jax.random.uniform(key, (COUNT, 3))
    here = vertices(SURFACES["diffuse"], np.asarray(BALL.middle) - distance * UP, COUNT)
    rim = 1.0 - np.sqrt(1.0 - (0.4 / distance) ** 2)

    def shares(guided):
        along, weight = eqx.filter_jit(aimed)(BALL, here, jnp.full(COUNT, guided), u)
        x, y, z = np.asarray(along).T
        return weight, z, np.stack([law(1.0 - z, rim), turn_share(np.arctan2(y, x))], -1)

    weight, z, found = shares(True)
    assert uniform_p_value(found) > LEVEL
    density = (1.0 / (1.0 - z + rim) + 1.0 / (1.0 + z + rim)) / np.log1p(2.0 / rim) + 2.0 * z
    np.testing.assert_allclose(weight, 0.7 * z / (0.25 * density), rtol=1e-9)
    assert uniform_p_value(shares(False)[2]) < LEVEL


def test_from_within_the_ball_directions_are_those_of_the_surface(key):
    u = jax.random.uniform(key, (100, 3))
    here = vertices(SURFACES["glossy"], np.asarray(BALL.middle) - 0.399 * UP, 100)
    for guided in (True, False):
        along, weight = aimed(BALL, here, jnp.full(100, guided), u)
        truth, theirs, _ = scattered(here, u)
        assert jnp.all(along == truth)
        np.testing.assert_allclose(weight, theirs, rtol=1e-15)


# --- closed forms --------------------------------------------------------------------------------


def turned(*places):
    """Places of a world that is turned as a whole: no plane of it lies along the axes."""
    return [TURN @ np.asarray(place, float) for place in places]


def level(height=0.0, toward=1.0):
    """A plane, before it is turned level, that looks up or down."""
    return plane(*turned((0.0, 0.0, height), (0.0, 0.0, toward)))


def near(place, radius):
    """A ball about a place of the turned world."""
    return sphere(*turned(place), radius)


def flux(found, where):
    """What lands where a mask says, with its error, from photons that are independent."""
    each = np.where(where, np.asarray(found.flux), 0.0)
    return estimate(jnp.asarray(each.reshape(-1, each.shape[-1]).sum(0)) * each.shape[-1])


def on_disc(found, number, place, radius, front=True):
    """Whether photons landed on a disc of a plane."""
    away = np.linalg.norm(np.asarray(found.position) - turned(place)[0], axis=-1)
    side = (np.asarray(found.index) == number) & (np.asarray(found.front) == front)
    return side & (away < radius)


@pytest.mark.smoke
@pytest.mark.parametrize("seed", range(4))
def test_a_sky_gives_both_sides_of_a_plane_pi_and_no_more(seed):
    """In the focus, and three and eight of its radii aside, on discs as wide as they are far."""
    scene = Scene.of(primitive(level(), albedo=0.8), environment=2.0)
    found = trace_photons(scene, jax.random.key(seed), COUNT, 2, focus=near((0, 0, 0), 1.0))
    for aside, radius in ((0.0, 1.0), (3.0, 2.0), (8.0, 4.0)):
        for front in (True, False):
            seen = flux(found, on_disc(found, 0, (aside, 0, 0), radius, front))
            assert z_test_of(seen, 2.0 * np.pi**2 * radius**2, level=LEVEL / 6.0).passed
    assert np.all(np.asarray(found.index[1:]) == -1)


def wedge(angle):
    """A floor and a wall, which reflect a half and meet at x = -1 in an angle, under a sky."""
    wall = plane(*turned((-1.0, 0.0, 0.0), (np.sin(angle), 0.0, -np.cos(angle))))
    half = (0.5, 0.0)
    return Scene.of(primitive(level(), albedo=half), primitive(wall, albedo=half), environment=1.0)


@pytest.mark.parametrize("angle", [0.5 * np.pi, 1.0])
def test_light_goes_to_and_fro_in_a_wedge_without_end(angle, key):
    """All of it, and what comes after none and one reflection, on both planes."""
    F, focus = 0.5 * (1.0 + np.cos(angle)), near((0.0, 0.0, 0.0), 1.0)
    found = trace_photons(wedge(angle), key, COUNT, 24, focus=focus)
    order = np.arange(25)[:, None]
    first = 0.64 * np.pi**2 * (1.0 - F)
    for number, place in enumerate([(0, 0, 0), (np.cos(angle) - 1.0, 0.0, np.sin(angle))]):
        seen = on_disc(found, number, place, 0.8)
        sums = [
            flux(found, seen),
            flux(found, seen & (order == 0)),
            flux(found, seen & (order == 1)),
        ]
        mean, error = (np.array([getattr(a, name) for a in sums]) for name in ("mean", "error"))
        truth = first * np.array([1.0 / (1.0 - 0.5 * F), 1.0, 0.5 * F])
        assert z_test(mean, error, truth).passed
        assert not z_test(mean, error, 1.25 * truth).passed


def test_light_goes_to_and_fro_between_planes_without_end(key):
    """A floor that shines, and a ceiling."""
    scene = Scene.of(
        primitive(level(), albedo=(0.5, 0.0), emission=(1.0, 0.0)),
        primitive(level(1.5, -1.0), albedo=(0.6, 0.0)),
    )
    found = trace_photons(scene, key, COUNT, 32, focus=near((0.0, 0.0, 0.7), 1.0))
    sums = [flux(found, on_disc(found, i, (0, 0, 1.5 * i), 1.0)) for i in (0, 1)]
    mean, error = (np.array([getattr(a, name) for a in sums]) for name in ("mean", "error"))
    truth = np.pi**2 / (1.0 - 0.3) * np.array([0.6, 1.0])
    assert z_test(mean, error, truth).passed
    assert not z_test(mean, error, 1.15 * truth).passed


def over(ball, albedo, **lights):
    """A ball over a plane, of which both reflect a share."""
    sky = {"environment": lights.pop("environment", None)}
    return Scene.of(
        primitive(level(), albedo=albedo, **lights), primitive(ball, albedo=albedo), **sky
    )


@pytest.mark.parametrize("height", [0.6, 4.0])
def test_a_plane_that_shines_lights_a_ball_above_it(height, key):
    """`pi L (1 - cos) / 2` under the angle to the zenith: three fourths on the lower half."""
    R, ball = 0.5, near((0.2, 0.1, height), 0.5)
    found = trace_photons(over(ball, 0.0, emission=(1.0, 1.5)), key, 4 * COUNT, 0)
    up = (np.asarray(found.position) - turned((0.2, 0.1, height))[0]) @ TURN @ UP
    hit = np.asarray(found.index) == 0
    halves = [flux(found, hit & side) for side in (up < 0.0, up > 0.0)]
    mean, error = (np.array([getattr(a, name) for a in halves]) for name in ("mean", "error"))
    truth = 2.0 * np.pi**2 * R**2 * np.array([0.75, 0.25])
    assert z_test(mean, error, truth).passed
    assert not z_test(mean, error, 1.2 * truth).passed
    assert np.all(np.asarray(found.front)[hit])
    assert np.all(np.asarray(found.index)[~hit] == -1)  # what the back sends meets nothing


def test_a_sky_over_a_plane_lights_a_ball_from_above_and_from_the_ground(key):
    """From the whole plane but for the ball's shadow, in closed form (see above)."""
    R, h, rho = 0.5, 0.7, 0.8
    found = trace_photons(over(near((0, 0, h), R), rho, environment=1.0), key, COUNT, 1)
    hit = np.asarray(found.index) == 0
    sums = [flux(found, hit & (np.arange(2)[:, None] == row)) for row in (0, 1)]
    mean, error = (np.array([getattr(a, name) for a in sums]) for name in ("mean", "error"))
    seen = 2.0 * np.pi * R**2 - 0.5 * np.pi * R**4 / h**2
    truth = np.array([2.0 * np.pi**2 * R**2, rho * np.pi * seen])
    assert z_test(mean, error, truth).passed
    assert not z_test(mean, error, 1.1 * truth).passed


# --- NumPy's paths, and those of the library ----------------------------------------------------


def paths_to_ball(rng, count, R, h, rho, sun):
    """Flux that a ball over a plane gets after two reflections, by paths from the ball, in NumPy.

    From the ball a path to the plane, from there to the ball again, and from it to the sky.
    """

    def cosine(n):
        w = rng.normal(size=n.shape)
        w = n + w / np.linalg.norm(w, axis=-1, keepdims=True)
        return w / np.linalg.norm(w, axis=-1, keepdims=True)

    n = rng.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    x, w = R * n + h * UP, cosine(n)
    down = w[:, 2] < 0.0
    x = x - w * (x[:, 2:] / np.where(down, w[:, 2], -1.0)[:, None])
    w = cosine(np.broadcast_to(UP, x.shape))
    b = np.sum((h * UP - x) * w, -1)
    square = b**2 - np.sum((h * UP - x) ** 2, -1) + R**2
    met = down & (square > 0.0)
    n = (x + w * (b - np.sqrt(np.maximum(square, 0.0)))[:, None] - h * UP) / R
    w = cosine(np.where(met[:, None], n, UP))
    L = np.where(met & (w[:, 2] > 0.0), sun(w), 0.0) * rho**2
    each = 4.0 * np.pi**2 * R**2 * L
    return each.mean(), each.std() / np.sqrt(count)


def bright(w):
    """A sky that is brighter on one side."""
    return (1.0 + w @ np.array([0.6, 0.0, 0.0])) ** 2


def test_light_from_ball_to_plane_to_ball_is_what_paths_in_numpy_bring(key):
    R, h, rho = 0.5, 0.6, 0.8
    scene = Scene.of(
        primitive(plane((0.0, 0.0, 0.0), UP), albedo=rho),
        primitive(sphere((0.0, 0.0, h), R), albedo=rho),
        environment=lambda w: (1.0 + w @ jnp.array([0.6, 0.0, 0.0])) ** 2,
    )
    found = trace_photons(scene, key, 4 * COUNT, 2)
    seen = flux(found, (np.asarray(found.index) == 0) & (np.arange(3)[:, None] == 2))
    truth, error = paths_to_ball(np.random.default_rng(1), 400_000, R, h, rho, bright)
    assert z_test(seen.mean, np.hypot(seen.error, error), truth).passed
    assert not z_test(seen.mean, np.hypot(seen.error, error), 1.4 * truth).passed


def mixed():
    """A glossy floor, a wall that shines and leans, a box, and a sky with a bright side."""
    return Scene.of(
        primitive(plane((0.0, 0.0, 0.0), UP), albedo=0.4, specular=0.3, exponent=6.0),
        primitive(plane((-1.5, 0.0, 0.0), (1.0, 0.3, 0.4)), albedo=0.5, emission=0.4),
        primitive(box((-0.3, -0.4, 0.2), (0.4, 0.3, 0.7)), albedo=0.6),
        environment=lambda w: 2.0 * jnp.exp(4.0 * (w @ jnp.array([0.48, 0.36, 0.8]) - 1.0)),
    )


@pytest.mark.parametrize("bounces", [0, 2])
def test_photons_bring_what_paths_find(bounces, key):
    """On squares of the floor beside and under the box, by paths from random places of them."""
    scene, half = mixed(), 0.3
    (floor,) = (i for i in range(3) if scene.material.specular[i] > 0.0)
    found = trace_photons(scene, key, 2 * COUNT, bounces)
    middles = np.array([[0.0, 0.0], [0.9, 0.2], [-0.8, 0.7]])
    place = np.asarray(found.position)
    on = (np.asarray(found.index) == floor) & np.asarray(found.front)
    keys = jax.random.split(key, 2 * len(middles))
    for k, middle in enumerate(middles):
        seen = flux(found, on & np.all(np.abs(place[..., :2] - middle) < half, -1))
        x = middle + half * (2.0 * jax.random.uniform(keys[2 * k], (1000, 2)) - 1.0)
        at = Receiver.at(jnp.pad(x, ((0, 0), (0, 1))), on=floor)
        E = path_irradiance(scene, at, key=keys[2 * k + 1], paths=50, bounces=bounces).mean
        truth = estimate(4.0 * half**2 * E)
        error = np.hypot(seen.error, truth.error)
        assert z_test(seen.mean, error, truth.mean, level=LEVEL / 3.0).passed
        assert not z_test(seen.mean, error, 1.3 * truth.mean, level=LEVEL / 3.0).passed


# --- what a user meets ---------------------------------------------------------------------------


def test_a_map_of_them_is_the_irradiance_of_the_ground():
    """Under a ball that touches it nearly: dark below, open farther off."""
    scene = Scene.of(
        primitive(plane((0.0, 0.0, 0.0), UP)),
        primitive(sphere((0.0, 0.0, 0.6), 0.5)),
        environment=1.0,
    )
    photons = photon_map(scene, trace_photons(scene, jax.random.key(3), 4 * COUNT, 0))
    x = np.array([0.6, 1.0, 2.0])
    at = Receiver.at(np.stack([x, 0.0 * x, 0.0 * x], -1), on=1)
    found = photon_irradiance(photons, DensityEstimator(k=1000), at)
    truth = np.pi * (1.0 - 0.25 * 0.6 / (x**2 + 0.36) ** 1.5)
    np.testing.assert_allclose(found, truth, rtol=0.12)


def test_the_same_key_brings_the_same_bytes_and_another_others(key):
    one, two = (trace_photons(mixed(), key, 100, 2) for _ in range(2))
    assert np.asarray(one.flux).tobytes() == np.asarray(two.flux).tobytes()
    other = trace_photons(mixed(), jax.random.key(5), 100, 2)
    assert not np.array_equal(one.flux, other.flux)


def test_a_lamp_sends_the_same_photons_past_planes_whose_light_is_traced(key):
    """Its own keep their flux; the planes send none, as under `jit` nobody knew."""
    lamp = primitive(sphere((0.0, 0.0, 1.0), 0.2), emission=1.0)
    scene = Scene.of(primitive(plane((0.0, 0.0, 0.0), UP), albedo=0.9), lamp)
    known = trace_photons(scene, key, 200, 2)
    traced = eqx.filter_jit(lambda scene: trace_photons(scene, key, 200, 2))(scene)
    np.testing.assert_array_equal(traced.index, known.index)
    np.testing.assert_allclose(traced.flux, known.flux, rtol=1e-12)
    np.testing.assert_allclose(traced.position, known.position, rtol=1e-9, atol=1e-12)


def test_many_keys_and_many_focuses_at_once(key):
    keys = jax.random.split(key, 2)
    scene = wedge(1.5)

    def one(key, radius):
        return trace_photons(scene, key, 50, 1, focus=sphere((0.0, 0.0, 0.0), radius)).flux

    found = jax.jit(jax.vmap(one))(keys, jnp.array([1.0, 2.0]))
    np.testing.assert_allclose(found[1], one(keys[1], 2.0), rtol=1e-9)


def test_in_single_precision_nothing_is_lost_or_infinite(key):
    with jax.enable_x64(False):
        scene = wedge(1.0)
        found = trace_photons(scene, key, COUNT, 3, focus=near((0.0, 0.0, 0.0), 1.0))
        assert found.flux.dtype == jnp.float32
        assert all(np.all(np.isfinite(np.asarray(a))) for a in jax.tree.leaves(found))
        sent = flux(found, on_disc(found, 0, (0, 0, 0), 0.8) & (np.arange(4)[:, None] == 0))
    assert z_test_of(sent, 0.64 * np.pi**2 * 0.5 * (1.0 - np.cos(1.0))).passed


def test_light_without_end_asks_for_a_focus_where_no_shape_says_it(key):
    with pytest.raises(ValueError, match="`focus` must say where photons are wanted"):
        trace_photons(wedge(1.0), key, 10)


def test_two_balls_are_no_focus(key):
    two = ellipsoid(np.zeros((2, 3)), np.stack([np.eye(3)] * 2))
    with pytest.raises(TypeError, match="`focus` must be one ball, of `sphere`, but is an Ellip"):
        trace_photons(wedge(1.0), key, 10, focus=two)


# --- faults --------------------------------------------------------------------------------------


def test_light_from_outside_of_the_focus_would_be_missed(key, monkeypatch):
    """Starts within twice its radius alone, as if what is farther did not matter."""
    right = photons.spread

    def cut(focus, point, normal, u):
        place, density = right(focus, point, normal, u)
        away = jnp.linalg.norm(place - focus.middle, axis=-1)
        return place, jnp.where(away < 2.0 * focus.radius, density, jnp.inf)

    monkeypatch.setattr(photons, "spread", cut)
    plain = photons._thrown.__wrapped__  # pyright: ignore[reportFunctionMemberAccess]
    monkeypatch.setattr(photons, "_thrown", plain)
    with pytest.raises(AssertionError):
        test_light_goes_to_and_fro_between_planes_without_end(key)


def test_weights_without_what_is_turned_up_would_be_noticed(key, monkeypatch):
    """As if directions below the surface were lost."""

    def alone(focus, here, along):
        axis, rim = _focus._cone(focus, here)
        t = 1.0 - jnp.sum(axis * along, -1)
        return 1.0 / ((t + rim) * 2.0 * jnp.pi * jnp.log1p(2.0 / rim))

    monkeypatch.setattr(_focus, "_toward_density", alone)
    with pytest.raises(AssertionError):
        test_directions_about_the_ball_weigh_what_they_are_more_than_others("diffuse", key)
