"""Mitsuba's shapes by hand: where their points lie, which discs close a tube, what is written."""

import types

import numpy as np
import pytest

from firstorder.io.scenes._elements import Place
from firstorder.io.scenes._mitsuba_shapes import READERS, closed_tubes, matrix, written
from firstorder.io.scenes._toml_tables import TomlTable
from firstorder.space import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Rectangles,
    primitive,
    sphere,
    triangle,
)

# Right-handed, with axes of unlike lengths that are not at right angles.
SHEAR = np.array([[2.0, 0.5, 0.1], [0.0, 1.5, -0.2], [0.3, 0.0, 0.5]])
SHIFT = np.array([10.0, -20.0, 30.0])


def turned(seed=0):
    """A rotation."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def world(axes, center=SHIFT):
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = axes, center
    return found


def read(kind, **keys):
    """Centre and axes (3, 3) of the shape that is read."""
    table = TomlTable(keys, Place("f"), {}, "shape", 0)
    shape = READERS[kind](table)
    table.done()
    assert shape.count == 1
    return type(shape), np.asarray(shape.center[0]), np.asarray(shape.axes[0])


# --- matrices ------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(4, 4), (1, 4, 4), (4, 4, 1)])
def test_a_matrix_may_be_one_of_many_or_stand_in_an_object(shape):
    given = world(0.3 * SHEAR)
    np.testing.assert_array_equal(matrix(given.reshape(shape)), given)
    np.testing.assert_array_equal(matrix(types.SimpleNamespace(matrix=given.tolist())), given)


WORDS = "a 4 x 4 matrix of numbers, the last row 0 0 0 1"


@pytest.mark.parametrize(
    "value",
    [
        "words",
        np.eye(3),
        list(np.eye(4).ravel()),
        np.stack([np.eye(4)] * 2),
        np.diag([1.0, 1.0, np.inf, 1.0]),
        *(np.eye(4) + np.outer([0, 0, 0, 1], row) for row in np.eye(4)),
    ],
)
def test_what_is_no_affine_matrix_is_refused(value):
    with pytest.raises(ValueError, match="4 x 4") as caught:
        matrix(value)
    assert str(caught.value) == WORDS


@pytest.mark.parametrize("axes", [np.diag([1.0, 1.0, 0.0]), np.diag([1.0, -1.0, 1.0])])
def test_a_map_that_flattens_or_mirrors_is_refused(axes):
    with pytest.raises(ValueError, match="does not mirror"):
        matrix(world(axes))


# --- reading -------------------------------------------------------------------------------------


def test_spheres_by_centre_and_radius_or_mapped():
    kind, center, axes = read("sphere", center=[1.0, 2.0, 3.0], radius=2.0)
    assert kind is Ellipsoids
    np.testing.assert_array_equal(center, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(axes, 2.0 * np.eye(3))
    _, center, axes = read("sphere", center=[1.0, 2.0, 3.0], radius=2.0, to_world=world(SHEAR))
    np.testing.assert_allclose(center, SHEAR @ [1.0, 2.0, 3.0] + SHIFT, rtol=1e-14)
    np.testing.assert_array_equal(axes, 2.0 * SHEAR)
    _, center, axes = read("sphere")
    np.testing.assert_array_equal(center, 0.0)
    np.testing.assert_array_equal(axes, np.eye(3))


def test_a_cube_is_mapped_as_it_stands():
    kind, center, axes = read("cube", to_world=world(SHEAR))
    assert kind is Boxes
    np.testing.assert_array_equal(center, SHIFT)
    np.testing.assert_array_equal(axes, SHEAR)


@pytest.mark.parametrize(("name", "expected"), [("rectangle", Rectangles), ("disk", Discs)])
def test_a_flat_shape_has_a_unit_normal_whatever_its_map_does_along_it(name, expected):
    kind, center, axes = read(name, to_world=world(SHEAR))
    assert kind is expected
    np.testing.assert_array_equal(center, SHIFT)
    np.testing.assert_array_equal(axes[:, :2], SHEAR[:, :2])
    np.testing.assert_allclose(axes[:, :2].T @ axes[:, 2], 0.0, rtol=0.0, atol=1e-15)
    assert axes[:, 2] @ axes[:, 2] == pytest.approx(1.0, rel=1e-15)
    assert np.linalg.det(axes) > 0.0
    _, _, flipped = read(name, to_world=world(SHEAR), flip_normals=True)
    np.testing.assert_array_equal(flipped[:, 2], -axes[:, 2])


@pytest.mark.parametrize("seed", range(4))
def test_a_flat_shape_that_is_turned_keeps_its_axes_to_the_bit(seed):
    _, _, axes = read("rectangle", to_world=world(turned(seed)))
    np.testing.assert_array_equal(axes, turned(seed))


ENDS = {
    "up": ([0.0, 0.0, 1.0], [0.0, 0.0, 4.0]),
    "down": ([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]),
    "along x": ([0.0, 0.5, 0.0], [2.0, 0.5, 0.0]),
    "leaning": ([0.1, 0.2, 0.3], [1.0, -1.0, 2.0]),
}


@pytest.mark.parametrize("name", ENDS)
def test_a_cylinder_has_its_ends_and_is_round_before_it_is_mapped(name):
    p0, p1 = map(np.array, ENDS[name])
    given = {"p0": p0.tolist(), "p1": p1.tolist(), "radius": 0.25, "to_world": world(SHEAR)}
    kind, center, axes = read("cylinder", **given)
    assert kind is Cylinders
    ends = np.stack([center - axes[:, 2], center + axes[:, 2]])
    np.testing.assert_allclose(ends, np.stack([p0, p1]) @ SHEAR.T + SHIFT, rtol=1e-13)
    own = np.linalg.solve(SHEAR, axes)
    length = np.linalg.norm(p1 - p0) / 2
    np.testing.assert_allclose(
        own.T @ own, np.diag([0.0625, 0.0625, length**2]), rtol=0.0, atol=1e-14
    )
    assert np.linalg.det(own) > 0.0
    if name == "up":
        np.testing.assert_allclose(own[:, :2], 0.25 * np.eye(3)[:, :2], rtol=0.0, atol=1e-15)


def test_a_cylinder_stands_on_the_origin_unless_told_otherwise():
    _, center, axes = read("cylinder")
    np.testing.assert_array_equal(center, [0.0, 0.0, 0.5])
    np.testing.assert_array_equal(axes, np.diag([1.0, 1.0, 0.5]))


@pytest.mark.parametrize(
    ("kind", "keys", "words"),
    [
        ("cylinder", {"p1": [0.0, 0.0, 0.0]}, "Argument `p1` must not be `p0`, but is."),
        ("cylinder", {"radius": 0.0}, "Argument `radius` must be positive, but is 0.0."),
        ("sphere", {"radius": 0.0, "to_world": np.eye(4)}, "`radius` must be positive, but is 0"),
        *((kind, {"flip_normals": True}, "`flip_normals` must be false: the front of a closed")
          for kind in ("sphere", "cube", "cylinder")),
    ],
)  # fmt: skip
def test_what_is_no_shape_is_refused(kind, keys, words):
    with pytest.raises(ValueError, match=words):
        read(kind, **keys)


# --- tubes ---------------------------------------------------------------------------------------

# A tube of radius 1 and length 6, from 97 to 103.
TUBE = Cylinders(np.array([0.0, 0.0, 100.0]), np.diag([1.0, 1.0, 3.0]))


def lid(side, *, lift=0.0, radius=1.0, turn=0.3, front=1.0):
    """A disc at one end of the tube; its own half-axes are turned."""
    c, s = np.cos(turn), np.sin(turn)
    axes = np.stack([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], -1) * [radius, radius, 1.0]
    axes = axes if side * front > 0.0 else axes @ np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    return Discs(np.array([0.0, 0.0, 100.0 + 3.0 * side + lift]), axes)


def tube_and(*discs, albedo=0.5):
    return [primitive(TUBE, albedo=albedo), *(primitive(d, albedo=0.5) for d in discs)]


def is_closed(*discs):
    """Whether discs are taken for the caps of the tube; if so, they are gone, or else all stay."""
    things = tube_and(*discs)
    rest, bare = closed_tubes(things)
    assert bare in ([], [0])
    assert rest[0] is things[0]
    return not bare


def test_a_tube_with_a_disc_on_each_end_is_a_cylinder_and_the_discs_are_gone():
    far = primitive(lid(1.0, lift=9.0), albedo=0.5)
    ball = primitive(sphere((0.0, 0.0, 0.0), 1.0))
    tube, top, base = tube_and(lid(1.0), lid(-1.0))
    assert closed_tubes([far, top, ball, tube, base]) == ([far, ball, tube], [])
    assert closed_tubes([ball, far]) == ([ball, far], [])


def test_a_tube_that_lacks_a_disc_is_named_by_its_number():
    tube, top, base = tube_and(lid(1.0), lid(-1.0))
    assert closed_tubes([top, tube]) == ([tube], [1])
    assert closed_tubes([base, base, tube])[1] == [2]
    assert closed_tubes([tube]) == ([tube], [0])
    small = primitive(Cylinders(np.zeros(3), np.eye(3)), albedo=0.5)
    rest, bare = closed_tubes([small, top, tube, base])
    assert (rest, bare) == ([small, tube], [0])


@pytest.mark.parametrize(
    ("top", "closes"),
    [
        (lid(1.0, front=-1.0), False),
        # Single precision of the size, 3, and of the place, 103.
        (lid(1.0, lift=1.05e-4), True),
        (lid(1.0, lift=1.07e-4), False),
        # Squares of half-axes, to 1e-6 of the square of the size.
        (lid(1.0, radius=1.0 + 4.4e-6), True),
        (lid(1.0, radius=1.0 + 4.6e-6), False),
    ],
)
def test_a_lid_lies_on_the_end_in_single_precision_and_looks_outward(top, closes):
    assert is_closed(top, lid(-1.0)) == closes


@pytest.mark.parametrize(("lift", "closes"), [(-1.02e-4, True), (-1.04e-4, False)])
def test_the_lid_at_the_other_end_likewise(lift, closes):
    """Its place is 97, so that its share is 1e-6 (3 + 97), and a part of it is the lid's own."""
    assert is_closed(lid(1.0), lid(-1.0, lift=lift / 1.03)) == closes


