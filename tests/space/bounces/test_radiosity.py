import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.space import Scene, primitive, rectangle, sphere
from firstorder.space.bounces import radiosity as indirect
from firstorder.space.bounces._radiance_maps import face_layout
from firstorder.space.bounces.radiosity import (
    _direct,
    _lights,
    rectangle_irradiance,
    solve_radiosity,
)
from firstorder.space.library import _scenes
from tests.space import worlds

CORNERS = np.array([(0.3, 0.3, 1.0), (0.3, 0.7, 1.0), (0.7, 0.7, 1.0), (0.7, 0.3, 1.0)])


def rectangle_lights(scene, point, normal, own, shadow=4):
    return _direct(scene, point, normal, own, shadow, _lights(scene))


def by_quadrature(point, normal, count=120):
    """Irradiance from the light of the box by its definition, cosines cut at the horizon."""
    t, w = np.polynomial.legendre.leggauss(count)
    x = 0.5 + 0.2 * t
    place = np.stack([*np.meshgrid(x, x), np.ones((count, count))], -1) - point
    r2 = np.sum(place**2, -1)
    both = np.maximum(place @ normal, 0.0) * np.maximum(place[..., 2], 0.0)
    return 0.04 * np.sum(np.outer(w, w) * both / r2**2)


def places():
    rng = np.random.default_rng(3)
    point, normal = rng.uniform(0.0, 0.8, (12, 3)), rng.normal(size=(12, 3))
    return point, normal / np.linalg.norm(normal, axis=1)[:, None]


def worst():
    point, normal = places()
    ours = [
        rectangle_irradiance(*map(jnp.asarray, (p, n, CORNERS)))
        for p, n in zip(point, normal, strict=True)
    ]
    exact = [by_quadrature(p, n) for p, n in zip(point, normal, strict=True)]
    return np.max(np.abs(np.array(ours) - exact))


@pytest.mark.smoke
def test_a_rectangle_gives_what_quadrature_says():
    """Smooth where no horizon cuts the light; a kink leaves the quadrature 1 / count^2."""
    assert worst() < 2.0 / 120**2 * 0.1


def no_horizon(point, normal, corners):
    p = corners - point
    q = jnp.roll(p, -1, axis=0)
    plane = jnp.cross(p, q)
    size = jnp.linalg.norm(plane, axis=1)
    return -0.5 * jnp.sum(jnp.arctan2(size, jnp.sum(p * q, 1)) * (plane @ normal) / size)


def test_a_light_that_sinks_below_the_horizon_is_noticed(monkeypatch):
    monkeypatch.setitem(globals(), "rectangle_irradiance", no_horizon)
    assert worst() > 1e-3


def test_the_wall_of_the_box_reflects_what_its_cells_receive():
    maps = solve_radiosity(_scenes.j12_box(), cells=4, shadow=0)
    (left,) = maps.scene.named("left")
    y = (np.arange(4) + 0.5) / 4
    for j, z in enumerate(y):
        for i, across in enumerate(y):
            E = by_quadrature(np.array([0.0, across, z]), np.array([1.0, 0.0, 0.0]))
            assert abs(float(maps.L[left, j, i]) - 0.5 / np.pi * E) < 1e-6 * E
    assert not np.any(np.delete(np.asarray(maps.L), left, axis=0))


def test_a_wall_that_is_dark_in_one_band_still_sends_the_others():
    lamp = primitive(rectangle((0.0, 0.0, 1.0), (0.0, 0.2, 0.0), (0.2, 0.0, 0.0)), emission=1.0)
    wall = rectangle((-0.5, 0.0, 0.5), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5))

    def sent(albedo):
        scene = Scene.of(lamp, primitive(wall, albedo=albedo))
        return np.asarray(solve_radiosity(scene, cells=2, shadow=0).L)

    grey = sent(0.5)[..., None]
    assert np.max(grey) > 0.0
    np.testing.assert_allclose(sent((0.0, 0.2, 1.0)), grey * [0.0, 0.4, 2.0], rtol=1e-12)


def test_half_a_light_behind_a_screen_gives_half():
    lamp = rectangle((0.0, 0.0, 1.0), (0.0, 0.2, 0.0), (0.2, 0.0, 0.0))
    screen = rectangle((0.5, 0.0, 0.5), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0))
    floor = rectangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    things = [
        primitive(lamp, name="lamp", emission=2.0),
        primitive(floor, name="floor", albedo=0.5),
    ]
    at, up, own = jnp.zeros((1, 3)), jnp.array([[0.0, 0.0, 1.0]]), jnp.array([1])
    full = rectangle_lights(Scene.of(*things), at, up, own).item()
    half = rectangle_lights(Scene.of(*things, primitive(screen, name="screen")), at, up, own).item()
    assert abs(half / full - 0.5) < 1e-6


