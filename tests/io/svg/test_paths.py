"""Pieces of paths: where they run, how many chords they take, and the shapes they become."""

import math

import numpy as np
import pytest

from firstorder.io.svg._paths import Bezier, Conic, Subpath, shapes

LINE = Bezier(np.array([[1.0, 1.0], [4.0, 5.0]]))
PARABOLA = Bezier(np.array([[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]]))
CUBIC = Bezier(np.array([[0.0, 0.0], [1.0, 2.0], [2.0, 0.0], [3.0, 1.0]]))


def conic(u, v, start=0.0, sweep=2.0 * math.pi, center=(1.0, -2.0)):
    return Conic(np.array(center), np.array(u), np.array(v), start, sweep)


LEANING = conic((2.0, 0.1), (0.3, 1.0), 0.3, -2.0)


def turned_by(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def shoelace(p):
    q = np.roll(p, -1, 0)
    return 0.5 * np.sum(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])


# --- where pieces run ----------------------------------------------------------------------------


def test_a_bezier_runs_where_casteljau_s_lines_have_it():
    for curve in (LINE, PARABOLA, CUBIC):
        found = curve.points(5)
        for t, point in zip(np.linspace(0.0, 1.0, 6), found, strict=True):
            control = curve.control
            while len(control) > 1:
                control = control[:-1] + t * np.diff(control, axis=0)
            np.testing.assert_allclose(point, control[0], rtol=0.0, atol=1e-14)
        np.testing.assert_array_equal(found[[0, -1]], curve.control[[0, -1]])


def test_a_conic_runs_by_its_half_diameters():
    found = conic((2.0, 0.1), (0.3, 1.0), math.pi / 2, -math.pi).points(2)
    np.testing.assert_allclose(found, [[1.3, -1.0], [3.0, -1.9], [0.7, -3.0]], rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("piece", [CUBIC, LEANING], ids=["bezier", "conic"])
def test_pieces_keep_their_places_when_they_are_mapped_and_turned(piece):
    A, b = np.array([[1.0, 0.3], [0.2, -2.0]]), np.array([0.5, 1.0])
    p = piece.points(7)
    np.testing.assert_allclose(piece.mapped(A, b).points(7), p @ A.T + b, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(piece.turned().points(7), p[::-1], rtol=0.0, atol=1e-14)
    second = np.diff(piece.points(1000), 2, axis=0) * 1000.0**2
    assert np.max(np.hypot(*second.T)) <= piece.bend * (1 + 1e-6)


@pytest.mark.parametrize(
    ("piece", "bend"),
    [
        (LINE, 0.0),
        (PARABOLA, 8.0),  # c'' = 2 (p0 - 2 p1 + p2)
        (CUBIC, 6.0 * 4.0),  # the larger of 6 |(0, -4)| and 6 |(0, 3)|
        (conic((3.0, 0.0), (0.0, 4.0), sweep=-3.0), 9.0 * 5.0),
    ],
)
def test_the_bend_of_a_piece_by_hand(piece, bend):
    assert piece.bend == pytest.approx(bend, rel=1e-14)


def test_the_chords_of_a_curve_are_as_many_as_the_bound_asks_for():
    """c'' of this parabola is (0, -8): 8 / (8 n^2) <= tolerance."""
    assert len(PARABOLA.within(1.0001 / 10**2)) - 1 == 10
    assert len(LINE.within(1e-300)) - 1 == 1
    assert len(PARABOLA.within(1.0001e-8)) - 1 == 10_000
    with pytest.raises(ValueError, match="asks for more than 10000 chords"):
        PARABOLA.within(0.9999e-8)


# --- what a conic is -----------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [-1.2, 0.7, 1.4])
@pytest.mark.parametrize("start", [0.4, 2.0])
def test_the_axes_of_an_ellipse_follow_from_any_two_conjugate_half_diameters(angle, start):
    c, s = math.cos(start), math.sin(start)
    u, v = (turned_by(angle) @ p for p in ([3.0 * c, s], [-3.0 * s, c]))
    semi, found = conic(u, v).axes
    np.testing.assert_allclose(semi, [3.0, 1.0], rtol=1e-14)
    assert (found - angle + 1.0) % math.pi == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize("size", [1e-3, 1e3])
@pytest.mark.parametrize(("excess", "is_round"), [(0.0, True), (1e-10, True), (4e-9, False)])
def test_a_circle_is_one_up_to_rounding(size, excess, is_round):
    u, v = size * turned_by(0.3)
    assert conic(u, v * (1.0 + excess)).is_round == is_round
    assert conic(u * (1.0 + excess), v).is_round == is_round


@pytest.mark.parametrize(
    ("turns", "is_whole"), [(1.0, True), (-1.0, True), (0.5, False), (2.0, False), (0.999, False)]
)
def test_a_conic_is_whole_after_one_turn_either_way(turns, is_whole):
    assert conic((1.0, 0.0), (0.0, 2.0), 0.2, 2.0 * math.pi * turns).is_whole == is_whole


@pytest.mark.parametrize("seed", range(8))
def test_the_turn_of_a_conic_has_the_sign_of_the_area_that_it_goes_around(seed):
    u, v = np.random.default_rng(seed).normal(size=(2, 2))
    for sweep in (1.3, -0.4):
        points = conic(u, v, 0.2, sweep, (0.0, 0.0)).points(9)
        with_middle = np.concatenate([np.zeros((1, 2)), points])
        assert conic(u, v, 0.2, sweep).turn == math.copysign(sweep, shoelace(with_middle))


# --- subpaths ------------------------------------------------------------------------------------

# Three lines of 4, 3 and 2 units.
PLACES = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 3.0]])
OPEN = Subpath(tuple(Bezier(PLACES[k : k + 2]) for k in range(3)), False)


