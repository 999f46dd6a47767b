"""Light along silhouettes against closed forms that know none, and against light by azimuth."""

import functools
import importlib

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from firstorder.space import (
    Receiver,
    Scene,
    boundary_gradient,
    box,
    cylinder,
    derivatives,
    disc,
    ellipsoid,
    irradiance,
    net_visibility,
    plane,
    primitive,
    receiver,
    rectangle,
    sphere,
    vector_irradiance,
)
from firstorder.space.azimuthal.transport import transport_by_azimuth
from firstorder.space.silhouettes import _edge_integrals as edge_integrals
from firstorder.visibility import _contour as contour
from tests.space import hemispheres, worlds

# The bounds: one ball with 16 nodes, and everything else.
ONE, OTHERS = 1e-13, 1e-10
SPOTS = [(x, 0.3 * x + 0.1) for x in (-2.5, -1.1, -0.2, 0.0, 0.3, 1.4, 6.0)]
BALLS = [((0.2, 0.1, 1.0), 0.7), ((0.2, 0.1, 0.3), 0.25), ((2.9, 0.4, 0.3), 0.7)]


def one(weight):
    """The weight of net visibility."""
    return jnp.ones_like(weight[..., 2])


@jax.jit
def ball(center, radius, x):
    """Net visibility and irradiance of a dark ball under a sky, with contour gradients."""
    scene = Scene.of(primitive(sphere(center, radius)), environment=1.0)
    at = receiver((0.0, 0.0, 0.0)).moved(x)
    return (
        net_visibility(scene, at),
        irradiance(scene, at),
        boundary_gradient(scene, at, weight=one),
        boundary_gradient(scene, at),
    )


def differences(function, h="1e-9"):
    """Value and gradient of a function of a place, in mpmath."""
    with mp.workdps(40):
        h = mp.mpf(h)
        steps = [function(h, 0) - function(-h, 0), function(0, h) - function(0, -h)]
        return float(function(0, 0)), np.array([float(s / (2 * h)) for s in steps])


def shifted(center, x, dx, dy):
    return [mp.mpf(float(c)) - m for c, m in zip(center, (x[0] + dx, x[1] + dy, 0), strict=True)]


@pytest.mark.parametrize(("center", "radius"), BALLS)
@pytest.mark.parametrize("x", SPOTS)
def test_one_ball_everywhere(center, radius, x):
    apart = np.hypot(center[0] - x[0], center[1] - x[1])
    if apart**2 + center[2] ** 2 <= 1.05 * radius**2:
        x = (x[0] - 3.0, x[1])  # beside the ball, not in it
    B, _, rate, _ = ball(jnp.array(center), radius, jnp.array(x))
    hidden, slope = differences(
        lambda dx, dy: hemispheres.cap(shifted(center, x, dx, dy), mp.mpf(radius))
    )
    assert abs(B - (2.0 * np.pi - hidden)) < ONE
    np.testing.assert_allclose(rate[:2], -slope, rtol=0.0, atol=ONE)


def test_irradiance_behind_a_ball_above_the_horizon():
    """pi r^2 h / d^3 is taken away, whatever lies where."""
    center, radius = np.array([0.2, 0.1, 1.0]), 0.7
    for x in ((0.0, 0.0), (-2.5, -0.65), (0.3, 0.19)):
        _, E, _, rate = ball(jnp.asarray(center), radius, jnp.array(x))
        away = np.array([*x, 0.0]) - center
        d = np.linalg.norm(away)
        np.testing.assert_allclose(E, np.pi - np.pi * radius**2 / d**3, rtol=1e-14)
        gradient = 3.0 * np.pi * radius**2 * away / d**5
        np.testing.assert_allclose(rate[:2], gradient[:2], rtol=0.0, atol=ONE)


# --- several shapes: all in one scene, every derivative by autodiff ------------------------------

PAIR = ((1.0, 0.4, 1.5), 0.6), ((1.2, -0.4, 2.5), 0.8)
AXES = np.array([[0.7, -0.2, 0.1], [0.1, 0.4, 0.2], [0.0, 0.1, 0.5]])
OVAL = (0.9, -0.8, 1.4)
BOX = (0.5, -0.4, 0.0), (1.1, 0.3, 0.9)
POLE = (-1.0, 0.5), 0.35, 1.2


