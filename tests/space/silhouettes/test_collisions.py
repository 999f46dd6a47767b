"""Which shapes run into each other, by distances that one knows."""

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import (
    Receiver,
    Scene,
    box,
    cylinder,
    disc,
    ellipsoid,
    irradiance,
    plane,
    primitive,
    rectangle,
    sphere,
    triangle,
)
from firstorder.space.shapes import Boxes, Cylinders, Discs, Ellipsoids, Rectangles, Triangles
from firstorder.space.shapes._bounds import bounds
from firstorder.space.silhouettes import _collisions as collisions

X, Y, Z = np.eye(3)


def found(*shapes, lit=(0,), environment=0.0):
    things = [primitive(s, emission=1.0 if k in lit else 0.0) for k, s in enumerate(shapes)]
    return collisions.find_collisions(Scene.of(*things, environment=environment))


# Two shapes as functions of a gap; they meet where it is negative.
TOUCHING = {
    "two balls": lambda g: (sphere(0 * X, 1.0), sphere((1.5 + g) * X, 0.5)),
    "a ball in a face": lambda g: (box(-X - Y - Z, X + Y + Z), sphere((1.4 + g) * X, 0.4)),
    "a ball on the floor": lambda g: (plane(0 * X, Z), sphere((1 + g) * Z, 1.0)),
    "a box on the floor": lambda g: (box((-1, -1, g), (1, 1, 2)), plane(0 * X, Z)),
    "a wall and a ball": lambda g: (cylinder(-Z, Z, 0.5), sphere((1.5 + g) * X, 1.0)),
    "two tubes end to end": lambda g: (cylinder(0 * Z, Z, 0.5), cylinder((1 + g) * Z, 2 * Z, 0.5)),
    "crossed tubes": lambda g: (
        cylinder(-Z, Z, 0.5),
        cylinder((1 + g) * X - Y, (1 + g) * X + Y, 0.5),
    ),
    "a disc at a ball": lambda g: (sphere(0 * X, 1.0), disc((1 + g) * X, X, 0.8)),
    "a rim at a box": lambda g: (box(-X - Y - Z, X + Y + Z), disc((1.5 + g) * X, Z, 0.5)),
    "a rod through a sheet": lambda g: (
        rectangle(0 * X, X, Y),
        cylinder(g * Z, 2 * Z + g * Z, 0.02),
    ),
    "two sheets": lambda g: (rectangle(0 * X, X, Y), rectangle((1 + g) * Z, X, Z)),
    "a corner at a sheet": lambda g: (rectangle(0 * X, X, Y), triangle(g * Z, Z + X, Z + 0.5 * Y)),
    "a disc and a sheet": lambda g: (
        disc(0 * X, Z, 0.7),
        rectangle((0.7 + 0.3 + g) * X, 0.3 * X, Z),
    ),
    "a ball at a triangle": lambda g: (
        triangle(0 * X, X, Y),
        sphere((0.5 + (0.2 + g) / np.sqrt(2.0)) * (X + Y), 0.2),
    ),
    "sheets of one width": lambda g: (
        rectangle(0 * X, X, Y),
        rectangle(0.7 * X, 0.7 * X, Z) if g < 0 else rectangle((1.7 + g) * X, 0.7 * X, Z),
    ),
    "a long body": lambda g: (
        ellipsoid(0 * X, np.diag([0.1, 2.0, 0.1])),
        sphere((0.6 + g) * X, 0.5),
    ),
}


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("name", TOUCHING)
def test_shapes_meet_where_they_overlap_and_not_where_there_is_a_gap(name, swapped):
    near, apart = TOUCHING[name](-0.1), TOUCHING[name](0.02)
    if swapped:
        near, apart = near[::-1], apart[::-1]
    (pair,) = found(*near)
    assert set(pair[:2]) == {0, 1}
    assert found(*apart) == []
    assert found(*TOUCHING[name](1e-9)) == []


@pytest.mark.parametrize("name", TOUCHING)
def test_shapes_meet_in_any_unit_of_length_and_any_place(name):
    for scale, place in [(1e-4, 0.0), (1e4, 1e4)]:
        shapes = [
            type(s)(np.asarray(s.center) * scale + place, np.asarray(s.axes) * scale)
            for s in TOUCHING[name](-0.1)
        ]
        assert len(found(*shapes)) == 1


