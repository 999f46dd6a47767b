"""Visual events: predicted jumps against independent brute force; what is missed; faults."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.flatland.discontinuities import events as brute
from firstorder.flatland import (
    Arcs,
    Circles,
    PointLights,
    Scene,
    Segments,
    box,
    closed_curve,
    primitive,
)
from firstorder.flatland.discontinuities import events
from firstorder.flatland.discontinuities.events import extrapolation_error, jumps_on, visual_events
from firstorder.numerics._host import with_floats
from tests.flatland import worlds

# One-sided seven-point differences of order k with steps h of 1e-4 to 1e-3 m: rounding 1e3 eps /
# h^k, and truncation (h / R)^(7 - k) on a curve of radius R = 0.13 m.
BOUND = (1e-9, 1e-6, 2e-5)


@pytest.mark.parametrize(
    ("kinds", "order"),
    [(brute.PAIRS, 1), (("shadow",), 0), (("shadow",), 1), (("dusk",), 1), (("horizon",), 2)],
)
def test_jumps_are_those_of_one_sided_differences_of_an_independent_irradiance(kinds, order):
    assert brute.brute_error(kinds, order) < BOUND[order]


def test_every_kind_of_event_is_there():
    kinds = set(brute.predicted().kind)
    assert {"shadow", "two points", "point and tangent", "edge-on", "horizon", "dusk"} <= kinds
    assert "two tangents" in visual_events(four_discs()).kind


def four_discs(emission=0.0):
    room = primitive(box((0.0, 0.0), (1.0, 1.0), inward=True), albedo=0.2, name="room")
    centers = [(0.25, 0.25), (0.25, 0.75), (0.75, 0.25), (0.75, 0.75)]
    discs = primitive(Circles(centers, [0.08] * 4), albedo=0.2, emission=emission, name="discs")
    return Scene.of(room, discs, points=PointLights((0.5, 0.5), 1.0))


def test_no_jump_of_the_gradient_is_missed():
    """Second differences of the independent irradiance are small but where one was predicted."""
    x = np.linspace(-1.99, 1.99, 3001)
    E = np.array([brute.on_floor(t) for t in x])
    bend = np.abs(np.diff(E, 2)) / (x[1] - x[0])  # a jump of E' shows as itself, E'' as h E''
    table = brute.predicted()
    there = -2.0 + 4.0 * table.s[(table.receiver == 0) & (table.jump_E1 != 0.0)]
    far = np.abs(x[1:-1, None] - there).min(axis=1) > 2.0 * (x[1] - x[0])
    assert bend[far].max() < 0.01
    assert np.abs(table.jump_E1[table.receiver == 0]).max() > 0.5


def test_events_of_the_four_discs_have_the_symmetry_of_the_square():
    walls = [jumps_on(four_discs(emission=1.0), i) for i in range(4)]
    for wall in walls[1:]:
        np.testing.assert_allclose(wall.s, walls[0].s, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(wall.jump_E1, walls[0].jump_E1, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(1.0 - walls[0].s[::-1], walls[0].s, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(walls[0].jump_E1[::-1], walls[0].jump_E1, rtol=0.0, atol=1e-9)


def test_events_do_not_depend_on_the_unit_of_length():
    angle = 2.0 * np.pi * np.arange(64) / 64
    bean = np.stack(
        [2.8 + 0.4 * np.cos(angle), 1.4 + 0.2 * np.sin(angle) + 0.1 * np.cos(2.0 * angle)], -1
    )

    def events_in(unit):
        room = box((0.0, 0.0), (4.0 * unit, 3.0 * unit), inward=True)
        bodies = Circles((unit, unit), 0.5 * unit), closed_curve(unit * bean, 4)
        shapes = [primitive(room, emission=1.0), *(primitive(body) for body in bodies)]
        table = visual_events(Scene.of(*shapes))
        return [table.receiver, table.kind, np.round(table.s, 12)]

    table, metres = events_in(2.0**-40), events_in(1.0)
    assert len(metres[0]) > 40
    for here, there in zip(table, metres, strict=True):
        np.testing.assert_array_equal(here, there)


def test_a_hidden_line_makes_no_jump():
    table = visual_events(four_discs(emission=1.0), hidden=True)
    hidden = table.take(~table.visible)
    assert len(hidden)
    assert not np.any([hidden.jump_E, hidden.jump_E1, hidden.jump_E2])


def test_the_jump_grows_as_space_shrinks():
    """E' has units of radiance over length: scaling space by 2 halves every jump of it."""
    small = jumps_on(brute.lit_scene(), 0)
    double = jax.tree.map(lambda a: 2.0 * a, brute.lit_scene().groups)
    large = Scene(
        double,
        brute.lit_scene().material,
        PointLights(
            2.0 * brute.lit_scene().points.position, 2.0 * brute.lit_scene().points.intensity
        ),
        None,
        brute.lit_scene().crossings,
        brute.lit_scene().names,
    )
    found = jumps_on(large, 0)
    np.testing.assert_allclose(found.s, small.s, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(2.0 * found.jump_E1, small.jump_E1, rtol=1e-7)


def test_both_sides_of_a_floor_are_receivers():
    floor = primitive(Segments((-2.0, 0.0), (2.0, 0.0)))
    lamp = primitive(Segments((-0.5, -1.0), (0.5, -1.0)), emission=1.0)
    blocker = primitive(Segments((-0.2, -0.5), (0.1, -0.5)))
    scene = Scene.of(floor, lamp, blocker)
    back = jumps_on(scene, 0, front=False)
    above = Scene.of(
        floor,
        primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0),
        primitive(Segments((0.1, 0.5), (-0.2, 0.5))),
    )
    front = jumps_on(above, 0)
    assert len(jumps_on(scene, 0).s) == 0
    np.testing.assert_allclose(back.s, front.s, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(back.jump_E1, front.jump_E1, rtol=1e-9)


@pytest.mark.parametrize(
    ("ahead", "back"),
    [
        (Segments((-2.0, -0.3), (2.0, 0.1)), Segments((2.0, 0.1), (-2.0, -0.3))),
        (Arcs((0.1, 1.5), 2.0, 2.2, 2.0), Arcs((0.1, 1.5), 2.0, 4.2, -2.0)),
        (Arcs((0.1, -3.0), 3.2, 0.5, -1.1), Arcs((0.1, -3.0), 3.2, -0.6, 1.1)),
    ],
    ids=["flat", "a bowl", "a hill"],
)
def test_a_surface_drawn_the_other_way_round_receives_on_its_other_side(ahead, back):
    """Of a lamp, a point light and edges in line; jumps of E and E'' change their sign with s."""
    others = (
        primitive(Segments((0.6, 0.8), (-0.2, 0.9))),
        primitive(Segments((0.9, 1.2), (-0.7, 1.3)), emission=1.0),
    )
    lights = PointLights((0.5, 1.05), 1.3)
    one, other = (
        Scene.of(primitive(shape, name="floor"), *others, points=lights) for shape in (ahead, back)
    )
    (floor,) = one.named("floor")
    front = [len(jumps_on(one, floor, front=side).s) > 0 for side in (True, False)]
    assert sum(front) == 1
    found = jumps_on(one, floor, front=front[0])
    turned = jumps_on(other, floor, front=front[1])
    assert np.any(found.jump_E != 0.0)
    assert np.any(found.jump_E1 != 0.0)
    np.testing.assert_allclose(1.0 - turned.s[::-1], found.s, rtol=0.0, atol=1e-12)
    for name, sign in (("jump_E", -1.0), ("jump_E1", 1.0), ("jump_E2", -1.0)):
        here, there = getattr(found, name), sign * getattr(turned, name)[::-1]
        np.testing.assert_allclose(there, here, rtol=1e-6, atol=1e-8)


def test_radiance_that_jumps_along_a_surface_makes_events_of_its_own():
    """A wall whose left half glows, seen past an edge, is a lamp that ends in the middle."""
    floor = primitive(Segments((-2.0, 0.0), (2.0, 0.0)))
    wall = primitive(Segments((1.0, 1.0), (-1.0, 1.0)))
    blocker = primitive(Segments((0.1, 0.5), (-0.2, 0.5)))
    half = Scene.of(floor, wall, blocker)
    found = jumps_on(
        half, 0, lambda i, s, front, u: jax.numpy.where((i == 1) & (s > 0.5), 1.0, 0.0), ((1, 0.5),)
    )
    lamp = Scene.of(floor, primitive(Segments((0.0, 1.0), (-1.0, 1.0)), emission=1.0), blocker)
    truth = jumps_on(lamp, 0)
    np.testing.assert_allclose(found.s, truth.s, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found.jump_E1, truth.jump_E1, rtol=1e-6)


def test_where_a_bar_leaves_a_disc_is_an_edge_of_what_is_seen():
    """The brightness of a wall changes there: of one of a bar and a disc that it goes through."""
    floor = primitive(Segments((-3.0, 0.0), (3.0, 0.0)))
    blocker = primitive(Segments((0.0, 0.5), (-1.0, 0.5)))
    bar = primitive(Segments((2.0, 1.45), (-2.0, 1.45)))
    disc = primitive(Circles((0.1, 1.5), 0.4), emission=1.0)
    found = jumps_on(Scene.of(floor, blocker, bar, disc), 0)
    crossing, edge = np.array([0.1 - np.sqrt(0.4**2 - 0.05**2), 1.45]), np.array([-1.0, 0.5])
    way = crossing - edge
    x = edge[0] - way[0] / way[1] * edge[1]
    k = np.argmin(np.abs(6.0 * found.s - 3.0 - x))
    assert abs(6.0 * found.s[k] - 3.0 - x) < 1e-12
    near, far = (np.hypot(p[0] - x, p[1]) for p in (edge, crossing))
    jump = (way[1] / np.hypot(*way)) ** 2 * (1.0 / near - 1.0 / far)
    assert abs(found.jump_E1[k] - jump) < 1e-6


@pytest.mark.parametrize("through", [0.0, 0.5])
def test_a_bar_seen_edge_on_is_seen_as_far_as_it_is_not_hidden(through):
    """E grows on either side of x = 0.4 with the bar's own light in place of the wall's behind it.

    The bar ends on the wall, or goes on through it.
    """
    low, met = np.array([0.3, 0.5]), np.array([0.2, 1.0])
    high = met + through * (met - low)
    floor = primitive(Segments((-3.0, 0.0), (3.0, 0.0)))
    bar = primitive(Segments(low, high), emission=(1.0, 0.9))
    wall = primitive(Segments((-0.8, 0.9), (1.2, 1.1)), emission=(0.2, 0.7))
    found = jumps_on(Scene.of(floor, bar, wall), 0)
    (jump,) = found.jump_E1[np.abs(6.0 * found.s - 3.0 - 0.4) < 1e-9]
    near, far = (np.hypot(p[0] - 0.4, p[1]) for p in (low, met))
    assert abs(jump - 0.5**2 / near**2 * (1.0 / near - 1.0 / far) * (1.0 + 0.9 - 1.4)) < 1e-9


def test_error_of_an_extrapolation_across_a_jump():
    """Against the sum of |E - line| for a function that does what the jumps say."""
    x = np.linspace(0.0, 1.0, 200_001)
    true = np.where(x > 0.4, 0.3 + 2.0 * (x - 0.4), 0.0)
    assert float(extrapolation_error(0.3, 2.0, 0.4, 1.0)) == pytest.approx(
        np.trapezoid(true, x), abs=1e-5
    )
    assert float(extrapolation_error(0.3, 2.0, 1.4, 1.0)) == 0.0


def test_traced_scenes_are_refused():
    with pytest.raises(ValueError, match="must be concrete"):
        jax.jit(lambda r: visual_events(Scene.of(primitive(Circles((0.0, 0.0), r)))).s)(1.0)
    with pytest.raises(ValueError, match="must not be negative, but is -1"):
        extrapolation_error(0.0, 1.0, -1.0, 1.0)


def _wrong(name):
    right = {"closer": events._closer, "across": events._across, "light": events._point_irradiance}
    return {
        "forget the far edge's speed": ("_closer", lambda near, far: 1.0 / np.maximum(near, 1e-3)),
        "sum for difference": (
            "_closer",
            lambda near, far: 1.0 / np.maximum(near, 1e-3) + 1.0 / np.maximum(far, 1e-3),
        ),
        "flip the sign of dL": ("_across", lambda *a: -right["across"](*a)),
        "forget the normal's turn": (
            "_point_irradiance",
            lambda p, t, n, kappa: right["light"](p, t, n, 0.0 * kappa),
        ),
        "forget the cosine of the light": (
            "_point_irradiance",
            lambda p, t, n, kappa: tuple(e * 1.1 for e in right["light"](p, t, n, kappa)),
        ),
    }[name]


@pytest.mark.parametrize(
    ("name", "kinds", "order"),
    [
        ("forget the far edge's speed", brute.PAIRS, 1),
        ("sum for difference", brute.PAIRS, 1),
        ("flip the sign of dL", ("horizon",), 2),
        ("flip the sign of dL", brute.PAIRS, 1),
        ("forget the cosine of the light", ("shadow",), 0),
    ],
)
def test_fault_is_noticed(name, kinds, order, monkeypatch):
    attribute, twin = _wrong(name)
    monkeypatch.setattr(events, attribute, twin)
    brute.predicted.cache_clear()
    try:
        error = brute.brute_error(kinds, order)
    finally:
        monkeypatch.undo()
        brute.predicted.cache_clear()
    assert np.isfinite(error)
    assert error > 1e2 * BOUND[order]


@pytest.mark.parametrize("x64", [True, False])
def test_a_scene_in_single_precision_has_the_events_of_its_numbers(x64):
    single = worlds.everything(jnp.float32)
    wanted = visual_events(with_floats(single, np.float64))
    with jax.enable_x64(x64):
        found = visual_events(single)
    assert len(found) > 50
    assert found.s.dtype == np.float32
    for name in ("receiver", "front", "kind", "visible"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
    for name in ("s", "jump_E", "jump_E1", "jump_E2"):
        np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), rtol=1e-6)


