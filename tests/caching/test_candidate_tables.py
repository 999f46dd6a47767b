import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import caching
from firstorder.caching import candidate_tables
from firstorder.caching.candidate_tables import gather_directions, tabulate_candidates
from firstorder.checks.statistics import LEVEL
from firstorder.space import Scene, box, plane, primitive, rectangle, sphere
from firstorder.space.bounces._radiance_maps import RadianceMaps, face_layout, trace_maps
from firstorder.space.estimators._irradiance_forms import (
    TracedRays,
    gather_samples,
    stratified_estimate,
    surface_area_estimate,
)
from firstorder.space.estimators.strata import Strata
from firstorder.space.library import _scenes, j12_box
from firstorder.space.receiver import receiver
from tests.samplers import disc_place, uniform_p_value

PLACES = np.array([[0.333, 0.333], [0.667, 0.3], [0.667, 0.55]])  # between the boxes


def lit(scene, cells=4):
    rng = np.random.default_rng(5)
    return RadianceMaps(
        scene, jnp.asarray(rng.uniform(0.2, 1.0, (len(face_layout(scene).shape), cells, cells)))
    )


@pytest.fixture(scope="module", params=["j12_occluder", "clutter"])
def both(request):
    """The table, and what the general forms make of the very same rays."""
    scene = _scenes.named_scene(request.param)
    (floor,) = scene.named("floor")
    maps, given = lit(scene), gather_directions(12, 20, sets=1)
    cells = Strata(
        jnp.asarray(given.theta),
        jnp.asarray(given.phi),
        jnp.moveaxis(jnp.asarray(given.directions[0], float), 0, -1),
        jnp.pi / 240 / jnp.asarray(given.directions[0, 2], float),
    )

    @jax.jit
    def seen(o, d):
        return trace_maps(maps, tuple(o.T), tuple(d.T), floor)

    def trace(o, d, on):
        s = seen(o, d)
        return TracedRays(s.distance, s.index, jnp.stack(s.normal, -1))

    at = receiver(np.append(PLACES, np.zeros((3, 1)), 1))

    def sample(white):
        def radiance(index, point, normal, d):
            o = jnp.repeat(at.position, 240, 0)
            return jnp.where(white, 1.0, seen(o, d).radiance)

        return gather_samples(trace, radiance, at, cells)

    samples, plain = sample(False), sample(True)
    forms = (
        surface_area_estimate(samples),
        stratified_estimate(samples),
        surface_area_estimate(plain),
        samples,
    )
    return lambda: tabulate_candidates(maps, PLACES, given, floor), forms


def worst(table, forms):
    area, strata, plain, samples = forms
    r = np.asarray(samples.distance).reshape(3, -1)
    pairs = [
        (table.E, strata.value),
        (table.gradient, strata.translation().gradient),
        (table.area_gradient, area.translation().gradient),
        (table.hessian, area.translation().hessian),
        (table.geometric, plain.translation().hessian),
        (table.minimum, r.min(1)),
        (table.harmonic, 1.0 / np.mean(1.0 / r, 1)),
        (table.brightest, np.asarray(samples.radiance).reshape(3, -1).max(1)),
    ]
    return max(np.max(np.abs(a - np.asarray(b))) / np.max(np.abs(b)) for a, b in pairs)


BOUND = 3e-4  # sums of single precision terms, 1 / cos large at grazing hits


@pytest.mark.smoke
def test_a_table_is_what_the_general_forms_make_of_the_same_rays(both):
    make, forms = both
    assert worst(make(), forms) < BOUND


def wrong_walls(self, L, inverse):
    return 0.5 * RIGHT(self, L, inverse)


RIGHT = candidate_tables._Look._walls


def nearer(solid, ready, o):
    return 1.01 * DISTANCE(solid, ready, o)


DISTANCE = candidate_tables._distance


@pytest.mark.parametrize(
    ("owner", "name", "fault"),
    [(candidate_tables._Look, "_walls", wrong_walls), (candidate_tables, "_distance", nearer)],
)
def test_a_fault_is_noticed(both, owner, name, fault, monkeypatch):
    make, forms = both
    monkeypatch.setattr(owner, name, fault)
    assert worst(make(), forms) > 10.0 * BOUND


def test_black_wall_and_none_give_the_same_radiometry():
    found = []
    for wall in ("black", "none"):
        scene = _scenes.j12_box(wall)
        L = np.zeros((scene.count, 2, 2))
        L[scene.named("left")[0]] = 0.3
        found.append(
            tabulate_candidates(
                RadianceMaps(scene, jnp.asarray(L)), PLACES, gather_directions(8, 12), 0
            )
        )
    black, none = found
    for name in ("E", "gradient", "hessian"):
        assert np.array_equal(getattr(black, name), getattr(none, name)), name
    assert np.all(black.minimum <= none.minimum)
    assert not np.array_equal(black.harmonic, none.harmonic)