def test_an_ellipse_closes_a_tube_of_the_same_section_alone():
    axes = SHEAR.copy()
    axes[:, 2] = 2.0 * np.cross(axes[:, 0], axes[:, 1])
    tube = primitive(Cylinders(SHIFT, axes))
    c, s = np.cos(0.7), np.sin(0.7)
    flat = axes[:, :2] @ np.array([[c, -s], [s, c]])
    unit = axes[:, 2] / np.linalg.norm(axes[:, 2])
    top, base = (
        primitive(Discs(SHIFT + side * axes[:, 2], np.stack([*pair, side * unit], -1)))
        for side, pair in ((1.0, flat.T), (-1.0, flat.T[::-1]))
    )
    assert closed_tubes([tube, top, base]) == ([tube], [])
    tilted = primitive(Discs(SHIFT + axes[:, 2], turned() @ np.asarray(top.shape.axes[0])))
    assert closed_tubes([tube, tilted, base])[1] == [0]


@pytest.mark.parametrize(
    ("keys", "closes"),
    [
        ({"albedo": 0.5}, True),
        ({"albedo": (0.5, 0.25)}, True),  # the back of a lid is within
        ({"albedo": (0.25, 0.5)}, False),
        ({"albedo": 0.5, "emission": 1.0}, False),
    ],
)
def test_a_lid_has_the_front_of_the_tube(keys, closes):
    lids = [primitive(lid(side), **keys) for side in (1.0, -1.0)]
    other = primitive(lid(1.0, lift=50.0))  # of another front, which is known first
    _, bare = closed_tubes([primitive(TUBE, albedo=0.5), other, *lids])
    assert bare == ([] if closes else [0])


