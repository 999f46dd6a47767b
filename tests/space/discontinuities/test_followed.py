"""Curves on which three outlines cross: lines through three edges, and tangents of a ball."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from firstorder.space import Receiver, Scene, primitive, sphere
from firstorder.space.discontinuities import _followed as module
from firstorder.space.discontinuities._edges import Edges
from firstorder.space.discontinuities._followed import Sights, Square, arrived, conditions, followed
from firstorder.space.discontinuities._rounds import rounds_of

RNG = np.random.default_rng(2)
# Three skew edges, and two more: above each other, along x and along y.
STARTS = np.array([(-1, -1, 1), (-1, 0.5, 1.5), (0.2, -1, 2), (-9, 0, 1), (0, -9, 2)], float)
ALONG = np.array([(2, 1.7, 0.2), (2, -0.6, 0.4), (-0.3, 2, 0.5), (18, 0, 0), (0, 18, 0)], float)
CENTER, RADIUS = np.array([0.02, 0.03, 0.5]), 0.2
LEVEL, TILTED = Receiver.at((0.0, 0.0, 0.0)), Receiver.at((0.1, -0.2, 0.0), (0.2, -0.1, 1.0))
ONES = np.array([0, 1, 2])
MIXED = np.array([3, 4, 5])  # two edges and the ball


def square(at=LEVEL, reach=1.5):
    ends = np.arange(10).reshape(5, 2)
    vertices = np.stack([STARTS, STARTS + ALONG], 1).reshape(10, 3)
    no, one = np.zeros((10, 5), bool), np.eye(5, dtype=bool)
    rounds = rounds_of(Scene.of(primitive(sphere(CENTER, RADIUS))))
    return Square(Edges(vertices, ends, no, one, None, 9.0, 1e-7), rounds, at, reach)


def unit(a):
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def angle(number, x, u):
    """From a line of sight to an outline: tangent of that to an edge's plane, or of a limb's."""
    if number < 5:
        m = unit(np.cross(STARTS[number] - x, ALONG[number]))
        return np.tan(np.arcsin(m @ u))
    far = np.linalg.norm(CENTER - x)
    cosine = (CENTER - x) @ u / far
    sine = np.sqrt(1.0 - cosine**2)
    return (sine**2 - (RADIUS / far) ** 2) / (2.0 * sine * cosine)


def at_outline(number, x):
    """A direction from a place to an outline, at random."""
    if number < 5:
        return unit(STARTS[number] + RNG.uniform(0, 1) * ALONG[number] - x)
    w = CENTER - x
    far = np.linalg.norm(w)
    across = unit(np.cross(w, RNG.normal(size=3)))
    sine = RADIUS / far
    return np.sqrt(1.0 - sine**2) * w / far + sine * across


@pytest.mark.parametrize("at", [LEVEL, TILTED])
def test_conditions_are_angles_to_outlines(at):
    where = square(at)
    flat, u = RNG.uniform(-1, 1, (6, 2)), unit(RNG.normal(size=(6, 3)) * 0.2 + (0, 0, 1))
    numbers = np.array([[0, 1, 2], [5, 0, 3], [4, 5, 1], [2, 1, 0], [3, 4, 5], [5, 5, 5]])
    value, slope = conditions(where, Sights(flat, u, numbers))
    frame = np.asarray(at.axes)[:, :2]
    x = np.asarray(at.position) + 1.5 * flat @ frame.T
    np.testing.assert_allclose(where.places(flat), x, rtol=1e-14)
    true = [
        [angle(n, *one) for n in row]
        for row, one in zip(numbers, zip(x, u, strict=True), strict=True)
    ]
    np.testing.assert_allclose(value, true, rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(slope[..., 2:], axis=-1), 1.0)
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", slope[..., 2:], u), 0.0, rtol=0.0, atol=1e-12
    )


@pytest.mark.parametrize("number", [0, 1, 2, 3, 4, 5])
def test_slopes_are_those_of_the_angles(number):
    """On an outline, by differences: of the place in halves of the square, and of the direction."""
    where, flat = square(TILTED), RNG.uniform(-1, 1, (1, 2))
    frame = 1.5 * np.asarray(TILTED.axes)[:, :2]
    x = np.asarray(TILTED.position) + flat[0] @ frame.T
    u = at_outline(number, x)
    value, slope = conditions(where, Sights(flat, u[None], np.full((1, 3), number)))
    np.testing.assert_allclose(value, 0.0, rtol=0.0, atol=1e-12)
    h, turn = 1e-6, np.linalg.svd(u[None])[2][1:]
    by_place = [
        (angle(number, x + h * e, u) - angle(number, x - h * e, u)) / (2 * h) for e in frame.T
    ]
    by_way = [
        (angle(number, x, unit(u + h * t)) - angle(number, x, unit(u - h * t))) / (2 * h)
        for t in turn
    ]
    for row in slope[0]:
        sign = np.sign(row[:2] @ by_place) if number < 5 else 1.0
        np.testing.assert_allclose(sign * row[:2], by_place, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(sign * turn @ row[2:], by_way, rtol=1e-6, atol=1e-8)


def through(s):
    """The line through all three edges from the share s of the first: place on z = 0, direction."""
    p = STARTS[0] + s * ALONG[0]
    plane = np.cross(STARTS[1] - p, ALONG[1])
    q = STARTS[2] + ALONG[2] * (plane @ (p - STARTS[2])) / (plane @ ALONG[2])
    d = (q - p) * np.sign((q - p)[2])
    return p - d * p[2] / d[2], unit(d)


def sights(places, ways, numbers, reach=1.5):
    places, ways = np.atleast_2d(places), np.atleast_2d(ways)
    return Sights(places[:, :2] / reach, ways, np.tile(numbers, (len(places), 1)))


def test_newton_leads_to_the_nearest_line_of_sight():
    where = square()
    x, u = (
        np.stack([through(s)[0] for s in (0.4, 0.6)]),
        np.stack([through(s)[1] for s in (0.4, 0.6)]),
    )
    start = sights(x, u, ONES)
    tangent = (
        np.stack([through(s + 1e-5)[0] - through(s - 1e-5)[0] for s in (0.4, 0.6)])[:, :2] / 1.5
    )
    turn = np.stack([through(s + 1e-5)[1] - through(s - 1e-5)[1] for s in (0.4, 0.6)])
    along = unit(np.concatenate([tangent, turn], 1))
    off = 1e-3 * RNG.normal(size=(2, 5))
    off -= np.sum(off * along, 1, keepdims=True) * along  # straight away from the curve
    z = start.both + off
    found, slope, there = arrived(where, Sights(z[:, :2], unit(z[:, 2:]), start.numbers))
    assert there.all()
    np.testing.assert_allclose(found.both, start.both, rtol=0.0, atol=3e-5)
    np.testing.assert_allclose(conditions(where, found)[0], 0.0, rtol=0.0, atol=1e-10)
    np.testing.assert_array_equal(slope, conditions(where, found)[1])


def test_where_there_is_none_nothing_has_arrived():
    """No line passes three edges along x whose planes are not one."""
    apart = np.array([(-1, 0, 1), (-1, 1, 1), (-1, 2, 4)], float)
    where = square()
    edges = where.edges._replace(
        vertices=np.stack([apart, apart + np.array([2.0, 0.0, 0.0])], 1).reshape(6, 3),
        ends=np.arange(6).reshape(3, 2),
    )
    none = Sights(np.array([[0.1, 0.2]]), np.array([[0.0, 0.3, 0.9]]), ONES[None])
    assert not arrived(where._replace(edges=edges), none)[2].any()


def test_a_line_that_passes_some_of_the_outlines_has_not_arrived(monkeypatch):
    """Each of the three in its turn; no step is taken."""
    monkeypatch.setattr(module, "ITERATIONS", 0)
    x, u = through(0.4)
    start = sights(np.tile(x, (4, 1)), np.tile(u, (4, 1)), ONES)
    numbers = np.array([(0, 1, 2), (3, 1, 2), (0, 3, 2), (0, 1, 3)])
    _, _, there = arrived(square(), start._replace(numbers=numbers))
    np.testing.assert_array_equal(there, [True, False, False, False])


def test_what_is_in_the_square_goes_upwards():
    where = square(TILTED)
    n = np.asarray(TILTED.normal)
    flat = np.array([(0.0, 0.0), (1.0, -1.0), (1.1, 0.0), (0.0, -1.1), (0.0, 0.0), (0.0, 0.0)])
    side = unit(np.cross(n, (1.0, 0.0, 0.0)))
    u = np.array([n, n, n, n, -n, side - 1e-3 * n])
    found = where.within(Sights(flat, u, np.zeros((6, 3), int)))
    np.testing.assert_array_equal(found, [True, True, False, False, False, False])


# --- whole curves --------------------------------------------------------------------------------


def steps(curve):
    return np.linalg.norm(np.diff(curve.both, axis=0), axis=1)


def test_a_curve_through_three_edges_is_followed_to_both_ends_of_the_square():
    where = square(reach=1.0)
    s = np.linspace(0.0, 1.0, 4001)
    x, u = (np.stack(a) for a in zip(*map(through, s), strict=True))
    inside = np.all(np.abs(x[:, :2]) < 1.0, axis=1)
    part = np.flatnonzero(inside)
    part = part[: np.argmax(np.diff(part, append=part[-1] + 9) > 1) + 1]  # the first stretch
    middle = part[len(part) // 3]
    (curve,) = followed(where, sights(x[middle], u[middle], ONES, 1.0))
    np.testing.assert_allclose(np.linalg.norm(curve.u, axis=1), 1.0)
    np.testing.assert_array_equal(curve.numbers, np.tile(ONES, (len(curve.u), 1)))
    np.testing.assert_allclose(conditions(where, curve)[0], 0.0, rtol=0.0, atol=1e-9)
    assert steps(curve).max() < 1.5 * module.LONGEST
    # Both ends are just outside, all between them within; what is within is near to the curve.
    within = where.within(curve)
    assert not within[0]
    assert not within[-1]
    assert within[1:-1].all()
    gap = np.linalg.norm(x[part][:, None, :2] - curve.flat[None], axis=-1).min(1)
    assert gap.max() < module.LONGEST
    assert np.min(np.linalg.norm(curve.flat - x[middle, :2], axis=1)) < 1e-12
    assert (steps(curve) > 0.5 * module.LONGEST).mean() > 0.5


def limb(a, b):
    """Distance of the ball's middle from the line from (a, b, 0) through both level edges."""
    p, d = np.array([a, b, 0.0]), np.array([-a / 2.0, -b, 1.0])
    return np.linalg.norm(np.cross(CENTER - p, d)) / np.linalg.norm(d)


