"""Derivatives along edges at fixed cuts against derivatives of closed forms that move them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics._vectors import dot_apart
from firstorder.space.silhouettes import _edge_integrals as edge_integrals
from firstorder.visibility._contour import segment_solid_angle, segment_vector_irradiance

CORNERS = ((0.9, -0.4, 0.8), (0.8, 1.1, 1.4), (-0.7, 0.5, 0.9))
MOVES = ((0.3, 0.2, -0.1), (-0.2, 0.5, 0.4), (0.1, -0.6, 0.2))
NODES = 40


def corners(x):
    """A triangle whose corners go different ways, one of them on a bend."""
    moved = jnp.array(CORNERS) + x * jnp.array(MOVES)
    return moved.at[2, 0].add(0.5 * x**2)


def jets(function):
    """Value and two derivatives where x = 0.1."""
    slope = jax.jacfwd(function)
    return jax.jit(lambda x: (function(x), slope(x), jax.jacfwd(slope)(x)))(0.1)


def cut_triangle(x, piece):
    """Its edges in two parts each; the cuts wander along them."""
    start = corners(x)
    end = jnp.roll(start, -1, 0)
    cut = jnp.array([0.3, 0.5, 0.8]) + x * jnp.array([1.0, -2.0, 0.5])
    zero, one = jnp.zeros(3), jnp.ones(3)
    return jnp.sum(piece(start, end, zero, cut) + piece(start, end, cut, one), 0)


def whole_triangle(x, closed):
    start = corners(x)
    return jnp.sum(closed(start, jnp.roll(start, -1, 0)), 0)


def together(function):
    """Its coordinates as vectors."""
    return lambda *a: jnp.stack(function(*a), -1)


PIECES = {
    "light": (together(edge_integrals.segment_light), segment_vector_irradiance),
    "angle": (edge_integrals.segment_angle, segment_solid_angle),
}


@pytest.mark.parametrize("name", PIECES)
def test_a_cut_polygon_has_the_derivatives_of_the_whole(name):
    piece, closed = PIECES[name]
    found = jets(lambda x: cut_triangle(x, piece))
    truth = jets(lambda x: whole_triangle(x, closed))
    for a, b in zip(found, truth, strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-13)


def ball(x):
    """The limb of a ball that moves and grows."""
    center, radius = jnp.array([0.5 + x, -0.3 * x, 2.0 + x * x]), 0.6 + 0.2 * x
    square = jnp.sum(center**2)
    share = radius**2 / square
    along = center / jnp.sqrt(square)
    side = jnp.cross(along, jnp.array([0.0, 1.0, 0.0]))
    side = side / jnp.sqrt(jnp.sum(side**2))
    size = radius * jnp.sqrt(1.0 - share)
    return center, radius, (center * (1.0 - share), size * side, size * jnp.cross(along, side))


def cut_limb(x, arc):
    """Three arcs whose ends wander; sense: the ball lies to the left."""
    _, _, (c, a, b) = ball(x)
    ends = jnp.array([0.0, 1.0 + 2.0 * x, 4.0 - x])
    last = jnp.append(ends[1:], 2.0 * np.pi)
    c, a, b = (jnp.broadcast_to(v, (3, 3)) for v in (c, a, b))
    return jnp.sum(arc(c, a, b, ends, last, NODES), 0)


def test_a_cut_limb_has_the_light_of_a_ball():
    def truth(x):
        center, radius, _ = ball(x)
        return jnp.pi * radius**2 * center / jnp.sum(center**2) ** 1.5

    found = jets(lambda x: cut_limb(x, together(edge_integrals.arc_light)))
    for a, b in zip(found, jets(truth), strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-12)


def ball_angle(x):
    center, radius, _ = ball(x)
    return 2.0 * jnp.pi * (1.0 - jnp.sqrt(1.0 - radius**2 / jnp.sum(center**2)))


def test_a_cut_limb_has_the_solid_angle_of_a_ball():
    found = jets(lambda x: cut_limb(x, edge_integrals.arc_angle))
    for a, b in zip(found, jets(ball_angle), strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-12)


def test_a_horizon_has_the_solid_angle_of_half_of_all_directions():
    """A circle about the eye, as a plane's horizon is, has no centre to point along."""
    tilted = jnp.array([[0.6, 0.0, 0.8]]), jnp.array([[0.0, 1.0, 0.0]])
    ends = jnp.array([0.0]), jnp.array([2.0 * np.pi])
    found = edge_integrals.arc_angle(jnp.zeros((1, 3)), *tilted, *ends, 8)
    np.testing.assert_allclose(found, [2.0 * np.pi], rtol=1e-12)


def test_an_edge_that_slides_along_itself_or_its_rays_sweeps_nothing():
    p, v = jnp.array(CORNERS), jnp.array(MOVES)
    np.testing.assert_allclose(
        edge_integrals.swept_rate(p, v, 2.0 * v - 3.0 * p), 0.0, rtol=0.0, atol=1e-15
    )