@functools.cache
def jets(name):
    """Net visibility with gradient and Hessian, compiled once a scene."""
    scene = {
        "two balls": lambda: Scene.of(*(primitive(sphere(*p)) for p in PAIR)),
        "ellipsoid": lambda: Scene.of(primitive(ellipsoid(OVAL, AXES))),
        "box": lambda: Scene.of(primitive(box(*BOX))),
        "cylinder": lambda: Scene.of(
            primitive(cylinder((*POLE[0], 0.0), (*POLE[0], POLE[2]), POLE[1]))
        ),
    }[name]()

    def value(x):
        return net_visibility(scene, receiver((0.0, 0.0, 0.0)).moved(x), nodes=48)

    return jax.jit(lambda x: (value(x), jax.grad(value)(x)))


def hidden_by(name, x, dx, dy):
    if name == "two balls":
        one, two = ((shifted(c, x, dx, dy), mp.mpf(r)) for c, r in PAIR)
        return hemispheres.two_caps(one, two)
    if name == "box":
        return hemispheres.box(*(shifted(c, x, dx, dy) for c in BOX))
    axis = shifted((*POLE[0], 0.0), x, dx, dy)
    away = mp.sqrt(axis[0] ** 2 + axis[1] ** 2)
    return hemispheres.cylinder(away, mp.mpf(POLE[1]), mp.mpf(POLE[2]))


@pytest.mark.parametrize("x", [(0.0, 0.0), (-0.3, 0.1)])
@pytest.mark.parametrize("name", ["two balls", "box", "cylinder"])
def test_value_and_gradient_of_other_shapes(name, x):
    B, slope = jets(name)(jnp.array(x))
    hidden, gradient = differences(lambda dx, dy: hidden_by(name, x, dx, dy))
    assert abs(B - (2.0 * np.pi - hidden)) < OTHERS
    np.testing.assert_allclose(slope, -gradient, rtol=0.0, atol=OTHERS)


def test_an_ellipsoid():
    B, slope = jets("ellipsoid")(jnp.zeros(2))
    hidden = hemispheres.ellipsoid(np.array(OVAL), AXES)[0]
    assert abs(B - (2.0 * np.pi - hidden)) < OTHERS
    h = 1e-3
    weights = ((1, 0.75), (2, -0.15), (3, 1.0 / 60.0))

    def rise(e):
        return sum(
            w * (hemispheres.ellipsoid(OVAL - n * h * e, AXES)[0]
                 - hemispheres.ellipsoid(OVAL + n * h * e, AXES)[0])
            for n, w in weights
        ) / h  # fmt: skip

    np.testing.assert_allclose(slope, [-rise(e) for e in np.eye(3)[:2]], rtol=0.0, atol=OTHERS)


# --- lights --------------------------------------------------------------------------------------


def below_a_disc(xy, height):
    """E of a plane that looks up at a parallel disc of unit radius and radiance: Lambert's."""
    rho = np.sum(xy**2, -1)
    h = height * height
    return 0.5 * np.pi * (1.0 - (h + rho - 1.0) / np.sqrt((h + rho + 1.0) ** 2 - 4.0 * rho))


@functools.cache
def under_a_disc(nodes):
    """The same by the rim, at many places."""

    def E(xy, height):
        lit = primitive(disc(jnp.stack([0.0, 0.0, height]), (0.0, 0.0, -1.0), 1.0), emission=1.0)
        return irradiance(Scene.of(lit), receiver(jnp.append(xy, 0.0)), nodes=nodes)

    return jax.jit(jax.vmap(E, (0, None)))


@pytest.mark.parametrize(
    ("height", "nodes", "error"),
    [
        (3.0, 8, 7e-9),
        (3.0, 16, 1e-15),
        (1.0, 8, 2e-5),
        (1.0, 16, 2e-10),
        (1.0, 32, 2e-15),
        (0.3, 16, 3e-5),
        (0.3, 32, 5e-10),
    ],
)
def test_a_rim_takes_as_many_nodes_as_it_is_near(height, nodes, error):
    """By as much as the docstring says, and not by a hundredth of it."""
    xy = np.random.default_rng(0).uniform(-3.0, 3.0, (2000, 2))
    wrong = np.abs(under_a_disc(nodes)(xy, height) - below_a_disc(xy, height))
    assert 0.01 * error < wrong.max() < error


