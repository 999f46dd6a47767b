"""Light by azimuth against closed forms that know nothing of slices, and against its autodiff."""

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest

from firstorder.space import (
    Scene,
    boundary_gradient,
    box,
    cylinder,
    ellipsoid,
    irradiance,
    net_visibility,
    plane,
    primitive,
    receiver,
    rectangle,
    sphere,
    triangle,
)
from firstorder.space.azimuthal import transport
from firstorder.space.azimuthal._critical_azimuths import parts
from firstorder.space.azimuthal.transport import (
    irradiance_by_azimuth,
    transport_by_azimuth,
    visibility_by_azimuth,
)
from firstorder.space.receiver import Receiver
from tests.space import hemispheres

Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
BOUND = 1e-11  # of the issue, with 64 nodes
HIDDEN = ((0.0, 0.0, -50.0), 1.0)  # a ball below the horizon


def ovals(centers, axes):
    """A scene of two ellipsoids."""
    return Scene.of(*(primitive(ellipsoid(centers[i], axes[i])) for i in (0, 1)))


def balls(centers, axes, position):
    """Net visibility behind two ellipsoids, and autodiff of its value."""

    def found(x):
        at = receiver(jnp.append(x, position[2]))
        B = visibility_by_azimuth(ovals(centers, axes), at, nodes=64, most=16)
        return B.value, B

    slope, B = jax.jacfwd(found, has_aux=True)(position[:2])
    return B, slope


def lit_balls(centers, axes, position):
    """Irradiance behind two ellipsoids."""
    return irradiance_by_azimuth(ovals(centers, axes), receiver(position), nodes=64, most=16)


def two(one, other=HIDDEN, x=(0.0, 0.0)):
    """A case of two balls, or of two ellipsoids given by matrices."""
    axes = [np.eye(3) * a if np.ndim(a) == 0 else np.asarray(a) for a in (one[1], other[1])]
    return np.array([one[0], other[0]], float), np.array(axes, float), np.array([*x, 0.0], float)


# Under the ball, beside it, and where it meets the horizon; over the pole by a hair.
SPOTS = [(x, 0.3 * x + 0.1) for x in (-2.5, -1.6, -1.1, -0.6, -0.2, 0.0, 0.3, 0.9, 1.4, 3.0, 6.0)]
SINGLE = [two((np.array([0.2, 0.1, h]), r), x=x) for h, r in ((1.0, 0.7), (0.3, 0.7)) for x in SPOTS
          if np.hypot(x[0] - 0.2, x[1] - 0.1) ** 2 + h * h > 1.05 * r * r]  # fmt: skip
PAIRS = [
    (((1.0, 0.4, 1.5), 0.6), ((1.2, -0.4, 2.5), 0.8)),
    (((0.3, 0.2, 1.5), 0.6), ((-0.5, 0.1, 2.5), 0.9)),
    (((0.6, 0.8, 0.7), 0.35), ((0.9, 0.5, 1.4), 0.6)),
]
NESTED = [(((0.5, 0.4, 1.0), 0.5), ((1.0, 0.8, 2.2), 0.4))]  # the second is behind the first
APART = [(((1.5, 0.4, 1.0), 0.5), ((-1.0, 0.8, 1.2), 0.4))]
AXES = np.array([[0.7, -0.2, 0.1], [0.1, 0.4, 0.2], [0.0, 0.1, 0.5]])
OVALS = [((0.9, -0.8, 1.1), AXES), ((0.1, 0.1, 1.2), AXES)]
CASES = (
    SINGLE
    + [two(*p) for p in PAIRS + NESTED + APART]
    + [two(p[0]) for p in NESTED]
    + [two(c) for p in APART for c in p]
    + [two(c) for c in OVALS]
    + [(2.5 * c, 2.5 * a, 2.5 * x) for c, a, x in [two(*PAIRS[0])]]
    + [two(HIDDEN)]
)


def of_all(function):
    """All cases in one compiled call."""
    args = [jnp.asarray(np.stack(a)) for a in zip(*CASES, strict=True)]
    found = jax.tree.map(np.asarray, jax.jit(jax.vmap(function))(*args))
    return [jax.tree.map(lambda a, i=i: jnp.asarray(a[i]), found) for i in range(len(CASES))]


@pytest.fixture(scope="module")
def table():
    return of_all(balls)


@pytest.fixture(scope="module")
def lit_table():
    return of_all(lit_balls)