# --- writing -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "name"), [(Boxes, "cube"), (Rectangles, "rectangle"), (Discs, "disk")]
)
def test_shapes_are_written_as_their_maps(kind, name):
    shapes = kind(np.stack([SHIFT, 2.0 * SHIFT]), np.stack([np.eye(3), turned()]))
    (found,) = written(shapes, 1)
    assert (found.ending, found.kind, list(found.keys)) == ("", name, ["to_world"])
    np.testing.assert_allclose(
        found.keys["to_world"], world(turned(), 2.0 * SHIFT), rtol=0.0, atol=1e-15
    )


def test_a_sphere_is_written_by_its_radius_or_turned_and_an_ellipsoid_not_at_all():
    (found,) = written(sphere((1.0, 2.0, 3.0), 0.5), 0)
    assert found == ("", "sphere", {"center": [1.0, 2.0, 3.0], "radius": 0.5})
    (found,) = written(Ellipsoids(SHIFT, 7.0 * turned()), 0)
    assert (found.ending, found.kind, list(found.keys)) == ("", "sphere", ["to_world"])
    np.testing.assert_allclose(found.keys["to_world"], world(7.0 * turned()), rtol=0.0, atol=1e-14)
    with pytest.raises(ValueError, match="has spheres and no ellipsoids"):
        list(written(Ellipsoids(SHIFT, np.diag([1.0, 1.0, 2.0])), 0))