def lambert(corners, x):
    """Irradiance of a polygon of unit radiance above the horizon, in mpmath."""
    total = mp.mpf(0)
    seen = [[mp.mpf(c[0]) - x[0], mp.mpf(c[1]) - x[1], mp.mpf(c[2])] for c in corners]
    for a, b in zip(seen, seen[1:] + seen[:1], strict=True):
        c = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        size = mp.sqrt(sum(t * t for t in c))
        total += mp.atan2(size, sum(i * j for i, j in zip(a, b, strict=True))) * c[2] / size / 2
    return abs(total)


def lamp(emission=2.0):
    return primitive(
        rectangle((0.0, 0.0, 1.0), (0.0, 0.5, 0.0), (0.4, 0.0, 0.0)), emission=emission
    )


CORNERS = [(0.4, 0.5, 1.0), (-0.4, 0.5, 1.0), (-0.4, -0.5, 1.0), (0.4, -0.5, 1.0)]


def test_a_lamp_half_behind_a_screen_and_a_floor_between_walls():
    """The screen cuts the lamp along a straight edge: what is left is a rectangle again."""
    screen = rectangle((-5.0, 0.0, 0.5), (5.0, 0.0, 0.0), (0.0, 9.0, 0.0))  # x < 0, at half height
    scene = Scene.of(lamp(), primitive(screen), environment=0.0)

    def value(x):
        return irradiance(scene, receiver((0.0, 0.0, 0.0)).moved(x))

    def truth(x, y):
        cut = -x  # the shadow of x = 0 at half height falls on the lamp there
        left = [(0.4, 0.5, 1.0), (cut, 0.5, 1.0), (cut, -0.5, 1.0), (0.4, -0.5, 1.0)]
        return 2 * lambert(left, (x, y))

    place = (0.1, 0.2)
    E, slope, bend = jax.jit(lambda x: (value(x), jax.grad(value)(x), jax.hessian(value)(x)))(
        jnp.array(place)
    )
    with mp.workdps(40):
        x, y = (mp.mpf(c) for c in place)
        np.testing.assert_allclose(E, float(truth(x, y)), rtol=1e-13)
        for i, j in ((1, 0), (0, 1)):
            np.testing.assert_allclose(
                slope[0 if i else 1], float(mp.diff(truth, (x, y), (i, j))), rtol=0.0, atol=1e-12
            )
        second = [float(mp.diff(truth, (x, y), n)) for n in ((2, 0), (1, 1), (0, 2))]
    np.testing.assert_allclose([bend[0, 0], bend[0, 1], bend[1, 1]], second, rtol=0.0, atol=1e-10)


def test_a_closed_room_of_one_radiance_is_a_furnace():
    walls = [
        rectangle((0, 0, 2), (0, 1, 0), (1, 0, 0)),
        rectangle((1, 0, 1), (0, 1, 0), (0, 0, 1)),
        rectangle((-1, 0, 1), (0, 1, 0), (0, 0, 1)),
        rectangle((0, 1, 1), (1, 0, 0), (0, 0, 1)),
        rectangle((0, -1, 1), (1, 0, 0), (0, 0, 1)),
        rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)),
    ]
    things = [primitive(w, emission=1.0, two_sided=True) for w in walls]
    scene = Scene.of(*things, primitive(box((-0.5, -0.5, 0.5), (0.3, 0.4, 0.9)), emission=1.0))
    find = jax.jit(lambda p, n: vector_irradiance(scene, receiver(p, n)))
    for p, n in (((0.7, 0.2, 0.3), (0, 0, 1)), ((-0.8, -0.7, 1.5), (0.3, 0.5, -0.4))):
        light = find(jnp.array(p), jnp.array(n, float))
        np.testing.assert_allclose(light, [0.0, 0.0, np.pi], rtol=0.0, atol=1e-12)