def test_of_lamps_in_one_place_the_last_gives_light():
    """However the two are turned; by rounding one would be before the other."""
    turn = worlds.rotation(np.array([0.3, -0.5, 0.2]))
    lamp = rectangle(turn @ np.array([0, 0, 1.0]), turn @ np.array([0, 0.2, 0]), turn[:, 0])
    at, up, none = jnp.zeros((1, 3)), turn[:, 2][None], jnp.array([-1])
    one, two = (
        rectangle_lights(Scene.of(*(primitive(lamp, emission=L) for L in lamps)), at, up, none)
        for lamps in ((2.0,), (5.0, 2.0))
    )
    np.testing.assert_allclose(two, one, rtol=1e-12)


def test_the_nearer_half_of_a_lamp_behind_a_screen_takes_more_than_half():
    """Of a long lamp that starts overhead: what is left is the light of the farther half."""
    at = np.array([2.0, -1.0, 0.5])
    x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    lamp = rectangle(at + x + z, (0.0, 0.1, 0.0), (1.0, 0.0, 0.0))
    screen = rectangle(at + 0.5 * z, (0.5, 0.0, 0.0), (0.0, 0.5, 0.0))
    floor = rectangle(at, (3.0, 0.0, 0.0), (0.0, 3.0, 0.0))
    scene = Scene.of(primitive(lamp, emission=1.0), *map(primitive, (floor, screen)))
    own, up = jnp.array([1]), jnp.array([[0.0, 0.0, 1.0]])
    found = rectangle_lights(scene, jnp.asarray(at)[None], up, own, 32).item()
    t, w = np.polynomial.legendre.leggauss(40)
    x, y = np.meshgrid(1.5 + 0.5 * t, 0.1 * t, indexing="ij")
    left = 0.05 * np.sum(np.outer(w, w) / (x * x + y * y + 1.0) ** 2)
    np.testing.assert_allclose(found, left, rtol=2.0 / 32**2)


def test_the_second_bounce_brings_the_wall_to_the_block():
    """One cell on the left of the block, against the wall's cells summed by their coupling."""
    scene = _scenes.j12_occluder()
    maps = [solve_radiosity(scene, cells=4, bounces=k, rays=4096, shadow=0) for k in (1, 2)]
    first, both = (np.asarray(m.L) for m in maps)
    (left,) = (k for k, i in enumerate(face_layout(scene).shape) if i in scene.named("left"))
    s = (np.arange(400) + 0.5) / 400
    z, y = np.meshgrid(s, s, indexing="ij")
    wall = np.repeat(np.repeat(first[left], 100, 0), 100, 1)
    point = np.array([0.35, 0.35 + 0.3 * 1.5 / 4, 0.25 * 2.5 / 4])
    r2 = 0.35**2 + (y - point[1]) ** 2 + (z - point[2]) ** 2
    E = np.sum(wall * 0.35**2 / r2**2) / 400**2
    second = both[0, 2, 1] - first[0, 2, 1]
    # Of 4096 rays of a lattice, those beside the edges of cells go astray: some 4096^-0.75 of them.
    assert abs(second / (0.5 / np.pi * E) - 1.0) < 4.0 * 4096**-0.75 * 4


def test_one_ray_of_each_cell_looks_another_way():
    """So that all cells of a face together see what each of them sees by many rays."""

    def second(rays):
        L = [
            solve_radiosity(_scenes.j12_occluder(), cells=8, bounces=k, rays=rays, shadow=0).L
            for k in (1, 2)
        ]
        return np.mean(L[1] - L[0], axis=(1, 2))

    one, many = second(1), second(256)
    large = many > 0.05 * np.max(many)
    assert np.sum(large) >= 5
    np.testing.assert_allclose(one[large], many[large], rtol=0.0, atol=0.15 * np.max(many))


@pytest.mark.parametrize("sky", [0.1, lambda w: 0.1 + 0.0 * w[2]])
def test_a_sky_is_no_light_of_these_and_is_refused(sky):
    """It would be left out of the first reflection without a word."""
    box = _scenes.j12_box()
    under = Scene.of(
        primitive(rectangle((0.5, 0.5, 0.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0)), albedo=0.5),
        primitive(rectangle((0.5, 0.5, 1.0), (0.0, 0.2, 0.0), (0.2, 0.0, 0.0)), emission=1.0),
        environment=sky,
    )
    with pytest.raises(ValueError, match=r"^Argument `scene` must have no sky here, but "):
        solve_radiosity(under, cells=2, shadow=0)
    assert solve_radiosity(box, cells=2, shadow=0).L.max() > 0.0


@pytest.mark.parametrize("unit", [1e-20, 1e-9, 1e9, 1e18])
def test_the_unit_of_length_does_not_matter_in_single_precision(unit):
    """A small light, of whose edges the squares of products of coordinates are the least."""
    corners = np.array([(0.1, 0.1, 1.0), (0.1, 0.12, 1.0), (0.12, 0.12, 1.0), (0.12, 0.1, 1.0)])
    point, up = np.array([0.05, 0.02, 0.01]), jnp.array([0.0, 0.0, 1.0], jnp.float32)
    exact = rectangle_irradiance(point, np.array([0.0, 0.0, 1.0]), corners)
    ours = rectangle_irradiance(
        jnp.asarray(unit * point, jnp.float32), up, jnp.asarray(unit * corners, jnp.float32)
    )
    np.testing.assert_allclose(ours, exact, rtol=2e-3)


