"""The slow tracer, against hits worked out by hand; `_intersect`, which it judges, is not asked."""

import numpy as np
import pytest

from firstorder.flatland import Arcs, Circles, Curves, Ellipses, Scene, Segments, primitive
from firstorder.flatland import _reference as reference

UP, RIGHT = np.array([0.0, 1.0]), np.array([1.0, 0.0])
ZERO = np.zeros(2)


def hits(shape, origin, along, on=-1):
    scene = Scene.of(*(primitive(s) for s in (shape if isinstance(shape, tuple) else (shape,))))
    t, index = reference.reference_nearest(scene, np.array([origin]), np.array([along]), on)
    return t[0], index[0]


# --- segments ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "end", "t"),
    [
        ((-1.0, 2.0), (1.0, 2.0), 2.0),
        ((-1.0, 1.0), (3.0, 5.0), 2.0),  # at a quarter of it
        ((0.0, 2.0), (1.0, 2.0), 2.0),  # its very start
        ((-1.0, 2.0), (0.0, 2.0), 2.0),  # its very end
        ((0.1, 2.0), (1.0, 2.0), np.inf),
        ((-1.0, 2.0), (-0.1, 2.0), np.inf),
        ((-1.0, -2.0), (1.0, -2.0), np.inf),  # behind
        ((0.5, 1.0), (0.5, 3.0), np.inf),  # along the ray
        ((0.0, 1.0), (0.0, 3.0), np.inf),  # in the ray
    ],
)
def test_segments(start, end, t):
    found, index = hits(Segments(start, end), ZERO, UP)
    assert found == pytest.approx(t, rel=1e-14)
    assert index == (0 if np.isfinite(t) else -1)


# --- round shapes --------------------------------------------------------------------------------


def test_circles_from_outside_inside_and_beside():
    ball = Circles((0.6, 3.0), 1.0)
    assert hits(ball, ZERO, UP)[0] == pytest.approx(3.0 - 0.8, rel=1e-14)
    assert hits(ball, (0.0, 3.0), UP)[0] == pytest.approx(0.8, rel=1e-14)
    assert hits(ball, (0.0, 4.0), UP)[0] == np.inf
    assert hits(ball, (-0.5, 0.0), UP)[0] == np.inf
    assert hits(Circles((0.6, 3.0), 2.0), ZERO, UP)[0] == pytest.approx(3.0 - np.sqrt(4.0 - 0.36))


def test_an_ellipse_that_leans():
    """`x^2 / 4 + y^2 = 1`, turned by 90 degrees and by 30 degrees counter-clockwise."""
    lying = Ellipses((0.0, 5.0), (2.0, 1.0), 0.0)
    assert hits(lying, ZERO, UP)[0] == pytest.approx(4.0)
    assert hits(lying, (1.0, 0.0), UP)[0] == pytest.approx(5.0 - np.sqrt(0.75))
    standing = Ellipses((0.0, 5.0), (2.0, 1.0), 0.5 * np.pi)
    assert hits(standing, ZERO, UP)[0] == pytest.approx(3.0)
    tilt, at = np.pi / 6.0, np.array([0.3, 5.0])
    axis = np.array([np.cos(tilt), np.sin(tilt)])
    leaning = Ellipses(at, (2.0, 1.0), tilt)
    assert hits(leaning, at, axis)[0] == pytest.approx(2.0)
    assert hits(leaning, at, np.array([-axis[1], axis[0]]))[0] == pytest.approx(1.0)
    assert hits(leaning, at - 7.0 * axis, axis)[0] == pytest.approx(5.0)


@pytest.mark.parametrize("sweep", [1.0, -1.0])
def test_arcs_hide_where_they_sweep(sweep):
    """From the right of the top, counter-clockwise or clockwise, by a quarter."""
    start = -0.25 * np.pi if sweep > 0.0 else 0.25 * np.pi
    arc = Arcs((0.0, 3.0), 1.0, start, sweep * 0.5 * np.pi)
    # The top quarter: from below a ray goes through to it, from above it meets it first.
    assert hits(arc, ZERO, UP)[0] == pytest.approx(4.0)
    assert hits(arc, (0.0, 9.0), -UP)[0] == pytest.approx(5.0)
    edge = np.sqrt(0.5)
    assert hits(arc, (edge - 1e-9, 0.0), UP)[0] == pytest.approx(3.0 + edge)
    assert hits(arc, (-edge + 1e-9, 0.0), UP)[0] == pytest.approx(3.0 + edge)
    assert hits(arc, (edge + 1e-9, 0.0), UP)[0] == np.inf
    assert hits(arc, (-edge - 1e-9, 0.0), UP)[0] == np.inf


