"""Where lines run into round shapes: against sampled insides, and by chords done by hand."""

import numpy as np
import pytest

from firstorder.space import Cylinders, Ellipsoids, Receiver, Scene, cylinder, disc, primitive
from firstorder.space.discontinuities._contacts import round_contacts
from firstorder.space.discontinuities._edges import edges_of

ALONG = np.array([1.0, 0.0, 0.0])


def contacts(*shapes, start=(0.0, 0.0, 0.0), along=ALONG, reach=4.0):
    scene, at = Scene.of(*map(primitive, shapes)), Receiver.at(start)
    return round_contacts(scene, edges_of(scene, at), at, along, reach)


def skew(seed):
    return 0.6 * np.eye(3) + np.random.default_rng(seed).uniform(-0.3, 0.3, (3, 3))


INSIDE = {
    Ellipsoids: lambda q: np.sum(q * q, axis=-1) < 1.0,
    Cylinders: lambda q: (np.sum(q[..., :2] ** 2, axis=-1) < 1.0) & (np.abs(q[..., 2]) < 1.0),
}


@pytest.mark.parametrize("kind", INSIDE)
@pytest.mark.parametrize("seed", range(6))
def test_a_line_changes_sides_at_its_contacts(kind, seed):
    axes, center = skew(seed), np.array([2.0, 0.1, -0.05])
    start, along = np.array([0.1, -0.2, 0.3]), np.array([0.96, 0.1, -0.1])
    t = np.linspace(0.0, 4.0, 40001)
    q = np.linalg.solve(axes, (start + t[:, None] * along - center).T).T
    changes = t[1:][np.diff(INSIDE[kind](q))]
    assert len(changes) == 2
    found = contacts(kind(center, axes), start=start, along=along)
    np.testing.assert_allclose(found, changes, rtol=0.0, atol=1.01e-4)


def test_chords_of_a_ball_and_of_a_wall_are_those_of_a_circle():
    """Beside the middle by 0.6 of the radius: half a chord is 0.8 of it."""
    ball = Ellipsoids((2.0, 0.6, 0.0), np.eye(3))
    wall = cylinder((2.0, 0.3, -1.0), (2.0, 0.3, 1.0), 0.5)
    np.testing.assert_allclose(contacts(ball), [1.2, 2.8], rtol=1e-14)
    np.testing.assert_allclose(contacts(wall), [1.6, 2.4], rtol=1e-14)
    np.testing.assert_allclose(contacts(ball, wall), [1.2, 1.6, 2.4, 2.8], rtol=1e-14)


def test_only_what_is_before_the_start_and_within_reach_counts():
    ball = Ellipsoids((2.0, 0.6, 0.0), np.eye(3))
    np.testing.assert_allclose(contacts(ball, start=(2.0, 0.0, 0.0)), [0.8], rtol=1e-14)
    np.testing.assert_allclose(contacts(ball, reach=2.0), [1.2], rtol=1e-14)
    assert contacts(ball, start=(2.0, -0.5, 0.0)).size == 0


@pytest.mark.parametrize("beside", [1.01, 2.0])
def test_a_line_beside_a_body_does_not_meet_it(beside):
    assert contacts(Ellipsoids((2.0, beside, 0.0), np.eye(3))).size == 0
    assert contacts(cylinder((2.0, beside, -1.0), (2.0, beside, 1.0), 1.0)).size == 0


@pytest.mark.parametrize(("beside", "count"), [(0.0, 1), (0.39, 1), (0.41, 0)])
def test_a_line_meets_a_disc_within_its_radius(beside, count):
    """The plane `0.6 (x - 1.5) + 0.8 y = 0` at y = 0; the disc is measured in its plane."""
    middle = np.array([1.5, 0.0, 0.0]) + beside * np.array([-0.8, 0.6, 0.0])
    found = contacts(disc(middle, (0.6, 0.8, 0.0), 0.4), start=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(found, [1.5] * count, rtol=1e-12)


def test_a_line_meets_discs_across_it():
    found = contacts(
        disc((1.5, 0.1, 0.0), (1.0, 0.0, 0.0), 0.4), disc((2.5, 0.1, 0.0), (-3, 0, 0), 1.0)
    )
    np.testing.assert_allclose(found, [1.5, 2.5], rtol=1e-14)


def test_a_line_in_or_beside_the_plane_of_a_disc_does_not_cross_it():
    assert contacts(disc((1.5, 0.0, 0.0), (0.0, 0.0, 1.0), 0.4)).size == 0
    assert contacts(disc((1.5, 0.0, 0.2), (0.0, 0.0, 1.0), 0.4)).size == 0


def test_a_line_along_a_cylinder_meets_its_ends():
    tube = cylinder((1.0, 0.1, 0.0), (3.0, 0.1, 0.0), 0.5)
    np.testing.assert_allclose(contacts(tube), [1.0, 3.0], rtol=1e-14)
    assert contacts(tube, start=(0.0, 0.7, 0.0)).size == 0


@pytest.mark.parametrize(
    ("floor", "count"), [(0.0, 2), (-5e-9, 2), (5e-9, 2), (-1e-7, 2), (1e-7, 0), (-2.5, 0), (1, 0)]
)
def test_a_cylinder_that_stands_on_the_plane_is_run_into(floor, count):
    """Its base may be above the plane by the distance at which points are one, 1.5e-8 of 2 m."""
    found = contacts(cylinder((2.0, 0.3, floor), (2.0, 0.3, floor + 2.0), 0.5))
    np.testing.assert_allclose(found, [1.6, 2.4][:count], rtol=1e-14)


def test_how_near_points_are_one_is_metres_whatever_the_size_of_the_cylinder():
    """A cylinder of a decimetre, above the plane by less than rounding of a scene of 6 m."""
    floor, far = 5e-8, Ellipsoids((0.0, 9.0, 3.0), 3.0 * np.eye(3))
    small = cylinder((2.0, 0.0, floor), (2.0, 0.0, floor + 0.1), 0.05)
    np.testing.assert_allclose(contacts(small, far), [1.95, 2.05], rtol=1e-12)
    assert contacts(cylinder((2.0, 0.0, 1e-6), (2.0, 0.0, 0.1), 0.05), far).size == 0


def test_many_cylinders_of_one_kind_are_met_each_by_itself():
    first, *others = (
        cylinder((x, 0.0, z), (x, 0.0, 1.0), 0.25) for x, z in [(1, 0), (2, 0), (3, 0.1)]
    )
    many = Cylinders(
        *(
            np.concatenate([np.asarray(getattr(one, name)) for one in (first, *others)])
            for name in ("center", "axes")
        )
    )
    np.testing.assert_allclose(contacts(many), [0.75, 1.25, 1.75, 2.25], rtol=1e-14)
