"""Shapes of drawings as paths: numbers, transforms, and where each element has its outline."""

import itertools
import math

import numpy as np
import pytest

from firstorder.io.svg._paths import Bezier, Conic
from firstorder.io.svg._shapes import affine, floats, length, subpaths


def outline(path, chords=40):
    """Points all along a subpath; its pieces begin where the one before ends."""
    parts = [piece.points(chords) for piece in path.pieces]
    for before, behind in itertools.pairwise(parts):
        np.testing.assert_allclose(before[-1], behind[0], rtol=0.0, atol=1e-12)
    return np.concatenate(parts)


def corners(path):
    return [piece.points(1).tolist() for piece in path.pieces]


# --- numbers -------------------------------------------------------------------------------------


def test_numbers_stand_between_spaces_commas_and_signs():
    assert floats("x", "1,-2-3 .5e1+4.") == [1.0, -2.0, -3.0, 5.0, 4.0]
    assert floats("x", " 7 ", 1) == [7.0]
    assert floats("x", "") == []


@pytest.mark.parametrize(
    ("words", "count", "sentence"),
    [
        ("1 2", 1, "`x` must be a number, but is '1 2'."),
        ("1", 2, "`x` must be 2 numbers, but is '1'."),
        ("1 two", None, "`x` must be numbers, but is '1 two'."),
        ("1 1e999", None, "`x` must be finite, but is '1 1e999'."),
    ],
)
def test_what_are_no_such_numbers_is_one_sentence(words, count, sentence):
    with pytest.raises(ValueError, match="`x` must be") as caught:
        floats("x", words, count)
    assert str(caught.value) == sentence


@pytest.mark.parametrize(
    ("words", "pixels"),
    [("3", 3), (" 1in ", 96), ("25.4mm", 96), ("2.54 CM", 96), ("-72pt", -96), ("6pc", 96),
     ("101.6Q", 96), ("1e1px", 10)],
)  # fmt: skip
def test_a_length_is_in_pixels_of_which_an_inch_has_96(words, pixels):
    assert length("x", words) == pytest.approx(pixels, rel=1e-15)


@pytest.mark.parametrize("words", ["", "px", "1em", "50%", "1e999", "1 2"])
def test_what_is_no_length_is_refused(words):
    with pytest.raises(ValueError, match="`x` must be a length, but is"):
        length("x", words)


# --- transforms ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "image"),  # of the point (2, 1), by hand
    [
        ("", (2, 1)),
        ("translate(5)", (7, 1)),
        ("translate(5, -1)", (7, 0)),
        ("scale(3)", (6, 3)),
        ("scale(3 -2)", (6, -2)),
        ("rotate(90)", (-1, 2)),
        ("rotate(90deg 3px 1)", (3, 0)),
        ("skewX(45)", (3, 1)),
        ("skewY(45)", (2, 3)),
        ("matrix(1 2 3 4 5 6)", (1 * 2 + 3 * 1 + 5, 2 * 2 + 4 * 1 + 6)),
        ("translate(10 20) , rotate(90) scale(2, 3)", (10 - 3, 20 + 4)),
        ("translate(10 20) rotate(90)", (10 - 1, 20 + 2)),
        ("scale(2 3) translate(10 20)", (24, 63)),
        ("scale(1e-90)", (2e-90, 1e-90)),
    ],
)
def test_transforms_act_from_the_right_to_the_left(words, image):
    found = affine(words)
    assert found.shape == (2, 3)
    np.testing.assert_allclose(found @ [2, 1, 1], image, rtol=1e-12, atol=1e-12 * max(image))


@pytest.mark.parametrize("words", ["turn(3)", "rotate(1 2)", "scale(1) x", "matrix(1)", "scale()"])
def test_an_unknown_transform_is_refused(words):
    with pytest.raises(ValueError, match="`transform` is not understood"):
        affine(words)


@pytest.mark.parametrize("words", ["scale(0 1)", "scale(1e-110)", "scale(1e300) scale(1e300)"])
def test_a_transform_without_an_inverse_is_refused(words):
    with np.errstate(all="ignore"), pytest.raises(ValueError, match="must be invertible"):
        affine(words)


# --- straight elements ---------------------------------------------------------------------------

A, B, C = [1.0, 2.0], [4.0, 2.0], [4.0, 6.0]


def test_a_line_goes_from_its_first_to_its_second_point():
    (path,) = subpaths("line", {"x1": "1", "y1": "2", "x2": "4", "y2": "6"})
    assert corners(path) == [[A, C]]
    assert not path.closed
    (path,) = subpaths("line", {"x2": "3"})
    assert corners(path) == [[[0.0, 0.0], [3.0, 0.0]]]


