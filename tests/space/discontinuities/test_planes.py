"""Planes in which outlines lie, of shapes of which one can count them."""

import numpy as np
import pytest

from firstorder.space import Receiver, Scene, box, cylinder, disc, primitive, rectangle, triangle
from firstorder.space.discontinuities._edges import edges_of
from firstorder.space.discontinuities._planes import planes_along, planes_of
from firstorder.space.discontinuities._rounds import rounds_of

AT = Receiver.at((0.0, 0.0, 0.0))
X, Y, Z = np.eye(3)
TRIANGLE = triangle((0.0, 0.0, 1.0), (3.0, 0.5, 1.2), (0.3, 2.0, 2.0))


def planes(*shapes):
    scene = Scene.of(*map(primitive, shapes))
    return planes_of(edges_of(scene, AT), rounds_of(scene))


def holds(found, point, normal):
    """How many of the planes are that through a point with a normal."""
    points, normals = found
    n = np.asarray(normal) / np.linalg.norm(normal)
    same = np.abs(normals @ n) > 1.0 - 1e-9
    return np.sum(same & (np.abs((points - point) @ n) < 1e-9))


def test_the_edges_of_a_triangle_lie_in_one_plane():
    points, normals = planes(TRIANGLE)
    assert len(points) == 1
    normal = np.cross([3.0, 0.5, 0.2], [0.3, 2.0, 1.0])
    assert holds((points, normals), [0.0, 0.0, 1.0], normal) == 1
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0, rtol=1e-14)


def test_a_box_has_six_faces_and_six_planes_through_edges_that_face_each_other():
    found = planes(box((0.0, 0.0, 1.0), (1.0, 1.0, 2.0)))
    assert len(found[0]) == 12
    middle = np.array([0.5, 0.5, 1.5])
    for a in (X, Y, Z):
        assert [holds(found, middle + s * a / 2.0, a) for s in (1.0, -1.0)] == [1, 1]
    for a, b in [(X, Y), (Y, Z), (Z, X)]:
        assert [holds(found, middle, a + s * b) for s in (1.0, -1.0)] == [1, 1]


def test_edges_in_one_line_span_no_plane():
    """Two rectangles that continue each other: the plane of both, and those across it."""
    first = rectangle((1.0, 0.0, 1.0), X, 0.5 * Y)
    found = planes(first, rectangle((3.5, 0.0, 1.0), X, 0.5 * Y))
    assert len(found[0]) == 1
    assert holds(found, [0.0, 0.0, 1.0], Z) == 1


def test_an_edge_and_one_that_starts_on_its_line_span_the_plane_of_both():
    """Whichever of the ends lies on the line of the other, and however near the other end is."""
    tip = np.array([4.0, 0.0, 1.0])
    shapes = triangle((0, 0, 1), (3, 0, 1), (1.0, 0.2, 3.0)), triangle(tip, (5, 1, 1), (4, 1, 9))
    found = planes(*shapes)
    assert holds(found, tip, Z) == 1


def test_a_disc_lies_in_its_plane_and_a_cylinder_has_two_rims():
    found = planes(disc((0.0, 0.0, 2.0), (0.6, 0.0, 0.8), 0.3))
    assert len(found[0]) == 1
    assert holds(found, [0.0, 0.0, 2.0], [0.6, 0.0, 0.8]) == 1
    found = planes(cylinder((0.0, 0.0, 2.0), (0.0, 0.0, 3.0), 0.3))
    assert len(found[0]) == 2
    assert [holds(found, [0.0, 0.0, z], Z) for z in (2.0, 3.0)] == [1, 1]


def test_parallel_walls_touch_four_planes_and_crossing_ones_none():
    """Of radii 0.5 and 0.2, two metres apart: normals at the cosines 0.15 and 0.35 to the way."""
    tube = cylinder((0.0, 0.0, 1.0), (0.0, 0.0, 2.0), 0.5)
    found = planes(tube, cylinder((2.0, 0.0, 1.0), (2.0, 0.0, 2.0), 0.2))
    assert len(found[0]) == 2 + 4  # rims at the same heights share their planes
    for cosine in (0.15, 0.35):
        for sine in (1.0, -1.0):
            n = np.array([cosine, sine * np.sqrt(1.0 - cosine**2), 0.0])
            assert holds(found, 0.5 * n, n) == 1
    leaning = cylinder((2.0, 0.0, 1.2), (2.0, 1.0, 2.4), 0.2)
    assert len(planes(tube, leaning)[0]) == 2 + 2


@pytest.mark.parametrize(("beside", "count"), [(0.7, 2), (0.700001, 0)])
def test_walls_that_cross_touch_one_plane_where_they_touch_each_other(beside, count):
    """Axes along z and y, and as far apart as both radii; a plane on either side is found."""
    tube = cylinder((0.0, 0.0, 1.0), (0.0, 0.0, 2.0), 0.5)
    found = planes(tube, cylinder((beside, -2.0, 1.4), (beside, 3.0, 1.4), 0.2))
    upright = np.abs(found[1][:, 0]) > 1.0 - 1e-9
    assert np.sum(upright) == count // 2
    assert holds(found, [0.5, 0.0, 0.0], X) == count // 2


def test_two_planes_through_an_edge_along_a_wall_touch_it():
    """An upright edge a metre from an axis: normals at the cosine of the radius 0.6."""
    tube = cylinder((0.0, 0.0, 1.0), (0.0, 0.0, 2.0), 0.6)
    upright = triangle((1.0, 0.0, 1.1), (1.0, 0.0, 2.3), (1.7, 0.4, 5.0))
    found = planes(tube, upright)
    assert len(found[0]) == 2 + 1 + 2
    for s in (1.0, -1.0):
        assert holds(found, [1.0, 0.0, 0.0], [0.6, 0.8 * s, 0.0]) == 1


def test_a_plane_that_holds_many_edges_counts_once_and_one_beside_it_again():
    found = planes(rectangle((1.0, 0.0, 1.0), X, Y), rectangle((5.0, 0.3, 1.0), X + Y, X - Y))
    assert holds(found, [0.0, 0.0, 1.0], Z) == 1
    found = planes(rectangle((1.0, 0.0, 1.0), X, Y), rectangle((5.0, 0.3, 1.001), X + Y, X - Y))
    assert holds(found, [0.0, 0.0, 1.0], Z) == 1
    assert holds(found, [0.0, 0.0, 1.001], Z) == 1


def test_a_line_of_receivers_crosses_planes_within_its_reach():
    shapes = [disc((x, 0.0, 1.0), (0.8, 0.0, 0.6), 0.1) for x in (-0.5, 1.0, 2.0)]
    scene = Scene.of(*map(primitive, shapes))
    t, normal = planes_along(edges_of(scene, AT), rounds_of(scene), AT, X, 2.0)
    np.testing.assert_allclose(np.sort(t), [0.25, 1.75])  # x + 0.6 / 0.8 and x - ... of the floor
    np.testing.assert_allclose(np.abs(normal), [[0.8, 0.0, 0.6]] * 2, rtol=0.0, atol=1e-12)
