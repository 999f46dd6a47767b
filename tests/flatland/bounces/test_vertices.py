"""What paths of flatland meet, and light that is sampled from there: by hand."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Circles, PointLights, Scene, Segments, primitive
from firstorder.flatland.bounces import _light_sampling as sampling
from firstorder.flatland.bounces import _vertices as vertices
from firstorder.flatland.bounces._scatter import Scattered, Surface, scatter

UP, RIGHT = np.array([0.0, 1.0]), np.array([1.0, 0.0])
FLOOR = primitive(
    Segments((-5.0, 0.0), (5.0, 0.0)), emission=(0.5, 0.7), albedo=(0.2, 0.3), mirror=0.1, ior=1.5
)
BALL = primitive(
    Circles((1.0, 3.0), 1.0), emission=(2.0, 4.0), albedo=(0.4, 0.6), specular=0.3, exponent=7.0
)
SCENE = Scene.of(FLOOR, BALL)
PLAN = vertices.Plan(None, jnp.array(1.0), True, scatter)
lights = eqx.filter_jit(sampling.lights)
meet = eqx.filter_jit(vertices.meet)
sample = eqx.filter_jit(vertices.sampled_light)
# Fluxes of sides, `2 L length`: both fronts, both backs.
FLUX = np.array([2 * 0.5 * 10.0, 2 * 2.0 * 2 * np.pi, 2 * 0.7 * 10.0, 2 * 4.0 * 2 * np.pi])
SLANT = np.array([0.6, -0.8])

RAYS = {  # start, direction; shape, front?, place, normal, speed there, distance
    "the floor": ((-3.0, 4.0), SLANT, 0, True, (0.0, 0.0), UP, 10.0, 5.0),
    "the floor from below": ((-3.0, -2.0), UP, 0, False, (-3.0, 0.0), -UP, 10.0, 2.0),
    "the ball": ((-2.0, 3.6), RIGHT, 1, True, (0.2, 3.6), (-0.8, 0.6), 2 * np.pi, 2.2),
    "the ball from inside": ((1.0, 3.0), SLANT, 1, False, (1.6, 2.2), -SLANT, 2 * np.pi, 1.0),
}


# Two more start from shapes, and one meets nothing.
STARTS = [*(ray[0] for ray in RAYS.values()), (1.0, 0.0), (1.0, 2.0), (-3.0, 4.0)]
WAYS = [*(ray[1] for ray in RAYS.values()), UP, UP, (-0.6, 0.8)]


@pytest.fixture(scope="module")
def met():
    on = jnp.array([-1, -1, -1, -1, 0, 1, -1])
    return meet(SCENE, lights(SCENE), jnp.asarray(STARTS), on, jnp.asarray(np.array(WAYS)), PLAN)


@pytest.mark.parametrize("name", RAYS)
def test_a_ray_meets_a_side_of_a_shape(name, met):
    _, along, number, front, place, normal, speed, far = RAYS[name]
    along, normal = np.asarray(along), np.asarray(normal)
    got = jax.tree.map(lambda a: a[[*RAYS].index(name)], met)
    step = float(lights(SCENE).step)
    assert got.there
    assert got.front == front
    here = got.vertex
    assert here.on == number
    t = np.array([normal[1], -normal[0]])  # the normal is to the left of it
    np.testing.assert_allclose(here.tangent, t, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(here.sine, along @ t, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(here.cosine, -along @ normal, rtol=0.0, atol=1e-12)
    # A step before the side that is met, which is tiny.
    np.testing.assert_allclose(here.position, np.array(place) + step * normal, rtol=0.0, atol=1e-12)
    assert 0.5 * step < (np.asarray(here.position) - np.array(place)) @ normal < 1e-6
    side = 0 if front else 1
    m = here.surface
    np.testing.assert_allclose(got.radiance, ((0.5, 0.7), (2.0, 4.0))[number][side])
    np.testing.assert_allclose(m.albedo, ((0.2, 0.3), (0.4, 0.6))[number][side])
    np.testing.assert_allclose(m.mirror, (0.1, 0.0)[number])
    np.testing.assert_allclose(m.specular, (0.0, 0.3)[number])
    np.testing.assert_allclose(m.exponent, (0.0, 7.0)[number])
    np.testing.assert_allclose(m.ior, ((1.5, 1.0 / 1.5), (0.0, 0.0))[number][side])
    chance = FLUX[number + 2 * side] / FLUX.sum()
    np.testing.assert_allclose(got.density, chance * far / (speed * abs(along @ normal)), rtol=1e-9)


def test_the_parameter_is_that_of_the_shape(met):
    np.testing.assert_allclose(met.s[:2], [0.5, 0.2], rtol=1e-12)


def test_a_ray_does_not_meet_the_place_that_it_starts_from(met):
    np.testing.assert_array_equal(met.vertex.on[4:6], [1, 1])
    np.testing.assert_allclose(met.vertex.position[4:6, 1], [2.0, 4.0], rtol=0.0, atol=1e-6)


def test_rays_that_meet_nothing_find_the_sky_or_the_dark(met):
    """The sky's angle is counter-clockwise from +y."""
    assert not met.there[6]
    assert met.radiance[6] == 0.0
    lit = Scene.of(FLOOR, BALL, environment=lambda theta: 9.0 + theta)
    along = np.array([*((-np.sin(a), np.cos(a)) for a in (0.3, -1.2)), SLANT])
    start = jnp.array([[-3.0, 4.0], [3.0, 4.0], [-3.0, 4.0]])
    got = meet(lit, where := lights(lit), start, jnp.full(3, -1), jnp.asarray(along), PLAN)
    assert got.there.tolist() == [False, False, True]
    np.testing.assert_allclose(got.radiance, [9.3, 7.8, 0.5], rtol=1e-12)
    chance = np.asarray(where.pick.probability)[-1]
    pieces = np.pi * ((np.arange(256) + 0.5) / 128.0 - 1.0)
    table = 0.9 * (9.0 + pieces) + 0.1 * 9.0
    k = np.floor((np.array([0.3, -1.2]) + np.pi) / (2.0 * np.pi) * 256).astype(int)
    true = chance * table[k] / (table.mean() * 2.0 * np.pi)
    np.testing.assert_allclose(got.density[:2], true, rtol=1e-12)
    chance = FLUX[0] / FLUX.sum() * (1.0 - chance)
    np.testing.assert_allclose(got.density[2], chance * 5.0 / (10.0 * 0.8), rtol=1e-9)