def turned_room(at, unit=1.0, slit=0.0):
    """A floor under a lamp and a plate, or two with a slit between them; all of it turned."""
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])

    def piece(a, b):
        return Segments(*(unit * (turn @ np.array(p)) + at for p in (a, b)))

    plates = (
        [piece((-0.5, 0.5), (0.0, 0.5)), piece((slit, 0.5), (0.5, 0.5))]
        if slit
        else [piece((-0.2, 0.5), (0.15, 0.5))]
    )
    return Scene.of(
        primitive(piece((-1.0, 0.0), (1.0, 0.0)), albedo=0.5),
        primitive(piece((0.3, 1.0), (-0.3, 1.0)), emission=1.0),
        *map(primitive, plates),
    )


@pytest.mark.parametrize(("far", "unit"), [(1e5, 0.03), (1e6, 1.0)])
def test_events_far_from_the_origin_are_there(far, unit):
    near = jumps_on(turned_room(np.zeros(2)), 0)
    found = jumps_on(turned_room(far * np.array([0.731, 0.414]), unit), 0)
    assert len(near.s) == 4
    np.testing.assert_allclose(found.s, near.s, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(unit * found.jump_E1, near.jump_E1, rtol=0.0, atol=1e-4)


def test_a_narrow_slit_far_from_the_origin_has_two_edges():
    near = jumps_on(turned_room(np.zeros(2), slit=5e-5), 0)
    found = jumps_on(turned_room(1e5 * np.array([0.731, 0.414]), slit=5e-5), 0)
    assert len(near.s) == 6
    np.testing.assert_allclose(found.s, near.s, rtol=0.0, atol=1e-8)
