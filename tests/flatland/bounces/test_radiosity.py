"""The radiosity reference: an independent solution, furnaces, energy, derivatives."""

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.flatland.bounces import radiosity as oracle
from firstorder.flatland import (
    Arcs,
    Circles,
    PointLights,
    Receiver,
    Scene,
    Segments,
    box,
    derivatives,
    irradiance,
    polyline,
    primitive,
)
from firstorder.flatland.bounces import _panels as cutting
from firstorder.flatland.bounces import _transfer as transfer
from firstorder.flatland.bounces._panels import Discretization
from firstorder.flatland.bounces.radiosity import corner_exponent, solve_radiosity
from firstorder.flatland.visible import receiver
from tests.flatland.worlds import two_rooms

PLACES = np.array([1e-4, 0.01, 0.1, 0.26, 0.5])
COARSE = Discretization(5, 1e-2)


def room(albedo=0.2, emission=0.0, discs=False, light=True):
    walls = primitive(box((0.0, 0.0), (1.0, 1.0), inward=True), albedo=albedo, emission=emission)
    centers = [(0.25, 0.25), (0.25, 0.75), (0.75, 0.25), (0.75, 0.75)]
    more = (
        [primitive(Circles(centers, [0.08] * 4), albedo=albedo, emission=emission)] if discs else []
    )
    return Scene.of(walls, *more, points=PointLights((0.5, 0.5), 1.0) if light else None)


@pytest.fixture(scope="module")
def scene_c():
    return solve_radiosity(room(), fineness=Discretization(8, 1e-5))


@pytest.fixture(scope="module")
def scene_d():
    return solve_radiosity(room(discs=True), fineness=COARSE)


@eqx.filter_jit
def three(solution, index, s):
    """E, E' and E'' in the parameter."""

    def E(t):
        return solution.irradiance(receiver(solution.scene, index, t))

    def first(t):
        return jax.jvp(E, (t,), (jnp.ones_like(t),))

    def both(t):
        (value, slope), (_, bend) = jax.jvp(first, (t,), (jnp.ones_like(t),))
        return jnp.stack([value, slope, bend])

    return jax.vmap(both)(s).T


def test_two_solutions_go_through_one_compiled_function():
    index, s = jnp.asarray(0), jnp.asarray([0.3])  # the floor, on which s is x
    traced = []

    @eqx.filter_jit
    def asked(solution):
        traced.append(solution)
        return solution.E

    for albedo in (0.2, 0.4):
        solution = solve_radiosity(room(albedo), fineness=Discretization(2, 0.5))
        asked(solution)
        E, slope, _ = three(solution, index, s)
        jet = derivatives(solution.irradiance, receiver(solution.scene, index, s[0]))
        assert jet.value == pytest.approx(float(E[0]), rel=1e-12)
        assert jet.gradient[0] == pytest.approx(float(slope[0]), rel=1e-12)
    assert len(traced) == 1


def test_scene_c_is_that_of_an_independent_solution_with_both_derivatives(scene_c):
    """E to 1e-8; E' and E'' from kernels that sympy differentiates under the integral."""
    ours = np.asarray(three(scene_c, jnp.asarray(0), jnp.asarray(PLACES)))
    truth = oracle.room_derivatives(PLACES)
    assert np.abs(ours[0] / truth[0] - 1.0).max() < 1e-8
    far = PLACES >= 0.01
    scale = np.abs(truth[:, far]).max(axis=1, keepdims=True)
    assert (np.abs(ours - truth)[:, far] / scale).max() < 1e-7
    # The power at the corner makes E'' diverge: -12 at x = 1/4, thousands at 1e-4.
    assert abs(truth[2, 0]) > 50.0 * abs(truth[2, 3])


def test_what_is_emitted_is_absorbed(scene_c, scene_d):
    for solution, bound in ((scene_c, 1e-10), (scene_d, 1e-5)):
        emitted, absorbed = solution.flux()
        assert float(emitted) == pytest.approx(2.0 * np.pi)
        assert float(absorbed) == pytest.approx(float(emitted), rel=bound)


def test_a_closed_room_of_one_radiance_is_a_furnace():
    """Emission 1 - rho makes L = 1 and E = 2 everywhere, corners included."""
    solution = solve_radiosity(
        room(0.3, 0.7, discs=True, light=False), fineness=Discretization(3, 0.1)
    )
    assert np.abs(np.asarray(solution.E) - 2.0).max() < 2e-12
    radiance = 0.7 + np.asarray(solution.reflected)
    assert np.abs(radiance - 1.0).max() < 1e-12