@pytest.mark.parametrize(
    ("tag", "points", "lines", "closed"),
    [
        ("polyline", "1 2 4 2 4 6", [[A, B], [B, C]], False),
        ("polyline", "1 2 4 2 4 6 1 2", [[A, B], [B, C], [C, A]], True),
        ("polyline", "1 2 4 2 1 2", [[A, B], [B, A]], False),  # there and back
        ("polygon", "1,2 4,2 4,6", [[A, B], [B, C], [C, A]], True),
    ],
)
def test_polylines_are_open_unless_they_come_back_and_polygons_closed(tag, points, lines, closed):
    (path,) = subpaths(tag, {"points": points})
    assert corners(path) == lines
    assert path.closed == closed


def test_a_polyline_of_no_line_draws_nothing():
    assert subpaths("polyline", {}) == []
    assert subpaths("polyline", {"points": "1 2"}) == []
    with pytest.raises(ValueError, match="must be pairs of numbers, but has 3 numbers"):
        subpaths("polyline", {"points": "1 2 3"})


# --- round elements ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tag", "size"), [("circle", {"r": "3"}), ("ellipse", {"rx": "3", "ry": "2"})]
)
def test_ovals_go_once_around_their_middle(tag, size):
    (path,) = subpaths(tag, {"cx": "1", "cy": "5", **size})
    half = [3.0, 3.0 if tag == "circle" else 2.0]
    p = (outline(path) - [1.0, 5.0]) / half
    np.testing.assert_allclose(np.hypot(*p.T), 1.0, rtol=1e-14)
    assert path.closed
    assert path.pieces[0].is_whole
    assert path.area > 0.0


@pytest.mark.parametrize("zero", ["rx", "ry", "width", "height"])
def test_an_element_without_a_size_draws_nothing(zero):
    tag = "ellipse" if zero[0] == "r" else "rect"
    sizes = {"rx": "1", "ry": "1"} if tag == "ellipse" else {"width": "1", "height": "1"}
    assert len(subpaths(tag, sizes)) == 1
    assert subpaths(tag, sizes | {zero: "0"}) == []
    with pytest.raises(ValueError, match=f"`{zero}` must not be negative, but is -1"):
        subpaths(tag, sizes | {zero: "-1"})
    with pytest.raises(ValueError, match=f"`{zero}` is missing"):
        subpaths(tag, {key: value for key, value in sizes.items() if key != zero})


RECT = {"x": "1", "y": "2", "width": "6", "height": "4"}


@pytest.mark.parametrize("rounded", [{}, {"rx": "0"}, {"rx": "1", "ry": "0"}, {"rx": "auto"}])
def test_a_rectangle_has_four_sides(rounded):
    (path,) = subpaths("rect", RECT | rounded)
    assert path.closed
    a, b, c, d = [1.0, 2.0], [7.0, 2.0], [7.0, 6.0], [1.0, 6.0]
    assert corners(path) == [[a, b], [b, c], [c, d], [d, a]]


@pytest.mark.parametrize(
    ("rounded", "rx", "ry"),
    [
        ({"rx": "1"}, 1, 1),
        ({"ry": "0.5", "rx": "auto"}, 0.5, 0.5),
        ({"rx": "2", "ry": "0.5"}, 2, 0.5),
        ({"rx": "9"}, 3, 2),
        ({"rx": "9", "ry": "1"}, 3, 1),
        ({"rx": "1", "ry": "9"}, 1, 2),
    ],
)
def test_a_rounded_rectangle_ends_at_its_size_and_its_corners_are_quarters(rounded, rx, ry):
    (path,) = subpaths("rect", RECT | rounded)
    assert path.closed
    p = outline(path, 400)
    beyond = np.maximum(np.abs(p - [4.0, 4.0]) - [3.0 - rx, 2.0 - ry], 0.0)
    np.testing.assert_allclose(np.hypot(*(beyond / [rx, ry]).T), 1.0, rtol=1e-12)
    np.testing.assert_allclose(p[-1], p[0], rtol=0.0, atol=1e-12)
    x, y = p.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert area == pytest.approx(24.0 - (4.0 - math.pi) * rx * ry, rel=1e-5)


# --- paths ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("d", ["", " ", "none", "M 1 1", "M 1 1 L 1 1", "M1 1A2 0 0 0 0 1 1"])
def test_a_path_without_a_line_draws_nothing(d):
    assert subpaths("path", {"d": d}) == []


@pytest.mark.parametrize(
    ("d", "lines", "closed"),
    [
        ("M1 2h3v4", [[A, B], [B, C]], False),
        ("M1 2h3v4z", [[A, B], [B, C], [C, A]], True),
        ("M1 2h3v4L1,2", [[A, B], [B, C], [C, A]], True),
        ("M1 2h3v4L1,2Z", [[A, B], [B, C], [C, A]], True),
        ("M1 2h3h-3v1", [[A, B], [B, A], [A, [1.0, 3.0]]], False),  # it comes by its beginning
        ("m1 2 3 0 0 4", [[A, B], [B, C]], False),
        ("M1 2l0 0h3", [[A, B]], False),
        ("M1 2A0 3 0 0 0 4 2", [[A, B]], False),  # an arc of no radius is a line
    ],
)
def test_lines_of_a_path_are_closed_by_z_or_by_coming_back(d, lines, closed):
    (path,) = subpaths("path", {"d": d})
    assert corners(path) == lines
    assert path.closed == closed


