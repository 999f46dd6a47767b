"""Photon maps of space against closed forms, paths and radiosity."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.caching import largest_radiance
from firstorder.checks.statistics import z_test
from firstorder.space import (
    Receiver,
    Scene,
    box,
    cylinder,
    disc,
    irradiance,
    plane,
    primitive,
    rectangle,
    sphere,
    triangle,
)
from firstorder.space.bounces import (
    DensityEstimator,
    final_gather,
    photon_irradiance,
    photon_map,
    photon_radiance_maps,
    photon_radiances,
    photonmap,
    solve_radiosity,
    trace_maps,
    trace_photons,
)
from firstorder.space.estimators import hemisphere_strata
from firstorder.space.library import j12_box

COUNT = 60_000
TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


@functools.cache
def bowl():
    """A ball of radius 2 around a ball of radius 0.5 and radiance 1: even irradiance 1 / 16 pi."""
    scene = Scene.of(
        primitive(sphere((0.0, 0.0, 0.0), 2.0)),
        primitive(sphere((0.0, 0.0, 0.0), 0.5), emission=1.0),
    )
    return photon_map(scene, trace_photons(scene, jax.random.key(1), COUNT, 0))


def in_bowl(count=300):
    """Places all over the inside, far enough apart to share few photons."""
    n = np.arange(count) + 0.5
    z, phi = 1.0 - 2.0 * n / count, np.pi * (3.0 - np.sqrt(5.0)) * n
    rho = np.sqrt(1.0 - z * z)
    out = np.stack([rho * np.cos(phi), rho * np.sin(phi), z], -1)
    return Receiver.at(2.0 * out, -out, on=0)


@pytest.mark.smoke
@pytest.mark.parametrize(
    "how",
    [
        DensityEstimator(radius=0.1),
        DensityEstimator(k=12),
        DensityEstimator(k=12, keep_farthest=True),
    ],
)
def test_an_even_irradiance_is_found_up_to_the_known_excess(how):
    """A chord of length r cuts a cap of area pi r^2 off a ball, so that no width biases it."""
    found = np.asarray(photon_irradiance(bowl(), how, in_bowl()))
    truth = how.excess * np.pi / 16.0
    error = found.std(ddof=1) / np.sqrt(found.size)
    assert z_test(found.mean(), error, truth).passed
    assert not z_test(found.mean(), error, 1.08 * truth).passed
    # Poisson's scatter: one over the root of the photons that count.
    many = 0.01 / 16.0 * COUNT if how.radius else how.k
    assert abs(found.std() / found.mean() * np.sqrt(many) - 1.0) < 0.2


def test_nothing_arrives_on_the_other_side():
    here = in_bowl(4)
    outside = Receiver.at(here.position, -here.normal, on=0)
    assert photon_irradiance(bowl(), DensityEstimator(k=12), outside).tolist() == [0.0] * 4
    assert photon_irradiance(bowl(), DensityEstimator(radius=0.1), outside).tolist() == [0.0] * 4


# --- edges ---------------------------------------------------------------------------------------


@functools.cache
def under_a_lamp():
    """A black unit square, 1 m under a lamp of 0.4 m: every irradiance in closed form."""
    lamp = rectangle((0.5, 0.5, 1.0), (0.0, 0.2, 0.0), (0.2, 0.0, 0.0))
    floor = rectangle((0.5, 0.5, 0.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0))
    scene = Scene.of(primitive(lamp, emission=1.0), primitive(floor, name="floor"))
    assert scene.named("floor") == (1,)
    return scene, photon_map(scene, trace_photons(scene, jax.random.key(2), 8 * COUNT, 0))


def mean_over_disc(scene, place, radius, whole):
    """Mean of the exact irradiance over the part of a disc that lies on the floor, by midpoints."""
    n = np.arange(2000)
    rho, phi = radius * np.sqrt((n + 0.5) / n.size), np.pi * (3.0 - np.sqrt(5.0)) * n
    x = place + np.stack([rho * np.cos(phi), rho * np.sin(phi), 0.0 * n], -1)
    on = np.all((x[:, :2] > 0.0) & (x[:, :2] < 1.0), -1)
    E = jax.jit(jax.vmap(lambda p: irradiance(scene, Receiver.at(p, on=1))))(jnp.asarray(x))
    return np.sum(np.where(on, E, 0.0)) / (n.size if whole else on.sum())


@pytest.mark.parametrize("place", [(0.4, 0.6, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.0)])
@pytest.mark.parametrize("cut", [False, True])
def test_the_boundary_bias_is_what_the_disc_says(place, cut):
    """Inside, on an edge and in a corner: with and without the part of the disc that hangs over."""
    scene, photons = under_a_lamp()
    radius = 0.08
    at = Receiver.at(np.array([place]), on=1)
    found = photon_irradiance(photons, DensityEstimator(radius=radius, cut=cut), at)
    truth = mean_over_disc(scene, np.array(place), radius, not cut)
    each = photons.photons.flux.max()
    area = np.pi * radius**2 * (1.0 if not cut or place[0] > 0 else 0.25 if place[1] == 0 else 0.5)
    spread = np.sqrt(each * truth / area)
    assert z_test(found, spread, truth, truth_error=0.01 * truth).passed
    exact = irradiance(scene, Receiver.at(place, on=1))
    assert abs(truth / exact - (1.0 if cut else area_left(place))) < 0.1


def area_left(place):
    return {0: 1.0, 1: 0.5, 2: 0.25}[place[:2].count(0.0)]


FACES = {
    "box": (box((-1, -1, -1), (1, 1, 1)), (1.0, 0.9, 0.9), (1.0, 0.0, 0.0)),
    "wall of a cylinder": (cylinder((0, 0, -1), (0, 0, 1), 1.0), (1.0, 0.0, 0.95), (1, 0, 0)),
    "cap of a cylinder": (cylinder((0, 0, -1), (0, 0, 1), 1.0), (0.9, 0.0, 1.0), (0, 0, 1)),
    "disc": (disc((0, 0, 0), (0, 0, 1), 1.0), (0.9, 0.0, 0.0), (0, 0, 1)),
    "triangle": (triangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), (0.45, 0.5, 0.0), (0, 0, 1)),
    "ball": (sphere((0, 0, 0), 1.0), (0.0, 0.0, 1.0), (0, 0, 1)),
    "plane": (plane((0, 0, 0), (0, 0, 1)), (0.0, 0.0, 0.0), (0, 0, 1)),
}


def circle_segment(d, r=0.2):
    """Share of a disc of radius r beyond a line at distance d."""
    a = np.clip(d / r, -1.0, 1.0)
    return (np.arccos(a) - a * np.sqrt(1.0 - a * a)) / np.pi


def lens(d, r=0.2):
    """Share of a disc of radius r that lies in the unit disc, its centre d from that one's."""
    a = np.arccos((d * d + r * r - 1.0) / (2.0 * d * r))
    b = np.arccos((d * d + 1.0 - r * r) / (2.0 * d))
    return (r * r * (a - np.sin(a) * np.cos(a)) + b - np.sin(b) * np.cos(b)) / (np.pi * r * r)