def test_gradients_in_blockers_and_lights():
    """A ball over the receiver hides pi r^2 h / d^3 of the sky and of a lamp that fills it."""

    def value(center, radius, sky):
        scene = Scene.of(primitive(sphere(center, radius)), environment=sky)
        return irradiance(scene, receiver((0.0, 0.0, 0.0)))

    def truth(center, radius, sky):
        d = jnp.sqrt(jnp.sum(center**2))
        return sky * (jnp.pi - jnp.pi * radius**2 * center[2] / d**3)

    given = jnp.array([0.2, 0.1, 1.0]), 0.7, 3.0
    found = jax.jit(lambda *a: (jax.grad(value, (0, 1, 2))(*a), jax.hessian(value)(*a)))(*given)
    np.testing.assert_allclose(
        np.hstack(found[0]), np.hstack(jax.grad(truth, (0, 1, 2))(*given)), rtol=0.0, atol=1e-10
    )
    np.testing.assert_allclose(found[1], jax.hessian(truth)(*given), rtol=0.0, atol=1e-9)


def test_turning_the_receiver_is_the_vector_of_light():
    scene = Scene.of(lamp(), primitive(sphere((0.3, 0.2, 0.5), 0.1)), environment=0.25)
    at = receiver((0.1, 0.0, 0.0), (0.1, 0.2, 1.0))
    slope = jax.jit(jax.grad(lambda t: irradiance(scene, at.tilted(t))))(jnp.zeros(2))
    light = jax.jit(vector_irradiance)(scene, at)
    np.testing.assert_allclose(slope, light[:2], rtol=0.0, atol=1e-12)


def glow(w):
    """A sky that varies."""
    return 1.0 + 0.5 * w[0] + 0.25 * w[2] * w[1]


def test_a_sky_that_varies_by_contour_and_by_azimuth():
    scene = Scene.of(*(primitive(sphere(*p)) for p in PAIR), environment=glow)
    at = receiver((0.1, 0.2, 0.0))
    found = jax.jit(lambda at: boundary_gradient(scene, at, nodes=48))(at)
    other = jax.jit(
        lambda at: transport_by_azimuth(
            scene, at, transport=lambda at, w: glow(at.axes @ w) * w[2], nodes=48
        )
    )(at)
    np.testing.assert_allclose(found[:2], other.gradient.boundary, rtol=0.0, atol=OTHERS)


# --- properties ----------------------------------------------------------------------------------


def turned(a, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ np.asarray(a, float)


@functools.cache
def town():
    """Box, pole and ball, for any turn about the vertical and any scale, and whether one is cut."""

    def value(angle, scale):
        c, s = jnp.cos(angle), jnp.sin(angle)
        turn = jnp.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

        def put(shape):
            return type(shape)(scale * shape.center @ turn.T, scale * turn @ shape.axes)

        scene = Scene.of(
            primitive(put(box(*BOX))),
            primitive(put(cylinder((*POLE[0], 0.0), (*POLE[0], POLE[2]), POLE[1]))),
            primitive(put(sphere(*PAIR[0]))),
            environment=1.0,
        )
        at = receiver((0.0, 0.0, 0.0))
        return irradiance(scene, at, nodes=32), boundary_gradient(scene, at, nodes=32)

    return jax.jit(jax.vmap(value))(jnp.array([0.0, 1.1, 0.0]), jnp.array([1.0, 1.0, 2.5]))


@pytest.mark.parametrize("long", [0.5, 5.0, 500.0])
def test_edges_of_a_long_lamp_take_no_more_nodes(long):
    """Nodes even along a tube of ten metres, half a metre away, lost a sixth of the gradient."""
    lamp = rectangle((0.3, 0.1, 1.0), (0.0, long, 0.0), (0.4, 0.0, 0.0))
    scene, n = Scene.of(primitive(lamp, emission=1.0)), (0.3, 0.1, 1.0)

    def both(x):
        at = Receiver.at(x, n)
        slope = jax.grad(lambda x: irradiance(scene, Receiver.at(x, n)))(x)
        return boundary_gradient(scene, at), slope @ at.axes

    found, slope = jax.jit(both)(jnp.array([0.0, 0.0, 0.5]))
    np.testing.assert_allclose(found, slope, rtol=1e-11)


def test_a_turned_scene_has_a_turned_gradient():
    E, g = town()
    np.testing.assert_allclose(E[1], E[0], rtol=1e-12)
    np.testing.assert_allclose(g[1], turned(g[0], 1.1), rtol=0.0, atol=1e-10)


def test_a_scene_of_twice_the_size_has_half_the_gradient():
    E, g = town()
    np.testing.assert_allclose(E[2], E[0], rtol=1e-12)
    np.testing.assert_allclose(2.5 * g[2], g[0], rtol=0.0, atol=1e-11)


def test_a_screen_in_two_halves_is_the_screen():
    whole = Scene.of(
        primitive(rectangle((0.2, 0.0, 1.0), (0.5, 0.0, 0.1), (0.0, 0.4, 0.0))), environment=1.0
    )
    halves = Scene.of(
        primitive(rectangle((-0.05, 0.0, 0.95), (0.25, 0.0, 0.05), (0.0, 0.4, 0.0))),
        primitive(rectangle((0.45, 0.0, 1.05), (0.25, 0.0, 0.05), (0.0, 0.4, 0.0))),
        environment=1.0,
    )
    at = receiver((0.1, -0.2, 0.0))
    both = jax.jit(lambda scene: (irradiance(scene, at), boundary_gradient(scene, at)))
    for one_piece, two in zip(both(whole), both(halves), strict=True):
        np.testing.assert_allclose(one_piece, two, rtol=0.0, atol=1e-10)


# --- properties: the whole moved, measured in another unit, dimmed, cut in two -------------------


@jax.jit
def _jets(change, x, y):
    """Irradiance with gradient and Hessian by all five freedoms, in a scene that may change."""
    found = derivatives(irradiance, worlds.lit(change), worlds.below(change, x, y))
    return found.value, found.gradient, found.hessian


def jets_at(place, **change):
    """The same in NumPy; compiled once for all changes."""
    return [np.asarray(a) for a in _jets(worlds.Change(**change).arrays, *map(float, place))]


def assert_alike(ours, expected):
    """To rounding, each of value, gradient and Hessian by its largest entry."""
    for a, b in zip(ours, expected, strict=True):
        assert np.all(np.isfinite(b))
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-11 * (1.0 + np.abs(b).max()))