def test_noise_keeps_the_mean_and_other_shapes_are_refused():
    given = gather_directions(30, 40, sets=2, noise=True)
    assert given.noise is not None
    assert abs(given.noise.mean() - 1.0) < 5.0 / np.sqrt(3.0 * given.noise.size)
    scene = Scene.of(primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor"))
    with pytest.raises(ValueError, match="`maps` must have shapes of"):
        tabulate_candidates(RadianceMaps(scene, jnp.zeros((0, 2, 2))), PLACES, given, 0)
    with pytest.raises(ValueError, match="`rows` must be a positive integer"):
        gather_directions(0, 4)
    assert jax.tree.leaves(gather_directions(2, 2, sets=1))[0].dtype == np.float32


def test_gather_directions_come_by_their_cosine():
    """Projected to the disc they are uniform in every cell; the noise is uniform in [0, 2]."""
    given = gather_directions(2, 3, sets=6000, seed=3, noise=True)
    w = np.moveaxis(np.asarray(given.directions, float), 1, -1)
    places = disc_place(w[..., :2].reshape(-1, 2)).reshape(*w.shape[:-1], 2)
    places = np.mod(places * (2, 3), 1.0)
    for row in range(2):
        assert uniform_p_value(np.clip(places[:, row, 0], 0.0, 1.0)) > LEVEL / 2
    assert uniform_p_value(np.sqrt(places[:, 0, 0])) < LEVEL
    noise = given.noise
    assert noise is not None
    assert uniform_p_value(0.5 * noise[:, 0, 0]) > LEVEL


@pytest.mark.parametrize("strips", [4, 150])
def test_a_lamp_of_many_strips_is_a_lamp(strips):
    """More shapes than a byte can number."""
    floor = primitive(rectangle((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0)))
    middles = -1.0 + (2.0 * np.arange(strips) + 1.0) / strips
    lamps = [
        primitive(rectangle((x, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0 / strips, 0.0, 0.0)), emission=1.0)
        for x in middles
    ]
    scene, given = Scene.of(floor, *lamps), gather_directions(16, 32)
    maps = RadianceMaps(scene, jnp.ones((len(face_layout(scene).shape), 2, 2)))
    found = tabulate_candidates(maps, np.array([[0.3, 0.2]]), given, on=0)
    wx, wy, wz = given.directions[0].astype(float)
    hit = (np.abs(0.3 + wx / wz) < 1.0) & (np.abs(0.2 + wy / wz) < 1.0)
    assert found.E[0] == pytest.approx(np.pi * np.mean(hit), rel=1e-6)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"on": 99}, "`on` must be the number of a shape"),
        ({"on": -1}, "`on` must be the number of a shape"),
        ({"position": np.zeros(2)}, "`position` must have shape"),
        ({"position": np.zeros((1, 3))}, "`position` must have shape"),
        ({"position": np.full((1, 2), np.nan)}, "`position` must be finite"),
        ({"height": np.nan}, "`height` must be finite"),
    ],
)
def test_places_and_their_floor_are_checked(wrong, words):
    maps = RadianceMaps(j12_box(), jnp.ones((4, 2, 2)))
    given = {"position": np.zeros((1, 2)), "on": 0, "height": 0.0, **wrong}
    directions = caching.gather_directions(2, 4, sets=1)
    with pytest.raises(ValueError, match=words):
        caching.tabulate_candidates(
            maps, given["position"], directions, given["on"], given["height"]
        )
    with pytest.raises(ValueError, match=words):
        caching.occlusion_table(maps, given["position"], given["on"], given["height"], rays=16)
    with pytest.raises(ValueError, match="Argument `seed` must not be negative"):
        caching.gather_directions(2, 4, seed=-1)


