"""Edges from traced rays: the point of contact, not the first hit; few rays more."""

import jax
import numpy as np
import pytest

from firstorder.space import Scene, primitive, receiver, rectangle, sphere
from firstorder.space.azimuthal import _from_rays as from_rays
from firstorder.space.azimuthal._from_rays import traced_edges

CENTER, RADIUS = np.array([0.9, 0.3, 1.4]), 0.5


def traced():
    scene = Scene.of(primitive(sphere(CENTER, RADIUS)))
    return jax.jit(lambda: traced_edges(scene, receiver((0.0, 0.0, 0.0)), azimuths=100, rays=100))()


def ball_ends(phi, x, y):
    """Where slices of azimuth phi meet the ball, by the circle in each; NaN elsewhere."""
    gap = CENTER - np.array([x, y, 0.0])
    u = gap[0] * np.cos(phi) + gap[1] * np.sin(phi)
    square = RADIUS**2 - (gap[1] * np.cos(phi) - gap[0] * np.sin(phi)) ** 2
    half = np.arcsin(np.sqrt(np.where(square > 0.0, square, np.nan)) / np.hypot(u, gap[2]))
    middle = np.arctan2(u, gap[2])
    return np.stack([middle - half, middle + half], 1)


def rates(ends, phi, h=1e-6):
    """Derivatives of edge angles along x and y."""
    return [(ends(phi, *(h * e)) - ends(phi, *(-h * e))) / (2 * h) for e in np.eye(2)]


@pytest.fixture(scope="module")
def found():
    return traced()


def test_the_touched_point_of_a_ball(found):
    shown = np.asarray(found.sign != 0)
    assert np.all(found.smooth[shown] == 1)
    D = np.sqrt(CENTER @ CENTER - RADIUS**2)  # the same for every ray that touches
    np.testing.assert_allclose(np.asarray(found.distance)[shown], D, rtol=1e-3)
    phi = np.broadcast_to(np.asarray(found.phi)[:, None], shown.shape)[shown]
    u = CENTER[0] * np.cos(phi) + CENTER[1] * np.sin(phi)
    v = CENTER[1] * np.cos(phi) - CENTER[0] * np.sin(phi)
    half = np.arcsin(np.sqrt(RADIUS**2 - v**2) / np.hypot(u, CENTER[2]))
    sign = np.asarray(found.sign)[shown]
    truth = np.arctan2(u, CENTER[2]) - sign * half
    np.testing.assert_allclose(np.asarray(found.alpha)[shown], truth, atol=1e-4)


def test_it_takes_few_rays_more(found):
    assert found.extra <= 0.3 * 100 * 100


def test_the_rates_of_edges_and_their_sum(found):
    """Against each slice's circle; the error of an angle, 1e-5, counts by the chord's width."""
    phi, sign = np.asarray(found.phi), np.asarray(found.sign)[:, :2]
    low, high = ball_ends(phi, 0.0, 0.0).T
    assert np.array_equal(sign[:, 0] != 0.0, np.isfinite(low))
    x, y = rates(ball_ends, phi)
    across = -np.sin(phi)[:, None] * x + np.cos(phi)[:, None] * y
    error = np.abs(np.asarray(found.alpha_v)[:, :2] / across - 1.0)
    assert np.nanmax(error * (high - low)[:, None]) < 2e-5
    weight = sign * np.abs(np.sin(ball_ends(phi, 0.0, 0.0))) * np.pi / phi.size
    truth = [np.nansum(weight * x), np.nansum(weight * y)]
    np.testing.assert_allclose(found.gradient(), truth, atol=2e-5)


def plate_ends(phi, x, y):
    """Where slices meet the rectangle overhead, [-0.6, 1] x [-0.5, 0.7] at the height of 1 m."""
    c, s = np.cos(phi), np.sin(phi)
    ways = [
        np.minimum((np.where(e * c > 0, 1.0, -0.6) - x) / c * e,
                   (np.where(e * s > 0, 0.7, -0.5) - y) / s * e)
        for e in (-1.0, 1.0)
    ]  # fmt: skip
    return np.stack([-np.arctan(ways[0]), np.arctan(ways[1])], 1)


def test_edges_that_are_corners():
    """Found where they were bisected; how they run is seen from the slices beside them."""
    scene = Scene.of(primitive(rectangle((0.2, 0.1, 1.0), (0.8, 0.0, 0.0), (0.0, 0.6, 0.0))))
    found = jax.jit(
        lambda: traced_edges(scene, receiver((0.0, 0.0, 0.0)), azimuths=100, rays=100)
    )()
    phi = np.asarray(found.phi)
    assert np.all(found.smooth == 0.0)
    truth = plate_ends(phi, 0.0, 0.0)
    np.testing.assert_allclose(found.alpha[:, :2], truth, atol=np.pi / 100 / 2**9)
    x, y = rates(plate_ends, phi)
    across = -np.sin(phi)[:, None] * x + np.cos(phi)[:, None] * y
    error = np.abs(np.asarray(found.alpha_v)[:, :2] - across)
    # All but the slices on either side of the four corners.
    assert np.sort(error.ravel())[-9] < 0.01


def _first_hits(edges, inside, t, normal, w, right=from_rays._touched):
    alpha, _, _, smooth = right(edges, inside, t, normal, w)
    return alpha, t[:, 0], normal[:, 0], smooth


def test_the_first_hit_is_not_the_touched_point(monkeypatch):
    monkeypatch.setattr(from_rays, "_touched", _first_hits)
    wrong = traced()
    D = np.sqrt(CENTER @ CENTER - RADIUS**2)
    error = np.abs(np.asarray(wrong.distance) - D)[np.asarray(wrong.sign != 0)]
    assert np.max(error) > 2e-3 * D
