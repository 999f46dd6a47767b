"""Points on surfaces: the density that is said is the density with which they are drawn."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import z_test_of
from firstorder.sampling import estimate
from firstorder.space import Scene, box, cylinder, disc, ellipsoid, primitive, rectangle, triangle
from firstorder.space.bounces import _surface_points
from firstorder.space.shapes.kinds import Boxes

COUNT = 20_000
SHEAR = np.array([[1.0, 0.3, 0.0], [0.0, 1.0, 0.2], [0.1, 0.0, 1.0]])


def spheroid_area(a, c):
    """Of semi-axes a, a and c > a, by its meridian."""
    e = np.sqrt(1.0 - (a / c) ** 2)
    return 2.0 * np.pi * a**2 * (1.0 + c / (a * e) * np.arcsin(e))


def sheared_box_area():
    u, v, w = 2.0 * SHEAR.T
    return 2.0 * sum(np.linalg.norm(np.cross(a, b)) for a, b in ((u, v), (v, w), (w, u)))


AREAS = {
    "ellipsoid": (ellipsoid((0, 0, 0), np.diag([0.5, 0.5, 2.0])), spheroid_area(0.5, 2.0)),
    "box": (box((0, 0, 0), (1, 2, 3)), 22.0),
    "sheared box": (Boxes(np.zeros(3), SHEAR), sheared_box_area()),
    "cylinder": (cylinder((0, 0, 0), (0, 0, 3), 0.5), 2 * np.pi * 0.5 * 3 + 2 * np.pi * 0.25),
    "disc": (disc((0, 0, 0), (0, 1, 1), 2.0), 4.0 * np.pi),
    "rectangle": (rectangle((0, 0, 0), (1, 0, 0), (0.5, 1, 0)), 4.0),
    "triangle": (triangle((0, 0, 0), (2, 0, 0), (0, 1, 0)), 1.0),
}


def areas(shape, key):
    """What each point says of the area, and where it lies."""
    scene = Scene.of(primitive(shape))
    u = jax.random.uniform(key, (COUNT, 2))
    point, normal = jax.vmap(lambda u: scene.ask(0, lambda s: _surface_points.point_on(s, u)))(u)
    density = _surface_points.area_density(scene, jnp.zeros(COUNT, int), normal)
    return 1.0 / density, point, normal


@pytest.mark.smoke
@pytest.mark.parametrize("name", AREAS)
def test_the_mean_of_one_over_the_density_is_the_area(name, key):
    shape, area = AREAS[name]
    found, _, _ = areas(shape, key)
    assert z_test_of(estimate(found), area, truth_error=1e-12 * area).passed


@pytest.mark.parametrize("name", AREAS)
def test_the_divergence_theorem_gives_the_volume(name, key):
    """Points and normals belong together: the flux of x / 3 through a closed surface."""
    shape, _ = AREAS[name]
    found, point, normal = areas(shape, key)
    volume = {"ellipsoid": 4 / 3 * np.pi * 0.5, "box": 6.0, "cylinder": 0.75 * np.pi,
              "sheared box": 8.0 * np.linalg.det(SHEAR)}.get(name, 0.0)  # fmt: skip
    flux = found * jnp.sum(point * normal, -1) / 3.0
    assert z_test_of(estimate(flux), volume, truth_error=1e-12).passed


def test_points_of_a_triangle_lie_evenly_in_it(key):
    """By its first moments and that of `x y`."""
    _, point, _ = areas(AREAS["triangle"][0], key)
    x, y, z = point.T
    assert jnp.all((x >= 0.0) & (y >= 0.0) & (x / 2.0 + y <= 1.0) & (z == 0.0))
    for found, mean in ((x, 2.0 / 3.0), (y, 1.0 / 3.0), (x * y, 1.0 / 6.0)):
        assert z_test_of(estimate(found), mean).passed


# Of closed shapes the integral of |x|^2 over the inside, and what is 1 on the surface alone.
CLOSED = {
    "ellipsoid": (
        4.0 / 3.0 * np.pi * 0.5 * (0.25 + 0.25 + 4.0) / 5.0,
        lambda x: np.linalg.norm(x / [0.5, 0.5, 2.0], axis=-1),
    ),
    "box": (
        6.0 * (1.0 + 4.0 + 9.0) / 3.0,
        lambda x: np.max(np.abs(x / [0.5, 1.0, 1.5] - 1.0), axis=-1),
    ),
    "sheared box": (
        8.0 * np.linalg.det(SHEAR) * np.sum(SHEAR**2) / 3.0,
        lambda x: np.max(np.abs(np.linalg.solve(SHEAR, x.T)), axis=0),
    ),
    "cylinder": (
        np.pi * 0.25 * 3.0 * (0.5 * 0.25 + 9.0 / 3.0),
        lambda x: np.maximum(2.0 * np.hypot(x[:, 0], x[:, 1]), np.abs(x[:, 2] / 1.5 - 1.0)),
    ),
}


@pytest.mark.parametrize("name", CLOSED)
def test_points_lie_everywhere_on_a_closed_surface_and_nowhere_else(name, key):
    """The flux of |x|^2 x / 5 is the integral of |x|^2 over the inside."""
    inside, surface = CLOSED[name]
    found, point, normal = areas(AREAS[name][0], key)
    np.testing.assert_allclose(surface(np.asarray(point)), 1.0, rtol=0.0, atol=1e-12)
    flux = found * jnp.sum(point**2, -1) * jnp.sum(point * normal, -1) / 5.0
    assert z_test_of(estimate(flux), inside, truth_error=1e-12).passed


def test_points_of_the_unit_cube_alone_are_noticed(key, monkeypatch):
    """Faces of a box drawn alike by number, as if the density were even by area."""
    monkeypatch.setattr(
        _surface_points, "area_density", lambda scene, index, normal: jnp.full(COUNT, 1.0 / 24.0)
    )
    shape, area = AREAS["box"]
    assert not z_test_of(estimate(areas(shape, key)[0]), area, truth_error=1e-12).passed