@pytest.mark.parametrize("name", TOUCHING)
def test_points_lie_where_they_meet(name):
    """Within the bounds of both shapes."""
    pair = TOUCHING[name](-0.1)
    ((_, _, where),) = found(*pair)
    ends = [bounds(shape) for shape in pair]
    low = np.max([low[0] for low, _ in ends], axis=0)
    high = np.min([high[0] for _, high in ends], axis=0)
    assert where.shape[1] == 3
    assert np.all(where >= low - 1e-6)
    assert np.all(where <= high + 1e-6)


CROSSED = {
    "sheets that share an axis": (rectangle(0 * X, X, Z), rectangle(0 * X, Y, Z)),
    "sheets of one height": (rectangle(0 * X, X, Z), rectangle(0.3 * X, X + Y, Z)),
    "a sheet along a diagonal": (rectangle(0 * X, X + Z, X - Z), rectangle(0 * X, 2 * Y, 3 * X)),
    "discs about one middle": (disc(0 * X, X, 1.0), disc(0 * X, Y, 1.0)),
    "discs of unlike size": (disc(0 * X, X, 1.0), disc(0 * X, Y, 0.5)),
}


@pytest.mark.parametrize("name", CROSSED)
def test_flat_shapes_cross_also_where_the_ends_of_their_cut_are_on_both_edges(name):
    assert len(found(*CROSSED[name])) == 1
    assert len(found(*CROSSED[name][::-1])) == 1


BESIDE = {
    "an edge on a face": (rectangle(0 * X, X, Y), rectangle(Z, X, Z)),
    "edges on each other": (rectangle(0 * X, X, Y), rectangle(Y + Z, X, Z)),
    "a corner on an edge": (rectangle(0 * X, X, Y), triangle(Y, Y + Z + X, Y + Z - X)),
    "in one plane": (rectangle(0 * X, X, Y), rectangle(0.5 * X, X, Y)),
    "a corner on a face": (rectangle(0 * X, X, Y), triangle(0 * X, Z + X, Z - X)),
    "beside each other": (rectangle(0 * X, X, Y), rectangle(1.5 * Y, X, Z + 0.4 * Y)),
}


@pytest.mark.parametrize("name", BESIDE)
def test_flat_shapes_that_touch_do_not_cross(name):
    assert found(*BESIDE[name]) == []
    assert found(*BESIDE[name][::-1]) == []


def test_a_body_in_another_does_not_meet_its_surface():
    assert found(sphere(0 * X, 1.0), sphere(0.1 * X, 0.3)) == []
    assert found(sphere(0 * X, 1.0), box(-0.2 * (X + Y + Z), 0.2 * (X + Y + Z))) == []
    assert found(sphere(0 * X, 1.0), disc(0.1 * X, Z, 0.4)) == []
    assert found(box(-X - Y - Z, X + Y + Z), cylinder(-0.5 * Z, 0.5 * Z, 0.02)) == []


def test_a_rod_through_a_body_meets_it_between_the_points_of_both():
    rod = cylinder((0.03, 0.05, -3.0), (0.04, 0.03, 3.0), 0.01)
    assert len(found(sphere(0 * X, 0.3), rod)) == 1
    assert len(found(box((-0.2, -0.2, -0.2), (0.2, 0.2, 0.2)), rod)) == 1


def test_pairs_of_which_one_shines_count_once():
    """Three balls in a row, each meets the next."""
    row = [sphere(1.5 * k * X, 1.0) for k in range(3)]
    pairs = {
        lit: {tuple(sorted(p[:2])) for p in found(*row, lit=lit)}
        for lit in [(), (0,), (1,), (0, 1, 2)]
    }
    assert pairs == {(): set(), (0,): {(0, 1)}, (1,): {(0, 1), (1, 2)}, (0, 1, 2): {(0, 1), (1, 2)}}
    assert len(found(*row, lit=(0, 1, 2))) == 2


# --- what is refused -----------------------------------------------------------------------------


def half_in(emission=(1.0, 0.0), wall=(0.0, 0.0)):
    """A ball half in an upright wall at x = 0, whose front looks along x."""
    return Scene.of(
        primitive(sphere((0.0, 0.0, 2.0), 0.5), emission=emission[0], name="ball"),
        primitive(rectangle((0.0, 0.0, 2.0), Y, Z), emission=wall),
    )


