"""What a shape with a material keeps of what it was given, number by number."""

import numpy as np
import pytest

from firstorder.flatland import Arcs, Segments, primitive

TWO = Segments([(0.0, 0.0), (2.0, 1.0)], [(1.0, 0.0), (2.0, 3.0)])
ONE = Segments((0.0, 0.0), (1.0, 0.0))


def test_each_number_goes_where_its_name_says():
    made = primitive(
        TWO, name="pair", emission=[(1.0, 2.0), (3.0, 4.0)], albedo=(0.1, 0.2),
        mirror=np.array((0.3, 0.35)), specular=np.array((0.05, 0.06)),
        exponent=np.array((7.0, 8.0)), ior=np.array((1.5, 0.0)),
    )  # fmt: skip
    assert made.name == "pair"
    assert made.shape is TWO
    m = made.material
    np.testing.assert_array_equal(m.emission, [[1.0, 2.0], [3.0, 4.0]])
    np.testing.assert_array_equal(m.albedo, [[0.1, 0.2], [0.1, 0.2]])
    np.testing.assert_array_equal(m.mirror, [0.3, 0.35])
    np.testing.assert_array_equal(m.specular, [0.05, 0.06])
    np.testing.assert_array_equal(m.exponent, [7.0, 8.0])
    np.testing.assert_array_equal(m.ior, [1.5, 0.0])


def test_what_is_left_out_is_zero():
    m = primitive(ONE).material
    for name in ("emission", "albedo"):
        np.testing.assert_array_equal(getattr(m, name), [[0.0, 0.0]])
    for name in ("mirror", "specular", "exponent", "ior"):
        np.testing.assert_array_equal(getattr(m, name), [0.0])
    assert primitive(ONE).name == ""


@pytest.mark.parametrize(
    ("shares", "name"),
    [
        ({"albedo": 0.6, "mirror": 0.5}, "albedo"),
        ({"albedo": 0.6, "specular": 0.5}, "albedo"),
        ({"mirror": 0.6, "specular": 0.5}, "mirror"),
        ({"emission": -1.0}, "emission"),
        ({"mirror": -0.1}, "mirror"),
        ({"exponent": -1.0}, "exponent"),
        ({"ior": -1.0}, "ior"),
        ({"specular": np.full(3, 0.1)}, "specular"),
    ],
)
def test_what_reflects_more_than_all_or_is_negative_is_refused(shares, name):
    with pytest.raises(ValueError, match=f"`{name}`"):
        primitive(TWO, **shares)


def test_exponents_and_indices_are_no_shares():
    made = primitive(ONE, albedo=1.0, exponent=50.0, ior=1.5, emission=9.0).material
    assert (made.albedo.max(), made.exponent.max(), made.ior.max()) == (1.0, 50.0, 1.5)


def test_a_shape_is_turned_if_its_left_is_away_from_the_point():
    """`facing`: of two segments one is turned, the other is not."""
    made = primitive(TWO, facing=(1.0, 5.0)).shape
    np.testing.assert_array_equal(made.start, TWO.start)
    np.testing.assert_array_equal(made.end, TWO.end)
    made = primitive(TWO, facing=(1.0, -5.0)).shape
    np.testing.assert_array_equal(made.start, [(1.0, 0.0), (2.0, 1.0)])
    np.testing.assert_array_equal(made.end, [(0.0, 0.0), (2.0, 3.0)])


@pytest.mark.parametrize("turned", [False, True])
def test_an_arc_is_judged_at_its_middle(turned):
    """A quarter from the top to the left, and back: its middle is up and to the left of 0."""
    start, sweep = (0.0, 0.5 * np.pi) if not turned else (0.5 * np.pi, -0.5 * np.pi)
    arc = Arcs((0.0, 0.0), 1.0, start, sweep)
    inside, outside = (primitive(arc, facing=p).shape for p in ((-0.6, 0.6), (-0.8, 0.8)))
    # Counter-clockwise, the centre is to the left.
    assert np.all(inside.sweep > 0.0)
    assert np.all(outside.sweep < 0.0)


def test_what_is_no_shape_is_refused():
    with pytest.raises(TypeError, match="shape"):
        primitive(3.0)