def on_limb(reach=1.5):
    """A line of sight that touches the ball, through both level edges."""
    a: Any = brentq(lambda a: limb(a, 0.1) - RADIUS, 0.1, 1.4)
    return sights((a, 0.1, 0.0), unit(np.array([-a / 2.0, -0.1, 1.0])), MIXED, reach)


def test_a_curve_around_a_ball_closes():
    where = square()
    start = on_limb()
    (curve,) = followed(where, start)
    x = 1.5 * curve.flat
    np.testing.assert_allclose([limb(*p) for p in x], RADIUS, rtol=0.0, atol=1e-8)
    np.testing.assert_array_equal(curve.both[0], curve.both[-1])
    np.testing.assert_allclose(curve.both[0], start.both[0], rtol=0.0, atol=1e-12)
    around = np.unwrap(np.arctan2(x[:, 1], x[:, 0]))
    assert abs(around[-1] - around[0]) == pytest.approx(2.0 * np.pi)
    assert np.all(np.diff(around) * np.sign(around[-1] - around[0]) > 0.0)
    assert steps(curve).max() < 1.5 * module.LONGEST
    assert len(x) < 4.0 * steps(curve).sum() / module.LONGEST


def test_several_curves_are_followed_at_once_each_for_itself():
    where = square(reach=1.0)
    a = np.flatnonzero([np.all(np.abs(through(s)[0][:2]) < 0.9) for s in np.linspace(0, 1, 41)])
    x, u = (
        np.stack(b)
        for b in zip(*(through(s) for s in np.linspace(0, 1, 41)[a[[0, -1]]]), strict=True)
    )
    ball = on_limb(1.0)
    lines = sights(x, u, ONES, 1.0)
    start = Sights(*(np.concatenate([p[:1], q, p[1:]]) for p, q in zip(lines, ball, strict=True)))
    found = followed(where, start)
    for curve, own in zip(found, start.numbers, strict=True):
        np.testing.assert_array_equal(curve.numbers, np.tile(own, (len(curve.u), 1)))
        np.testing.assert_allclose(conditions(where, curve)[0], 0.0, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(found[1].both[0], found[1].both[-1])
    (alone,) = followed(where, start.take(np.array([2])))
    np.testing.assert_allclose(found[2].both, alone.both, rtol=0.0, atol=1e-9)