# --- light that is sampled -----------------------------------------------------------------------

LAMP = primitive(Segments((1.0, 2.0), (-1.0, 2.0)), emission=3.0)  # looks down
WALL = primitive(Segments((0.4, 1.0), (0.6, 1.0)))


def vertex(albedo=0.8, specular=0.0):
    """Three places of a floor, from which rays came at an angle of 30 degrees."""
    surface = Surface(*(jnp.full(3, a) for a in (albedo, 0.0, specular, 5.0, 0.0)))
    place = jnp.array([[0.0, 0.0], [0.5, 0.0], [3.0, 0.0]])
    return vertices.Vertex(
        place, jnp.tile(jnp.asarray(RIGHT), (3, 1)), jnp.full(3, 0.5), jnp.full(3, np.sqrt(0.75)),
        surface, jnp.full(3, -1),
    )  # fmt: skip


def sampled(scene, here, s, survive=0.0, glossy=True):
    u = jnp.column_stack([jnp.full(3, 0.5), jnp.full(3, s)])
    plan = PLAN._replace(glossy=glossy)
    return sample(scene, lights(scene), here, u, jnp.asarray(survive), plan)


def by_hand(s, albedo, specular, survive):
    """`f cos L / (r / (speed cos_y) + survive pdf)` at s of the lamp, without blockers."""
    place = np.array([[0.0, 0.0], [0.5, 0.0], [3.0, 0.0]])
    way = np.array([1.0 - 2.0 * s, 2.0]) - place
    r = np.linalg.norm(way, axis=1)
    w = way / r[:, None]
    # Rays came from 30 degrees counter-clockwise, so the mirrored direction is 30 to the right.
    lobe = specular * np.maximum(w @ np.array([0.5, np.sqrt(0.75)]), 0.0) ** 5
    area = [_hemicircle(n) for n in (5, 6)]
    f = 0.5 * albedo * w[:, 1] + lobe * w[:, 1] / area[1]
    pdf = (0.5 * albedo * w[:, 1] + lobe / area[0]) / (albedo + specular)
    return f * 3.0 / (r / (2.0 * w[:, 1]) + survive * pdf)