def tilted(side):
    """A square room of one radiance, whose corners no number holds exactly."""
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    corners = side * np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]) @ turn
    return primitive(polyline(corners), albedo=0.3, emission=0.7)


def test_a_tilted_room_is_a_furnace_too():
    """Beside its corners rounding decides what a ray meets."""
    room = solve_radiosity(Scene.of(tilted(1.0)), fineness=Discretization(4, 1e-4))
    assert np.abs(np.asarray(room.E) - 2.0).max() < 1e-5


def _gathered(scene, panels, places):
    """Irradiance at places of the first arc, from panels that all send the same radiance."""
    even = jnp.ones((panels.shape.shape[0], panels.count))

    def one(s):
        return transfer.panel_irradiance(scene, panels, even, receiver(scene, 1, s), moving=False)

    return jax.vmap(one)(places)


@pytest.mark.parametrize("level", [0, 3])
@pytest.mark.parametrize("start", [0.5 * np.pi, 3.8092187744837633])
def test_a_hollow_shape_gathers_its_own_light(level, start):
    """Compiled as tests are, and as a program is: each rounds grazing rays in its own way."""
    center, radius = np.array([-1.94420069, 1.26589764]), 1.3518515820663346
    bowl = primitive(Arcs(center, radius, start, np.pi), emission=1.0)
    first = radius * np.array([-np.sin(start), np.cos(start)])
    lid = primitive(Segments(center - first, center + first), emission=1.0)
    scene = Scene.of(bowl, lid)
    panels, _ = cutting.cut_into_panels(scene, COARSE)
    compiled = jax.jit(_gathered, compiler_options={"xla_backend_optimization_level": level})
    E = compiled(scene, panels, jnp.linspace(0.01, 0.99, 200))
    assert np.abs(np.asarray(E) - 2.0).max() < 1e-8


@pytest.mark.parametrize("side", [1.0, 1e-9])
def test_a_furnace_in_single_precision_is_one(side):
    with jax.enable_x64(False):
        solution = solve_radiosity(Scene.of(tilted(side)), fineness=Discretization(4))
        assert solution.E.dtype == jnp.float32
        assert np.abs(np.asarray(solution.E) - 2.0).max() < 3e-4


def test_irradiance_in_scene_d_obeys_the_integral_equation_by_another_route(scene_d):
    """A fan of rays in NumPy, each asked of the solution where it ends: no gaps, no panels."""
    place, n = np.array([0.37, 0.0]), 60_000
    sine = (2.0 * (np.arange(n) + 0.5) / n - 1.0)[:, None]  # d(sin) = cos d(theta)
    u = np.concatenate([-sine, np.sqrt(1.0 - sine**2)], 1)
    t = np.full(n, np.inf)
    shape, s = np.zeros(n, int), np.zeros(n)
    for k, c in enumerate([(0.25, 0.25), (0.25, 0.75), (0.75, 0.25), (0.75, 0.75)]):
        w = np.asarray(c) - place
        along = u @ w
        square = 0.08**2 - (w @ w - along**2)
        near = along - np.sqrt(np.maximum(square, 0.0))
        hit = (square > 0.0) & (near > 0.0) & (near < t)
        t, shape = np.where(hit, near, t), np.where(hit, 4 + k, shape)
        q = place + near[:, None] * u - np.asarray(c)
        s = np.where(hit, np.mod(np.arctan2(q[:, 0], q[:, 1]) / (2.0 * np.pi), 1.0), s)
    for k, (axis, value) in enumerate([(1, 0.0), (0, 1.0), (1, 1.0), (0, 0.0)]):
        if k == 0:
            continue
        far = (value - place[axis]) / np.where(u[:, axis] == 0.0, 1e-300, u[:, axis])
        hit = (far > 0.0) & (far < t)
        q = (place + far[:, None] * u)[:, 1 - axis]
        t, shape = np.where(hit, far, t), np.where(hit, k, shape)
        s = np.where(hit, q if k == 1 else 1.0 - q, s)
    send = eqx.filter_jit(lambda sent, *a: jax.vmap(sent, in_axes=(0, 0, None, None))(*a))
    L = send(scene_d, jnp.asarray(shape), jnp.asarray(s), jnp.asarray(True), jnp.zeros(2))
    fan = 2.0 * float(jnp.mean(L))
    ours = float(scene_d.indirect(receiver(scene_d.scene, 0, 0.37)))
    assert ours == pytest.approx(fan, abs=2e-5)  # one ray in 60 000 at each of some ten edges


