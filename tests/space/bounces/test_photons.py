"""Photons of space: where flux goes, by closed forms and by exact irradiance."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import z_test, z_test_of
from firstorder.errors import NoLight
from firstorder.sampling import estimate
from firstorder.space import (
    Scene,
    box,
    cylinder,
    disc,
    ellipsoid,
    irradiance,
    plane,
    primitive,
    receiver,
    rectangle,
    sphere,
    triangle,
)
from firstorder.space.bounces import path_irradiance, photons, trace_photons
from tests.space.worlds import rotation

COUNT = 40_000
LAMPS = {
    "ball": (sphere((0.0, 0.0, 1.0), 0.2), 4.0 * np.pi * 0.04),
    "box": (box((-0.2, -0.1, 0.8), (0.2, 0.1, 1.2)), 2 * (0.16 + 0.08 + 0.08)),
    "can": (cylinder((0, 0, 0.8), (0, 0, 1.2), 0.2), 2 * np.pi * 0.2 * (0.4 + 0.2)),
    "disc": (disc((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), 0.3), np.pi * 0.09),
    "rectangle": (rectangle((0, 0, 1), (0, 0.2, 0), (0.3, 0, 0)), 0.24),
    "triangle": (triangle((0, 0, 1), (0, 0.4, 1), (0.4, 0, 1)), 0.08),
}


def room(lamp, albedo=0.0, **more):
    """A lamp of radiance 2 in a large box that nothing leaves."""
    return Scene.of(
        primitive(lamp, emission=2.0, name="lamp"),
        primitive(box((-3.0, -3.0, 0.0), (3.0, 3.0, 4.0)), albedo=(0.0, albedo), name="room"),
        **more,
    )


@pytest.mark.smoke
@pytest.mark.parametrize("name", LAMPS)
def test_a_lamp_sends_pi_times_radiance_times_area(name, key):
    lamp, area = LAMPS[name]
    found = trace_photons(room(lamp), key, COUNT, 0)
    (inside,) = room(lamp).named("room")
    assert np.all(found.index[0] == inside)
    assert not np.any(found.front)
    sent = estimate(found.flux[0] * COUNT)
    assert z_test_of(sent, 2.0 * np.pi * area, truth_error=1e-12).passed


@pytest.mark.parametrize(("emission", "hit"), [((2.0, 0.0), 1), ((0.0, 2.0), 2)])
def test_a_panel_sends_light_from_the_side_that_shines(emission, hit, key):
    """One that faces down, between a floor and a ceiling without end; by the cosine."""
    panel, area = LAMPS["rectangle"]
    floor, ceiling = plane((0, 0, 0), (0, 0, 1)), plane((0, 0, 2), (0, 0, -1))
    scene = Scene.of(primitive(panel, emission=emission), primitive(floor), primitive(ceiling))
    found = trace_photons(scene, key, 1000, 0)
    assert np.all(found.index[0] == hit)
    assert np.all(found.front)
    np.testing.assert_allclose(jnp.sum(found.flux), 2.0 * np.pi * area, rtol=1e-12)
    np.testing.assert_allclose(jnp.linalg.norm(found.back, axis=-1), 1.0, rtol=1e-12)
    assert z_test_of(estimate(abs(found.back[0, :, 2])), 2.0 / 3.0).passed


@pytest.mark.parametrize("name", LAMPS)
def test_the_floor_of_the_room_gets_its_exact_irradiance(name, key):
    """Flux through squares of the floor against closed forms that know no photon."""
    lamp, _ = LAMPS[name]
    scene, half = room(lamp), 0.25
    found = trace_photons(scene, key, COUNT, 0)
    middle = np.array([[0.0, 0.0], [0.6, 0.0], [0.0, -0.8], [-0.9, 0.7]])
    t, w = np.polynomial.legendre.leggauss(4)
    x = middle[:, None, None] + half * np.stack(np.meshgrid(t, t), -1)
    at = receiver(np.append(x.reshape(-1, 2), np.zeros((x.size // 2, 1)), 1))
    open_ = Scene.of(primitive(lamp, emission=2.0))
    E = np.asarray(jax.jit(jax.vmap(lambda a: irradiance(open_, a)))(at)).reshape(x.shape[:-1])
    truth = half**2 * np.einsum("i,j,kij->k", w, w, E)
    p, flux = np.asarray(found.position[0]), np.asarray(found.flux[0]) * COUNT
    inside = np.all(np.abs(p[None, :, :2] - middle[:, None]) < half, -1) & (p[:, 2] < 1e-9)
    sums = [estimate(jnp.asarray(np.where(row, flux, 0.0))) for row in inside]
    mean, error = (np.array([getattr(s, a) for s in sums]) for a in ("mean", "error"))
    assert z_test(mean, error, truth).passed
    assert not z_test(mean, error, 1.5 * truth).passed


def closed_room(rho):
    """Six walls of the unit cube that look inwards; the ceiling's middle is a black lamp."""
    middle, axes = np.full(3, 0.5), 0.5 * np.eye(3)
    walls = [
        primitive(rectangle(middle + s * axes[i], axes[j], axes[k]), albedo=rho, facing=middle)
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        for s in (-1.0, 1.0)
    ]
    lamp = disc((0.5, 0.5, 1.0 - 1e-3), (0.0, 0.0, -1.0), 0.1)
    return Scene.of(*walls, primitive(lamp, emission=2.0, name="lamp"))