def corners(path):
    return np.array([piece.points(1) for piece in path.pieces])


def test_a_subpath_is_mapped_and_turned_as_a_whole():
    A, b = np.array([[0.0, -1.0], [2.0, 0.0]]), np.array([1.0, 0.0])
    np.testing.assert_array_equal(corners(OPEN.mapped(A, b)), corners(OPEN) @ A.T + b)
    np.testing.assert_array_equal(corners(OPEN.turned()), corners(OPEN)[::-1, ::-1])
    assert not OPEN.mapped(A, b).closed
    assert not OPEN.turned().closed


def test_a_subpath_is_shut_by_a_line_to_its_beginning():
    shut = OPEN.shut()
    assert shut.closed
    np.testing.assert_array_equal(corners(shut)[-1], [[2.0, 3.0], [0.0, 0.0]])
    np.testing.assert_array_equal(corners(shut)[:-1], corners(OPEN))


def test_the_area_of_a_subpath_by_hand():
    """A trapezium; the other way round; a disc; a triangle of a thousandth, a million away."""
    assert OPEN.shut().area == pytest.approx(0.5 * (4 + 2) * 3, rel=1e-14)
    assert OPEN.shut().turned().area == pytest.approx(-9.0, rel=1e-14)
    disc = Subpath((conic((2.0, 0.0), (0.0, 2.0)),), True)
    assert disc.area == pytest.approx(4.0 * math.pi, rel=0.03)
    a, b, c = 1e6 / 3 + np.array([[0.0, 0.0], [1e-3, 0.0], [0.0, 1e-3]])
    small = Subpath(tuple(Bezier(np.stack(p)) for p in ((a, b), (b, c), (c, a))), True)
    assert small.area == pytest.approx(0.5e-6, rel=1e-3)


# --- shapes --------------------------------------------------------------------------------------


def test_shapes_come_in_the_order_of_travel_and_lines_that_meet_are_one_group():
    arc = conic((1.0, 0.0), (0.0, 1.0), 0.0, 1.0)
    (one, first), (two, _), (three, last) = shapes(Subpath((LINE, arc, CUBIC, LINE), False), 0.1)
    assert (one, two, three) == ("segment", "arc", "segment")
    np.testing.assert_array_equal(first["start"], [[1.0, 1.0]])
    np.testing.assert_array_equal(first["end"], [[4.0, 5.0]])
    chords = CUBIC.within(0.1)
    np.testing.assert_array_equal(last["start"], [*chords[:-1], [1.0, 1.0]])
    np.testing.assert_array_equal(last["end"], [*chords[1:], [4.0, 5.0]])


