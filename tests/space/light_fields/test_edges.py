"""Levels of outlines, against the geometry of rays in NumPy."""

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import SPACE_SLOPE
from firstorder.fields.field import Affine
from firstorder.space import (
    Receiver,
    Scene,
    box,
    cylinder,
    disc,
    ellipsoid,
    plane,
    primitive,
    rectangle,
    triangle,
)
from firstorder.space.light_fields._edges import DISCRIMINANTS, RoundLevel, StraightLevel, levels

AT = Receiver.at((0.3, -0.2, 0.1), (0.2, -0.3, 1.0))
PLACE, AXES = np.asarray(AT.position), np.asarray(AT.axes)
RNG = np.random.default_rng(5)


def ray(u):
    """Where rays start, and along what, in space."""
    x, y, v, w = np.moveaxis(u, -1, 0)
    o = np.stack([x, y, 0.0 * x], -1)
    return PLACE + o @ AXES.T, np.stack([-v, -w, 1.0 + 0.0 * v], -1) @ AXES.T


def through(point, slopes):
    """Rays of some slopes through points."""
    local = (point - PLACE) @ AXES
    return np.concatenate([local[..., :2] + slopes * local[..., 2:], slopes], -1)


@eqx.filter_jit
def _values(level, u):
    return jax.vmap(level.at)(u)


@eqx.filter_jit
def _discriminants(level, u):
    return jax.vmap(level.discriminant)(u)


@eqx.filter_jit
def jet(level, u):
    return level.jet(u)


def values(level, u):
    return np.asarray(_values(level, jnp.asarray(u)))


def discriminants(level, u):
    return np.asarray(_discriminants(level, jnp.asarray(u)))


def of(shape, axis=0):
    return [level for _, level in levels(Scene.of(primitive(shape)), AT, SPACE_SLOPE, axis)]


# --- straight ------------------------------------------------------------------------------------


def test_a_straight_level_is_a_triple_product():
    p, q = RNG.normal(size=(2, 3))
    u = RNG.normal(size=(6, 4))
    o = np.column_stack([u[:, :2], np.zeros(6)])
    D = np.column_stack([-u[:, 2:], np.ones(6)])
    true = np.sum(D * np.cross(p - o, q - o), -1)
    level = StraightLevel(jnp.asarray(p), jnp.asarray(q))
    np.testing.assert_allclose(values(level, u), true, rtol=1e-12)


def test_a_jet_of_a_straight_level_has_the_differences_of_a_bilinear_function():
    """Exact for any step."""
    level = StraightLevel(*map(jnp.asarray, RNG.normal(size=(2, 3))))
    u, steps = RNG.normal(size=4), np.eye(4)
    found = jet(level, jnp.asarray(u))
    first = [values(level, np.stack([u + e, u - e])) @ [0.5, -0.5] for e in steps]
    pairs = itertools.product(steps, steps)
    signs = np.array([[1, 1], [-1, 1], [1, -1], [-1, -1]])
    second = [
        values(level, u + signs @ np.stack([a, b])) @ [0.25, -0.25, -0.25, 0.25] for a, b in pairs
    ]
    np.testing.assert_allclose(found.value, values(level, u[None])[0])
    np.testing.assert_allclose(found.gradient, first, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.hessian, np.reshape(second, (4, 4)), rtol=0.0, atol=1e-12)


CORNERS = np.array(list(itertools.product((0.0, 0.5), (0.1, 0.4), (1.0, 1.7))))
A, B, C = np.array([[-0.2, -0.3, 1.0], [0.6, 0.1, 1.2], [0.1, 0.6, 1.1]])
MIDDLE, X, Y = np.array([[0.1, 0.3, 1.6], [0.2, 0.0, 0.1], [0.0, 0.1, 0.3]])
STRAIGHT = {
    "a box": (
        box(CORNERS[0], CORNERS[-1]),
        [(a, b) for a, b in itertools.combinations(CORNERS, 2) if np.sum(a != b) == 1],
    ),
    "a triangle": (triangle(A, B, C), [(A, B), (B, C), (C, A)]),
    "a rectangle": (
        rectangle(MIDDLE, X, Y),
        [(MIDDLE + s * X + Y, MIDDLE + s * X - Y) for s in (1, -1)]
        + [(MIDDLE + X + s * Y, MIDDLE - X + s * Y) for s in (1, -1)],
    ),
}