SHARES = {
    "box": 1.0 - 2.0 * circle_segment(0.1) + 0.0,
    "wall of a cylinder": 1.0 - circle_segment(0.05),
    "cap of a cylinder": lens(0.9),
    "disc": lens(0.9),
    "triangle": 1.0 - circle_segment(0.05 / np.sqrt(2.0)),
    "ball": 1.0,
    "plane": 1.0,
}


@pytest.mark.parametrize("name", FACES)
def test_the_share_of_a_disc_on_its_face_is_that_of_plane_geometry(name):
    shape, place, normal = FACES[name]
    at = Receiver.at(np.array([place]), np.array([normal]), on=0)
    found = photonmap._share(Scene.of(primitive(shape)), at, jnp.array([0.2]))
    corner = 0.0
    if name == "box":  # the corner counts twice in two segments
        x, y = np.meshgrid(*2 * [np.linspace(-0.2, 0.2, 1001)])
        inside = x**2 + y**2 < 0.04
        corner = np.mean((x > 0.1) & (y > 0.1) & inside) / np.mean(inside)
    assert abs(found[0] - SHARES[name] - corner) < 0.01


# --- a box with one bright wall ------------------------------------------------------------------


@functools.cache
def j12():
    scene = j12_box()
    return scene, photon_map(scene, trace_photons(scene, jax.random.key(3), 4 * COUNT))


CLOSE = DensityEstimator(k=400, cut=True)


def test_the_radiances_of_a_map_are_those_of_radiosity():
    scene, photons = j12()
    found, truth = photon_radiance_maps(photons, CLOSE, 8), solve_radiosity(scene, cells=8)
    (left,) = scene.named("left")
    # A twentieth is the scatter of 400 photons; at the edges the disc is cut and one-sided.
    off = np.asarray(found.L[left] / truth.L[left])[2:-2, 2:-2] - 1.0
    assert abs(off.mean()) < 0.02
    assert off.std() < 2.0 / np.sqrt(400)
    black = [i for i in range(4) if i != left]
    assert np.all(np.asarray(found.L)[black] == 0.0)


