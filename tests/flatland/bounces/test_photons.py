"""Photons as they are sent: which light, where on it, and which way."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL, chi_square, sampler_p_value
from firstorder.flatland import Scene, Segments, primitive
from firstorder.flatland.bounces import photons
from firstorder.flatland.bounces._light_sampling import lights
from firstorder.flatland.bounces.photons import trace_photons
from firstorder.sampling import UniformDirections
from tests.flatland.worlds import all_lights, two_rooms
from tests.samplers import COUNT, biased, turn_share, uniform_p_value


@functools.cache
def scene_and_lights():
    scene = all_lights()
    return scene, eqx.filter_jit(lights)(scene)


def numbers():
    return np.asarray(jax.random.uniform(jax.random.key(11), (2 * COUNT, 4)))


def sent(u):
    """Places, directions and own shapes of photons, and which of the lights each is from."""
    scene, where = scene_and_lights()
    place, along, _, on = eqx.filter_jit(photons._sent)(scene, where, jnp.asarray(u))
    at_point = np.all(np.asarray(place) == np.asarray(scene.points.position[0]), -1)
    light = np.where(at_point, "point", np.array(["lamp", "floor", "circle", "sky"])[on])
    return *(np.asarray(a) for a in (place, along)), light


def across(along, normal):
    """The sine of directions about a normal as a share: uniform where they come by the cosine."""
    return 0.5 * (1.0 + normal[..., 0] * along[:, 1] - normal[..., 1] * along[:, 0])


def p_values(u):
    """Chances of what is seen, by the light that sends it and by which of the lights are taken."""
    _, where = scene_and_lights()
    place, along, light = sent(u)
    order = {"point": 0, "lamp": 1, "circle": 3, "sky": -1}
    counts = np.array([np.sum(light == name) for name in order])
    chance = np.asarray(where.pick.probability)[list(order.values())]
    of = {name: (place[light == name], along[light == name]) for name in order}
    x, down = of["lamp"][0], np.array([0.0, -1.0])
    out = (of["circle"][0] - (1.5, 0.5)) / 0.2
    far, away = of["sky"]
    beside = far - np.asarray(where.center)
    offset = (beside[:, 1] * away[:, 0] - beside[:, 0] * away[:, 1]) / float(where.radius)
    angle = np.arctan2(away[:, 0], -away[:, 1])
    return {
        "pick": chi_square(counts, len(u) * chance),
        "lamp": uniform_p_value(np.stack([x[:, 0] + 0.5, across(of["lamp"][1], down)], -1)),
        "circle": uniform_p_value(
            np.stack(
                [turn_share(np.arctan2(out[:, 1], out[:, 0])), across(of["circle"][1], out)], -1
            )
        ),
        "point": uniform_p_value(turn_share(np.arctan2(*of["point"][1].T))),
        "sky": uniform_p_value(0.5 * (offset + 1.0)),
        "sky's angle": sampler_p_value(angle, where.sky.density, -np.pi, np.pi),
    }


def test_what_is_sent():
    found = p_values(numbers())
    assert min(found.values()) > LEVEL / len(found), found


@pytest.mark.parametrize(
    ("column", "seen"),
    [
        (0, {"pick"}),
        (1, {"lamp", "circle", "sky"}),
        (2, {"lamp", "circle", "point"}),
    ],
)
def test_numbers_that_are_not_uniform_are_noticed(column, seen):
    found = p_values(biased(numbers(), column))
    assert {name for name, p in found.items() if p < LEVEL} >= seen


def test_light_that_leaves_all_ways_alike_is_noticed(monkeypatch):
    monkeypatch.setattr(photons, "CosineDirections", UniformDirections)
    monkeypatch.setattr(photons, "_sent", functools.partial(photons._sent))  # traced again
    found = p_values(numbers())
    assert {name for name, p in found.items() if p < LEVEL} == {"lamp", "circle"}


def test_a_photon_is_on_a_shape_where_it_lands_and_on_none_where_it_does_not():
    """A lamp over a floor, and nothing else that a photon could meet."""
    lamp, floor = Segments((0.5, 1.0), (-0.5, 1.0)), Segments((-1.0, 0.0), (1.0, 0.0))
    scene = Scene.of(primitive(lamp, emission=1.0), primitive(floor))
    found = trace_photons(scene, jax.random.key(0), 4096, 0)
    index, flux = np.asarray(found.index).ravel(), np.asarray(found.flux).ravel()
    # Hottel: crossed strings less uncrossed ones, two of each, over twice the lamp's length of one.
    share = np.hypot(1.5, 1.0) - np.hypot(0.5, 1.0)
    assert set(index) == {-1, 1}
    assert abs(np.mean(index == 1) - share) < 4.0 * np.sqrt(share * (1.0 - share) / len(index))
    assert np.all(flux[index == 1] > 0.0)


@pytest.mark.parametrize("lamp", [0.0, 1.0])
def test_a_sun_between_the_nodes_of_the_table_sends_its_photons(lamp):
    """Of 0.008 rad, over a floor of length 2 that does not see the lamp."""
    far = Segments((3.0, -1.0), (2.0, -1.0))
    scene = Scene.of(
        primitive(Segments((-1.0, 0.0), (1.0, 0.0))),
        primitive(far, emission=lamp),
        environment=lambda a: jnp.where(jnp.abs(a) < 0.004, 125.0, 0.0),
    )
    found = trace_photons(scene, jax.random.key(0), 400_000, 0)
    flux = np.where(np.asarray(found.index[0]) == 0, found.flux[0], 0.0)
    assert abs(flux.sum() - 2.0) < 4.0 * np.sqrt((flux**2).sum())
    assert np.count_nonzero(flux) > 20


@pytest.mark.parametrize("lamps", [(1.0,), (1.0, 1.0), (3.0, 1.0)])
def test_a_lamp_drawn_on_a_turned_wall_sends_all_its_light_and_hides_what_is_drawn_before(lamps):
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])

    def line(start, end):
        return Segments(np.array(start) @ turn, np.array(end) @ turn)

    wall, floor = line((1.0, 1.0), (-1.0, 1.0)), line((-1.0, 0.0), (1.0, 0.0))
    drawn = [primitive(line((0.5, 1.0), (-0.5, 1.0)), emission=L) for L in lamps]
    scene = Scene.of(primitive(wall), primitive(floor), *drawn)
    found = trace_photons(scene, jax.random.key(0), 20_000, 0)
    index, flux = np.asarray(found.index[0]), np.asarray(found.flux[0])
    assert set(index) == {-1, 1}
    share = np.hypot(1.5, 1.0) - np.hypot(0.5, 1.0)  # Hottel's crossed strings
    assert abs(flux.sum() - 2.0 * share) < 4.0 * np.sqrt((flux**2).sum())


def test_no_photon_passes_a_wall_that_two_rooms_share():
    """Each room draws it, and neither lies along the axes."""
    scene, _ = two_rooms(0.3)
    found = trace_photons(scene, jax.random.key(0), 4096, 8)
    assert set(np.unique(found.index)) == {-1, 0, 2, 3, 7}  # of the wall they share the later