BEFORE, BEHIND = Receiver.at((3.0, 0.0, 0.0)), Receiver.at((-3.0, 0.0, 0.0))


def test_a_pair_that_sends_unlike_light_is_refused():
    with pytest.raises(ValueError, match=r"Shapes 0 \(`ball`\) and 1 run into each other"):
        collisions.check_apart(half_in(), BEFORE)
    collisions.check_apart(half_in(), Receiver.at((3.0, 0.0, 0.0), -Z))  # all below its horizon
    collisions.check_apart(half_in(), Receiver.at((3.0, 0.0, 9.0)))


def test_only_the_sides_that_are_shown_count():
    scene = half_in(wall=(1.0, 0.0))
    collisions.check_apart(scene, BEFORE)
    with pytest.raises(ValueError, match="run into each other"):
        collisions.check_apart(scene, BEHIND)


def test_light_that_is_given_and_traced_scenes_are_not_looked_at():
    collisions.check_apart(half_in(), BEFORE, radiance=lambda *_: 1.0)
    collisions.check_apart(half_in(), object())
    jax.jit(lambda x: collisions.check_apart(half_in(), Receiver.at(jnp.full(3, x))))(1.0)


def test_one_of_many_receivers_is_enough():
    scene = half_in(wall=(1.0, 0.0))
    places, ups = np.array([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [-3.0, 0.0, 0.0]]), np.tile(Z, (3, 1))
    collisions.check_apart_from(scene, places[:2], ups[:2])
    with pytest.raises(ValueError, match="run into each other"):
        collisions.check_apart_from(scene, places, ups)
    collisions.check_apart_from(scene, places, ups * [[1.0], [1.0], [-1.0]])


def test_a_traced_receiver_is_warned():
    def ask(scene, on=-1):
        at = Receiver.at((3.0, 0.0, 0.0), on=on)

        @jax.jit
        def program(x):
            moved = eqx.tree_at(lambda at: at.position, at, at.position + x)
            collisions.warn_of_collisions(scene, moved)

        program(1.0)

    with pytest.warns(UserWarning, match="run into each other"):
        ask(half_in())
    with pytest.warns(UserWarning, match="wrong where that line is seen"):
        ask(half_in(wall=(1.0, 0.0)))
    ask(half_in(wall=(1.0, 1.0)))  # like light on all sides: no warning
    ask(half_in(), on=1)
    collisions.warn_of_collisions(half_in(), BEFORE)


# --- planes --------------------------------------------------------------------------------------


def test_planes_meet_in_a_line_that_is_known_unless_they_are_one_but_for_rounding():
    n = np.array([0.3, -0.7, 0.2])
    assert found(plane(3 * X, X + Z), plane(2 * Z, X - 2 * Z)) == []
    assert found(plane(X, n), plane(2 * X, 3.0 * n)) == []
    assert found(plane(X, n), plane(X, -2.0 * n)) == []  # exactly parallel
    ((i, j, where),) = found(plane(X, n), plane(X, 3.0 * n))
    assert (i, j) == (0, 1)
    np.testing.assert_allclose((where - X) @ n, 0.0, rtol=0.0, atol=1e-9)
    assert np.max(np.linalg.norm(where, axis=-1)) > 1e5
    assert found(plane(X, n), plane(X, 3.0 * n), lit=()) == []


def test_planes_in_one_place_that_send_unlike_light_are_refused():
    n = np.array([0.3, -0.7, 0.2])
    scene = Scene.of(primitive(plane(X, n), emission=1.0), primitive(plane(X, 3.0 * n)))
    with pytest.raises(ValueError, match=r"^Shapes 0 and 1 run into each other .* at the other\.$"):
        irradiance(scene, Receiver.at(X + n, Z))


def test_scenes_are_looked_at_once():
    assert collisions.have_collisions(scene := half_in())
    assert collisions._collisions(scene) is collisions._collisions(scene)
    apart = Scene.of(primitive(sphere(X, 0.5), emission=1.0), primitive(sphere(3.0 * X, 0.5)))
    assert not collisions.have_collisions(apart)


def test_shapes_have_their_numbers_in_their_groups():
    shapes = [
        sphere(X, 0.1),
        box(0 * X, X + Y + Z),
        sphere(Y, 0.2),
        plane(0 * X, Z),
        box(X, 2 * X + Y + Z),
    ]
    scene = Scene.of(*map(primitive, shapes))
    numbers = [collisions._found(scene, k) for k in range(5)]
    counts = [group.count for group in scene.groups]
    assert [k for _, k in numbers] == list(itertools.chain(*map(range, counts)))
    assert [g for g, _ in numbers] == [g for g in scene.groups for _ in range(g.count)]


