"""The numbers of every picture are the library's, and dragging compiles nothing."""

import dataclasses
import time

import jax
import jax.monitoring
import jax.numpy as jnp
import numpy as np
import pytest
from flatland_explorer import handles, panels, paths, programs
from flatland_explorer.asked import Asked, Lit
from flatland_explorer.asked import lit as light_on
from flatland_explorer.board import LAMP, Board, Part, first_board, sorted_board

from firstorder.caching import Cache, Candidates, circular_regions, radius_for
from firstorder.conventions import direction
from firstorder.fields import Grid
from firstorder.flatland import (
    ConstantSky,
    Receiver,
    derivatives,
    irradiance,
    light_field,
    mirror_irradiance,
    nearest,
    receiver,
    view,
)
from firstorder.flatland.discontinuities import jumps_on
from firstorder.shadowfield import Wedge, grid_visibility, power_spectrum
from tests.machine import slower

COUNT = 48


def crossed():
    """The first board, its strip pushed through the disc and through the lamp's neighbour."""
    first = first_board()
    more = Part("segment", {"start": (0.1, 1.25), "end": (0.2, 1.4)}, "bar")
    board = sorted_board(first, [*first.parts, more], first.parts[first.receiver])
    return handles.move(board, "2.start", (-0.6, 0.5))


def asked(board):
    return Asked(board, COUNT)


def filled(values):
    return np.array([np.nan if v is None else v for v in values])


@pytest.fixture(scope="module")
def lit():
    return light_on(asked(crossed()))


def test_the_curves_are_the_exact_derivatives(lit):
    scene = crossed().scene()
    assert len(scene.crossings.pairs) >= 3  # the lamp and the bar, the strip and the disc twice
    np.testing.assert_array_equal(lit.s[lit.on_grid], asked(crossed()).grid)
    rows = np.append(lit.on_grid[::5], np.flatnonzero(lit.jump)[1])
    at = jax.vmap(lambda s: receiver(scene, 0, s))(lit.s[rows])
    true = jax.jit(jax.vmap(lambda at: derivatives(irradiance, scene, at, freedoms=("x",))))(at)
    expected = np.stack([true.value, true.first, true.second], -1)
    np.testing.assert_allclose(lit.E[rows], expected, rtol=1e-9, atol=1e-9)


def test_jumps_are_where_the_visual_events_are_and_have_both_sides(lit):
    true, rows = jumps_on(crossed().scene(), 0), np.flatnonzero(lit.jump)
    assert len(true.s) == 5
    for place, J in zip(true.s, true.jump_E1, strict=True):
        if np.sum(np.abs(true.s - place) < 1.0 / COUNT) > 1:
            continue  # two in one step: the first is told
        k = rows[np.argmin(np.abs(lit.s[rows] - place))]
        assert lit.s[k] <= place + 1e-9
        assert place <= lit.s[k + 1] + 1e-9
        assert lit.s[k + 1] - lit.s[k] < 1e-8
        np.testing.assert_allclose(lit.E[k + 1, 1] - lit.E[k, 1], J, rtol=0.0, atol=1e-6)


def test_what_is_sent_is_what_was_found(lit):
    one = asked(crossed())
    one.__dict__["lit"] = lit
    sent = panels.curve_panel(one)
    np.testing.assert_allclose(filled(sent["x"]), 2.0 * lit.s, rtol=0.0, atol=5.1e-6)
    for k, key in enumerate(("E", "E1", "E2")):
        near = 6e-6 * np.max(np.abs(lit.E[:, k]))  # six digits of the largest
        np.testing.assert_allclose(filled(sent[key]), lit.E[:, k], rtol=0.0, atol=near)
    assert sent["jump"] == lit.jump.tolist()


