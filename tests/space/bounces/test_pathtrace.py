"""Random paths against scenes whose light is known: furnaces, closed forms, quadrature."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import space
from firstorder.checks.statistics import LEVEL, chi_square, error_slope, z_test, z_test_of
from firstorder.checks.tolerance import normwise, rounding
from firstorder.numerics._vectors import orthonormal_frame
from firstorder.sampling import estimate
from firstorder.space import (
    Discs,
    Rectangles,
    Scene,
    Triangles,
    cylinder,
    ellipsoid,
    plane,
    primitive,
    receiver,
    rectangle,
)
from firstorder.space.bounces import pathtrace
from firstorder.space.bounces._surface_points import area_density, point_on
from firstorder.space.bounces._vertices import Vertex, brdf, scattered
from firstorder.space.bounces.pathtrace import path_irradiance, path_radiance
from firstorder.space.direct_lighting import irradiance
from firstorder.space.library._scenes import _floor, _lamp, _walls, j12_box
from tests.samplers import COUNT, biased, disc_place, turn_share, uniform_p_value
from tests.space import worlds

ALBEDO, PATHS = 0.6, 8192
PLACES = np.array([(0.3, 0.4, 0.0), (0.8, 0.1, 0.0)])
TERMS = np.cumsum(ALBEDO ** np.arange(4))  # light after 0, 1, 2, 3 reflections


@pytest.fixture(scope="module")
def furnace():
    """A closed cube whose walls all shine and reflect alike."""
    things = [_floor(ALBEDO), *_walls(ALBEDO)]
    return Scene.of(*(primitive(t.shape, name=t.name, albedo=ALBEDO, emission=1.0) for t in things))


def on_floor(scene):
    return receiver(PLACES, on=scene.named("floor")[0])


@pytest.mark.smoke
def test_in_a_furnace_every_path_brings_the_same(furnace, key):
    """E after k reflections is pi (1 + a + ... + a^k), without any variance."""
    found = path_irradiance(
        furnace, on_floor(furnace), key=key, paths=64, bounces=3, next_event=False
    )
    assert normwise(found.mean, np.pi * TERMS[3] * np.ones(2)) < rounding(100)
    assert np.all(np.asarray(found.error) < 1e-6)


def test_sampled_lights_in_a_furnace(furnace, key):
    found = path_irradiance(furnace, on_floor(furnace), key=key, paths=PATHS, bounces=2)
    assert z_test_of(found, np.pi * TERMS[2]).passed
    assert np.all(np.asarray(found.error) > 1e-4)


ALL = np.pi / (1.0 - ALBEDO)  # light after any number of reflections


def furnace_errors(furnace, key, **how):
    """Deviations of all light in a closed furnace from pi e / (1 - a), in standard errors."""
    found = path_irradiance(furnace, on_floor(furnace), key=key, paths=PATHS, **how)
    assert np.all(np.asarray(found.error) < 0.02 * ALL)
    assert found.count == PATHS
    return z_test_of(found, ALL)


@pytest.mark.parametrize("how", [{}, {"next_event": False}, {"survival": 0.5}, {"lanes": 100}])
def test_in_a_furnace_roulette_finds_all_light(how, furnace, key):
    """E = pi e / (1 - a), the sum of the geometric series; fewer reflections are told apart."""
    assert furnace_errors(furnace, key, **how).passed
    assert not furnace_errors(furnace, key, **how, bounces=3).passed


@pytest.mark.parametrize("next_event", [False, True])
@pytest.mark.parametrize("name", ["ball", "box", "can"])
def test_one_closed_shape_is_a_furnace_seen_from_within(name, next_event, key):
    """Of radiance 1 and albedo 1/2: 2 pi, in the middle of it and on its wall."""
    hollow = {
        "ball": ellipsoid((0, 0, 0), ((1, 0, 0), (0, 1.5, 0), (0, 0, 1))),
        "box": space.box((-1, -2, -1), (1, 1, 1)),
        "can": cylinder((0, 0, -1), (0, 0, 1), 1.0),
    }[name]
    scene = Scene.of(primitive(hollow, emission=(0.0, 1.0), albedo=(0.0, 0.5)))
    at = receiver(np.array([(0.0, 0.0, 0.0), (0.0, 0.0, -1.0)]), on=np.array([-1, 0]))
    E = path_irradiance(scene, at, key=key, paths=PATHS, next_event=next_event)
    assert z_test_of(E, 2.0 * np.pi * np.ones(2)).passed


def test_radiance_in_a_furnace_is_even(furnace, key):
    eye, along = np.array([[0.5, 0.5, 0.5]] * 2), np.array([[0.0, 0.6, 0.8], [0.0, 0.0, -1.0]])
    found = path_radiance(furnace, eye, along, key=key, paths=PATHS)
    assert z_test_of(found, 1.0 / (1.0 - ALBEDO)).passed


def test_results_of_a_receiver_do_not_depend_on_those_behind_it(furnace, key):
    at = on_floor(furnace)
    first = jax.tree.map(lambda a: a[:1], at)
    one, both = (path_irradiance(furnace, a, key=key, paths=256, lanes=32) for a in (first, at))
    np.testing.assert_allclose(one.mean[0], both.mean[0], rtol=1e-12)


def reflected(places, n=40):
    """Once reflected light on the floor of J12's box, by Lambert's sum and a product rule."""
    t, w = np.polynomial.legendre.leggauss(n)
    y, z = (a.ravel() for a in np.meshgrid(0.5 + 0.5 * t, 0.5 + 0.5 * t))
    wall, weight = np.stack([0.0 * y, y, z], -1), 0.25 * np.outer(w, w).ravel()
    corners = np.array([(0.3, 0.3, 1.0), (0.3, 0.7, 1.0), (0.7, 0.7, 1.0), (0.7, 0.3, 1.0)])
    p = corners - wall[:, None]
    q = np.roll(p, -1, 1)
    cross = np.cross(p, q)
    angle = np.arctan2(np.linalg.norm(cross, axis=-1), np.sum(p * q, -1))
    E = np.abs(np.sum(angle * cross[..., 0] / np.linalg.norm(cross, axis=-1), -1)) / 2.0
    way = wall - places[:, None]
    r2 = np.sum(way**2, -1)
    return np.sum(weight * 0.5 / np.pi * E * way[..., 2] * -way[..., 0] / r2**2, -1)


@pytest.fixture(scope="module")
def box():
    scene = j12_box()
    direct = jax.jit(jax.vmap(lambda a: irradiance(scene, a)))(on_floor(scene))
    return scene, np.asarray(direct), reflected(PLACES)


def box_errors(box, key):
    """Deviations of direct and of all light, in standard errors; and the thresholds."""
    scene, direct, once = box
    both = [
        path_irradiance(scene, on_floor(scene), key=key, paths=PATHS, bounces=k) for k in (0, 1)
    ]
    return z_test_of(both[0], direct), z_test_of(both[1], direct + once)


def test_direct_and_once_reflected_light_in_the_box_of_j12(box, key):
    assert all(z.passed for z in box_errors(box, key))
    scene, direct, _ = box
    chance = path_irradiance(
        scene, on_floor(scene), key=key, paths=PATHS, bounces=0, next_event=False
    )
    assert z_test_of(chance, direct).passed
    # The reflection is seen: without it the numbers would be far off.
    assert not z_test_of(
        path_irradiance(scene, on_floor(scene), key=key, paths=PATHS, bounces=1), direct
    ).passed


def test_the_error_falls_as_the_root_of_the_number_of_paths(box, key):
    scene, direct, _ = box
    counts = np.array([64, 256, 1024, 4096])
    runs = jax.random.split(key, 8)

    def off_by(count):
        """Root mean square of the deviations of eight runs."""
        each = [
            path_irradiance(scene, on_floor(scene), key=k, paths=int(count), bounces=0).mean
            for k in runs
        ]
        return np.sqrt(np.mean((np.array(each) - direct) ** 2))

    off = [off_by(count) for count in counts]
    assert abs(error_slope(counts, off).slope + 0.5) < 0.15


def lamp_errors(key):
    """A round lamp, stretched and slanted, over a receiver: sampled, and met by chance."""
    axes = np.array([[0.4, 0.1, 0.0], [0.0, 0.25, 0.1], [0.1, 0.0, 0.3]])
    scene = Scene.of(
        primitive(ellipsoid((0.2, 0.1, 1.5), axes), emission=2.0),
        primitive(plane((0, 0, 0), (0, 0, 1))),
    )
    at = receiver(PLACES, on=1)
    truth = jax.jit(jax.vmap(lambda a: irradiance(scene, a)))(at)
    found = path_irradiance(scene, at, key=key, paths=PATHS, bounces=0)
    return z_test_of(found, truth), truth, scene, at


@pytest.mark.parametrize("lamps", [(1.0,), (1.0, 1.0), (3.0, 1.0)])
def test_of_lamps_in_one_place_the_last_is_sampled(lamps, key):
    """Drawn on a wall, at a height of 1 over the receiver."""
    wall = primitive(rectangle((0, 0, 1), (0, 1, 0), (1, 0, 0)))
    panel = rectangle((0, 0, 1), (0, 0.5, 0), (0.5, 0, 0))
    scene = Scene.of(wall, *(primitive(panel, emission=L) for L in lamps))
    at = receiver((0.0, 0.0, 0.0))
    E = path_irradiance(scene, at, key=key, paths=PATHS, bounces=0)
    corner = 0.5 / np.hypot(0.5, 1.0)  # Lambert's sum over the edges
    assert z_test_of(E, 4.0 * corner * np.arctan(corner)).passed


def test_an_ellipsoid_as_a_lamp(key):
    sampled, truth, scene, at = lamp_errors(key)
    assert sampled.passed
    chance = path_irradiance(scene, at, key=key, paths=8 * PATHS, bounces=0, next_event=False)
    assert z_test_of(chance, truth).passed


@pytest.mark.parametrize(("specular", "exponent", "albedo"), [(0.0, 0.0, 0.7), (0.4, 20.0, 0.3)])
def test_under_a_white_sky_a_floor_shows_its_albedo(specular, exponent, albedo, key):
    """Seen from above a glossy lobe reflects its share; nothing else is in the way."""
    floor = primitive(
        plane((0, 0, 0), (0, 0, 1)), albedo=albedo, specular=specular, exponent=exponent
    )
    scene = Scene.of(floor, environment=1.0)
    eye, down = np.array([[0.0, 0.0, 2.0]]), np.array([[0.0, 0.0, -1.0]])
    found = path_radiance(scene, eye, down, key=key, paths=PATHS, bounces=1)
    # Without gloss every path brings the same, and only rounding is left of the error.
    assert z_test_of(found, specular + albedo, truth_error=1e-14).passed
    up = path_radiance(scene, eye, -down, key=key, paths=4, bounces=1)
    assert up.mean.tolist() == [1.0]
    assert path_radiance(scene, eye, down, key=key, paths=4, bounces=0).mean.tolist() == [0.0]


# --- samplers ------------------------------------------------------------------------------------

SURFACES = {"diffuse": (0.7, 0.0, 1.0), "glossy": (0.2, 0.5, 12.0), "gloss alone": (0.0, 0.6, 3.0)}


def vertices(surface, count):
    """Copies of a vertex on a slanted surface, seen from aside."""
    albedo, specular, exponent = surface
    normal = np.array([0.3, -0.2, 0.9])
    back = np.array([-0.4, 0.5, 0.8])
    one = [v / np.linalg.norm(v) for v in (normal, back)]
    normal, back = (jnp.asarray(np.tile(v, (count, 1))) for v in one)
    number = lambda a: jnp.full(count, float(a))  # noqa: E731
    none, lobes = jnp.full(count, -1), map(number, (albedo, specular, exponent))
    return Vertex(0.0 * normal, normal, none, back, *lobes, none)


def in_frame(along):
    """Height and share of the turn of directions about the normal of `vertices`."""
    frame = np.asarray(orthonormal_frame(vertices((0, 0, 0), 1).normal))[0]
    x, y, z = (np.asarray(along) @ frame).T
    return np.stack([z, turn_share(np.arctan2(y, x))], -1)


def expected_shares(surface, bins, nodes=6):
    """Share of directions in bins of height and turn above the surface, by the density."""
    t, w = np.polynomial.legendre.leggauss(nodes)
    middle = (np.arange(bins)[:, None] + 0.5 + 0.5 * t) / bins
    weight = np.tile(w, bins) / (2.0 * bins)
    z, turn = (a.ravel() for a in np.meshgrid(middle.ravel(), middle.ravel(), indexing="ij"))
    rho, phi = np.sqrt(1.0 - z**2), 2.0 * np.pi * turn
    local = np.stack([rho * np.cos(phi), rho * np.sin(phi), z], -1)
    here = vertices(surface, len(z))
    along = local @ np.asarray(orthonormal_frame(here.normal[:1]))[0].T
    density = np.asarray(eqx.filter_jit(brdf)(here, jnp.asarray(along))[1])
    each = 2.0 * np.pi * density.reshape(bins * nodes, -1) * np.outer(weight, weight)
    return each.reshape(bins, nodes, bins, nodes).sum((1, 3))


def directions_p_value(surface, law, u, bins=10):
    """Chi-square of scattered directions against the density of a surface; below is one bin."""
    along = eqx.filter_jit(scattered)(vertices(surface, len(u)), jnp.asarray(u))[0]
    above = np.histogramdd(in_frame(along), bins, ((0, 1), (0, 1)))[0]
    share = expected_shares(law, bins)
    seen = np.append(above, len(u) - above.sum())
    return chi_square(seen, len(u) * np.append(share, 1.0 - share.sum()))


@pytest.mark.parametrize("name", SURFACES)
def test_directions_follow_their_density(name, key):
    u, surface = np.asarray(jax.random.uniform(key, (COUNT, 3))), SURFACES[name]
    assert directions_p_value(surface, surface, u) > LEVEL
    albedo, specular, exponent = surface
    wrong = (albedo, specular, exponent + 1.0) if specular else (albedo, 0.1, 1.0)
    assert directions_p_value(surface, wrong, u) < LEVEL
    assert directions_p_value(surface, surface, biased(u, 1, 1.2)) < LEVEL


LEAN = np.array([[0.4, 0.1, 0.0], [0.0, 0.25, 0.1], [0.1, 0.0, 0.3]])
SHAPES = {
    "ellipsoid": ellipsoid((0.2, 0.1, 1.5), LEAN),
    "disc": Discs((0.2, 0.1, 1.5), LEAN),
    "rectangle": Rectangles((0.2, 0.1, 1.5), LEAN),
    "triangle": Triangles((0.2, 0.1, 1.5), LEAN),
}


def undone(name, point):
    """Numbers that are uniform where points are even by area on the canonical shape."""
    x, y, z = ((np.asarray(point) - (0.2, 0.1, 1.5)) @ np.linalg.inv(LEAN).T).T
    match name:
        case "ellipsoid":
            return np.stack([0.5 * (z + 1.0), turn_share(np.arctan2(y, x))], -1)
        case "disc":
            return disc_place(np.stack([x, y], -1))
        case "triangle":
            return np.stack([(x + y) ** 2, x / (x + y)], -1)
    return 0.5 * (np.stack([x, y], -1) + 1.0)


@pytest.mark.parametrize("name", SHAPES)
def test_points_of_a_light_are_even_by_area(name, key):
    """Flat ones in the world, an ellipsoid's on the unit ball, and the density knows: it adds up
    to the area."""
    shape = jax.tree.map(lambda a: a[0], SHAPES[name])
    u = jax.random.uniform(key, (COUNT, 2))

    @jax.jit
    def drawn(u):
        scene = Scene.of(primitive(SHAPES[name], emission=1.0))
        point, normal = jax.vmap(lambda u: point_on(shape, u))(u)
        index = jnp.zeros(len(point), jnp.int32)
        return point, area_density(scene, index, normal)

    point, density = drawn(u)
    assert uniform_p_value(undone(name, point)) > LEVEL
    assert uniform_p_value(undone(name, drawn(jnp.asarray(biased(u, 1, 1.3)))[0])) < LEVEL
    area = estimate(1.0 / density)
    assert z_test_of(area, area_of(name), truth_error=1e-12).passed
    assert not z_test_of(area, 1.03 * area_of(name)).passed


def area_of(name):
    """In the world; of the ellipsoid by a product rule over the unit ball."""
    flat = np.linalg.norm(np.cross(LEAN[:, 0], LEAN[:, 1]))
    if name != "ellipsoid":
        return {"disc": np.pi, "rectangle": 4.0, "triangle": 0.5}[name] * flat
    z, w = np.polynomial.legendre.leggauss(40)
    phi = 2.0 * np.pi * np.arange(80) / 80
    rho = np.sqrt(1.0 - z**2)[:, None]
    q = np.stack([rho * np.cos(phi), rho * np.sin(phi), z[:, None] + 0.0 * phi], -1)
    stretch = np.linalg.norm(q @ np.linalg.inv(LEAN), axis=-1) * abs(np.linalg.det(LEAN))
    return np.sum(w[:, None] * stretch) * 2.0 * np.pi / 80


# --- properties ----------------------------------------------------------------------------------


def path_light(key, paths=2048, **how):
    """Light at two places of a scene that may change, after up to two reflections."""
    options = {"next_event": how.pop("next_event", True), "bounces": how.pop("bounces", 2)}
    change = worlds.Change(**how).arrays
    scene = worlds.lit(change)
    each = [worlds.below(change, *map(jnp.asarray, place)) for place in ((0.1, 0.2), (-0.4, 0.3))]
    at = jax.tree.map(lambda *a: jnp.stack(a), *each)
    return path_irradiance(scene, at, key=key, paths=paths, lanes=512, **options)


def test_with_the_same_numbers_another_unit_and_place_change_nothing(key):
    rest = path_light(key)
    for how in ({"scale": 4.0}, {"scale": 0.3, "shift": (1.0, -2.0, 0.5)}):
        found = path_light(key, **how)
        np.testing.assert_allclose(found.mean, rest.mean, rtol=1e-9)
        np.testing.assert_allclose(found.error, rest.error, rtol=1e-9)


def test_with_the_same_numbers_lights_add(key):
    """Where lights are met by chance, which of them shine decides about no number."""
    light = np.array([0.5, 2.0, 0.25])
    alone = [path_light(key, light=one, next_event=False).mean for one in np.eye(3)]
    both = path_light(key, light=light, next_event=False).mean
    np.testing.assert_allclose(both, light @ np.array(alone), rtol=1e-12)


def apart(one, two):
    """The difference of two independent estimates, tested against none."""
    return z_test(one.mean, np.hypot(one.error, two.error), two.mean)


def test_a_turned_scene_and_lights_in_pieces_send_as_much(key):
    """In distribution: frames of shapes and which light is sampled do change."""
    keys = jax.random.split(key, 3)
    rest = path_light(keys[0], 8192)
    assert apart(path_light(keys[1], 8192, turn=(0.5, -0.8, 1.1), spin=0.7), rest).passed
    assert apart(path_light(keys[2], 8192, lamp=0.3, screen=0.6), rest).passed
    assert not apart(path_light(keys[1], 8192, light=(1.05, 0.735, 0.315)), rest).passed


# --- faults --------------------------------------------------------------------------------------


def _none(scene, origin, met, there, lights):
    return jnp.zeros_like(met.albedo)


def _canonical(scene, index, normal):
    return jnp.full(index.shape, 1.0 / (4.0 * jnp.pi))


def _twice(right):
    def scattered(here, u):
        along, factor, density = right(here, u)
        return along, 2.0 * factor, density

    return scattered


FAULTS = {
    "light is counted twice: sampled and met": ("_light_density", lambda _: _none),
    "the lamp's area is that of the unit ball": ("area_density", lambda _: _canonical),
    "reflected light twice": ("scattered", _twice),
}


def put_in(monkeypatch, name, wrong):
    """A wrong twin in the place of a part, in a program that is traced again."""
    monkeypatch.setattr(pathtrace, name, wrong(getattr(pathtrace, name)))
    plain = pathtrace._traced.__wrapped__  # pyright: ignore[reportFunctionMemberAccess]
    monkeypatch.setattr(pathtrace, "_traced", eqx.filter_jit(lambda *a: plain(*a)))


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_path_is_noticed(fault, box, key, monkeypatch):
    put_in(monkeypatch, *FAULTS[fault])
    z = lamp_errors(key)[0] if "lamp" in fault else box_errors(box, key)[1]
    assert np.all(np.isfinite(z.z))
    assert not z.passed


def _unweighted(right):
    def roulette(u, chance):
        on, _, again = right(u, chance)
        return on, jnp.ones_like(chance), again

    return roulette


def _early(right):
    """Ends paths at the receiver too."""

    def chance(total, depth, length):
        return jnp.where(depth == 0, length.survival, right(total, depth, length))

    return chance


def _off_by_a_little(right):
    def roulette(u, chance):
        on, weight, again = right(u, chance)
        return on, jnp.where(chance < 1.0, 0.97 * weight, weight), again

    return roulette


ROULETTE = {
    "what survives does not count for what ended": _unweighted,
    "what survives counts a little too little": _off_by_a_little,
}


@pytest.mark.parametrize("fault", ROULETTE)
def test_a_wrong_roulette_is_noticed(fault, furnace, key, monkeypatch):
    put_in(monkeypatch, "roulette", ROULETTE[fault])
    assert not furnace_errors(furnace, key).passed


def test_the_receiver_may_play_roulette_too(furnace, key, monkeypatch):
    """Any chance is right, as long as it is paid for: only the error depends on it."""
    put_in(monkeypatch, "survival_chance", _early)
    assert furnace_errors(furnace, key).passed


UPWARD = np.full(3, 0.5), np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda s, k: path_irradiance(s, on_floor(s), key=k, paths=1), "at least 2"),
        (
            lambda s, k: path_irradiance(s, on_floor(s), key=k, paths=4, bounces=-1),
            "not be negative",
        ),
        (lambda s, k: path_irradiance(s, on_floor(s), key=k, paths=4, survival=1.0), "`survival`"),
        (lambda s, k: path_radiance(s, *UPWARD, key=k, paths=1, bounces=0), "at least 2, but is 1"),
        (lambda s, k: path_radiance(s, *UPWARD, key=k, paths=4, bounces=-1), "but is -1"),
    ],
)
def test_bad_input_is_one_sentence(ask, words, furnace, key):
    with pytest.raises(ValueError, match=words):
        ask(furnace, key)


@pytest.mark.parametrize("bounces", [0, 1])
def test_rays_in_single_precision_are_answered_in_it(bounces, key):
    x, y, z = jnp.eye(3, dtype=jnp.float32)
    lamp = primitive(rectangle(z, y, x), emission=jnp.float32(1.0), albedo=jnp.float32(0.5))
    found = path_radiance(Scene.of(lamp), 0.0 * z, z, key=key, paths=4, bounces=bounces)
    assert found.mean.dtype == found.error.dtype == jnp.float32


def test_the_lamp_of_the_library_is_sampled():
    """A closed scene of one lamp: which shapes are sampled follows from what shines."""
    scene = Scene.of(_floor(0.5), _lamp((0.5, 0.5, 1.0), 0.2, 1.0))
    assert pathtrace._lights(scene) == scene.named("light")


@pytest.mark.parametrize("along", [(1.2, 0.0, -1.6), (np.nan, 0.0, 1.0)])
def test_a_direction_of_another_length_is_refused(along):
    with pytest.raises(ValueError, match=r"^Argument `along` must be a unit vector"):
        path_radiance(j12_box(), np.full(3, 0.5), np.array(along), key=jax.random.key(0), paths=2)