def test_what_mitsuba_lacks_is_refused():
    with pytest.raises(ValueError, match="must be right-handed"):
        list(written(Boxes(SHIFT, np.diag([1.0, -1.0, 1.0])), 0))
    with pytest.raises(ValueError, match="no shape for triangles"):
        list(written(triangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), 0))


@pytest.mark.parametrize("size", [0.1, 10.0])
def test_a_cylinder_is_written_as_a_tube_and_two_discs_that_close_it(size):
    axes = size * turned() * [1.0, 1.0, 3.0]
    tube, base, top = written(Cylinders(SHIFT, axes), 0)
    assert [w.ending for w in (tube, base, top)] == ["", "_base", "_top"]
    kind, center, found = read(tube.kind, **tube.keys)
    assert kind is Cylinders
    np.testing.assert_allclose(center, SHIFT, rtol=1e-14)
    np.testing.assert_allclose(found, axes, rtol=1e-13)
    for side, one in ((-1.0, base), (1.0, top)):
        kind, center, found = read(one.kind, **one.keys)
        assert kind is Discs
        np.testing.assert_allclose(center, SHIFT + side * axes[:, 2], rtol=1e-14)
        np.testing.assert_allclose(found[:, 2], side * turned()[:, 2], rtol=1e-13)
        flat = found[:, :2] @ found[:, :2].T
        np.testing.assert_allclose(
            flat, axes[:, :2] @ axes[:, :2].T, rtol=0.0, atol=1e-13 * size**2
        )


@pytest.mark.parametrize("size", [0.1, 10.0])
@pytest.mark.parametrize(
    ("wrong", "fits"),
    [
        ([[1, 0, 0.8e-6], [0, 1, 0], [0, 0, 1]], True),  # the axis leans
        ([[1, 0, 1.2e-6], [0, 1, 0], [0, 0, 1]], False),
        ([[1, 0, 0], [0, 1 + 0.4e-6, 0], [0, 0, 1]], True),  # a half-axis is longer
        ([[1, 0, 0], [0, 1 + 0.6e-6, 0], [0, 0, 1]], False),
        ([[1, 0.8e-6, 0], [0, 1, 0], [0, 0, 1]], True),  # they are not at right angles
        ([[1, 1.2e-6, 0], [0, 1, 0], [0, 0, 1]], False),
    ],
)
def test_a_cylinder_must_be_round_and_upright_in_single_precision(wrong, fits, size):
    shape = Cylinders(SHIFT, size * np.array(wrong) * [1.0, 1.0, 2.0])
    if fits:
        assert len(list(written(shape, 0))) == 3
    else:
        with pytest.raises(ValueError, match="round upright cylinders alone"):
            list(written(shape, 0))