@pytest.mark.parametrize(("start", "side"), [(0.2, -1.0), (np.pi + 0.2, 1.0)])
def test_an_arc_of_a_half_begins_at_its_angle(start, side):
    """Angles are counter-clockwise from the top: from 0.2 on it lies to the left."""
    arc = Arcs((0.0, 0.0), 2.0, start, np.pi)
    t, _ = hits(arc, ZERO, side * RIGHT)
    assert t == pytest.approx(2.0)
    assert hits(arc, ZERO, -side * RIGHT)[0] == np.inf


def test_a_curve_is_met_where_its_series_says():
    """Two waves: all hits of a line, by a scan."""
    cosines = np.array([(0.2, 3.0), (2.0, 0.3), (0.3, 0.0)])
    sines = np.array([(0.0, 0.0), (0.4, -1.5), (0.1, 0.4)])
    shape = Curves(cosines[None], sines[None])
    s = np.linspace(0.0, 1.0, 100_001)
    wave = 2.0 * np.pi * np.outer(s, [0, 1, 2])
    points = np.cos(wave) @ cosines + np.sin(wave) @ sines
    for origin, along in (((0.4, 0.0), UP), ((-3.0, 3.2), RIGHT), ((0.5, 2.5), RIGHT)):
        way = points - np.array(origin)
        side = way @ np.array([-along[1], along[0]])
        k = np.flatnonzero(side[1:] * side[:-1] < 0.0)
        share = side[k] / (side[k] - side[k + 1])
        t = (way[k] + share[:, None] * (way[k + 1] - way[k])) @ along
        assert hits(shape, origin, along)[0] == pytest.approx(np.min(t[t > 0.0]), rel=1e-6)
    assert hits(shape, (5.0, 0.0), UP)[0] == np.inf


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_curve_is_met_where_a_piece_of_it_begins(sense):
    """An ellipse by its series: both of its axes pass through points of even shares of it."""
    axes = np.array([(0.0, 0.0), (2.0, 0.0)]), np.array([(0.0, 0.0), (0.0, -sense)])
    shape = Curves(*(a[None] for a in axes))
    for along, t in ((UP, 1.0), (-UP, 1.0), (RIGHT, 2.0), (-RIGHT, 2.0)):
        assert hits(shape, ZERO, along)[0] == pytest.approx(t, rel=1e-12)
        assert hits(shape, -5.0 * along, along)[0] == pytest.approx(5.0 - t, rel=1e-12)


# --- the first of all ----------------------------------------------------------------------------


def test_the_nearest_of_all_shapes_and_its_number():
    two = Segments([(-1.0, 5.0), (-1.0, 2.0)], [(1.0, 5.0), (1.0, 2.0)])
    ball = Circles([(0.0, 9.0), (0.0, 1.0)], 0.5)
    assert hits((two, ball), ZERO, UP) == (0.5, 3)
    assert hits((two, ball), (0.0, 1.7), UP) == (pytest.approx(0.3), 1)
    assert hits((two, ball), (0.0, 2.5), UP) == (2.5, 0)
    assert hits((two, ball), (0.0, 6.0), UP) == (2.5, 2)
    assert hits((two, ball), (0.0, 6.0), RIGHT) == (np.inf, -1)
    scene = Scene.of(primitive(two), primitive(ball))
    t, index = reference.reference_nearest(
        scene, np.array([(0.0, 0.0), (0.0, 6.0)]), np.array([UP, RIGHT])
    )
    np.testing.assert_allclose(t, [0.5, np.inf])
    np.testing.assert_array_equal(index, [3, -1])


def test_a_ray_does_not_meet_the_point_that_it_starts_from():
    ball = Circles((0.0, 0.0), 1.0)
    assert hits(ball, (0.0, -1.0), UP, 0)[0] == pytest.approx(2.0)
    assert hits(ball, (0.0, -1.0 - 5e-8), UP, 0)[0] == pytest.approx(2.0, rel=1e-6)
    assert hits(ball, (0.0, -1.0 - 5e-8), UP)[0] == pytest.approx(5e-8, rel=1e-6)
    assert hits(ball, (0.0, -1.0 - 1.5e-7), UP, 0)[0] == pytest.approx(1.5e-7, rel=1e-6)
    # On one of two shapes only that one is left out near the start.
    other = (Segments((-1.0, 5e-8), (1.0, 5e-8)), Circles((0.0, -1.0), 1.0))
    assert hits(other, ZERO, UP, 1) == (pytest.approx(5e-8), 0)


def test_roots_keep_their_digits_where_one_is_tiny():
    """A circle of radius 1 with its near point 1e-12 ahead; and a ray that touches at its start."""
    near = reference._conic(np.array([0.0, 1.0 + 1e-9]), np.eye(2), ZERO, UP)
    assert min(near) == pytest.approx(1e-9, rel=1e-6)
    assert max(near) == pytest.approx(2.0 + 1e-9)
    assert reference._conic(np.array([1.0, 0.0]), np.eye(2), ZERO, UP) == [0.0]
    assert reference._conic(np.array([2.0, 0.0]), np.eye(2), ZERO, UP) == []