@pytest.mark.parametrize("name", STRAIGHT)
def test_each_edge_has_a_level_that_is_zero_on_rays_through_it(name):
    shape, ends = STRAIGHT[name]
    found = of(shape)
    assert len(found) == len(ends)
    slopes = RNG.uniform(-0.5, 0.5, (3, 2))
    rays = [through(a + np.array([[0.2], [0.5], [0.9]]) * (b - a), slopes) for a, b in ends]
    zero = np.array([[np.max(np.abs(values(level, u))) < 1e-12 for u in rays] for level in found])
    assert np.sum(zero, axis=0).tolist() == [1] * len(ends)
    assert np.sum(zero, axis=1).tolist() == [1] * len(ends)


def test_a_plane_has_its_horizon():
    n = np.array([0.3, -0.8, 0.6])
    (level,) = of(plane((1.0, 2.0, 3.0), n))
    assert isinstance(level, Affine)
    u = RNG.normal(size=(5, 4))
    _, D = ray(u)
    np.testing.assert_allclose(values(level, u), D @ n / np.linalg.norm(n), rtol=0.0, atol=1e-12)


# --- round ---------------------------------------------------------------------------------------

SKEW = np.array([[0.4, 0.1, 0.0], [0.05, 0.3, 0.1], [0.0, -0.1, 0.35]])
BASE, TOP, RADIUS = np.array([0.1, 0.2, 0.9]), np.array([0.4, 0.3, 1.5]), 0.25
NORMAL = np.array([0.3, 0.2, -1.0])


def meets_ball(o, D):
    """The nearest point of a line to the middle is in the unit ball."""
    t = -np.sum(o * D, -1) / np.sum(D * D, -1)
    return np.linalg.norm(o + t[:, None] * D, axis=-1) < 1.0


def meets_ellipsoid(o, D):
    return meets_ball(*(np.linalg.solve(SKEW, a.T).T for a in (o - [0.1, 0.2, 1.2], D)))


def meets_disc(center, normal, radius):
    def meets(o, D):
        t = (center - o) @ normal / (D @ normal)
        return np.linalg.norm(o + t[:, None] * D - center, axis=-1) < radius

    return meets


def meets_wall(o, D):
    """The line passes the axis within the radius."""
    n = np.cross(D, TOP - BASE)
    return np.abs(np.sum((BASE - o) * n, -1)) < RADIUS * np.linalg.norm(n, axis=-1)


ROUND = {
    "an ellipsoid": (ellipsoid((0.1, 0.2, 1.2), SKEW), [meets_ellipsoid]),
    "a disc": (disc(BASE, NORMAL, 0.4), [meets_disc(BASE, NORMAL, 0.4)]),
    "a cylinder": (
        cylinder(BASE, TOP, RADIUS),
        [meets_wall, *(meets_disc(end, TOP - BASE, RADIUS) for end in (TOP, BASE))],
    ),
}


@pytest.mark.parametrize("name", ROUND)
def test_a_discriminant_is_positive_where_a_ray_meets_the_shape(name):
    shape, meet = ROUND[name]
    found = of(shape)
    assert [level.way for level in found] == [1, -1] * len(meet)
    u = through(BASE + RNG.uniform(-0.6, 0.6, (300, 3)), RNG.uniform(-0.5, 0.5, (300, 2)))
    for level, meets in zip(found[::2], meet, strict=True):
        sign = discriminants(level, u) > 0.0
        np.testing.assert_array_equal(sign, meets(*ray(u)))
        assert 10 < np.sum(sign) < 290


@pytest.mark.parametrize("name", ROUND)
@pytest.mark.parametrize("axis", range(4))
def test_halves_of_an_outline_are_passed_once_each_and_are_the_discriminant_there(name, axis):
    """Along the axis the ray enters the shape over one half and leaves it over the other."""
    shape, meet = ROUND[name]
    found, s = of(shape, axis), np.linspace(-3.0, 3.0, 2401)
    u = through(0.5 * (BASE + TOP), np.array([0.05, -0.1]))
    line = u + s[:, None] * np.eye(4)[axis]
    for rising, falling, meets in zip(found[::2], found[1::2], meet, strict=True):
        hit = meets(*ray(line))
        enter, leave = np.flatnonzero(hit[1:] != hit[:-1])
        up, down = values(rising, line), values(falling, line)
        F = discriminants(rising, line)
        assert np.flatnonzero(np.diff(np.sign(up))).tolist() == [enter]
        assert np.flatnonzero(np.diff(np.sign(down))).tolist() == [leave]
        k = np.arange(len(s))
        outside = [0, enter, leave + 1, -1]
        np.testing.assert_allclose(np.where(k <= enter, up, down)[outside], F[outside], rtol=1e-9)
        # Beyond the vertex a half keeps the value that it has there.
        np.testing.assert_allclose(up[leave:], np.max(F), rtol=1e-4)
        np.testing.assert_allclose(down[: enter + 1], np.max(F), rtol=1e-4)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