def test_derivatives_in_scene_d_are_those_of_differences(scene_d):
    """Between events, on a wall, in the shade too, and on a disc."""
    for index, s in ((0, 0.3), (0, 0.15), (0, 0.47), (4, 0.4), (4, 0.1)):
        h = 2e-4
        around = s + h * np.arange(-2, 3)
        E, E1, E2 = np.asarray(three(scene_d, jnp.asarray(index), jnp.asarray(around)))
        numeric = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) @ E / (12.0 * h)
        assert E1[2] == pytest.approx(numeric, abs=1e-7 * max(1.0, abs(E1[2])) + 1e-8 / h)
        numeric = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) @ E1 / (12.0 * h)
        assert E2[2] == pytest.approx(numeric, abs=1e-5 * max(1.0, abs(E2[2])))


def test_a_solution_is_a_radiance(scene_c):
    """The core's own integration, which knows nothing of panels, sees the same light."""
    at = receiver(scene_c.scene, 0, 0.31)
    seen = eqx.filter_jit(lambda s, at: irradiance(s.scene, at, radiance=s, nodes=48))(scene_c, at)
    assert float(seen) == pytest.approx(float(scene_c.irradiance(at)), rel=1e-8)


def test_other_albedos_are_a_solve_away_and_differentiable(scene_c):
    brighter = scene_c.relit(jnp.full((4, 2), 0.6))
    assert float(brighter.irradiance(receiver(brighter.scene, 0, 0.26))) == pytest.approx(
        oracle.room_irradiance([0.26], 0.6)[0], rel=1e-7
    )
    slope = jax.grad(lambda a: jnp.sum(scene_c.relit(jnp.full((4, 2), a)).E[:, 0]))(0.2)
    up, down = (float(jnp.sum(scene_c.relit(jnp.full((4, 2), a)).E[:, 0])) for a in (0.201, 0.199))
    assert float(slope) == pytest.approx((up - down) / 0.002, rel=1e-4)


def test_a_scene_may_be_open_and_shapes_may_have_two_sides():
    """A screen lit from one side lights the floor before it, and not the floor behind it."""
    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor", albedo=0.5)
    screen = primitive(Segments((0.0, 0.1), (0.0, 1.0)), name="screen", albedo=(0.0, 0.8))
    scene = Scene.of(floor, screen, points=PointLights((0.5, 0.6), 1.0))
    solution = solve_radiosity(scene, fineness=COARSE)
    sides = set(zip(solution.panels.shape.tolist(), solution.panels.side.tolist(), strict=True))
    assert (0, 0) in sides
    assert (0, 1) not in sides  # nothing is below the floor
    emitted, absorbed = solution.flux()
    assert float(absorbed) < float(emitted)
    lit = solution.indirect(receiver(scene, 0, 0.75))  # the floor before the lit side
    dark = solution.indirect(receiver(scene, 0, 0.4))  # and behind the screen
    assert float(lit) > 0.02
    assert 0.0 <= float(dark) < 1e-3
    turned = primitive(Segments((0.0, 1.0), (0.0, 0.1)), albedo=(0.8, 0.0))  # the other way round
    other = solve_radiosity(Scene.of(floor, turned, points=scene.points), fineness=COARSE)
    np.testing.assert_allclose(other.indirect(receiver(scene, 0, 0.75)), lit, rtol=1e-9)


def _room(*more):
    """A lamp under a ceiling, and other things."""
    lamp = primitive(Segments((2.3, 2.9), (1.7, 2.9)), emission=1.0)
    return Scene.of(lamp, *(primitive(shape, albedo=0.5) for shape in more))