def test_all_flux_of_a_closed_room_is_absorbed(key):
    """Landed flux is that of a geometric series: each photon lands `1 / (1 - rho)` times."""
    rho, scene = 0.5, closed_room(0.5)
    found = trace_photons(scene, key, COUNT, 24)
    on_lamp = np.asarray(found.index) == scene.named("lamp")[0]
    # What the black lamp takes is out of the series: it counts as if it had gone on.
    each = np.where(on_lamp, 1.0 / (1.0 - rho), 1.0) * np.asarray(found.flux)
    landed = estimate(jnp.asarray(each.sum(0)) * COUNT)
    sent = 2.0 * np.pi * np.pi * 0.01
    assert z_test_of(landed, sent / (1.0 - rho), truth_error=sent * rho**24).passed
    assert not z_test_of(landed, 0.97 * sent / (1.0 - rho)).passed
    assert np.any(on_lamp)


def lobe_share(e, cosine, size=200):
    """Share of light from one direction that the lobe of share 1 sends up, by quadrature."""
    t, w = np.polynomial.legendre.leggauss(size)
    z, phi = 0.5 * (t[:, None] + 1.0), np.pi * (np.arange(size) + 0.5) * 2.0 / size
    x = np.sqrt(1.0 - z**2) * np.cos(phi)
    across = np.maximum(x * np.sqrt(1.0 - cosine**2) + z * cosine, 0.0)
    f = (e + 2.0) / (2.0 * np.pi) * across**e * z
    return np.sum(0.5 * w[:, None] * f) * 2.0 * np.pi / size


def test_a_glossy_floor_reflects_the_share_of_its_lobe(key):
    """Photons that land again, on a ball around all, carry what quadrature says."""
    floor = primitive(plane((0, 0, 0), (0, 0, 1)), specular=0.6, exponent=40.0)
    lamp = primitive(disc((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), 0.1), emission=1.0)
    scene = Scene.of(floor, lamp, primitive(sphere((0.0, 0.0, 0.0), 5e3)))
    found = trace_photons(scene, key, COUNT, 1)
    assert np.mean(np.asarray(found.index[0]) == scene.count - 1) > 0.999  # all on the floor
    t, w = np.polynomial.legendre.leggauss(24)
    square = 0.5 * (t + 1.0)  # light of the lamp is even in the squared cosine
    shares = [lobe_share(40.0, np.sqrt(a)) for a in square]
    truth = 0.6 * np.sum(0.5 * w * shares) * np.sum(found.flux[0])
    again = jnp.where(found.index[1] >= 0, found.flux[1], 0.0) * COUNT
    assert z_test_of(estimate(again), truth).passed
    assert not z_test_of(estimate(again), 1.05 * truth).passed


