"""What a shape with a material keeps of what it was given, number by number."""

import numpy as np
import pytest

from firstorder.space import disc, plane, primitive, rectangle, triangles
from firstorder.space.meshes.triangle_mesh import mesh

ONE = rectangle((0, 0, 1), (1, 0, 0), (0, 2, 0))  # its front looks up
# Two triangles in one plane, one looks up and one down.
TWO = triangles(mesh([(0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1)], [[0, 1, 2], [1, 2, 3]]))


def test_each_number_goes_where_its_name_says():
    made = primitive(
        TWO, name="pair", emission=[(1.0, 2.0), (3.0, 4.0)], albedo=(0.1, 0.2),
        specular=np.array((0.05, 0.06)), exponent=np.array((7.0, 8.0)),
    )  # fmt: skip
    assert made.name == "pair"
    assert made.shape is TWO
    m = made.material
    np.testing.assert_array_equal(m.emission, [[1.0, 2.0], [3.0, 4.0]])
    np.testing.assert_array_equal(m.albedo, [[0.1, 0.2], [0.1, 0.2]])
    np.testing.assert_array_equal(m.specular, [0.05, 0.06])
    np.testing.assert_array_equal(m.exponent, [7.0, 8.0])


def test_what_is_left_out_is_zero():
    m = primitive(ONE).material
    for name in ("emission", "albedo"):
        np.testing.assert_array_equal(getattr(m, name), [[0.0, 0.0]])
    for name in ("specular", "exponent"):
        np.testing.assert_array_equal(getattr(m, name), [0.0])
    assert primitive(ONE).name == ""


@pytest.mark.parametrize(
    ("shares", "name"),
    [
        ({"albedo": 0.6, "specular": 0.5}, "albedo"),
        ({"emission": -1.0}, "emission"),
        ({"specular": -0.1}, "specular"),
        ({"exponent": -1.0}, "exponent"),
        ({"specular": np.full(3, 0.1)}, "specular"),
    ],
)
def test_what_reflects_more_than_all_or_is_negative_is_refused(shares, name):
    with pytest.raises(ValueError, match=f"`{name}`"):
        primitive(TWO, **shares)


def test_exponents_are_no_shares():
    made = primitive(ONE, albedo=1.0, exponent=50.0, emission=9.0).material
    assert (made.albedo.max(), made.exponent.max()) == (1.0, 50.0)


@pytest.mark.parametrize(
    "shape", [ONE, disc((0, 0, 1), (0, 0, 1), 2.0), plane((0, 0, 1), (0, 0, 1))]
)
@pytest.mark.parametrize("height", [3.0, 0.5, -2.0])
def test_a_shape_is_turned_if_its_front_is_away_from_the_point(shape, height):
    """Seen from its centre, which is at height 1; far away to a side too."""
    made = primitive(shape, facing=(9.0, -4.0, height)).shape
    up = np.asarray(made.axes)[0, :, 2]
    assert np.sign(up[2]) == np.sign(height - 1.0)


def test_each_of_two_shapes_is_turned_for_itself():
    made = primitive(TWO, facing=(0.0, 0.0, 5.0)).shape
    np.testing.assert_array_equal(np.sign(np.asarray(made.axes)[:, 2, 2]), [1.0, 1.0])
    before = np.asarray(TWO.axes)[:, 2, 2]
    assert before[0] > 0.0 > before[1]


def test_what_is_no_shape_is_refused():
    with pytest.raises(TypeError, match="shape"):
        primitive(3.0)