GROUND = st.tuples(worlds.PLACE, worlds.PLACE)


@given(GROUND, worlds.TURN, worlds.SHIFT, worlds.TURN.map(lambda turn: turn[0]))
def test_rigid_motion_keeps_the_light_and_turns_its_derivatives(place, turn, shift, spin):
    """In the receiver's own axes nothing changes; where they spin, gradient and Hessian turn."""
    value, gradient, hessian = jets_at(place)
    T = np.asarray(worlds.about_normal(spin))
    expected = value, gradient @ T, T.T @ hessian @ T
    assert_alike(jets_at(place, turn=turn, shift=shift, spin=spin), expected)


@given(GROUND, worlds.SIZE)
def test_in_another_unit_of_length_each_step_is_worth_another(place, scale):
    """E and tilts have no length, a step divides by it."""
    value, gradient, hessian = jets_at(place)
    first, second = (np.asarray(worlds.as_measured(scale, order)) for order in (1, 2))
    found = jets_at(place, scale=scale)
    assert_alike(
        (found[0], found[1] / first, found[2] / second),
        (value, gradient, hessian),
    )


@given(GROUND, st.tuples(*[worlds.BRIGHT] * worlds.LIGHTS))
def test_lights_add_and_their_derivatives_too(place, light):
    alone = [jets_at(place, light=one) for one in np.eye(worlds.LIGHTS)]
    expected = [
        sum(L * a for L, a in zip(light, parts, strict=True)) for parts in zip(*alone, strict=True)
    ]
    assert_alike(jets_at(place, light=light), expected)


@given(GROUND, worlds.SHARE, worlds.SHARE)
def test_a_lamp_or_a_screen_in_two_pieces_is_the_same(place, lamp, screen):
    assert_alike(jets_at(place, lamp=lamp, screen=screen), jets_at(place))


@given(GROUND)
def test_more_nodes_change_nothing_that_counts(place):
    """Arcs are integrated to rounding: twice the nodes give the same."""
    same = worlds.Change().arrays
    at, scene = worlds.below(same, *map(jnp.asarray, place)), worlds.lit(same)
    coarse, fine = _vectors(scene, at)
    np.testing.assert_allclose(coarse, fine, rtol=0.0, atol=1e-11)


@jax.jit
def _vectors(scene, at):
    return tuple(vector_irradiance(scene, at, nodes=nodes) for nodes in (16, 32))


def test_the_floor_that_a_receiver_lies_on_hides_nothing():
    scene = Scene.of(
        primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), emission=5.0), environment=1.0
    )
    np.testing.assert_allclose(irradiance(scene, receiver((0.0, 0.0, 0.0), on=0)), np.pi)