def test_a_lamp_that_is_a_box_is_sampled_by_paths(key):
    """Light sampling of boxes and cylinders, against paths that meet them by chance."""
    for name in ("box", "can"):
        scene, at = room(LAMPS[name][0]), receiver((0.4, 0.2, 0.0))
        sampled = path_irradiance(scene, at, key=key, paths=COUNT, bounces=0)
        chance = path_irradiance(scene, at, key=key, paths=COUNT, bounces=0, next_event=False)
        truth = irradiance(Scene.of(primitive(LAMPS[name][0], emission=2.0)), at)
        assert z_test_of(sampled, truth).passed
        assert z_test_of(chance, truth).passed
        assert sampled.error < 0.5 * chance.error


def test_photons_of_even_directions_are_noticed(key, monkeypatch):
    """Directions even in solid angle, not by the cosine."""
    right = photons.cylindrical

    def even(rho, phi, z):
        return right(jnp.sqrt(1.0 - (1.0 - rho**2) ** 2), phi, 1.0 - rho**2)

    monkeypatch.setattr(photons, "cylindrical", even)
    plain = photons._thrown.__wrapped__  # pyright: ignore[reportFunctionMemberAccess]
    monkeypatch.setattr(photons, "_thrown", plain)
    with pytest.raises(AssertionError):
        test_the_floor_of_the_room_gets_its_exact_irradiance("disc", key)


def _open(environment):
    """A floor, a card above it and a lamp beside, under a sky."""
    lamp = rectangle((0.9, 0.0, 1.2), (0.0, 0.1, 0.0), (0.2, 0.0, 0.0))
    return Scene.of(
        primitive(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), name="floor"),
        primitive(rectangle((-0.3, 0.1, 0.5), (0.3, 0, 0), (0, 0.4, 0))),
        primitive(lamp, emission=1.0),
        environment=environment,
    )


def _sun(along):
    """A wide lobe about a direction aside; below the horizon dark."""
    toward = jnp.array([0.48, 0.36, 0.8])
    return 2.0 * jnp.exp(6.0 * (along @ toward - 1.0)) * (along[2] > 0.0)


def _small_sun(along):
    """A disc of 4 degrees' radius."""
    return jnp.where(along @ jnp.array([0.0, 0.6, 0.8]) > 0.9975, 300.0, 0.0)


def _floor_under(environment, key, count=4 * COUNT):
    """Flux on four squares of the floor by photons and by paths to the sky, with their errors."""
    scene, half = _open(environment), 0.12
    middle = np.array([[0.0, 0.0], [-0.3, 0.1], [0.6, -0.5], [-0.7, 0.7]])
    found = trace_photons(scene, key, count, 0)
    p, flux = np.asarray(found.position[0]), np.asarray(found.flux[0]) * count
    inside = np.all(np.abs(p[None, :, :2] - middle[:, None]) < half, -1)
    inside &= (np.asarray(found.index[0]) == 0) & np.asarray(found.front[0])
    sums = [estimate(jnp.asarray(np.where(row, flux, 0.0))) for row in inside]
    return scene, middle, half, sums