def test_growth_is_positive():
    """A circle about the normal, counter-clockwise, that widens."""
    p, v = jnp.array([1.0, 0.0, 1.0]), jnp.array([0.0, 1.0, 0.0])
    assert edge_integrals.swept_rate(p, v, jnp.array([1.0, 0.0, 0.0])) > 0.0


def test_reverse_is_forward():
    def value(x):
        return (
            cut_triangle(x, together(edge_integrals.segment_light))
            + cut_limb(x, together(edge_integrals.arc_light))
        )[2]

    both = jax.jit(lambda x: (jax.grad(value)(x), jax.jacfwd(value)(x)))(0.1)
    np.testing.assert_allclose(*both, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("nodes", [1, 6, 7])
def test_nodes_are_those_of_gauss_and_legendre(nodes):
    first, last = jnp.array([0.3, -1.0]), jnp.array([2.0, 5.0])
    even = jnp.zeros(2), jnp.zeros(2)
    cos, sin, w = edge_integrals.arc_nodes(first, last, nodes, even)
    x, weight = np.polynomial.legendre.leggauss(nodes)
    half = 0.5 * (np.asarray(last) - np.asarray(first))[:, None]
    t = np.asarray(first)[:, None] + half * (1.0 + x)
    np.testing.assert_allclose(cos, np.cos(t), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(sin, np.sin(t), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(w, half * weight, rtol=0.0, atol=1e-15)


def test_crowded_nodes_are_on_the_arc_and_measure_it():
    first, last = jnp.array([0.3, -1.0, 0.0]), jnp.array([2.0, 5.0, 2.0 * np.pi])
    crowded = jnp.array([0.0, 0.3, -0.4]), jnp.array([0.0, -0.2, 0.5])
    cos, sin, w = edge_integrals.arc_nodes(first, last, 60, crowded)
    np.testing.assert_allclose(cos**2 + sin**2, 1.0, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(jnp.sum(w, -1), last - first, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(
        jnp.sum(w * cos, -1), jnp.sin(last) - jnp.sin(first), rtol=0.0, atol=1e-12
    )
    np.testing.assert_allclose(
        jnp.sum(w * sin, -1), jnp.cos(first) - jnp.cos(last), rtol=0.0, atol=1e-12
    )


def test_nodes_move_as_differences_say():
    crowded, h = (jnp.array([0.0, 0.3, -0.6]), jnp.array([0.0, -0.2, 0.5])), 1e-3
    ends = jnp.array([0.3, -1.0, 0.0]), jnp.array([2.0, 5.0, 1.0])
    moves = jnp.array([0.7, -0.4, 0.2]), jnp.array([-0.3, 0.5, 0.6])

    def nodes(h):
        first, last = (end + h * move for end, move in zip(ends, moves, strict=True))
        return jnp.stack(edge_integrals.arc_nodes(first, last, 7, crowded))

    a, b, c, d = (nodes(k * h) for k in (-2.0, -1.0, 1.0, 2.0))
    slope = (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)
    np.testing.assert_allclose(jax.jvp(nodes, (0.0,), (1.0,))[1], slope, rtol=0.0, atol=1e-9)


def under_a_disc(x):
    """Irradiance of a plane 1 m below a disc of that radius, x beside its axis."""
    center, turn = jnp.array([1.0, 0.0, 0.0]) * x + jnp.array([0.0, 0.0, 1.0]), 0.7
    a = jnp.array([np.cos(turn), np.sin(turn), 0.0])
    b = jnp.array([-np.sin(turn), np.cos(turn), 0.0])
    whole = jnp.zeros(()), jnp.asarray(2.0 * jnp.pi)
    return edge_integrals.arc_upward(center, a, b, *whole, 16)[0]


def under_a_disc_in_closed_form(x):
    far = x**2 + 2.0
    return 0.5 * jnp.pi * (1.0 - (far - 2.0) / jnp.sqrt(far**2 - 4.0 * x**2))


def test_crowded_nodes_gain_three_digits_by_a_near_rim(monkeypatch):
    def errors():
        slope = jax.grad(under_a_disc)
        found = jax.jit(jax.vmap(lambda x: (under_a_disc(x), slope(x), jax.grad(slope)(x))))(x)
        return np.array([np.max(np.abs(a - b)) for a, b in zip(found, truth, strict=True)])

    x = jnp.linspace(0.0, 2.0, 41)
    closed = under_a_disc_in_closed_form
    truth = [jax.vmap(f)(x) for f in (closed, jax.grad(closed), jax.grad(jax.grad(closed)))]
    crowded = errors()
    assert np.all(crowded < (4e-7, 3e-6, 2e-5))
    monkeypatch.setattr(edge_integrals, "_crowd", lambda *_: (jnp.zeros(()), jnp.zeros(())))
    assert np.all(errors() > 300.0 * crowded)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_precision_is_kept(dtype):
    def value(x):
        start = jnp.asarray(CORNERS, dtype) + x
        zero, one = jnp.zeros(3, dtype), jnp.ones(3, dtype)
        lines = edge_integrals.segment_light(start, jnp.roll(start, -1, 0), zero, one)
        turned = start[:, ::-1], 0.1 * start, zero, one
        return sum(jnp.sum(a) for a in (*lines, *edge_integrals.arc_light(start, *turned, 4)))

    E, slope = jax.jit(jax.value_and_grad(value))(jnp.asarray(0.1, dtype))
    assert E.dtype == slope.dtype == dtype
    assert np.isfinite(slope)


FAULTS = {
    "sign": lambda p, level, dp: dot_apart(dp, level) / dot_apart(p, p) ** 1.5,
    "distance": lambda p, level, dp: -dot_apart(dp, level) / dot_apart(p, p),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_wrong_rate_is_seen(name, monkeypatch):
    def error():
        found = jax.jit(jax.grad(lambda x: cut_limb(x, edge_integrals.arc_angle)))(0.1)
        return abs(found - jax.grad(ball_angle)(0.1))

    assert error() < 1e-12
    monkeypatch.setattr(edge_integrals, "_swept", FAULTS[name])
    assert error() > 1e-2


def test_points_on_an_arc_have_its_radius_its_chord_and_its_length():
    """An arc of 1.7 rad of a tilted circle of radius 0.6, from an eye in the origin."""
    center = jnp.array([0.4, -0.3, 1.1])
    a, b = 0.6 * jnp.array([0.6, 0.8, 0.0]), 0.6 * jnp.array([0.0, 0.0, 1.0])
    first, last = jnp.array(0.4), jnp.array(2.1)
    p, v, w = edge_integrals.arc_points(center, a, b, first, last, 24)
    np.testing.assert_allclose(jnp.linalg.norm(p - center, axis=-1), 0.6, rtol=1e-12)
    np.testing.assert_allclose(jnp.sum((p - center) * v, -1), 0.0, rtol=0.0, atol=1e-12)
    ends = [center + a * jnp.cos(t) + b * jnp.sin(t) for t in (first, last)]
    np.testing.assert_allclose(w @ v, ends[1] - ends[0], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(w @ jnp.linalg.norm(v, axis=-1), 0.6 * 1.7, rtol=1e-12)


SEGMENT = np.array([[0.3, -0.4, 0.5], [0.7, 0.2, 0.9]])


def rate(start, end, nodes=12):
    """The vector `integral of p x dp / |p|^3` along a segment."""
    p, v, w = edge_integrals.line_points(start, end, nodes)
    r3 = jnp.sum(p * p, -1, keepdims=True) ** 1.5
    return jnp.sum(w[..., None] * jnp.cross(p, v) / r3, -2)


def rate_of_a_segment(start, end):
    """In closed form: the difference of the sines of sight, over the distance of its line."""
    e = (end - start) / np.linalg.norm(end - start)
    h2 = np.sum(np.cross(start, e) ** 2)
    sines = [np.dot(q, e) / np.linalg.norm(q) for q in (start, end)]
    return np.cross(start, e) * (sines[1] - sines[0]) / h2


@pytest.mark.parametrize("long", [1.0, 1e3, 1e6])
def test_edges_of_any_length_take_few_nodes(long):
    """Beside an edge a million times as long as it is far as well, but for rounding of its end."""
    start, end = SEGMENT[0] - long * (SEGMENT[1] - SEGMENT[0]), SEGMENT[1]
    found = jax.jit(rate)(start, end)
    np.testing.assert_allclose(found, rate_of_a_segment(start, end), rtol=1e-9)
    near = jax.jit(rate)(*SEGMENT)
    np.testing.assert_allclose(near, rate_of_a_segment(*SEGMENT), rtol=1e-13)


@pytest.mark.parametrize("unit", [1e-18, 1e-9, 1e12])
def test_nodes_of_a_segment_are_those_of_every_unit_in_single_precision(unit):
    found = edge_integrals.line_points(*jnp.asarray(unit * SEGMENT, "float32"), 5)
    true = edge_integrals.line_points(*jnp.asarray(SEGMENT), 5)
    for a, b in zip(found[:2], true[:2], strict=True):
        np.testing.assert_allclose(a, unit * np.asarray(b), rtol=1e-5)


@pytest.mark.parametrize("aside", [0.0, 1e-200, 1e-12])
def test_a_segment_that_is_seen_end_on_sweeps_nothing(aside):
    def swept(h):
        start = jnp.stack([h, jnp.zeros_like(h), jnp.ones_like(h)])
        return jnp.sum(rate(start, start + jnp.array([0.0, 0.0, 2.0])))

    value, slope = jax.jit(jax.value_and_grad(swept))(jnp.asarray(aside))
    # p x dp / |p|^3 = -h dz / z^3 along y
    np.testing.assert_allclose(value, -aside * 0.5 * (1.0 - 1.0 / 9.0), rtol=1e-3, atol=1e-30)
    np.testing.assert_allclose(slope, -0.5 * (1.0 - 1.0 / 9.0), rtol=1e-3)
