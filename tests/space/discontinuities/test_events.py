"""Visual events on a line of receivers, against polygons that are clipped, and by symmetries.

The brute force is that of `derivations/space/discontinuities/events.py`; it shares nothing with the
library.
"""

import functools

import jax
import numpy as np
import pytest

from derivations.flatland.discontinuities.events import brute_jump
from derivations.space.discontinuities import events as brute
from firstorder.space import (
    GaussianSky,
    Receiver,
    Scene,
    box,
    disc,
    plane,
    polygon,
    primitive,
    rectangle,
    sphere,
)
from firstorder.space.discontinuities import (
    _edges,
    _jumps,
    _lines_of_sight,
    visual_events_along,
)

START = Receiver.at((-2.0, 0.53, 0.0))
WAY = (1.0, -0.07, 0.0)
LAMP = primitive(rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.6, 0.0, 0.0)), emission=1.0)
LOW, HIGH = np.array([-0.2, -0.3, 0.5]), np.array([0.25, 0.2, 0.9])


def found(*things, at=START, along=WAY, reach=4.0, **options):
    return visual_events_along(Scene.of(*things), at, along=along, reach=reach, **options)


def same(a, b, atol=1e-9):
    np.testing.assert_allclose(a.x, b.x, rtol=0.0, atol=atol)
    np.testing.assert_allclose(a.jump_E1, b.jump_E1, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(a.jump_E2, b.jump_E2, rtol=0.0, atol=1e-6)


# --- against clipped polygons --------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["two edges in a plane", "vertex and edge", "three edges"])
def test_jumps_are_those_of_clipped_polygons(kind):
    assert brute.brute_error(kind) < 1e-5


STEP = 2e-3
SHOWN = 0.1  # jumps of E'' above this are not missed; the largest are 1.7, 3.1 and 2.0 W/m^4


@functools.cache
def sampled(seed):
    t = np.arange(0.0, brute.REACH, STEP)
    return t, np.array([brute.on_line(seed)(s) for s in t])


def left_over(seed, table):
    """The largest change, from sample to sample, of E'' without the jumps of a table.

    A jump that the table does not have changes it by at least half of itself.
    """
    t, E = sampled(seed)
    smooth = E - 0.5 * np.maximum(t[:, None] - table.x, 0.0) ** 2 @ table.jump_E2
    return np.max(np.abs(np.diff(smooth, 3))) / STEP**2


@pytest.mark.parametrize("seed", [1, 3, 5])
def test_no_event_with_a_large_jump_is_missed(seed):
    assert left_over(seed, brute.predicted(seed)) < 0.5 * SHOWN


def test_corners_whose_edges_share_planes_are_found_too():
    """Two faces of a box under a lamp: where no strip is seen in a plane E'' jumps all the same."""
    x, y, z = np.diag([0.2, 0.3, 0.2])
    shapes = [((0.0, 0.0, 2.0), 2.5 * x, 1.5 * y), ((0.0, 0.0, 1.0), x, y), ((0.2, 0.0, 0.8), y, z)]
    lamp, *faces = (rectangle(*shape) for shape in shapes)
    start, way = np.array([1.5, -0.9, 0.0]), np.array([-0.8, 0.6, 0.0])
    things = [primitive(lamp, emission=(1.0, 1.0)), *map(primitive, faces)]
    table = found(*things, at=Receiver.at(start), along=way, reach=2.5)
    rows = np.flatnonzero(table.kind == "vertex and edge")

    def E(t):
        return brute.brute_irradiance(start + t * way, *(brute.corners(*each) for each in shapes))

    jumps = [brute_jump(E, at, 2, 5e-4) for at in table.x[rows]]
    assert len(rows) > 1
    np.testing.assert_allclose(table.jump_E2[rows], jumps, rtol=0.0, atol=1e-5)


def test_a_strip_ends_where_a_third_face_crosses_its_plane():
    """A tilted card hides four fifths of one strip; its sides cross the plane off their middles."""
    x, y = np.diag([0.5, 0.4, 0.0])[:2]
    card = (0.1, 0.15, 0.7), np.array([0.3, 0.05, 0.1]), np.array([0.03, 0.2, -0.02])
    shapes = [((0.0, 0.0, 2.0), y, x), ((0.05, 0.0, 1.0), 0.4 * x, 0.5 * y), card]
    start, way = np.array([-1.0, 0.11, 0.0]), np.array([1.0, 0.0, 0.0])
    lamp, *faces = (rectangle(*shape) for shape in shapes)
    things = [primitive(lamp, emission=1.0), *map(primitive, faces)]
    table = found(*things, at=Receiver.at(start), along=way, reach=1.5)
    table = table.take(table.kind == "two edges in a plane")

    def E(t, shapes=shapes):
        return brute.brute_irradiance(start + t * way, *(brute.corners(*each) for each in shapes))

    np.testing.assert_allclose(table.x, [0.2, 1.0], rtol=0.0, atol=1e-9)
    jumps = [brute_jump(E, at, 1) for at in table.x]
    np.testing.assert_allclose(table.jump_E1, jumps, rtol=0.0, atol=1e-6)
    free = brute_jump(lambda t: E(t, shapes[:2] + shapes[1:2]), 1.0, 1)
    assert 0.1 < jumps[1] / free < 0.3


def test_an_event_that_is_left_out_is_seen():
    table = brute.predicted(1)
    for row in np.flatnonzero(np.abs(table.jump_E2) > SHOWN):
        assert left_over(1, table.take(np.arange(len(table)) != row)) > 0.5 * SHOWN


@pytest.fixture
def searched_again():
    """The search runs anew, and nothing that it finds is kept."""
    brute.predicted.cache_clear()
    yield
    brute.predicted.cache_clear()


def test_images_that_move_too_fast_are_seen(monkeypatch, searched_again):
    monkeypatch.setattr(_jumps, "tangential", lambda at, m: 1.01 * np.asarray(m))
    assert brute.brute_error("vertex and edge") > 1e-3


def test_triangles_with_two_sines_exchanged_are_seen(monkeypatch, searched_again):
    right = _jumps._sines
    monkeypatch.setattr(_jumps, "_sines", lambda m, u: right(m, u)[:, [1, 0, 2]])
    assert brute.brute_error("three edges") > 1e-3


def test_a_lamp_that_is_seen_edge_on_appears_on_one_side():
    """Its front alone shines: E' jumps from zero to what Lambert's polygon says."""
    shape = (0.3, 0.1, 1.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.2)  # its front looks along x
    lamp = primitive(rectangle(*shape), emission=1.0)
    table = found(lamp, at=Receiver.at((0.0, 0.0, 0.0)), along=(1.0, 0.2, 0.0), reach=1.0)
    way = np.array([1.0, 0.2, 0.0]) / np.sqrt(1.04)

    def E(t):
        place = t * way
        return brute.lambert(brute.corners(*shape) - place) if place[0] > 0.3 else 0.0

    assert table.kind.tolist() == ["two edges in a plane"]
    np.testing.assert_allclose(table.x, 0.3 * np.sqrt(1.04), rtol=1e-12)
    np.testing.assert_allclose(table.jump_E1, brute_jump(E, table.x[0], 1), rtol=1e-7)


# --- by symmetries -------------------------------------------------------------------------------


def test_a_box_has_the_events_of_its_faces():
    middle, half = 0.5 * (LOW + HIGH), 0.5 * (HIGH - LOW)
    faces = []
    for i in range(3):
        u, v, w = np.roll(np.diag(half), -i, axis=0)
        faces += [primitive(rectangle(middle + side * w, u, v)) for side in (1.0, -1.0)]
    whole = found(LAMP, primitive(box(LOW, HIGH)))
    same(found(LAMP, *faces), whole)
    assert len(whole) == 8


def test_a_cut_between_triangles_is_no_edge():
    center, u, v = np.array([0.1, 0.2, 2.0]), np.array([0.5, 0.1, 0.0]), np.array([0.1, -0.4, 0.1])
    lamp = primitive(rectangle(center, u, v), emission=1.0)
    cut = primitive(polygon(brute.corners(center, u, v)), emission=1.0)
    blocker = primitive(box(LOW, HIGH))
    whole = found(lamp, blocker)
    same(found(cut, blocker), whole)
    assert len(whole) > 5


def test_a_line_that_is_walked_back_has_its_events_in_reverse():
    scene = brute.scene_of(brute.skew(1))
    there = brute.predicted(1)
    end = Receiver.at(brute.START + brute.REACH * brute.WAY / np.linalg.norm(brute.WAY))
    back = visual_events_along(scene, end, along=-brute.WAY, reach=brute.REACH)
    np.testing.assert_allclose(brute.REACH - back.x[::-1], there.x, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(-back.jump_E2[::-1], there.jump_E2, rtol=1e-6)


def test_jumps_shrink_as_space_grows():
    """E' is radiance over length and E'' over its square."""
    small = found(LAMP, primitive(box(LOW, HIGH)))
    lamp = rectangle((0.0, 0.0, 4.0), (0.0, 1.0, 0.0), (1.2, 0.0, 0.0))
    large = found(
        primitive(lamp, emission=1.0),
        primitive(box(2.0 * LOW, 2.0 * HIGH)),
        at=Receiver.at((-4.0, 1.06, 0.0)),
        reach=8.0,
    )
    np.testing.assert_allclose(large.x, 2.0 * small.x, rtol=1e-9)
    np.testing.assert_allclose(2.0 * large.jump_E1, small.jump_E1, rtol=1e-6)


@pytest.mark.parametrize("k", [1e-6, 1e6])
def test_vertices_and_edges_of_a_very_small_scene_are_those_of_a_large_one(k):
    lamp = rectangle((0.0, 0.0, 2.0 * k), (0.0, 0.5 * k, 0.0), (0.6 * k, 0.0, 0.0))
    scene = Scene.of(primitive(lamp), primitive(box(k * LOW, k * HIGH)))
    pairs = _lines_of_sight.vertex_edge_pairs(_edges.edges_of(scene, Receiver.at((0.0, 0.0, 0.0))))
    # Of different shapes any, of one shape those edges that do not end at the vertex.
    assert len(pairs[0]) == 4 * 12 + 8 * 4 + 4 * 2 + 8 * 9


def test_a_sky_is_light_like_any_other():
    """A blocker before a sky of radiance one is a lamp of minus one."""
    things = [primitive(rectangle((0.1, 0.0, 1.5), (0.0, 0.4, 0.1), (0.5, 0.0, 0.0)))]
    things += [primitive(box(LOW, HIGH))]
    scene = Scene.of(*things, environment=1.0)
    dark = visual_events_along(scene, START, along=WAY, reach=4.0)
    shining = [
        primitive(rectangle((0.1, 0.0, 1.5), (0.0, 0.4, 0.1), (0.5, 0.0, 0.0)), emission=(1, 1)),
        primitive(box(LOW, HIGH), emission=1.0),
    ]
    lit = found(*shining)
    np.testing.assert_allclose(lit.x, dark.x, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(lit.jump_E1, -dark.jump_E1, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(lit.jump_E2, -dark.jump_E2, rtol=0.0, atol=1e-6)
    assert len(lit) > 5


# --- what is seen, and what is not ---------------------------------------------------------------


def test_hidden_events_are_given_if_asked_for_and_make_no_jump():
    table = found(LAMP, primitive(box(LOW, HIGH)), hidden=True)
    hidden = table.take(~table.visible)
    assert len(hidden)
    assert not np.any([hidden.jump_E1, hidden.jump_E2])
    assert len(table) - len(hidden) == len(found(LAMP, primitive(box(LOW, HIGH))))


def test_a_lid_under_the_lamp_hides_all_events_of_what_is_above_it():
    lid = primitive(rectangle((0.0, 0.0, 0.1), (9.0, 0.0, 0.0), (0.0, 9.0, 0.0)))
    assert len(found(LAMP, primitive(box(LOW, HIGH)), lid)) == 0


def test_a_line_that_runs_into_a_wall_tells_so():
    wall = primitive(rectangle((0.5, 0.0, 0.5), (0.0, 1.0, 0.0), (0.0, 0.0, 0.5)))
    table = found(LAMP, wall, along=(1.0, 0.0, 0.0))
    row = table.take(table.kind == "contact")
    np.testing.assert_allclose(row.x, [2.5])
    assert row.order.tolist() == [0]


def test_a_line_of_sight_touches_what_the_table_says():
    table = brute.predicted(1)
    vertices = np.concatenate([brute.corners(*shape) for shape in brute.skew(1)])
    for row in np.flatnonzero(table.kind == "vertex and edge"):
        ends = table.position[row] + np.outer(
            [table.near[row], table.far[row]], table.direction[row]
        )
        away = np.linalg.norm(ends[:, None] - vertices, axis=-1)
        assert np.min(away) < 1e-9


def test_receivers_may_lie_on_the_floor_of_the_scene():
    blocker = primitive(box(LOW, HIGH))
    on_it = Receiver.at((-2.0, 0.53, 0.0), on=2)
    floor = primitive(rectangle((0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (0.0, 3.0, 0.0)))
    ground = primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    alone = found(LAMP, blocker)
    same(found(LAMP, blocker, floor, at=on_it), alone)
    same(found(LAMP, blocker, ground, at=on_it), alone)


# --- what is refused -----------------------------------------------------------------------------


def test_far_planes_are_refused():
    with pytest.raises(ValueError, match="a plane without end"):
        found(LAMP, primitive(plane((0.0, 0.0, 3.0), (0.0, 0.0, 1.0))))


@pytest.mark.parametrize(
    ("along", "words"),
    [
        ((0.0, 0.0, 0.0), "the zero vector"),
        ((1.0, 0.0, 0.2), "perpendicular"),
        ((1.0, 0.0), "shape"),
        ((np.nan, 0.0, 0.0), "finite"),
    ],
)
def test_a_line_that_is_none_is_refused(along, words):
    with pytest.raises(ValueError, match=words):
        found(LAMP, along=along)


def test_a_sky_that_varies_a_length_of_zero_and_a_traced_scene_are_refused():
    sky = GaussianSky((0.0, 0.0, 1.0), 1.0, 0.3)
    with pytest.raises(ValueError, match="one radiance"):
        visual_events_along(Scene.of(LAMP, environment=sky), START, along=WAY, reach=1.0)
    with pytest.raises(ValueError, match="reach"):
        found(LAMP, reach=0.0)

    def traced(z):
        lamp = primitive(rectangle((0.0, 0.0, z), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)), emission=1.0)
        return found(lamp).x.sum()

    with pytest.raises(ValueError, match="traced"):
        jax.jit(traced)(2.0)


def rows_of(scene, at, reach=4.0, along=(1.0, 0.0, 0.0)):
    """All events on a line, hidden ones too."""
    return visual_events_along(scene, at, along=np.asarray(along), reach=reach, hidden=True)


def test_an_edge_along_the_line_is_an_edge_in_either_order():
    lamp = primitive(rectangle((0.0, 0.0, 3.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)), emission=1.0)
    plate = primitive(rectangle((0.0, 0.3, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)))
    ball = primitive(sphere((0.1, 0.2, 1.0), 0.2))
    at = Receiver.at((-3.0, -0.1, 0.0))
    one, two = (
        rows_of(Scene.of(*parts), at, 6.0) for parts in ((lamp, plate, ball), (plate, lamp, ball))
    )
    for found in (one, two):
        assert np.sum((found.kind == "three edges") & found.visible) == 2
    for name in ("x", "jump_E1", "jump_E2"):
        np.testing.assert_allclose(
            *(np.sort(getattr(found, name)) for found in (one, two)), rtol=0.0, atol=1e-8
        )


def lamp_and_plate(dtype, unit=1.0, high=0.0, *more):
    """A lamp over a plate that is turned by 45 degrees."""
    lamp, plate = (
        rectangle(*(np.asarray(unit * np.array(a), dtype) for a in rows))
        for rows in (
            ((0.0, 0.0, 2.0 + high), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)),
            ((0.0, 0.05, 1.0 + high), (0.14, 0.14, 0.0), (0.14, -0.14, 0.0)),
        )
    )
    return Scene.of(primitive(lamp, emission=1.0), primitive(plate), *more)


def receiver_of(dtype, start):
    return Receiver.at(np.asarray((start, 0.0, 0.0), dtype))


@pytest.mark.parametrize(("dtype", "far"), [("float64", 1e7), ("float32", 1e3)])
def test_a_panel_far_away_changes_no_event(dtype, far):
    panel = rectangle(*np.asarray([(0.0, far, far), (1.0, 0.0, 0.0), (0.0, 1.0, 1.0)], dtype))
    right = rows_of(lamp_and_plate("float64"), receiver_of("float64", -2.0))
    found = rows_of(
        lamp_and_plate(dtype, 1.0, 0.0, primitive(panel)), receiver_of(dtype, -2.0),
        along=np.asarray((1.0, 0.0, 0.0), dtype),
    )  # fmt: skip
    assert np.sum(right.visible) == 10
    assert np.sum(found.visible) == 10
    tolerance = 1e-6 if dtype == "float64" else 2e-2
    np.testing.assert_allclose(
        found.jump_E2[found.visible], right.jump_E2[right.visible], rtol=tolerance, atol=tolerance
    )


@pytest.mark.parametrize("unit", [1e3, 1e6])
def test_events_seen_do_not_depend_on_the_unit(unit):
    lamp, plate = (
        rectangle(*np.asarray(unit * np.array(rows), "float32"))
        for rows in (
            ((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)),
            ((0.0, 0.0, 1.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0)),
        )
    )
    scene = Scene.of(primitive(lamp, emission=1.0), primitive(plate, emission=np.float32(0.1)))
    found = rows_of(
        scene, receiver_of("float32", -2.0 * unit), 4.0 * unit,
        along=np.asarray((1.0, 0.0, 0.0), "float32"),
    )  # fmt: skip
    assert np.sum(found.visible) == 4
    np.testing.assert_allclose(
        np.sort(unit * found.jump_E1[found.visible]),
        [-0.08851, -0.08851, 0.16435, 0.16435],
        rtol=1e-3,
    )


def test_a_crossing_at_angle_zero_of_an_outline_stands_once():
    plate = disc((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 0.5)
    corner = np.asarray(plate.center[0] + plate.axes[0][:, 0])
    for k in range(8):
        eye = np.array([-0.7 + 0.13 * k, 0.0, 0.0])
        far = np.linalg.norm(corner - eye)
        u = (corner - eye) / far
        side = np.cross(u, [0.0, 1.0, 0.0])
        side /= np.linalg.norm(side)
        one, two = (np.cos(a) * side + np.sin(a) * np.cross(u, side) for a in (0.7, 2.0))
        scene = Scene.of(
            primitive(plate),
            primitive(sphere(eye + 1.8 * far * u + 0.3 * one, 0.3)),
            primitive(sphere(eye + 2.7 * far * u + 0.4 * two, 0.4), emission=1.0),
        )
        found = rows_of(scene, Receiver.at((-2.01, 0.0, 0.0)))
        x = found.x[found.kind == "three edges"]
        assert np.sum(np.abs(x - eye[0] - 2.01) < 1e-6) == 1
        assert np.all(np.diff(np.sort(x)) > 1e-7)