@pytest.mark.parametrize("sky", [0.4, _sun])
def test_the_sky_sends_what_paths_find(sky, key):
    scene, middle, half, sums = _floor_under(sky, key)
    t, w = np.polynomial.legendre.leggauss(8)
    x = middle[:, None, None] + half * np.stack(np.meshgrid(t, t), -1)
    at = receiver(np.append(x.reshape(-1, 2), np.zeros((x.size // 2, 1)), 1), on=0)
    keys = jax.random.split(key, x.size // 2)
    E = jax.vmap(lambda a, k: path_irradiance(scene, a, key=k, paths=2000, bounces=0))(at, keys)
    weight = half**2 * np.outer(w, w)
    each = np.asarray(E.mean).reshape(x.shape[:-1]), np.asarray(E.error).reshape(x.shape[:-1])
    truth = np.einsum("ij,kij->k", weight, each[0])
    off = np.sqrt(np.einsum("ij,kij->k", weight**2, each[1] ** 2))
    mean, error = (np.array([getattr(s, a) for s in sums]) for a in ("mean", "error"))
    assert z_test(mean, np.hypot(error, off), truth).passed
    assert not z_test(mean, np.hypot(error, off), 1.4 * truth).passed


def test_a_small_sun_is_found(key):
    found, half = _floor_under(_small_sun, key)[3][3], 0.12  # in the open
    truth = 300.0 * 2.0 * np.pi * (1.0 - 0.9975) * 0.8 * (2.0 * half) ** 2
    lamp = _floor_under(0.0, key)[3][3]
    assert abs(found.mean - lamp.mean - truth) < 4.0 * np.hypot(found.error, lamp.error)
    assert found.error < 0.15 * truth  # of directions even over the sky it would be half


def test_every_part_of_a_sky_of_unknown_light_sends_photons():
    scene = _open(lambda along: jnp.where(along[0] > 0.999999, 1e6, 0.0))
    fluxes = photons._sky_fluxes(scene, jnp.asarray(1.0), jnp.asarray(2.0))
    assert jnp.all(fluxes > 0.0)
    np.testing.assert_allclose(jnp.sum(fluxes), 0.2, rtol=1e-12)


def test_planes_in_one_place_are_one_however_far_a_photon_lands(key):
    """They lean, so that the coordinates of what lands far off are rounded to either side."""
    lean = [primitive(plane((0.0, 0.0, 0.0), (0.3, 0.2, 0.9)), albedo=0.9) for _ in range(2)]
    scene = Scene.of(*lean, primitive(sphere((0.0, 0.0, 1.0), 0.2), emission=1.0))
    found = trace_photons(scene, key, COUNT, 1)
    on = np.isin(np.asarray(found.index), [1, 2])
    assert np.max(np.abs(np.asarray(found.position)[0, on[0]])) > 100.0
    assert not np.any(on[0] & on[1])


def test_photons_of_a_dark_room_are_none(key):
    scene = Scene.of(primitive(ellipsoid((0, 0, 0), np.eye(3))))
    with pytest.warns(NoLight, match="Nothing in the scene shines"):
        found = trace_photons(scene, key, 10, 1)
    assert np.all(found.index == -1)
    assert np.all(found.flux == 0.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"count": 0}, "`count`"),
        ({"bounces": -1}, "not be negative"),
        ({"survival": 1.0}, "`survival`"),
    ],
)
def test_bad_input_is_one_sentence(options, words, key):
    with pytest.raises(ValueError, match=words):
        trace_photons(room(LAMPS["disc"][0]), key, **({"count": 10} | options))


@pytest.mark.parametrize("lamps", [(2.0,), (2.0, 2.0), (5.0, 2.0)])
def test_a_lamp_drawn_on_a_turned_wall_sends_all_its_light_and_hides_what_is_drawn_before(
    lamps, key
):
    """To a large ball around, which takes all of it."""
    turn = rotation(np.array([0.3, -0.5, 0.2]))

    def panel(side):
        return rectangle(*(turn @ a for a in side * np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0]])))

    drawn = [primitive(panel(0.5), emission=L) for L in lamps]
    around = primitive(sphere((0.0, 0.0, 0.0), 9.0), name="ball")
    scene = Scene.of(primitive(panel(1.0)), around, *drawn)
    found = trace_photons(scene, key, COUNT, 0)
    assert set(np.unique(found.index)) <= {-1, *scene.named("ball")}
    sent = estimate(found.flux[0] * COUNT)
    assert abs(sent.mean - 2.0 * np.pi) <= 4.0 * sent.error + 1e-9


def test_all_flux_within_one_closed_shape_is_absorbed(key):
    """A ball that shines and reflects inwards: each photon lands `1 / (1 - rho)` times."""
    hollow = primitive(sphere((1.0, 2.0, 3.0), 0.5), emission=(0.0, 2.0), albedo=(0.0, 0.5))
    found = trace_photons(Scene.of(hollow), key, COUNT, 24)
    landed = estimate(found.flux.sum(0) * COUNT)
    sent = 2.0 * np.pi**2
    assert z_test_of(landed, 2.0 * sent, truth_error=sent * 0.5**24).passed
    assert not np.any(found.front)
