"""Tubes along knots: closed, as large as they should be, without twist or seam."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from firstorder.models.knots import torus_knot
from tests.models.test_primitives import check_closed, volume


@pytest.mark.parametrize(
    ("piece", "characteristic"),
    [
        (lambda: torus_knot(2, 3, rings=60, sides=7), 0),
        (lambda: torus_knot(3, 5, 0.09, rings=200, sides=5), 0),
    ],
)
def test_they_are_closed_and_face_outwards(piece, characteristic):
    check_closed(piece(), characteristic)


def test_volume_is_that_of_pappus():
    """The area of the section times the way of its middle."""
    t = np.linspace(0.0, 2.0 * np.pi, 20001)
    far = 2.0 + np.cos(3 * t)
    line = np.stack([far * np.cos(2 * t), far * np.sin(2 * t), np.sin(3 * t)], -1) / 3.0
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    tube = torus_knot(2, 3, 0.05, rings=600, sides=24)
    section = 0.5 * 24 * np.sin(2.0 * np.pi / 24) * 0.05**2
    assert volume(tube) == pytest.approx(section * length, rel=2e-3)


def test_a_knot_does_not_twist():
    """A vector across the tube turns by what closing it takes, evenly from ring to ring."""
    rings, sides = 400, 8
    v = np.asarray(torus_knot(3, 2, 0.1, rings, sides).vertices, float).reshape(rings, sides, 3)
    middle = v.mean(1)
    along = np.roll(middle, -1, 0) - np.roll(middle, 1, 0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    across = (v[:, 0] - middle) / np.linalg.norm(v[:, 0] - middle, axis=1)[:, None]
    step = np.roll(across, -1, 0) - across
    spin = np.sum(step * np.cross(along, across), 1)
    assert np.max(abs(spin)) <= np.pi / rings + 1e-3  # at most half a turn over all of it
    between = 0.5 * (np.roll(spin, 1) + np.roll(spin, -1))
    assert np.max(abs(spin - between)) < 1e-5  # also where the last ring meets the first


def test_where_a_knots_vertices_stand_about_it_is_known_to_fourth_order():
    """Among ever more rings a vector across comes to be one that turns about the line evenly."""

    def rings(count):
        v = np.asarray(torus_knot(3, 2, 0.1, count, 8).vertices).reshape(count, 8, 3)
        return v - v.mean(1)[:, None]

    fine, errors = rings(1600), []
    for count in (50, 100):
        first, true = rings(count)[:, 0], fine[:: 1600 // count]
        # The vertices 0 and 2 of a ring are a quarter turn apart.
        off = np.arctan2(*(np.sum(true[:, k] * first, 1) for k in (2, 0)))
        errors.append(np.ptp(off))
    assert errors[0] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(2.0**4, rel=0.15)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: torus_knot(2, 4), "`p` and `q` must have no divisor in common"),
        (lambda: torus_knot(radius=0.4), "`radius` must be below"),
        (lambda: torus_knot(rings=4), "`rings` and `sides` must be at least"),
    ],
)
def test_what_makes_no_piece_is_refused(call, sentence):
    with pytest.raises(ValueError, match=r"^Arguments? ") as caught:
        call()
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("p", "q", "radius", "rings"),
    [(11, 7, 0.05, 50), (5, 8, 0.05, 20), (2, 15, 0.08, 50), (7, 11, 0.0812, 400)],
)
def test_a_tube_whose_line_passes_itself_between_two_rings_is_refused(p, q, radius, rings):
    t = 2.0 * np.pi * np.arange(rings) / rings
    far = 2.0 + np.cos(q * t)
    corners = np.stack([far * np.cos(p * t), far * np.sin(p * t), np.sin(q * t)], -1) / 3.0
    share = np.linspace(0.0, 1.0, 6000 // rings, endpoint=False)[:, None]
    points = corners[:, None] * (1.0 - share) + np.roll(corners, -1, 0)[:, None] * share
    points = points.reshape(-1, 3)
    arc = np.cumsum(np.linalg.norm(np.roll(points, -1, 0) - points, axis=1))
    pairs = cKDTree(points).query_pairs(1.99 * radius, output_type="ndarray")
    apart = abs(arc[pairs[:, 0]] - arc[pairs[:, 1]])
    assert np.any(np.minimum(apart, arc[-1] - apart) > 3.0 * np.pi * radius)
    with pytest.raises(ValueError, match=r"^Argument `radius` must be below"):
        torus_knot(p, q, radius, rings)