def test_other_lights_are_refused_in_one_sentence():
    lamp = primitive(sphere((0.0, 0.0, 1.0), 0.1), name="lamp", emission=1.0)
    with pytest.raises(ValueError, match="must have rectangles with one bright side as lights"):
        solve_radiosity(Scene.of(lamp), cells=4)
    with pytest.raises(ValueError, match="`bounces` must be a positive integer"):
        solve_radiosity(_scenes.j12_box(), bounces=0)
    with pytest.raises(ValueError, match=r"^Argument `cells` must be at least 2, but is 1\.$"):
        solve_radiosity(_scenes.j12_box(), cells=1)
    assert indirect.FRONT == 0


# --- properties ----------------------------------------------------------------------------------


@jax.jit
def _lambert(change, where, cut):
    """A rectangle's irradiance at a place of any normal, whole, and by the sum of two pieces."""
    position, normal = where
    R = worlds.rotation(change.turn)

    def moved(p):
        return change.scale * p @ R.T + change.shift

    ends = jnp.asarray(CORNERS)
    middle = ends[jnp.array([3, 2])] + cut * (ends[jnp.array([0, 1])] - ends[jnp.array([3, 2])])
    parts = (
        ends,
        jnp.concatenate([ends[:2], middle[::-1]]),
        jnp.concatenate([middle, ends[2:]]),
    )
    n = R @ (normal / jnp.linalg.norm(normal))
    whole, one, two = (rectangle_irradiance(moved(position), n, moved(p)) for p in parts)
    return whole, one + two


def lambert(where, cut=0.5, **change):
    found = _lambert(worlds.Change(**change).arrays, *jax.tree.map(jnp.asarray, (where, cut)))
    return np.array(found)


WHERE = st.tuples(
    st.tuples(worlds.PLACE, worlds.PLACE, st.floats(-0.5, 0.9)),
    st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.1, 1.0)),
)


@given(WHERE, worlds.TURN, worlds.SHIFT, worlds.SIZE, worlds.SHARE)
def test_a_rectangle_moved_scaled_or_cut_gives_the_same(where, turn, shift, scale, cut):
    where = tuple(np.asarray(a) for a in where)
    whole, parts = lambert(where, cut, turn=turn, shift=shift, scale=scale)
    np.testing.assert_allclose([whole, parts], lambert(where)[0], rtol=0.0, atol=1e-12)


@functools.cache
def solved(radiance=1.0, share=1.0, power=0):
    """Maps of the box with the block after one and two bounces.

    Args:
        radiance: of the light.
        share: by which all albedos are multiplied.
        power: of two, by which all lengths are multiplied: that rounds nothing.
    """
    scene = _scenes.j12_occluder(radiance=radiance)
    longer = jax.tree.map(lambda a: a * 2.0**power, scene.groups)
    darker = eqx.tree_at(lambda m: m.albedo, scene.material, share * scene.material.albedo)
    scene = Scene(longer, darker, scene.environment, scene.names)
    return [
        np.asarray(solve_radiosity(scene, cells=3, bounces=k, rays=16, shadow=2).L) for k in (1, 2)
    ]


def test_radiosity_is_linear_in_light_and_knows_no_unit_of_length():
    """Each bounce falls by the albedo once more."""
    first, both = solved()
    assert np.max(both - first) > 0.0
    np.testing.assert_allclose(solved(radiance=3.7), 3.7 * np.array(solved()), rtol=1e-12)
    np.testing.assert_array_equal(solved(power=3), solved())
    darker = solved(share=0.4)
    np.testing.assert_allclose(darker[0], 0.4 * first, rtol=1e-12)
    np.testing.assert_allclose(darker[1] - darker[0], 0.16 * (both - first), rtol=1e-9, atol=1e-15)


SQUARE = np.array([(-1.0, -1.0, 0.0), (-1.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0)])


def test_a_small_lamp_keeps_its_digits_in_single_precision():
    for far in (1e3, 1e4):
        corners = (SQUARE + np.array([0.3 * far, 0.0, far])).astype("float32")
        found = rectangle_irradiance(
            np.zeros(3, "float32"), np.array([0.0, 0.0, 1.0], "float32"), corners
        )
        square = 1.09 * far**2
        assert abs(found / (4.0 * far**2 / square**2) - 1.0) < 1e-3


@pytest.mark.parametrize("which", range(3))
def test_a_number_that_is_none_gives_no_irradiance(which):
    given = [np.zeros(3), np.array([0.0, 0.0, 1.0]), SQUARE + np.array([0.0, 0.0, 2.0])]
    ask = jax.jit(lambda s: rectangle_irradiance(*(
        jnp.asarray(a) + (s if i == which else 0.0) for i, a in enumerate(given)
    )))  # fmt: skip
    assert ask(0.0) > 0.0
    assert np.isnan(ask(jnp.nan))


def test_a_normal_of_another_length_is_refused():
    with pytest.raises(ValueError, match=r"^Argument `normal` must be a unit vector"):
        rectangle_irradiance(np.zeros(3), np.array([0.0, 0.0, 2.0]), SQUARE)
