"""Views of space: projections against arithmetic, silhouettes against what defines them."""

import numpy as np
import pytest

from firstorder.imaging.camera import pinhole
from firstorder.plotting import (
    draw_silhouettes,
    draw_sky,
    draw_view,
    panels,
    project,
    silhouette_curves,
)
from firstorder.plotting.space import _sky_curves
from firstorder.space import Scene, box, plane, primitive, receiver, rectangle, sphere

CAMERA = pinhole((0.0, -5.0, 2.0), (0.0, 0.0, 0.5), gamma=2.0)


@pytest.fixture(scope="module")
def world():
    return Scene.of(
        primitive(plane((0, 0, 0), (0, 0, 1)), name="floor"),
        primitive(sphere((-0.8, 0.0, 0.6), 0.4), name="ball", albedo=0.5),
        primitive(box((0.3, -0.3, 0.0), (0.9, 0.3, 0.7)), name="box", albedo=0.8),
        primitive(rectangle((0.0, 0.0, 2.5), (0.0, 0.3, 0.0), (0.3, 0.0, 0.0)), emission=1.0),
    )


@pytest.fixture
def ax():
    return panels()[1][0, 0]


def test_what_lies_behind_the_camera_is_nowhere():
    assert np.all(np.isnan(project(CAMERA, [0.0, -6.0, 2.0])))
    np.testing.assert_allclose(project(CAMERA, [0.0, 0.0, 0.5]), [0.0, 0.0], rtol=0.0, atol=1e-12)


def test_silhouettes_of_a_ball_are_tangent(world):
    eye = np.array([1.0, 1.0, 0.0])
    numbers = [k for k, _ in silhouette_curves(world, eye)]
    (ball,), (cube,), (floor,) = (world.named(n) for n in ("ball", "box", "floor"))
    assert floor not in numbers
    assert numbers.count(ball) == 1
    assert numbers.count(cube) >= 4
    points = next(p for k, p in silhouette_curves(world, eye) if k == ball)
    normal = points - np.array([-0.8, 0.0, 0.6])
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 0.4)
    np.testing.assert_allclose(np.sum(normal * (points - eye), -1), 0.0, rtol=0.0, atol=1e-12)


def test_the_area_in_the_sky_is_what_a_ball_hides(world):
    """Nusselt: areas of the projected sky are shares of its irradiance, times pi."""
    scene = Scene.of(primitive(sphere((0.3, 0.2, 1.0), 0.5)))
    (curve,) = _sky_curves(scene, receiver((0.0, 0.0, 0.0)))
    x, y = curve.T
    area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    d2 = 1.13
    assert abs(area / (np.pi * 0.25 / d2**1.5) - 1.0) < 0.01  # a polygon of 64 corners


def test_a_view_fills_each_silhouette_once(world, ax):
    draw_view(ax, world, CAMERA, names=True)
    assert len(ax.patches) == 3
    assert {t.get_text() for t in ax.texts} == {"ball", "box"}
    before = len(ax.lines)
    draw_silhouettes(ax, world, (1.0, 1.0, 0.0), CAMERA)
    assert len(ax.lines) >= before + 6


def test_a_wall_without_end_is_drawn_where_it_is(ax):
    wall = Scene.of(primitive(plane((2.0, 1.0, 0.0), (3.0, 0.0, 0.0))))
    draw_view(ax, wall, pinhole((2.0, -4.0, 0.0), (2.0, 0.0, 0.0)))  # seen edge-on
    across = np.concatenate([line.get_xdata() for line in ax.lines])
    np.testing.assert_allclose(across[np.isfinite(across)], 0.0, rtol=0.0, atol=1e-12)
    assert np.isfinite(across).sum() > 1000


def test_a_box_is_one_polygon_of_six_corners(world, ax):
    draw_view(ax, world, CAMERA)
    (cube,) = world.named("box")
    pieces = [p for k, p in silhouette_curves(world, CAMERA.eye) if k == cube]
    corners = {tuple(np.round(p, 9)) for piece in pieces for p in piece}
    shown = [p.get_xy() for p in ax.patches]
    counts = sorted(len({tuple(np.round(q, 9)) for q in xy}) for xy in shown)
    assert counts[:2] == [4, len(corners)]


def test_a_sky_shows_its_rim(world, ax):
    draw_sky(ax, world, receiver((0.0, 0.5, 0.0)), "sky")
    assert len(ax.lines) > 5
    assert ax.get_title(loc="left") == "sky"


def test_where_a_point_is_drawn_does_not_depend_on_the_others():
    """A star far away does not push what is near behind the camera."""
    near, star = [0.3, 0.0, 0.5], [0.0, 1e9, 0.0]
    np.testing.assert_array_equal(project(CAMERA, [near, star])[0], project(CAMERA, near))