def test_a_box_on_a_floor_is_a_floor_with_that_outline():
    corners = [(0, 0), (0.7, 0), (0.7, 1), (1.3, 1), (1.3, 0), (4, 0), (4, 3), (0, 3)]
    outline = [Segments(a, b) for a, b in itertools.pairwise([*corners, corners[0]])]
    scenes = (
        _room(box((0, 0), (4, 3), inward=True), box((0.7, 0), (1.3, 1))),
        _room(*outline),
    )
    fineness = Discretization(4, 0.01)
    stands, bends = (solve_radiosity(scene, fineness=fineness) for scene in scenes)
    x = jnp.array([(2.0, 1.5), (0.3, 0.2), (0.65, 0.02), (3.9, 0.1)])
    found = [
        jax.jit(jax.vmap(lambda p, s=s: s.irradiance(Receiver(p, 0.3))))(x) for s in (stands, bends)
    ]
    np.testing.assert_allclose(found[0], found[1], rtol=3e-4)


def test_a_gap_too_thin_for_its_length_is_refused():
    hovers = _room(box((0, 0), (4, 3), inward=True), box((0.7, 1e-7), (1.3, 1)))
    with pytest.raises(ValueError, match="at most 20000 nodes"):
        solve_radiosity(hovers, fineness=Discretization(40, 1e-7))


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_two_rooms_share_a_wall_and_no_light(turn):
    """Each draws it. The light of a lamp in one is absorbed there."""
    scene, beside = two_rooms(turn)
    solution = solve_radiosity(scene)
    assert solution.irradiance(beside) == 0.0
    np.testing.assert_allclose(*solution.flux(), rtol=1e-6)


def test_what_lies_under_a_lamp_neither_shines_nor_absorbs():
    room = primitive(box((0.0, 0.0), (1.0, 1.0), inward=True), albedo=0.5)
    lamp = primitive(Segments((0.3, 0.0), (0.7, 0.0)), emission=1.0, albedo=0.2)
    emitted, absorbed = solve_radiosity(Scene.of(room, lamp, lamp)).flux()
    np.testing.assert_allclose(emitted, 0.8, rtol=1e-12)
    np.testing.assert_allclose(absorbed, 0.8, rtol=1e-5)


def test_what_is_not_diffuse_is_refused():
    glass = primitive(box((0.0, 0.0), (1.0, 1.0)), mirror=0.5, emission=1.0)
    with pytest.raises(ValueError, match="must be diffuse, but holds a surface with `mirror`"):
        solve_radiosity(Scene.of(glass))
    with pytest.raises(ValueError, match="must be concrete"):
        jax.jit(lambda a: solve_radiosity(room(a)).E)(0.2)
    with pytest.raises(ValueError, match="`albedo` must be positive"):
        corner_exponent(0.0)


def test_the_power_at_a_corner():
    assert corner_exponent(0.5) == pytest.approx(oracle.fitted_exponent(0.5), abs=1e-3)


FAULTS = {
    "forget the ends' motion": (
        "_ends",
        lambda *a: jnp.zeros(()),
    ),
    "forget the second order of the ends": (
        "_ends",
        lambda scene, panels, at, here, gaps, L: (
            0.5 * radiosity_ends(scene, panels, at, here, gaps, L)
        ),
    ),
    "forget the parts": ("_parts", lambda scene, panels, at, gaps, L: jnp.zeros(())),
    "see through the discs": ("_whole", lambda panels, gaps: jnp.ones(panels.shape.shape, bool)),
}
radiosity_ends = transfer._ends


def jet_of(solution):
    """Light that was reflected, and its derivative, at one receiver in the penumbra."""

    def E(t):
        return solution.indirect(receiver(solution.scene, 0, t))

    def jet(t):
        return jnp.stack(jax.jvp(E, (t,), (jnp.ones_like(t),)))

    return np.asarray(jax.jit(jet)(jnp.asarray(0.47)))


@pytest.fixture(scope="module")
def right(scene_d):
    return jet_of(scene_d)


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_noticed(name, scene_d, right, monkeypatch):
    """E or E' at one receiver in the penumbra of light from the walls."""
    attribute, twin = FAULTS[name]
    monkeypatch.setattr(transfer, attribute, twin)
    wrong = jet_of(scene_d)
    assert np.all(np.isfinite(wrong))
    assert np.abs(wrong - right).max() > 1e-2


def test_fault_panels_not_cut_at_events_is_noticed(monkeypatch):
    """Energy is then kept to a part in a thousand only."""
    right = cutting.visual_events

    def none(*args, **options):
        table = right(*args, **options)
        return table.take(np.zeros(0, int))

    monkeypatch.setattr(cutting, "visual_events", none)
    emitted, absorbed = solve_radiosity(room(discs=True), fineness=COARSE).flux()
    assert abs(float(absorbed / emitted) - 1.0) > 1e-4