def test_within_a_body_there_is_no_value():
    board = handles.move(first_board(), "4.body", (0.0, 0.05))
    found = light_on(asked(board))
    x, E = 2.0 * found.s - 1.0, found.E[:, 0]
    reach = (0.13**2 - 0.05**2) ** 0.5
    inside = np.abs(x) < reach - 1e-7
    assert np.all(np.isnan(E[inside]))
    assert np.all(np.isfinite(E[np.abs(x) > reach + 1e-7]))
    assert np.sum(inside) > 3
    field = panels.field_panel(asked(board))
    s = (np.array(field["inside"]) + 0.5) / COUNT
    np.testing.assert_array_less(np.abs(2.0 * s - 1.0), reach)
    probed = dataclasses.replace(board, probe=0.5)
    assert panels.view_panel(asked(probed)) == {"gaps": [], "inside": True}
    assert panels.curve_panel(asked(probed))["probe"]["values"] == [None] * 3


@pytest.mark.parametrize("part", ["ellipse", "curve", "box"])
def test_every_kind_of_body_is_known_from_inside(part):
    c, r = (0.0, 0.02), 0.2
    ring = [(-r, -r), (-r, r), (r, r), (r, -r)]
    bodies = {
        "ellipse": [Part("ellipse", {"center": c, "semi": (r, 0.1), "tilt": 0.1})],
        "curve": [
            Part(
                "curve",
                {"cosines": (c, (0.0, r)), "sines": ((0.0, 0.0), (r, 0.0)), "samples": 32},
            )
        ],
        "box": [
            Part("segment", {"start": a, "end": b})
            for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)
        ],
    }
    first = first_board()
    board = sorted_board(first, [*first.parts[:2], *bodies[part]], first.parts[0])
    world = asked(board).world
    at = jax.vmap(lambda s: receiver(world.scene, 0, s))(jnp.array([0.2, 0.45, 0.5, 0.55, 0.8]))
    inside = jax.vmap(lambda at: programs._inside(world, at))(at)
    assert inside.tolist() == [False, True, True, True, False]


def test_the_probe_sees_what_the_library_sees():
    board = dataclasses.replace(crossed(), probe=0.1, tilt=0.3)
    found = panels.view_panel(asked(board))["gaps"]
    scene = board.scene()
    on = receiver(scene, 0, board.probe)
    seen = view(scene, Receiver(on.position, on.n + 0.3, on.on))
    wide = np.flatnonzero(np.diff(seen.angles) > 1e-12)
    ends = np.stack([seen.angles[wide], seen.angles[wide + 1]], -1)
    # Where the two lists cut a gap in two, both parts show the same shape.
    for gap in found:
        middle = 0.5 * (gap["from"] + gap["to"])
        k = np.flatnonzero((ends[:, 0] <= middle) & (middle <= ends[:, 1]))[0]
        assert gap["seen"] == int(seen.seen[wide[k]])
    E = sum(g["L"] * (np.sin(g["to"]) - np.sin(g["from"])) for g in found)
    exact = irradiance(scene, Receiver(on.position, on.n + 0.3, on.on))
    np.testing.assert_allclose(E, exact, rtol=1e-5)
    np.testing.assert_allclose(light_on(asked(board)).probe[0], exact, rtol=1e-9)


def test_the_light_field_is_the_scenes():
    board = dataclasses.replace(first_board(), environment=ConstantSky(0.25))
    found = panels.field_panel(asked(board))
    scene = board.scene()
    L = light_field(scene, receiver(scene, 0, 0.5))
    strips = np.array([s for s in found["strips"] if s[2] - s[1] > 1e-3][::5])
    # A mirror emits nothing: what it shows is compared below.
    strips = strips[strips[:, 3] != 3]
    x, theta = 2.0 * (strips[:, 0] + 0.5) / COUNT - 1.0, 0.5 * (strips[:, 1] + strips[:, 2])
    true = jax.vmap(L)(x, theta)
    assert len(x) > 40
    np.testing.assert_allclose(strips[:, 4], true, rtol=0.0, atol=1e-6)
    assert set(np.round(np.asarray(true), 6)) == {0.0, 0.25, 1.0}