@pytest.mark.parametrize("axis", [0, 3])
def test_halves_are_passed_in_any_unit_of_length(unit, axis):
    at = Receiver.at(PLACE * unit, (0.2, -0.3, 1.0))
    shape = disc(BASE * unit, NORMAL, 0.4 * unit)
    scale = np.array([unit, unit, 1.0, 1.0])
    line = (
        through(BASE, np.array([0.05, -0.1])) + np.linspace(-3, 3, 601)[:, None] * np.eye(4)[axis]
    )
    pair = levels(Scene.of(primitive(shape)), at, SPACE_SLOPE, axis)
    for (_, level), same in zip(pair, of(disc(BASE, NORMAL, 0.4), axis), strict=True):
        np.testing.assert_allclose(values(level, line * scale), values(same, line), rtol=1e-6)


def test_a_parabola_that_is_none_has_only_one_half():
    """Along the rays of a plane that holds a disc's normal, nothing bends: a square less one."""
    level = RoundLevel(jnp.array([0.0, 0.0, 1.0]), jnp.eye(3), DISCRIMINANTS["wall"], 1, 2)
    flat = RoundLevel(
        jnp.zeros(3), jnp.zeros((3, 3)).at[0, 0].set(1.0), DISCRIMINANTS["disc"], 1, 1
    )
    u = jnp.array([0.3, 0.2, 0.1, 0.4])
    np.testing.assert_allclose(level.at(u), 0.1**2 + 0.4**2 - (0.3 * 0.4 - 0.2 * 0.1) ** 2)
    assert flat.at(u) == 1.0


def test_a_jet_of_a_round_level_has_the_differences_of_its_discriminant():
    level = of(ellipsoid((0.1, 0.2, 1.2), SKEW), 1)[0]
    u = through(np.array([0.1, 0.2, 1.2]), np.array([0.1, 0.2])) - [0.0, 0.3, 0.0, 0.0]
    found, h = jet(level, jnp.asarray(u)), 1e-5
    ends = np.stack([u + h * np.eye(4), u - h * np.eye(4)])
    F = discriminants(level, ends.reshape(8, 4))
    np.testing.assert_allclose(found.gradient, (F[:4] - F[4:]) / (2.0 * h), rtol=0.0, atol=1e-8)


def test_levels_carry_the_numbers_of_their_shapes():
    shapes = [ROUND["a cylinder"][0], STRAIGHT["a box"][0], STRAIGHT["a triangle"][0]]
    shapes += [triangle(A, C, B + np.array([0.0, 0.0, 1.0])), ROUND["an ellipsoid"][0]]
    scene = Scene.of(*map(primitive, shapes))
    numbers = [number for number, _ in levels(scene, AT, SPACE_SLOPE, 0)]
    of_kind = {"Cylinders": 6, "Boxes": 12, "Triangles": 3, "Ellipsoids": 2}
    sizes = [of_kind[type(g).__name__] for g in scene.groups for _ in range(g.count)]
    assert numbers == np.repeat(np.arange(5), sizes).tolist()


def test_planes_have_a_level_for_the_line_in_which_they_meet():
    """And parallel ones that of a line in the first, across which nothing changes."""
    floor, slope = (
        plane((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)),
        plane((2.0, 0.0, 0.0), (-1.0, 0.5, -1.0)),
    )
    lid = plane((0.0, 0.0, 4.0), (0.0, 0.0, -1.0))
    scene = Scene.of(*map(primitive, (floor, slope, lid)))
    found = list(levels(scene, AT, SPACE_SLOPE, 0))
    assert [number for number, _ in found] == [0, 1, 2, 0, 0, 1]
    axes = np.asarray(AT.axes)
    lines = [np.stack([level.start, level.end]) @ axes.T + AT.position for _, level in found[3:]]
    for points, z in ((lines[0], -1.0), (lines[1], -1.0), (lines[2], 4.0)):
        np.testing.assert_allclose(points[:, 2], z, rtol=0.0, atol=1e-13)
        assert np.linalg.norm(points[1] - points[0]) > 0.1
    for points in (lines[0], lines[2]):  # -(x - 2) + y / 2 - z = 0
        np.testing.assert_allclose(points @ np.array([-1.0, 0.5, -1.0]), -2.0, rtol=0.0, atol=1e-13)