@jax.jit
def _ball_before_the_horizon(turn):
    """Visibility, its gradient and irradiance of who faces a dark ball half above a dark floor."""
    up, ahead = turn[2], turn[0]
    scene = Scene.of(
        primitive(sphere(2.0 * ahead, 0.6)), primitive(plane(-up, up)), environment=1.0
    )
    at = receiver(jnp.zeros(3), ahead)
    moved = jax.grad(lambda p: net_visibility(scene, receiver(p, ahead)))(jnp.zeros(3))
    swept = at.axes @ boundary_gradient(scene, at, weight=one)
    return net_visibility(scene, at), turn @ moved, turn @ swept, irradiance(scene, at)


def test_a_ball_hides_a_part_of_a_planes_horizon():
    """It takes half of its solid angle from the sky, and a step up lowers it by 1 / D."""
    turns = np.concatenate([np.eye(3)[None], Rotation.random(4, random_state=0).as_matrix()])
    a, D = np.arcsin(0.3), 2.0
    slope = np.sin(a) / D * np.array([-np.pi * np.tan(a), 0.0, 2.0])
    for turn in turns:
        V, moved, swept, E = _ball_before_the_horizon(turn)
        np.testing.assert_allclose(V, np.pi * np.cos(a), rtol=1e-13)
        np.testing.assert_allclose(E, 0.5 * np.pi * np.cos(a) ** 2, rtol=1e-13)
        np.testing.assert_allclose(moved, slope, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(swept, slope, rtol=0.0, atol=1e-12)


# --- bad input and faults ------------------------------------------------------------------------


def test_inside_a_shape_there_is_no_answer():
    assert np.isnan(ball(jnp.array([0.0, 0.0, 0.1]), 0.7, jnp.zeros(2))[0])


@pytest.mark.parametrize(
    "room",
    [box((-2.0, -2.0, 0.0), (2.0, 2.0, 3.0)), cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 3.0), 2.0)],
)
def test_from_an_inner_wall_what_is_in_a_room_is_seen(room):
    lamp = primitive(rectangle((0.0, 0.0, 1.5), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)), emission=1.0)
    inside = Scene.of(primitive(room), lamp)
    assert type(inside.groups[0]) is type(room)
    E = irradiance(inside, receiver((0.3, 0.0, 0.0), on=0))
    np.testing.assert_allclose(E, irradiance(Scene.of(lamp), receiver((0.3, 0.0, 0.0))), rtol=1e-14)


def test_a_sky_of_many_radiances_is_refused():
    scene = Scene.of(primitive(sphere((0.0, 0.0, 2.0), 0.5)), environment=glow)
    words = r"^Argument `scene` must have a sky of one radiance here, .*transport_by_azimuth"
    with pytest.raises(ValueError, match=words):
        irradiance(scene, receiver((0.0, 0.0, 0.0)))


def flat_rate(p, v):
    """The distance to the second power only."""
    return contour.translation_rate(p, v) * jnp.sqrt(jnp.sum(p**2, -1))[..., None]


FAULTS = {
    "distance": ("translation_rate", flat_rate),
    "sign": ("translation_rate", lambda p, v: -contour.translation_rate(p, v)),
    "half": ("arc_angle", lambda *a: 0.5 * edge_integrals.arc_angle(*a)),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_wrong_formula_is_seen(name, monkeypatch):
    which, wrong = FAULTS[name]
    module = importlib.import_module("firstorder.space.direct_lighting")
    monkeypatch.setattr(module, which, wrong)
    center, radius = np.array([0.2, 0.1, 1.0]), 0.7
    scene = Scene.of(primitive(sphere(center, radius)), environment=1.0)
    at = receiver((0.5, 0.0, 0.0))
    B, rate = jax.jit(lambda at: (net_visibility(scene, at), boundary_gradient(scene, at)))(at)
    away = np.array([0.5, 0.0, 0.0]) - center
    d = np.linalg.norm(away)
    error = max(
        abs(B - 2.0 * np.pi * np.sqrt(1.0 - radius**2 / d**2)),
        np.abs(rate[:2] - (3.0 * np.pi * radius**2 * away / d**5)[:2]).max(),
    )
    assert 1e-2 < error < np.inf