def test_chords_without_length_are_left_out():
    assert shapes(Subpath((Bezier(np.zeros((2, 2))),), False), 1.0) == []
    # There and back along a line: the middle one of three chords has no length.
    flat = conic((1.0, 0.0), (0.0, 0.0), -0.3, 0.6)
    ((kind, found),) = shapes(Subpath((flat,), False), 0.0051)
    assert kind == "segment"
    turn = 1.0 + math.cos(0.1)
    np.testing.assert_allclose(found["end"], [[turn, -2], [1.0 + math.cos(0.3), -2]], rtol=1e-14)
    for sweep in (-2.0 * math.pi, 2.0 * math.pi):
        flat = Subpath((conic((1.0, 0.0), (0.0, 0.0), 0.0, sweep),), True)
        assert [kind for kind, _ in shapes(flat, 0.1)] == ["segment"]


def shape_of(piece):
    ((kind, found),) = shapes(Subpath((piece,), True), 1e-3)
    return kind, {key: np.asarray(value)[0] for key, value in found.items()}


# Flatland's normals are to the left of travel: outward for those who go round clockwise.
@pytest.mark.parametrize("start", [0.0, 0.4])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_closed_ovals_that_look_outward_are_circles_and_ellipses(start, mirror):
    clockwise = -2.0 * math.pi * mirror
    u, v = turned_by(0.5) @ [3.0, 0.0], turned_by(0.5) @ [0.0, mirror]
    kind, found = shape_of(conic(u, 3.0 * v, start, clockwise))
    assert kind == "circle"
    np.testing.assert_array_equal(found["center"], [1.0, -2.0])
    assert found["radius"] == pytest.approx(3.0, rel=1e-14)
    kind, found = shape_of(conic(v, u, start, -clockwise))
    assert kind == "ellipse"
    np.testing.assert_array_equal(found["center"], [1.0, -2.0])
    np.testing.assert_allclose(found["semi"], [3.0, 1.0], rtol=1e-14)
    assert (found["tilt"] - 0.5 + 1.0) % math.pi == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize("sweep", [1.2, -2.5, "whole"])
def test_arcs_run_where_the_conic_does(mirror, sweep):
    sweep = 2.0 * math.pi * mirror if sweep == "whole" else sweep
    piece = conic(2.0 * turned_by(0.5)[0], 2.0 * mirror * turned_by(0.5)[1], 0.7, sweep)
    kind, found = shape_of(piece)
    assert kind == "arc"
    angle = found["start"] + np.linspace(0.0, 1.0, 8)[:, None] * found["sweep"]
    points = found["radius"] * np.concatenate([-np.sin(angle), np.cos(angle)], -1)
    np.testing.assert_allclose(found["center"] + points, piece.points(7), rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_an_ellipse_that_looks_inward_is_a_curve_of_one_harmonic(mirror):
    piece = conic((3.0, 0.2), (0.1, mirror), 0.7, 2.0 * math.pi * mirror)
    kind, found = shape_of(piece)
    assert kind == "curve"
    turn = 2.0 * np.pi * np.linspace(0.0, 1.0, 8)[:, None]
    (middle, right), (still, up) = found["cosines"], found["sines"]
    points = middle + np.cos(turn) * right + np.sin(turn) * up
    np.testing.assert_allclose(points, piece.points(7), rtol=0.0, atol=1e-13)
    np.testing.assert_array_equal(still, 0.0)


def test_a_part_of_an_ellipse_becomes_chords_on_it():
    kind, found = shape_of(LEANING)
    assert kind == "segment"
    assert len(LEANING.within(1e-3)) > 20
    np.testing.assert_array_equal(found["start"], LEANING.points(1)[0])