def test_light_by_a_flat_mirror_is_the_librarys_to_a_cell():
    glass = Part("segment", {"start": (1.1, 0.1), "end": (1.3, 1.4)}, "glass", {"mirror": 0.8})
    first = first_board()
    board = sorted_board(first, [*first.parts[:3], glass], first.parts[0])
    scene = board.scene()
    found = panels.field_panel(asked(board))
    s = (np.arange(COUNT) + 0.5) / COUNT
    k = scene.named("glass")[0]
    true = jax.vmap(lambda s: mirror_irradiance(scene, receiver(scene, 0, s), mirrors=(k,)))(s)
    strips = np.array(found["strips"])
    own = [strips[(strips[:, 0] == i) & (strips[:, 3] == k)] for i in range(COUNT)]
    width = np.array([np.max(rows[:, 2]) - np.min(rows[:, 1]) for rows in own])
    # Two edges of the lamp's image, each found to half of a sixteenth of a 32nd of the gap.
    near = 0.8 * width / panels.CELLS / (panels.FINER + 1)
    np.testing.assert_array_less(np.abs(filled(found["mirrored"]["E"]) - true), near + 1e-6)
    assert np.max(true / near) > 40.0


def test_the_spectrum_is_that_of_the_shadow_light_field_in_its_own_frame():
    parts = [
        Part("segment", {"start": (0.0, 0.0), "end": (1.0, 0.0)}, "floor"),
        Part("segment", {"start": (0.8, 1.0), "end": (0.2, 1.0)}, "light", LAMP),
        Part("segment", {"start": (0.3013, 0.5027), "end": (0.4491, 0.5519)}, "blocker"),
        Part("circle", {"center": (0.6507, 0.7011), "radius": 0.0603}, "blocker"),
    ]
    upright = Board(tuple(parts))
    found = panels.spectrum_panel(asked(upright))
    n = programs.SHADOW
    grid = Grid.spanning((n, n), (0.5, 0.5), (0.5, 0.5))
    energy = power_spectrum(grid_visibility(upright.scene(), grid), grid)
    near = slice(n // 2 - programs.SHOWN, n // 2 + programs.SHOWN + 1)
    amplitude = np.sqrt(np.asarray(energy))[near, near]
    shade = 1.0 + np.log10(np.maximum(amplitude / amplitude.max(), 1e-4)) / 4.0
    np.testing.assert_allclose(np.array(found["cells"]), shade, rtol=0.0, atol=2e-6)
    np.testing.assert_allclose(found["depths"], (0.2386, 0.4973), rtol=0.0, atol=1e-5)
    wedge = Wedge(0.2386, 0.4973)
    np.testing.assert_allclose(found["slopes"], wedge.slopes(1.0), rtol=1e-4)

    def turned(part):  # the whole scene, turned and shifted
        def at(p):
            return (0.3 + 0.8 * p[0] - 0.6 * p[1], -0.2 + 0.6 * p[0] + 0.8 * p[1])

        return part.with_numbers(
            **{k: at(v) for k, v in part.numbers.items() if k in ("start", "end", "center")}
        )

    aslant = panels.spectrum_panel(asked(Board(tuple(map(turned, parts)))))
    # The disc's top is one of 65 points of its rim.
    top = 0.0603 * (1.0 - np.cos(np.pi / 64.0)) / 0.2386**2
    np.testing.assert_allclose(aslant["slopes"], found["slopes"], rtol=0.0, atol=top + 1e-5)
    np.testing.assert_allclose(aslant["cells"], found["cells"], rtol=0.0, atol=1e-5)


def test_the_spectrum_says_why_it_is_not_there():
    dark = Board(tuple(p for p in first_board().parts if p.name != "lamp"))
    assert "no lamp" in panels.spectrum_panel(asked(dark))["words"]
    below = handles.move(first_board(), "1.body", (0.0, -1.0))
    assert "behind" in panels.spectrum_panel(asked(below))["words"]
    alone = Board(first_board().parts[:2])
    assert panels.spectrum_panel(asked(alone))["slopes"] is None


def test_the_records_answer_as_a_cache_of_them_alone(lit):
    board = crossed()
    one = asked(board)
    one.__dict__["lit"] = lit
    found = panels.record_panel(one)
    E = lit.E[lit.on_grid]
    rows = [int(np.argmin(np.abs(2.0 * one.grid - v))) for v in found["x"]]
    table = Candidates.on_line(2.0 * one.grid[rows], E[rows])
    radius = radius_for(E[rows, 2], board.tolerance * np.max(E[:, 0]), definition="largest")
    region = circular_regions(radius, *(2.0 * r for r in panels.REACH))
    np.testing.assert_allclose(found["reach"], region.radius, rtol=1e-4)
    answer = Cache.of(table, region)(2.0 * one.grid[:, None])
    assert bool(np.all(answer.covered))
    np.testing.assert_allclose(found["answer"], answer.value, rtol=0.0, atol=1e-6)
    finer = asked(dataclasses.replace(board, tolerance=1e-3))
    finer.__dict__["lit"] = lit
    more = panels.record_panel(finer)
    assert len(more["x"]) > len(found["x"])
    for given in (found, more):
        error = filled(given["answer"]) - E[:, 0]
        np.testing.assert_allclose(given["worst"], np.max(np.abs(error)), rtol=0.0, atol=2e-6)
        np.testing.assert_allclose(given["rms"], np.sqrt(np.mean(error**2)), rtol=0.0, atol=2e-6)


def test_a_cache_without_light_says_so():
    one = asked(crossed())
    nothing = Lit(one.grid, np.zeros((COUNT, 3)), *[np.arange(COUNT)] * 2, np.zeros(3))
    one.__dict__["lit"] = nothing
    assert "No light" in panels.record_panel(one)["words"]


# --- the path ------------------------------------------------------------------------------------


def through(board, ray, u):
    """A ray at the probe, followed back through the real mirror to a line across the lamp's ray."""
    scene, points = board.scene(), np.array(ray.points)
    place, n = handles.probe_frame(board)
    n = n + board.tilt
    origin = jnp.asarray(place) + u[0] * jnp.array([jnp.cos(n), jnp.sin(n)])
    along = direction(n + ray.received + u[1])
    if ray.mirrored:
        k = scene.named("mirror")[0]
        hit = nearest(scene, origin[None], along[None], 0)
        s = hit.s[0]
        origin = origin + hit.t[0] * along
        normal = scene.frame(k, s).normal
        along = along - 2.0 * jnp.sum(along * normal) * normal
    way = jnp.asarray(points[1] - points[0])
    angle = jnp.arctan2(-way[0], way[1])  # of the light that leaves the lamp
    normal, tangent = direction(angle), jnp.array([jnp.cos(angle), jnp.sin(angle)])
    gap = jnp.asarray(points[0]) - origin
    t = jnp.sum(gap * normal) / jnp.sum(along * normal)
    x = jnp.sum((origin + t * along - jnp.asarray(points[0])) * tangent)
    leaves = jnp.arctan2(along[0], -along[1]) - angle
    return jnp.stack([x, jnp.arctan2(jnp.sin(leaves), jnp.cos(leaves))])


@pytest.mark.parametrize(
    "case", ["bent", "bent the other way", "from behind", "straight", "tilted"]
)
def test_the_path_is_the_first_order_of_real_rays(case):
    board = first_board()
    if case == "bent the other way":
        board = handles.move(board, "3.bend", (1.23, 0.74))
    if case == "from behind":
        arc = board.parts[3]
        start, sweep = arc.numbers["start"], arc.numbers["sweep"]
        board = board.replaced(3, arc.with_numbers(start=start + sweep, sweep=-sweep))
    if case == "straight":
        board = Board(board.parts[:2], probe=0.42)
    if case == "tilted":
        board = dataclasses.replace(board, tilt=-0.4)
    ray = paths.central_ray(board)
    assert ray is not None
    assert ray.mirrored == (case != "straight")
    numbers = jnp.array(
        [ray.sigma, ray.received, *[*ray.distances, 0.0][:2], ray.incidence, ray.kappa]
    )
    path = paths.path_of(numbers, ray.mirrored)
    M, frame = jnp.eye(2), path.source.frame
    for event in path.events:
        law = event.law(frame)
        M, frame = M @ law.M, law.to if getattr(law, "to", None) is not None else frame
    zero = through(board, ray, jnp.zeros(2))
    np.testing.assert_allclose(zero, 0.0, rtol=0.0, atol=1e-9)
    true = jax.jacfwd(lambda u: through(board, ray, u))(jnp.zeros(2))
    np.testing.assert_allclose(M, true, rtol=0.0, atol=1e-8)
    found = panels.path_panel(asked(board))["steps"]
    first = np.array(found[0]["light"])
    np.testing.assert_allclose(first, np.diag([ray.sigma**2, paths.SPREAD**2]), rtol=1e-4)
    inverse = np.linalg.inv(np.asarray(true))
    last = inverse @ first @ inverse.T
    np.testing.assert_allclose(found[-1]["light"], last, rtol=0.0, atol=2e-4 * np.max(np.abs(last)))


def test_a_path_that_is_none_says_so():
    below = handles.move(Board(first_board().parts[:2]), "1.body", (0.0, -1.0))
    assert "No lamp" in panels.path_panel(asked(below))["words"]


# --- no compilation, and little time -------------------------------------------------------------


def everything(board):
    one = Asked(board)
    return [panel(one) for panel in PANELS]


PANELS = (
    panels.view_panel,
    panels.field_panel,
    panels.curve_panel,
    panels.spectrum_panel,
    panels.path_panel,
    panels.record_panel,
)


def compilations(act):
    """How many programs are compiled, or read from the cache, while something is done."""
    found = []

    def listen(event, *_, **__):
        if "backend_compile" in event:
            found.append(event)

    jax.monitoring.register_event_duration_secs_listener(listen)
    try:
        act()
    finally:
        jax.monitoring.unregister_event_duration_listener(listen)
    return len(found)


def test_twenty_moves_compile_nothing():
    board = first_board()
    everything(board)
    boards = []
    for k in range(20):  # the strip goes through the disc, the mirror bends, the lamp turns
        board = handles.move(board, "2.body", (-0.45 + 0.02 * k, 0.5 + 0.04 * k))
        board = handles.move(board, "3.bend", (1.3 + 0.01 * k, 0.78))
        board = handles.move(board, "1.normal", (-0.3 + 0.05 * k, 0.5))
        board = handles.move(board, "probe.place", (-0.9 + 0.09 * k, 0.0))
        boards.append(dataclasses.replace(board, tolerance=10.0 ** (-3.5 + 0.15 * k)))
    crossings = {len(b.scene().crossings.pairs) for b in boards}
    assert len(crossings) > 1
    assert compilations(lambda: [everything(b) for b in boards]) == 0
    # One more part is another program, so that the count is one that can fail.
    one = Asked(handles.added(board, "strip"))
    assert any(compilations(lambda panel=panel: panel(one)) > 0 for panel in PANELS)


def test_a_redraw_takes_less_than_a_tenth_of_a_second():
    board = first_board()
    everything(board)

    def cost(k):
        moved = handles.move(board, "2.body", (0.1 + 0.01 * k, 0.6))
        begin = time.process_time()
        everything(moved)
        return time.process_time() - begin

    # Processor time, summed over threads: other processes on the machine do not enter. The fastest
    # of twelve counts, so that the first one that is fast enough will do.
    bound = 0.1 * slower()
    assert any(cost(k) < bound for k in range(12))
