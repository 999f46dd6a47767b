"""Random paths against scenes whose light is known: furnaces, closed forms, quadrature."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import error_slope, z_test_of
from firstorder.checks.tolerance import normwise, rounding
from firstorder.space import Scene, ellipsoid, plane, primitive, receiver
from firstorder.space.bounces import pathtrace
from firstorder.space.bounces.pathtrace import path_irradiance, path_radiance
from firstorder.space.direct_lighting import irradiance
from firstorder.space.library._scenes import _floor, _lamp, _walls, j12_box

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


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda s, k: path_irradiance(s, on_floor(s), key=k, paths=1), "at least 2"),
        (
            lambda s, k: path_irradiance(s, on_floor(s), key=k, paths=4, bounces=-1),
            "not be negative",
        ),
        (lambda s, k: path_irradiance(s, on_floor(s), key=k, paths=4, survival=1.0), "`survival`"),
    ],
)
def test_bad_input_is_one_sentence(ask, words, furnace, key):
    with pytest.raises(ValueError, match=words):
        ask(furnace, key)


def test_the_lamp_of_the_library_is_sampled():
    """A closed scene of one lamp: which shapes are sampled follows from what shines."""
    scene = Scene.of(_floor(0.5), _lamp((0.5, 0.5, 1.0), 0.2, 1.0))
    assert pathtrace._lights(scene) == scene.named("light")