def test_the_largest_radiance_of_the_photons_keeps_the_meaning_of_a_threshold():
    """J12's footnote: it is the brightest wall's, and twice as large under twice the light."""
    scene, photons = j12()
    brightest = solve_radiosity(scene, cells=64).L.max()
    found = largest_radiance(photon_radiances(photons, CLOSE))
    assert 1.0 < found / brightest < 1.0 + 4.0 / np.sqrt(400)
    bright = j12_box(radiance=2.0)
    twice = photon_map(bright, trace_photons(bright, jax.random.key(3), 4 * COUNT))
    assert abs(largest_radiance(photon_radiances(twice, CLOSE)) / found - 2.0) < 1e-9


def from_wall(scene, place, rows=64):
    """Irradiance of a place of the floor from the maps of radiosity, by many rays."""
    cells = hemisphere_strata(rows, 4 * rows)
    along = tuple(cells.directions.reshape(-1, 3).T)
    start = tuple(jnp.full_like(along[0], x) for x in place)
    L = trace_maps(solve_radiosity(scene, cells=64), start, along, 0).radiance
    return np.pi * np.mean(L)


def test_final_gathering_is_right_and_steadier_than_the_density():
    """Light of the wall alone, then with the lamp's."""
    scene, photons = j12()
    x = np.linspace(0.15, 0.85, 6)
    at = Receiver.at(np.stack([x, 0.0 * x + 0.5, 0.0 * x], -1), on=0)
    cells, dark = hemisphere_strata(24, 96), j12_box(radiance=0.0)
    gathered = final_gather(dark, at, where=cells, photons=photons, how=CLOSE)
    wall = np.array([from_wall(scene, place) for place in np.asarray(at.position)])
    lamp = jax.jit(jax.vmap(lambda a: irradiance(scene, a)))(at)
    seen = photon_irradiance(photons, DensityEstimator(k=100), at)
    off = np.sqrt(np.mean((gathered / wall - 1.0) ** 2))
    rough = np.sqrt(np.mean((seen / (wall + lamp) - 1.0) ** 2))
    assert off < 0.02
    assert rough > 3.0 * off
    both = final_gather(scene, at, where=cells, photons=photons, how=CLOSE)
    np.testing.assert_allclose(both, wall + lamp, rtol=0.05)
    assert np.all(both > gathered)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda m, at: photon_irradiance(m, CLOSE, Receiver.at((0.0, 0.0, 0.0))), "`on`"),
        (lambda m, at: photon_irradiance(m, CLOSE, Receiver.at((0.0, 0.0, 0.0), on=99)), "at.on"),
        (lambda m, at: photon_radiances(m, CLOSE, 0), "`every`"),
        (lambda m, at: photon_radiance_maps(m, CLOSE, 0), "`cells`"),
    ],
)
def test_bad_input_is_one_sentence(ask, words):
    with pytest.raises(ValueError, match=words):
        ask(bowl(), in_bowl(1))


# --- faults --------------------------------------------------------------------------------------


def test_photons_through_a_wall_would_be_noticed(monkeypatch):
    """All sides in one tree: the dark side of the bowl becomes bright."""
    right = photonmap._sides
    monkeypatch.setattr(photonmap, "_sides", lambda *a: 0 * right(*a))
    mixed = photon_map(bowl().scene, jax.tree.map(lambda a: a[None], bowl().photons))
    here = in_bowl(4)
    outside = Receiver.at(here.position, -here.normal, on=0)
    assert np.all(photon_irradiance(mixed, DensityEstimator(k=12), outside) > 0.0)


def test_of_a_receivers_normal_only_the_sign_counts_at_the_edge_of_its_surface():
    floor = Scene.of(primitive(rectangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))))
    shares = [
        photonmap._share(
            floor,
            Receiver.at(jnp.array([(0.95, 0.0, 0.0)]), jnp.array([normal]), on=jnp.array([0])),
            jnp.array([0.2]),
        )[0]
        for normal in ((0.0, 0.0, 1.0), (np.sin(1.0), 0.0, np.cos(1.0)))
    ]
    assert 0.6 < shares[0] < 0.7
    assert shares[1] == shares[0]
