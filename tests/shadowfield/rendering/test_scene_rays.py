"""Shadow rays through analytic scenes against the equations of a ball, and against contours."""

import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL
from firstorder.shadowfield import lamp_frame, own_visibility, scene_blockers
from firstorder.shadowfield.rendering import scene_rays
from firstorder.space import Scene, irradiance, plane, primitive, receiver, rectangle, sphere
from tests import drawn_lamp
from tests.samplers import uniform_p_value

FLOOR = primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor")
BALL = primitive(sphere((0.1, 0.0, 1.0), 0.3), name="ball")
CENTER, U, V = (0.0, 0.0, 2.0), (0.0, 0.4, 0.0), (0.4, 0.0, 0.0)
LAMP = lamp_frame(CENTER, U, V)


def rays(count=3000, seed=0):
    rng = np.random.default_rng(seed)
    a = np.append(rng.uniform(-1.0, 1.0, (count, 2)), np.zeros((count, 1)), 1)
    y = np.append(rng.uniform(-0.4, 0.4, (count, 2)), np.zeros((count, 1)), 1)
    return a, LAMP.world(y)


def test_shares_of_the_way_are_those_at_which_rays_enter_and_leave_a_ball():
    a, b = rays()
    scene = Scene.of(FLOOR, BALL)
    first, last = scene_blockers(scene, scene.named("floor")[0])(a, b)
    way, out = a - b, b - np.array([0.1, 0.0, 1.0])
    square, half = np.sum(way**2, 1), np.sum(way * out, 1)
    root = half**2 - square * (np.sum(out**2, 1) - 0.09)
    hit = root > 0.0
    assert 0.1 < np.mean(hit) < 0.9
    np.testing.assert_array_equal(np.isfinite(first), hit)
    np.testing.assert_array_equal(np.isfinite(last), hit)
    size = np.sqrt(root[hit])
    np.testing.assert_allclose(first[hit], (-half[hit] - size) / square[hit], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(last[hit], (-half[hit] + size) / square[hit], rtol=0.0, atol=1e-9)
    assert np.all(np.isposinf(first[~hit]))
    assert np.all(np.isneginf(last[~hit]))
    # Of two things the one nearer to the receiver is last.
    both = Scene.of(FLOOR, BALL, primitive(sphere((0.1, 0.0, 0.4), 0.1)))
    nearer = scene_blockers(both, both.named("floor")[0])(a, b)
    assert np.all(nearer[1] >= last)
    assert np.any(nearer[1] > last)


@pytest.mark.parametrize("strata", [4, 16])
def test_own_rays_see_the_share_that_contours_do(strata):
    """Far below a small lamp all of it shines alike, and the share is that of the irradiance.

    The limb crosses 1.9 strata for each along an edge of the lamp (1.2 m of it, in any direction),
    and a stratum that it cuts in two parts of any size has a variance of 1/6 in the mean.
    """
    points = np.array([[x, 0.3, -20.0] for x in np.linspace(-12.0, 12.0, 9)])
    big = primitive(sphere((0.3, 0.1, 1.5), 0.35))
    lamp = primitive(rectangle(CENTER, U, V), emission=1.0)
    found = own_visibility(Scene.of(big), LAMP, points, np.full(9, -1), strata, 3)
    share = [
        irradiance(Scene.of(big, lamp), receiver(x)) / irradiance(Scene.of(lamp), receiver(x))
        for x in points
    ]
    assert np.ptp(share) > 0.2
    sigma = np.sqrt(1.9 * strata / 6.0) / strata**2
    np.testing.assert_allclose(found, share, rtol=0.0, atol=4.0 * sigma)
    assert np.sqrt(np.mean((found - np.array(share)) ** 2)) < 1.5 * sigma


def test_none_and_wrong_numbers():
    scene = Scene.of(BALL)
    assert own_visibility(scene, LAMP, np.zeros((0, 3)), np.zeros(0, int), 4).shape == (0,)
    with pytest.raises(ValueError, match="strata"):
        own_visibility(scene, LAMP, np.zeros((1, 3)), np.zeros(1, int), 0)
    either = (ValueError, TypeError)
    with pytest.raises(either, match=r"`on` must be the number of a shape, 0 to 0, but is 7\."):
        own_visibility(scene, LAMP, np.zeros((2, 3)), np.array([-1, 7]), 2)
    with pytest.raises(either, match=r"`on` must have shape \(2,\)|type hint"):
        own_visibility(scene, LAMP, np.zeros((2, 3)), np.zeros(3, int), 2)
    with pytest.raises(either, match=r"`on` must be a shape's number, an integer|type hint"):
        own_visibility(scene, LAMP, np.zeros((1, 3)), np.zeros(1), 2)
    with pytest.raises(either, match="`on` must be the number of a shape, 0 to 0, but is 1"):
        scene_blockers(scene, on=1)


def test_own_rays_come_evenly(monkeypatch):
    """One in each stratum of the lamp, anywhere in it."""
    seen = []

    def recorded(function, rays, block):
        seen.append(LAMP.local(rays[1])[:, :2] / LAMP.half)
        return np.zeros(len(rays[1]), bool)

    monkeypatch.setattr(scene_rays, "host_blocks", recorded)
    points, strata = np.zeros((4000, 3)), 2
    own_visibility(Scene.of(BALL), LAMP, points, np.full(4000, -1), strata)
    place = 0.5 * (seen[0] + 1.0) * strata
    cell = place.astype(int)
    number = (cell @ (strata, 1)).reshape(4000, strata**2)
    np.testing.assert_array_equal(number, np.tile(np.arange(strata**2), (4000, 1)))
    assert uniform_p_value(place - cell) > LEVEL
    assert uniform_p_value((place - cell) ** 1.1) < LEVEL


def test_points_that_no_ray_of_the_lamp_can_reach_have_no_share():
    """They once saw all of it: pixels of the sky, and what stands behind the lamp."""
    points = np.array([[np.nan] * 3, [0.0, 0.0, 9.0], [0.0, 0.0, 0.0]])
    found = own_visibility(Scene.of(BALL), LAMP, points, np.full(3, -1), 4)
    np.testing.assert_array_equal(np.isfinite(found), [False, False, True])


def test_blockers_are_those_of_a_scene():
    with pytest.raises(TypeError, match=r"`scene` must be a `Scene` of space|violates type hint"):
        scene_blockers(None)  # pyright: ignore[reportArgumentType]


def test_what_the_lamp_is_drawn_on_is_no_blocker():
    ceiling = primitive(drawn_lamp.board(1.0, 3.0))
    card = primitive(drawn_lamp.board(0.4, 0.5))
    n = np.random.default_rng(0).random((400, 2))
    a = np.insert(0.2 * n - 0.1, 2, 0.0, 1) @ drawn_lamp.Q.T
    b = np.insert(0.4 * n - 0.2, 2, 1.0, 1) @ drawn_lamp.Q.T
    for share in scene_blockers(Scene.of(ceiling, card))(a, b):
        np.testing.assert_allclose(share, 0.6)
    first, last = scene_blockers(Scene.of(ceiling))(a, b)
    assert np.all(np.isposinf(first))
    assert np.all(np.isneginf(last))