def test_a_path_goes_on_where_it_was_closed_and_elsewhere_after_a_move():
    first, second, third = subpaths("path", {"d": "M1 2h3v4zh1M5 5v1"})
    assert corners(first) == [[A, B], [B, C], [C, A]]
    assert corners(second) == [[A, [2.0, 2.0]]]
    assert corners(third) == [[[5.0, 5.0], [5.0, 6.0]]]
    assert [path.closed for path in (first, second, third)] == [True, False, False]


@pytest.mark.parametrize(
    ("d", "control"),
    [
        ("M0 0C1 1 2 1 3 0", [[0, 0], [1, 1], [2, 1], [3, 0]]),
        ("M1 1c1 1 2 1 3 0", [[1, 1], [2, 2], [3, 2], [4, 1]]),
        ("M0 0Q1 1 2 0", [[0, 0], [1, 1], [2, 0]]),
        # A smooth curve goes on from one of its own degree, and from no other.
        ("M0 0C1 1 2 1 3 0S5 1 6 0", [[3, 0], [4, -1], [5, 1], [6, 0]]),
        ("M0 0Q1 1 2 0T4 0", [[2, 0], [3, -1], [4, 0]]),
        ("M0 0Q1 1 2 0S4 1 5 0", [[2, 0], [2, 0], [4, 1], [5, 0]]),
        ("M0 0Q1 1 2 0t2 0s2 1 3 0", [[4, 0], [4, 0], [6, 1], [7, 0]]),
        ("M0 0C1 1 2 1 3 0T5 0", [[3, 0], [3, 0], [5, 0]]),
        ("M0 0C1 1 2 1 3 0s2 1 3 0T8 0", [[6, 0], [6, 0], [8, 0]]),
    ],
)
def test_curves_have_the_control_points_that_svg_gives_them(d, control):
    (path,) = subpaths("path", {"d": d})
    last = path.pieces[-1]
    assert isinstance(last, Bezier)
    np.testing.assert_array_equal(last.control, control)


@pytest.mark.parametrize("large", [0, 1])
@pytest.mark.parametrize("sweeping", [0, 1])
def test_an_arc_is_that_of_the_four_ellipses_through_its_ends(large, sweeping):
    """Half-axes 3 and 1, turned by 20 degrees; a sweep goes towards growing angles."""
    (path,) = subpaths("path", {"d": f"M0.5 0A3 1 20 {large}{sweeping}2 1"})
    (arc,) = path.pieces
    assert isinstance(arc, Conic)
    p = arc.points(20)
    np.testing.assert_allclose(p[[0, -1]], [[0.5, 0.0], [2.0, 1.0]], rtol=0.0, atol=1e-12)
    c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
    x, y = (p - arc.center).T
    np.testing.assert_allclose(np.hypot((c * x + s * y) / 3.0, c * y - s * x), 1.0, rtol=1e-12)
    assert (abs(arc.turn) > math.pi) == bool(large)
    assert (arc.turn > 0.0) == bool(sweeping)


@pytest.mark.parametrize(
    ("d", "sentence"),
    [
        ("L 1 1", "`d` must begin with a move, but is 'L 1 1'."),
        ("M 0 0 # 3", "`d` must be numbers, but is ' 0 0 # 3'."),
        ("M 0 0 L", "`d` has a wrong part: 'L'."),
        ("M 0 0 C 1 2 3 4", "`d` has a wrong part: 'C 1 2 3 4'."),
        ("M 0 0 H 1 Z 2", "`d` has a wrong part: 'Z 2'."),
        ("M 0 0 X 3", "`d` has a wrong part: 'X 3'."),
        ("M 0 0 A 1 1 0 2 1 3 0", "`d` is no path: 'M 0 0 A 1 1 0 2 1 3 0'."),
        ("M 0 0 A 1 # 1", "`d` has a wrong part: 'A 1 # 1'."),
        (
            "L " + "1 " * 19 + "1",  # 41 characters
            "`d` must begin with a move, but is 'L 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1...'.",
        ),
        ("L " + "1 " * 18 + "11", f"`d` must begin with a move, but is 'L {'1 ' * 18}11'."),
    ],
)
def test_a_wrong_path_is_told_in_one_sentence(d, sentence):
    with pytest.raises(ValueError, match="`d` ") as caught:
        subpaths("path", {"d": d})
    assert str(caught.value) == sentence