# --- canonical shapes ----------------------------------------------------------------------------

CLOSED = [Ellipsoids, Boxes, Cylinders]
FLAT = [Discs, Rectangles, Triangles]


@pytest.mark.parametrize("kind", CLOSED + FLAT)
def test_points_lie_on_the_whole_surface(kind):
    """At no place of it is the nearest of them farther than a fifth of the shape's half."""
    points = collisions.SURFACES[kind]
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (400, 3))
    if kind in CLOSED:
        np.testing.assert_allclose(collisions._gauge(kind, points), 1.0, rtol=1e-12)
        q = q / collisions._gauge(kind, q)[:, None]
    else:
        assert np.all(points[:, 2] == 0.0)
        q = q[collisions._gauge(kind, q) <= 1.0] * [1.0, 1.0, 0.0]
    assert np.max(collisions._gauge(kind, points)) <= 1.0 + 1e-12
    near = np.min(np.linalg.norm(q[:, None] - points, axis=-1), axis=1)
    assert np.max(near) < 0.2


def test_edges_are_those_of_canonical_shapes():
    start, end = collisions.EDGES[Boxes]
    assert np.all(np.abs(np.concatenate([start, end])) == 1.0)
    np.testing.assert_allclose(np.linalg.norm(end - start, axis=1), 2.0)
    assert len({frozenset(map(tuple, pair)) for pair in np.stack([start, end], 1)}) == 12
    for kind, turn in [
        (Rectangles, 8.0),
        (Triangles, 2.0 + np.sqrt(2.0)),
        (Discs, 64.0 * np.sin(np.pi / 32)),
    ]:
        start, end = collisions.EDGES[kind]
        np.testing.assert_allclose(np.linalg.norm(end - start, axis=1).sum(), turn)
        np.testing.assert_allclose(collisions._gauge(kind, start), 1.0)
        np.testing.assert_array_equal(end, np.roll(start, -1, 0))
    start, end = collisions.EDGES[Cylinders]
    np.testing.assert_allclose(np.hypot(*np.concatenate([start, end])[:, :2].T), 1.0)
    upright = np.linalg.norm((end - start)[:, :2], axis=1) < 1e-12
    assert np.sum(upright) == 32
    assert np.all(np.abs(np.concatenate([start, end])[:, 2]) == 1.0)
    chords = (end - start)[~upright]
    np.testing.assert_allclose(chords[:, 2], 0.0)
    np.testing.assert_allclose(np.linalg.norm(chords, axis=1), 2.0 * np.sin(np.pi / 32))
    start, end = collisions.EDGES[Ellipsoids]
    np.testing.assert_allclose(np.linalg.norm(end - start, axis=1), 2.0 * np.sin(np.pi / 32))
    np.testing.assert_allclose(np.linalg.norm(np.concatenate([start, end]), axis=1), 1.0)


@pytest.mark.parametrize("kind", CLOSED)
def test_the_deepest_point_of_a_segment_is_the_least_of_many(kind):
    start, end = np.random.default_rng(3).uniform(-2.0, 2.0, (2, 20, 3))
    share = np.linspace(0.0, 1.0, 4001)[:, None, None]
    least = np.min(collisions._gauge(kind, start + share * (end - start)), axis=0)
    found = collisions._deepest(kind, start, end)
    np.testing.assert_allclose(collisions._gauge(kind, found), least, rtol=0.0, atol=1e-3)
    along = np.cross(found - start, end - start)
    np.testing.assert_allclose(along, 0.0, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("kind", "gauge"),
    [
        (Ellipsoids, 1.3),
        (Boxes, 1.2),
        (Cylinders, 1.2),
        (Discs, 0.5),
        (Rectangles, 0.4),
        (Triangles, 0.1),
    ],
)
def test_a_gauge_is_one_on_the_edge(kind, gauge):
    """At (0.4, 0.3, 1.2); of a triangle `1 - 3 min(x, y, 1 - x - y)`."""
    q = np.array([[0.4, 0.3, 1.2]])
    np.testing.assert_allclose(collisions._gauge(kind, q), gauge)