def _hemicircle(n):
    """`int cos^n` over half a turn."""
    t = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20_001)
    return np.trapezoid(np.cos(t) ** n, t)


@pytest.mark.parametrize("survive", [0.0, 0.7])
@pytest.mark.parametrize("specular", [0.0, 0.2])
def test_light_of_a_lamp_is_weighed_by_both_densities(survive, specular):
    got = sampled(Scene.of(LAMP), vertex(0.6, specular), 0.2, survive)
    np.testing.assert_allclose(got, by_hand(0.2, 0.6, specular, survive), rtol=1e-7)


def test_without_gloss_lobes_are_left_out():
    got = sampled(Scene.of(LAMP), vertex(0.6, 0.2), 0.2, 0.0, False)
    np.testing.assert_allclose(got, by_hand(0.2, 0.6, 0.0, 0.0), rtol=1e-9)


def test_what_stands_between_hides_a_lamp_and_its_back_is_dark():
    free, hidden = by_hand(0.25, 0.8, 0.0, 0.0), np.array([True, False, True])
    got = sampled(Scene.of(LAMP, WALL), vertex(), 0.25)
    np.testing.assert_allclose(got, np.where(hidden, free, 0.0), rtol=1e-9)
    back = primitive(Segments((-1.0, 2.0), (1.0, 2.0)), emission=3.0)
    np.testing.assert_array_equal(sampled(Scene.of(back), vertex(), 0.25), 0.0)


@pytest.mark.parametrize("survive", [0.0, 0.7])
def test_a_point_light_is_met_by_no_ray(survive):
    """`f I / r`, whatever the surface would draw."""
    scene = Scene.of(WALL, points=PointLights((0.5, 2.0), 4.0))
    got = sampled(scene, vertex(), 0.3, survive)
    way = np.array([0.5, 2.0]) - np.array([[0.0, 0.0], [0.5, 0.0], [3.0, 0.0]])
    r = np.linalg.norm(way, axis=1)
    true = 0.4 * (way[:, 1] / r) * 4.0 / r
    np.testing.assert_allclose(got, true * [1, 0, 1], rtol=1e-9)


def test_a_scattered_ray_leaves_in_the_plane():
    n = np.array([[0.6, 0.8]])
    here = vertex()._replace(tangent=jnp.array([[0.8, -0.6]]))
    one = jnp.ones(1)
    turned = Scattered(jnp.array([0.28]), jnp.array([0.96]), one, one, jnp.array([False]))
    true = 0.96 * n - 0.28 * np.array([[0.8, -0.6]])
    np.testing.assert_allclose(vertices.plane_direction(here, turned), true, rtol=1e-14)


def test_gloss_is_looked_for_and_supposed_where_nobody_can_know():
    assert vertices.has_gloss(SCENE)
    assert not vertices.has_gloss(Scene.of(FLOOR))
    known = []
    jax.jit(lambda s: known.append(vertices.has_gloss(s)))(Scene.of(FLOOR))
    assert known == [True]
