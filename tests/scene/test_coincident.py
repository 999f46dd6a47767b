"""Surfaces in the same place: what shines is seen, whatever the order, turn and rounding."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder.checks.tolerance import normwise
from firstorder.numerics._compiled import own_programs
from firstorder.scene import _intersect

TURNS = 60


def in_flatland(rng):
    """A lamp on a wall and a receiver, turned and moved: coordinates of both, and where it is."""
    angle, away = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-3.0, 3.0, 2)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x = rng.uniform(-1.9, 1.7)
    wall, lamp = [(2.0, 1.0), (-2.0, 1.0)], [(x + rng.uniform(0.01, 0.3), 1.0), (x, 1.0)]
    at = [(rng.uniform(-5.0, 5.0), 1.0 - 10.0 ** rng.uniform(-3.0, 0.5))]
    wall, lamp, at = (jnp.asarray(np.array(a) @ turn.T + away) for a in (wall, lamp, at))
    return wall, lamp, (at[0], jnp.asarray(angle))


def flat_light(things, where):
    scene = flatland.Scene.of(*(flatland.primitive(flatland.Segments(*c), **m) for c, m in things))
    return flatland.irradiance(scene, flatland.Receiver(*where))


def in_space(rng):
    """The same in space: centre and half axes of rectangles."""
    turn, away = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.uniform(-3.0, 3.0, 3)
    x, y = rng.uniform(-1.5, 1.5, 2)
    wall = np.array([(0.0, 0.0, 1.0), (0.0, 2.0, 0.0), (2.0, 0.0, 0.0)])
    lamp = np.array([(x, y, 1.0), (0.0, 0.2, 0.0), (0.3, 0.0, 0.0)])
    at = np.array([*rng.uniform(-4.0, 4.0, 2), 1.0 - 10.0 ** rng.uniform(-2.0, 0.5)])
    aside = np.array([away, np.zeros(3), np.zeros(3)])
    wall, lamp = (jnp.asarray(a @ turn.T + aside) for a in (wall, lamp))
    up = turn @ (np.array([0.0, 0.0, 1.0]) + 0.3 * rng.normal(size=3))
    return wall, lamp, (jnp.asarray(turn @ at + away), jnp.asarray(up))


def light_in_space(things, where):
    scene = space.Scene.of(*(space.primitive(space.rectangle(*c), **m) for c, m in things))
    return space.irradiance(scene, space.receiver(*where))


WORLDS = {"flatland": (in_flatland, flat_light), "space": (in_space, light_in_space)}
DARK, BRIGHT = {"albedo": 0.5}, {"emission": 1.0}


def with_gradients(light):
    """Irradiance and its gradient by the lamp and the receiver: lamp alone, and both orders."""

    def among(lamp, where, wall, which):
        things = {
            "alone": [(lamp, BRIGHT)],
            "first": [(lamp, BRIGHT), (wall, DARK)],
            "last": [(wall, DARK), (lamp, BRIGHT)],
        }
        return light(things[which], where)

    found = jax.value_and_grad(among, argnums=(0, 1))
    return jax.jit(lambda wall, lamp, where: [found(lamp, where, wall, w) for w in ORDERS])


ORDERS = ("alone", "first", "last")


@pytest.mark.parametrize("world", WORLDS)
def test_a_lamp_on_a_wall_shines_as_if_there_were_no_wall(world):
    cases, light = WORLDS[world]
    rng, asked, bright = np.random.default_rng(7), with_gradients(light), 0
    for _ in range(TURNS):
        alone, *orders = (jax.tree.leaves(found) for found in asked(*cases(rng)))
        bright += float(alone[0]) > 1e-3
        for found in orders:
            assert all(normwise(a, b) < 1e-9 for a, b in zip(found, alone, strict=True))
    assert bright > TURNS / 4


@pytest.mark.parametrize("world", WORLDS)
def test_a_search_by_rounding_alone_loses_lamps(world, monkeypatch):
    monkeypatch.setattr(_intersect, "tie", lambda dtype: 0.0)
    with own_programs(), pytest.raises(AssertionError):
        test_a_lamp_on_a_wall_shines_as_if_there_were_no_wall(world)


def test_of_two_lamps_in_the_same_place_the_later_one_is_seen():
    wall = (-1.0, 1.0), (1.0, 1.0)
    for first, last in ((1.0, 3.0), (3.0, 1.0)):
        both = [((wall), {"emission": (e, e)}) for e in (first, last)]
        found = flat_light(both, ((0.1, 0.0), 0.0))
        np.testing.assert_allclose(found, flat_light(both[1:], ((0.1, 0.0), 0.0)))


@pytest.mark.parametrize("count", [3, 40])
def test_rays_end_on_the_lamp_among_few_shapes_and_among_many(count):
    """In one reduction, and in a scan by kinds: a disc on a rectangle, in either order."""
    balls = [space.primitive(space.sphere((9.0 + k, 9.0, 9.0), 0.1)) for k in range(count)]
    wall = space.primitive(space.rectangle((0.1, 0.2, 1 / 3), (1.0, 0.1, 0.3), (0.1, 1.0, 0.2)))
    disc = space.primitive(
        space.disc((0.1, 0.2, 1 / 3), np.cross((1.0, 0.1, 0.3), (0.1, 1.0, 0.2)), 0.5), emission=1.0
    )
    rng = np.random.default_rng(1)
    ends = np.array([0.1, 0.2, 1 / 3]) + 0.3 * (
        rng.uniform(-1.0, 1.0, (200, 1)) * [1.0, 0.1, 0.3]
        + rng.uniform(-1.0, 1.0, (200, 1)) * [0.1, 1.0, 0.2]
    )
    eye = np.array([0.3, -0.2, -1.7])
    along = (ends - eye) / np.linalg.norm(ends - eye, axis=1, keepdims=True)
    for things in ([wall, *balls, disc], [disc, *balls, wall]):
        scene = space.Scene.of(*things)
        found = space.first_shape(scene, jnp.broadcast_to(eye, along.shape), jnp.asarray(along))
        emission = np.asarray(scene.material.emission)
        assert np.all(np.any(emission[np.asarray(found)] > 0.0, axis=1))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_far_from_the_origin_a_wall_casts_no_shadow_on_a_lamp_drawn_on_it(dtype):
    """Where coordinates round by more than the share of a distance that tells surfaces apart."""
    away = 0.1 / np.finfo(dtype).eps ** 0.5
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    wall, lamp = (
        (np.array(ends) @ turn + away).astype(dtype)
        for ends in ([(2.0, 1.0), (-2.0, 1.0)], [(1.0, 1.0), (-1.0, 1.0)])
    )
    scene = flatland.Scene.of(
        *(flatland.primitive(flatland.Segments(*ends)) for ends in (wall, lamp))
    )
    share = np.linspace(0.05, 0.95, 100, dtype=dtype)[:, None]
    ends = lamp[0] + share * (lamp[1] - lamp[0])
    start = np.broadcast_to((np.array([0.3, 0.0]) @ turn + away).astype(dtype), ends.shape)
    assert not np.any(flatland.occluded(scene, start, ends, -1, 1))