def by_hand(function, *case):
    """Value and gradient in the receiver's place of a blocked solid angle, in mpmath."""
    with mp.workdps(30):
        h = mp.mpf(10) ** -9

        def at(x, y):
            return function(mp.mpf(x), mp.mpf(y), *case)

        rise = [(at(h, 0) - at(-h, 0)) / (2 * h), (at(0, h) - at(0, -h)) / (2 * h)]
        return 2 * np.pi - float(at(0, 0)), -np.array([float(r) for r in rise])


def moved(center, place, x, y):
    return [mp.mpf(c) - p for c, p in zip(center, (place[0] + x, place[1] + y, 0), strict=True)]


@pytest.mark.parametrize("i", range(len(SINGLE)))
def test_one_ball_wherever_the_receiver_is(table, i):
    centers, axes, place = CASES[i]
    B, slope = table[i]
    value, gradient = by_hand(
        lambda x, y: hemispheres.cap(moved(centers[0], place, x, y), axes[0, 0, 0])
    )
    assert abs(B.value - value) < BOUND
    np.testing.assert_allclose(B.gradient.total, gradient, rtol=0.0, atol=BOUND)
    np.testing.assert_allclose(slope, gradient, rtol=0.0, atol=BOUND)


@pytest.mark.parametrize("k", range(len(PAIRS)))
def test_two_balls_that_overlap(table, k):
    (c, r), (d, s) = PAIRS[k]
    B, slope = table[len(SINGLE) + k]

    def hidden(x, y):
        return hemispheres.two_caps((moved(c, (0, 0), x, y), r), (moved(d, (0, 0), x, y), s))

    value, gradient = by_hand(hidden)
    assert abs(B.value - value) < 1e-10
    np.testing.assert_allclose(B.gradient.total, gradient, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(slope, gradient, rtol=0.0, atol=1e-10)


def rest(table):
    """The cases after those of one and two balls, in order."""
    return table[len(SINGLE) + len(PAIRS) :]


def test_what_is_behind_a_blocker_blocks_nothing(table):
    nested, _, alone, *_ = rest(table)
    assert abs(nested[0].value - alone[0].value) < 1e-13
    np.testing.assert_allclose(
        nested[0].gradient.total, alone[0].gradient.total, rtol=0.0, atol=1e-12
    )


def test_blockers_that_are_apart_add_up(table, lit_table):
    for cases, whole in (([a[0] for a in table], 2.0 * np.pi), (lit_table, np.pi)):
        _, both, _, one, other, *_ = rest(cases)
        hidden = [whole - a.value for a in (both, one, other)]
        np.testing.assert_allclose(hidden[0], hidden[1] + hidden[2], rtol=1e-12)
        parts_ = [a.gradient.total for a in (both, one, other)]
        np.testing.assert_allclose(parts_[0], parts_[1] + parts_[2], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("k", range(len(OVALS)))
def test_an_ellipsoid(table, lit_table, k):
    (B, slope), E = rest(table)[5 + k], rest(lit_table)[5 + k]
    center, axes = OVALS[k]

    def hidden(x, y):
        return np.array(hemispheres.ellipsoid(np.array(center) - [x, y, 0.0], axes))

    solid, cosine = hidden(0.0, 0.0)
    assert abs(B.value - (2.0 * np.pi - solid)) < 1e-11
    assert abs(E.value - (np.pi - cosine)) < 1e-11
    h = 1e-3
    weights = ((1, 0.75), (2, -0.15), (3, 1.0 / 60.0))
    rise = np.array([
        sum(w * (hidden(*(n * h * e)) - hidden(*(-n * h * e))) for n, w in weights) / h
        for e in np.eye(2)
    ])  # fmt: skip
    np.testing.assert_allclose(B.gradient.total, -rise[:, 0], rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(slope, -rise[:, 0], rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(E.gradient.total, -rise[:, 1], rtol=0.0, atol=1e-10)


def test_angles_do_not_know_lengths(table, lit_table):
    for cases in ([a[0] for a in table], lit_table):
        small, large = cases[len(SINGLE)], rest(cases)[7]
        assert abs(small.value - large.value) < 1e-13
        np.testing.assert_allclose(
            small.gradient.total, 2.5 * large.gradient.total, rtol=0.0, atol=1e-12
        )


def test_an_open_sky(table, lit_table):
    (B, slope), E = rest(table)[8], rest(lit_table)[8]
    np.testing.assert_allclose([B.value, E.value], [2.0 * np.pi, np.pi], rtol=1e-14)
    assert np.all(B.gradient.total == 0.0)
    np.testing.assert_allclose(slope, 0.0, rtol=0.0, atol=1e-14)  # rounding of the panels


# --- edges that are straight, and walls ----------------------------------------------------------

BOX, POLE = ((0.5, -0.4, 0.0), (1.1, 0.3, 0.9)), ((-1.0, 0.5, 0.0), (-1.0, 0.5, 1.2), 0.35)
SLANT = ((-3.0, -2.0, 0.5), (3.0, -2.5, 1.4), (0.2, -6.0, 4.0))


@pytest.mark.parametrize("x", [(0.0, 0.0), (-0.3, 0.1)])
def test_an_upright_box_an_upright_cylinder_and_a_slanted_edge(x, town):
    B = town(jnp.array(x))

    def hidden(dx, dy):
        low, high = (moved(c, x, dx, dy) for c in BOX)
        axis = moved(POLE[0], x, dx, dy)
        away = mp.sqrt(axis[0] ** 2 + axis[1] ** 2)
        slanted = abs(hemispheres.triangle(*(moved(c, x, dx, dy) for c in SLANT)))
        pole = hemispheres.cylinder(away, mp.mpf(POLE[2]), mp.mpf(POLE[1][2]))
        return hemispheres.box(low, high) + pole + slanted

    value, gradient = by_hand(hidden)
    assert abs(B.value - value) < 1e-10
    np.testing.assert_allclose(B.gradient.total, gradient, rtol=0.0, atol=1e-10)


@pytest.fixture(scope="module")
def town():
    scene = Scene.of(primitive(box(*BOX)), primitive(cylinder(*POLE)), primitive(triangle(*SLANT)))
    return jax.jit(lambda x: visibility_by_azimuth(scene, receiver(jnp.append(x, 0.0)), nodes=24))


def test_an_edge_that_leans_in_the_plane_of_the_normal_moves_all_at_once():
    corners = (1.0, 0.0, 1.0), (2.0, 0.0, 3.0), (1.5, 1.0, 2.0)  # the first edge: in y = 0
    scene = Scene.of(primitive(triangle(*corners)))

    def visible(x):
        B = visibility_by_azimuth(scene, receiver(jnp.append(x, 0.0)))
        return B.value, B

    (_, B), slope = jax.value_and_grad(visible, has_aux=True)(jnp.zeros(2))

    def hidden(dx, dy):
        return abs(hemispheres.triangle(*(moved(c, (0.0, 0.0), dx, dy) for c in corners)))

    value, gradient = by_hand(hidden)
    assert abs(B.value - value) < 1e-10
    np.testing.assert_allclose(
        [B.gradient.total, slope], [gradient, gradient], rtol=0.0, atol=1e-10
    )


@pytest.mark.parametrize("up", [1.0, 0.6, 0.0, -0.8, -1.0])
def test_a_plane_leaves_a_lune_between_its_horizon_and_the_receivers(up, beside_a_plane):
    """A floor leaves all, a ceiling nothing; and it is the same from everywhere."""
    B = beside_a_plane(up)
    assert abs(B.value - 2.0 * (np.pi - np.arccos(up))) < 1e-13
    np.testing.assert_allclose(B.gradient.total, 0.0, rtol=0.0, atol=1e-13)


@pytest.fixture(scope="module")
def beside_a_plane():
    """Before a plane at a distance of 1, by the height of its unit normal."""

    def found(up):
        flat = jnp.sqrt(1.0 - up * up)
        normal = jnp.stack([0.8 * flat, -0.6 * flat, up])
        scene = Scene.of(primitive(plane(-normal, normal)))
        return visibility_by_azimuth(scene, receiver((0.0, 0.0, 0.0)), nodes=64)

    return jax.jit(found)


@pytest.mark.parametrize("on", [-1, 0])
def test_a_plane_through_the_receiver_hides_nothing_as_along_contours(on):
    """Whatever the receiver's normal, as under a bump; it is what a wide rectangle does."""
    walls = plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), rectangle(np.zeros(3), 9 * Y, 9 * Z)
    for n in ((0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)):
        at = Receiver.at((0.0, 0.0, 0.0), n, on=on)
        for wall in walls:
            scene = Scene.of(primitive(wall))
            np.testing.assert_allclose(visibility_by_azimuth(scene, at).value, 2.0 * np.pi)
            np.testing.assert_allclose(irradiance_by_azimuth(scene, at).value, np.pi)
            np.testing.assert_allclose(net_visibility(scene, at), 2.0 * np.pi)


# Receivers: the horizon of one of two planes cuts the outlines of a ball and of a rectangle.
CUT = [
    ((-0.3, 0.4, -0.1), (-0.8, 0.3, 0.9)),
    ((0.0, 0.5, 0.3), (-0.4, -0.5, 0.7)),
    ((0.0, 0.3, 0.5), (-0.3, -0.7, -0.2)),
]


@pytest.fixture(scope="module")
def between_planes():
    """A ball and a rectangle that two planes cut, by azimuth and along contours."""
    scene = Scene.of(
        primitive(sphere((0.6, 0.3, 0.8), 0.4)),
        primitive(rectangle((-0.7, 0.4, 0.5), (0.3, 0.1, 0.2), (-0.1, 0.5, 0.1))),
        primitive(plane((1.5, 0.0, 1.0), (-1.0, 0.3, -0.6))),
        primitive(plane((-0.5, 1.2, 1.0), (0.4, -1.0, -0.5))),
        environment=1.0,
    )

    def both(x, n):
        E = jax.value_and_grad(lambda x: irradiance(scene, Receiver.at(x, n)))(x)
        return irradiance_by_azimuth(scene, Receiver.at(x, n), nodes=48), E

    return jax.jit(both)


@pytest.mark.parametrize(("x", "n"), CUT)
def test_horizons_of_planes_cut_what_is_behind_them(x, n, between_planes):
    """The slices do not see a kink, so that one inside a panel costs four to seven digits."""
    by_azimuth, (E, slope) = between_planes(np.array(x), np.array(n))
    assert abs(by_azimuth.value - E) < 1e-9
    along = np.asarray(slope) @ np.asarray(Receiver.at(x, n).axes)[:, :2]
    np.testing.assert_allclose(by_azimuth.gradient.total, along, rtol=0.0, atol=1e-7)


def test_by_azimuth_and_along_contours():
    """Two balls that overlap and a box: neither route shares more than the silhouettes."""
    (c, r), (d, s) = PAIRS[0]
    scene = Scene.of(
        primitive(sphere(c, r)), primitive(sphere(d, s)), primitive(box(*BOX)), environment=1.0
    )
    at = receiver((-0.2, 0.1, 0.0))

    def both():
        slope = boundary_gradient(scene, at, weight=lambda w: jnp.ones_like(w[..., 2]))
        return (
            visibility_by_azimuth(scene, at, nodes=48),
            net_visibility(scene, at, nodes=32),
            slope,
        )

    B, value, slope = jax.jit(both)()
    assert abs(B.value - value) < 1e-11
    np.testing.assert_allclose(B.gradient.total, slope[:2], rtol=0.0, atol=1e-10)


# --- light ---------------------------------------------------------------------------------------


def lit(at, w):
    """Light that varies with direction and place, on a glossy surface seen from a fixed eye."""
    L = 1.0 + 0.4 * (at.axes @ w)[0] + 0.3 * jnp.sin(at.position[0] + 2.0 * at.position[1])
    to_eye = jnp.array([0.4, -0.2, 2.0]) - at.position
    half = jnp.dot(at.axes @ w, to_eye) / jnp.linalg.norm(to_eye)
    return L * (1.0 + 0.5 * half**3) * w[2]


def test_any_transport_on_a_curved_receiver():
    """Interior and boundary sum to the derivative of the value, along the surface."""

    def found(x):
        scene = Scene.of(primitive(sphere((0.7, 0.3, 1.2), 0.5)))
        at = Receiver(
            jnp.zeros(3), jnp.eye(3), jnp.array([[-0.4, 0.2], [0.2, 0.5]]), jnp.asarray(-1)
        )
        B = transport_by_azimuth(scene, at.moved(x), transport=lit, nodes=20, inner=14)
        return B.value, B

    slope, B = jax.jit(lambda x: jax.jacfwd(found, has_aux=True)(x))(jnp.zeros(2))
    np.testing.assert_allclose(B.gradient.total, slope, rtol=0.0, atol=1e-9)
    assert np.min(np.abs(B.gradient.interior)) > 1e-2
    assert np.min(np.abs(B.gradient.boundary)) > 1e-2


NOWHERE = {
    "a negative radius": lambda x: (sphere((0.0, 0.0, 2.0), x - 0.5), receiver((0.0, 0.0, 0.0))),
    "a centre": lambda x: (sphere(jnp.stack([1.0 / (x - 0.2), 0.0, 3.0]), 1.0),
                           receiver((0.0, 0.0, 0.0))),
    "a place": lambda x: (sphere((0.0, 0.0, 2.0), 1.0),
                          Receiver.at(jnp.stack([jnp.log(x - 0.3), 0.0, 0.0]))),
    "a normal": lambda x: (sphere((0.0, 0.0, 2.0), 1.0),
                           Receiver.at((0.0, 0.0, 0.0), jnp.stack([0.0, 0.0, x - 0.2]))),
    "a bend": lambda x: (sphere((0.0, 0.0, 2.0), 1.0),
                         receiver((0.0, 0.0, 0.0), S=jnp.log(x - 0.3) * np.eye(2))),
}  # fmt: skip


@pytest.mark.parametrize("name", NOWHERE)
def test_of_traced_numbers_that_are_none_the_integral_is_nan(name):
    """Slices do not meet what is nowhere, and an open sky looks like an answer."""

    @jax.jit
    def found(x):
        shape, at = NOWHERE[name](x)
        return irradiance_by_azimuth(Scene.of(primitive(shape)), at)

    assert np.all(np.isnan(jax.tree.leaves(found(0.2))[0]))
    assert np.all(np.isfinite(found(0.9).value))


WRONG_LIGHT = {
    "a number": (1.0, "must be a function of a receiver and a direction, but is none"),
    "a vector": (lambda at, w: w, r"must be one number, but has shape \(3,\)"),
    "a complex number": (lambda at, w: 1j * w[2], "must be real, but is complex"),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", WRONG_LIGHT)
def test_light_is_a_real_number_of_a_direction(name):
    transport, words = WRONG_LIGHT[name]
    with pytest.raises((TypeError, ValueError), match=f"`transport` {words}|type hint"):
        transport_by_azimuth(
            ovals(np.eye(3) + 3.0, [np.eye(3)] * 2), receiver((0.0, 0.0, 0.0)), transport=transport
        )


def test_a_count_of_nothing_is_refused():
    scene = Scene.of(primitive(sphere((0.0, 0.0, 2.0), 1.0)))
    with pytest.raises(ValueError, match="Argument `nodes` must be a positive integer, but is 0"):
        visibility_by_azimuth(scene, receiver((0.0, 0.0, 0.0)), nodes=0)


# --- deliberate faults, in one slice -------------------------------------------------------------


def slice_errors():
    """Ends of a ball's interval and rate of B in one slice, against the slice's circle."""
    center, radius, phi = np.array([0.7, 0.3, 1.2]), 0.5, 0.6

    def ends(x):
        gap = center - np.append(x, 0.0)
        u, v = (
            gap[0] * np.cos(phi) + gap[1] * np.sin(phi),
            gap[1] * np.cos(phi) - gap[0] * np.sin(phi),
        )
        middle, half = (
            np.arctan2(u, gap[2]),
            np.arcsin(np.sqrt(radius**2 - v**2) / np.hypot(u, gap[2])),
        )
        return np.array([middle - half, middle + half])

    def one():
        at = receiver((0.0, 0.0, 0.0))
        cut = transport._sliced(
            parts(Scene.of(primitive(sphere(center, radius))), at),
            jnp.asarray(phi),
            jnp.asarray(0.0),
        )
        return cut.low[0], cut.high[0], transport._edge_rate(cut, transport.Uniform(), at)

    low, high, rate = jax.jit(one)()

    def seen(x):
        a, b = ends(x)
        return 2.0 - (np.cos(a) - np.cos(b))

    h = 1e-5
    truth = np.array([(seen(h * e) - seen(-h * e)) / (2 * h) for e in np.eye(2)])
    return np.max(np.abs([low, high] - ends((0.0, 0.0)))), np.max(np.abs(rate - truth))


def test_one_slice():
    ends, rate = slice_errors()
    assert ends < 1e-14
    assert rate < 1e-9


def _other_turn(part, v, base, lag, right=transport._arc_hits):
    p, k, low, high = right(part, v, base, lag)
    return p, k, high, low


def _no_tangents(part, v, base, lag, right=transport._arc_hits):
    p, k, low, high = right(part, v, base, lag)
    return p, k[..., ::-1], low, high


def _no_sine(cut, T, at, right=transport._edge_rate):
    class Wrong(transport.Uniform):
        def edge(self, w):
            return 1.0 / jnp.sqrt(1.0 - w[..., 2] ** 2)

    return right(cut, Wrong(), at)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [("_arc_hits", _other_turn), ("_arc_hits", _no_tangents), ("_edge_rate", _no_sine)],
)
def test_a_fault_is_noticed(monkeypatch, name, wrong):
    monkeypatch.setattr(transport, name, wrong)
    worst = max(slice_errors())
    assert np.isfinite(worst)
    assert worst > 1e-3


# --- single precision ----------------------------------------------------------------------------


def in_single_precision(unit, ask):
    """Behind a ball, a box, a leaning cylinder and a panel, of that unit of length."""

    def of(numbers):
        return jnp.asarray(unit * np.array(numbers), jnp.float32)

    shapes = (
        sphere(of((0.5, 0.2, 1.2)), of(0.3)),
        box(of((0.2, -1.2, 0.0)), of((0.8, -0.6, 0.9))),
        cylinder(of((-1.0, 0.3, 0.0)), of((-0.8, 0.4, 1.1)), of(0.2)),
        triangle(of((0.1, 0.1, 1.5)), of((0.4, 0.1, 1.4)), of((0.1, 0.5, 1.6))),
    )
    up = jnp.array([0.0, 0.0, 1.0], jnp.float32)
    return ask(Scene.of(*map(primitive, shapes)), receiver(of((0.0, 0.0, 0.0)), up))


@pytest.mark.parametrize("unit", [1e-12, 1e-9, 1e9, 1e12])
@pytest.mark.parametrize("ask", [visibility_by_azimuth, irradiance_by_azimuth])
def test_the_unit_of_length_does_not_matter(ask, unit):
    """Discriminants of arcs hold fourth powers of lengths, and crossings sixth."""
    found, plain = in_single_precision(unit, ask), in_single_precision(1.0, ask)
    np.testing.assert_allclose(found.value, plain.value, rtol=1e-6)
    rate, expected = unit * found.gradient.boundary, plain.gradient.boundary
    np.testing.assert_allclose(rate, expected, rtol=0.0, atol=2e-4)


def test_what_is_asked_in_single_precision_is_answered_in_it():
    found = in_single_precision(1.0, visibility_by_azimuth)
    assert {leaf.dtype.name for leaf in jax.tree.leaves(found)} == {"float32"}


def test_on_an_inner_wall_the_wall_hides_nothing_as_for_net_visibility():
    """The sky is seen through it, behind a ball in the room."""
    room, ball = box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)), sphere((0.1, 0.05, 0.1), 0.4)
    scene = Scene.of(primitive(room, name="room"), primitive(ball))
    at = Receiver.at((0.2, 0.1, -1.0), (0.0, 0.0, 1.0), on=scene.named("room")[0])
    size = 0.4 / np.linalg.norm([0.1 - 0.2, 0.05 - 0.1, 0.1 + 1.0])  # sine of its half angle
    true = 2.0 * np.pi * np.sqrt(1.0 - size**2)
    for found in (visibility_by_azimuth(scene, at).value, net_visibility(scene, at)):
        np.testing.assert_allclose(found, true, rtol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_an_upright_edge_far_from_the_origin_turns_as_near_it(seed):
    """The corners carry the rounding of the receiver's place: the edge is in its slice by more."""
    R = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    center, u, v = (R @ np.array(a) for a in ((1.0, 0.3, 0.8), (0.3, 0.5, 0.0), (0.0, 0.0, 0.4)))

    @jax.jit
    def found(at):
        scene = Scene.of(primitive(rectangle(center + at, u, v)))
        return irradiance_by_azimuth(scene, Receiver.at(at, jnp.asarray(R[:, 2])))

    near, far = found(jnp.zeros(3)), found(1e5 * jnp.array([1.0, -0.7, 0.4]))
    assert np.max(np.abs(near.gradient.boundary)) > 0.1
    np.testing.assert_allclose(far.value, near.value, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(far.gradient.boundary, near.gradient.boundary, rtol=0.0, atol=1e-9)


def test_the_end_of_a_plane_has_a_derivative_in_single_precision():
    def value(tilt):
        normal = jnp.stack([jnp.sin(tilt), 0.0 * tilt, jnp.cos(tilt)])
        below = jnp.array([0.0, 0.0, -1.0], tilt.dtype)
        scene = Scene.of(primitive(plane(below, normal)), environment=jnp.ones((), tilt.dtype))
        up = jnp.array([0.0, 0.0, 1.0], tilt.dtype)
        return irradiance_by_azimuth(scene, Receiver.at(jnp.zeros(3, tilt.dtype), up)).value

    slope = jax.jit(jax.grad(value))(jnp.float32(0.5))
    assert abs(slope + 0.5 * np.pi * np.sin(0.5)) < 1e-5