@pytest.mark.parametrize("last", ["lamp", "wall"])
def test_a_lamp_drawn_on_a_wall_is_seen(last):
    """The wall, if it came first, once hid it; against rays that meet one plane."""
    floor = rectangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    wall, lamp = (
        rectangle((0.0, 0.0, 1.3), (0.0, side, 0.0), (side, 0.0, 0.0)) for side in (1.0, 0.3)
    )
    things = [primitive(wall), primitive(lamp, emission=5.0)][:: 1 if last == "lamp" else -1]
    sent = [0.0, 1.0, 5.0] if last == "lamp" else [0.0, 5.0, 1.0]
    maps = RadianceMaps(
        Scene.of(primitive(floor), *things), jnp.asarray(sent)[:, None, None] * jnp.ones((2, 2))
    )
    given, place = gather_directions(16, 32, sets=1), np.array([0.1, 0.2])
    table = tabulate_candidates(maps, place[None], given, 0)
    x, y, z = given.directions[0].reshape(3, -1)
    size = np.max(np.abs(place[:, None] + 1.3 * np.stack([x, y]) / z), axis=0)
    seen = np.where(size < 0.3, 5.0, np.where(size < 1.0, 1.0, 0.0))
    assert np.sum(size < 0.3) > 10
    np.testing.assert_allclose(table.E, np.pi * np.mean(seen), rtol=1e-6)


def test_maps_of_several_bands_are_refused():
    """The table once took bands for cells, and gave one number for all of them."""
    maps, place = RadianceMaps(j12_box(), jnp.ones((4, 2, 2, 3))), np.full((1, 2), 0.5)
    words = r"^Argument `maps.L` must have shape \(4, 2, 2\), but has \(4, 2, 2, 3\)\.$"
    with pytest.raises(ValueError, match=words):
        tabulate_candidates(maps, place, gather_directions(2, 4, sets=1), 0)
    with pytest.raises(ValueError, match=words):
        caching.occlusion_table(maps, place, 0, rays=16)


def test_a_table_of_no_place_is_none():
    maps = RadianceMaps(j12_box(), jnp.ones((4, 2, 2)))
    with pytest.raises(ValueError, match="must hold at least one place"):
        caching.occlusion_table(maps, np.zeros((0, 2)), 0, rays=16)


@pytest.mark.parametrize(
    "room",
    [box((-0.4, -0.5, -0.3), (0.7, 0.5, 1.2)), sphere((0.0, 0.1, 0.2), 0.8)],
    ids=["box", "ball"],
)
def test_a_place_in_a_closed_shape_sees_its_dark_inside(room):
    """It once saw through it, to the lamp; against rays one by one."""
    floor, lamp = (
        rectangle((0.0, 0.0, z), (0.0, 2.0, 0.0), (s, 0.0, 0.0))
        for z, s in ((0.0, -2.0), (3.0, 2.0))
    )
    scene = Scene.of(primitive(floor, name="floor"), primitive(lamp), primitive(room))
    maps, (on,) = lit(scene), scene.named("floor")
    given, place = gather_directions(12, 20, sets=1), np.array([0.1, 0.2])
    table = tabulate_candidates(maps, place[None], given, on)
    d = jnp.asarray(given.directions[0].reshape(3, -1), float)
    hits = trace_maps(maps, tuple(jnp.full(240, a) for a in (*place, 0.0)), tuple(d), on)
    assert table.E == 0.0 == np.max(hits.radiance)
    np.testing.assert_allclose(table.minimum, np.min(hits.distance), rtol=1e-5)
    np.testing.assert_allclose(table.harmonic, 1.0 / np.mean(1.0 / hits.distance), rtol=1e-5)


@pytest.mark.parametrize("far", [1e5, 1e7])
def test_a_lamp_behind_a_ceiling_stays_hidden_far_from_the_origin(far):
    """Places are rounded in double precision; a lamp once shone through as in single."""
    P, given, tables = np.array([[0.3, 0.2], [-0.4, 0.1]]), gather_directions(8, 32, sets=1), []
    for x in (0.0, far):
        floor, ceiling, lamp, block = (
            rectangle((x, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
            rectangle((x, 0.0, 1.0), (0.0, 2.0, 0.0), (2.0, 0.0, 0.0)),
            rectangle((x, 0.0, 1.03125), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),
            box((x + 0.5, -0.5, 0.0), (x + 0.75, 0.5, 0.25)),
        )
        scene = Scene.of(
            primitive(floor),
            primitive(block),
            primitive(ceiling, name="ceiling"),
            primitive(lamp, emission=8.0, name="lamp"),
        )
        L = np.zeros((len(face_layout(scene).shape), 1, 1))
        for name, sent in (("ceiling", 0.5), ("lamp", 8.0)):
            L[face_layout(scene).first[scene.named(name)[0]]] = sent
        maps = RadianceMaps(scene, jnp.asarray(L))
        tables.append(tabulate_candidates(maps, P + np.array([x, 0.0]), given, 0))
    near, away = tables
    for name in ("E", "gradient", "hessian", "minimum", "harmonic"):
        np.testing.assert_allclose(getattr(away, name), getattr(near, name), rtol=1e-6, atol=1e-6)
    assert np.all(near.brightest == 0.5)
