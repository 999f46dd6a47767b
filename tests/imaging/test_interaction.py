"""The surface point of a pixel, from both sides, against an ellipsoid and a triangle by hand."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import _interaction as interaction
from firstorder.imaging._reflection import surface_point
from firstorder.imaging.camera import pinhole
from firstorder.imaging.facets import mesh_facets
from firstorder.imaging.surface_maps import SurfaceMaps, UVMaps
from firstorder.space import Scene, ellipsoid, primitive, rectangle
from firstorder.space.meshes.triangle_mesh import mesh
from firstorder.space.primitives import Material

shape_seen = eqx.filter_jit(interaction.surface_interaction)
face_seen = eqx.filter_jit(interaction.facet_interaction)

# The second of two ellipsoids, `x^2 / 4 + y^2 + z^2 / 0.25 = 1` about (0, 0, 1).
SEMI, MIDDLE = np.array([2.0, 1.0, 0.5]), np.array([0.0, 0.0, 1.0])
SCENE = Scene.of(
    primitive(ellipsoid((9.0, 9.0, 9.0), np.eye(3)), albedo=0.9),
    primitive(ellipsoid(MIDDLE, np.diag(SEMI)), albedo=(0.3, 0.4), specular=0.2, exponent=7.0),
    primitive(rectangle((0, 0, -3), (1, 0, 0), (0, 1, 0)), albedo=0.1),
)
INDEX = jnp.array(1)
OUT = pinhole((0.5, -3.0, 2.0), (0.2, 0.1, 1.0), gamma=2.0)
IN = pinhole((0.5, 0.1, 1.05), (-1.0, 0.4, 1.1), gamma=2.0)
P = np.array([0.05, -0.03])


def ray(camera, p):
    d = np.asarray(camera.axes) @ np.append(p, -2.0)
    return np.asarray(camera.eye), d / np.linalg.norm(d)


def met(camera, p):
    """Distance, place and outward normal, from the quadratic."""
    eye, d = ray(camera, p)
    w, u = (eye - MIDDLE) / SEMI, d / SEMI
    a, b, c = u @ u, w @ u, w @ w - 1.0
    root = np.sqrt(b * b - a * c)
    t = (-b - root) / a if c > 0.0 else (-b + root) / a
    return t, eye + t * d, normal(eye + t * d)


def normal(x):
    n = (x - MIDDLE) / SEMI**2
    return n / np.linalg.norm(n)


def bent(x, T, side):
    """The shape operator `-T^T dn T` by differences."""
    h = 1e-6
    turn = np.stack([(normal(x + h * t) - normal(x - h * t)) / (2.0 * h) for t in T.T], -1)
    return -T.T @ (side * turn)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_shape_is_seen_from_the_side_of_the_eye(side):
    camera = OUT if side > 0.0 else IN
    at = shape_seen(SCENE, camera, jnp.asarray(P), INDEX)
    t, x, n = met(camera, P)
    np.testing.assert_allclose(at.view.distance, t, rtol=1e-12)
    np.testing.assert_allclose(at.point.position, x, rtol=1e-12)
    np.testing.assert_allclose(at.point.normal, side * n, rtol=1e-12)
    np.testing.assert_allclose(at.point.base_normal, side * n, rtol=1e-12)
    np.testing.assert_allclose(at.view.to_eye, -ray(camera, P)[1], rtol=1e-12)
    T = np.asarray(at.point.tangents)
    S = bent(x, T, side)
    np.testing.assert_allclose(at.S, S, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(at.point.turning, -T @ S, rtol=0.0, atol=1e-8)
    h = 1e-6
    moved = [(met(camera, P + h * e)[1] - met(camera, P - h * e)[1]) / (2.0 * h) for e in np.eye(2)]
    np.testing.assert_allclose(at.view.position_D_p, np.stack(moved, -1), rtol=1e-6)
    assert at.lobe.albedo == (0.3 if side > 0.0 else 0.4)
    assert (float(at.lobe.specular), float(at.lobe.exponent)) == (0.2, 7.0)
    np.testing.assert_array_equal(at.lobe.slope, 0.0)


def test_an_exponent_of_zero_has_a_derivative():
    at = shape_seen(
        SCENE, pinhole((0.1, 0.2, 1.0), (0, 0, -3), (0, 1, 0)), jnp.zeros(2), jnp.array(2)
    )
    assert at.lobe.exponent == 1e-6


# --- faces ---------------------------------------------------------------------------------------

CORNERS = np.array([(0.1, 0.0, 0.2), (1.2, 0.1, 0.0), (0.2, 0.9, 0.4)])
NORMALS = np.array([(-0.2, 0.1, 1.0), (0.4, 0.0, 1.0), (0.1, 0.5, 0.8)])
NORMALS = NORMALS / np.linalg.norm(NORMALS, axis=1)[:, None]
UV = np.array([(0.0, 0.0), (1.0, 0.2), (0.1, 1.0)])
AWAY = CORNERS + np.array([0.0, 0.0, 9.0])
KNOWN = mesh_facets(
    mesh(np.vstack([AWAY, CORNERS]), [[0, 1, 2], [3, 4, 5]]),
    np.vstack([np.tile((0.0, 0.0, 1.0), (3, 1)), NORMALS]), [0, 1], np.stack([0.0 * UV, UV]),
)  # fmt: skip
FACE = jnp.array(1)
MATTER = Material(
    jnp.zeros((2, 2)), jnp.array([(0.9, 0.8), (0.3, 0.4)]), jnp.array([0.7, 0.2]),
    jnp.array([5.0, 0.0]),
)  # fmt: skip
ABOVE = pinhole((0.4, -1.0, 2.5), (0.5, 0.3, 0.2), gamma=2.0)
BELOW = pinhole((0.4, -1.0, -2.5), (0.5, 0.3, 0.2), gamma=2.0)


def face_met(camera, p):
    """Distance, place, interpolated normal and (u, v), by solving for the weights."""
    eye, d = ray(camera, p)
    up = np.cross(CORNERS[1] - CORNERS[0], CORNERS[2] - CORNERS[0])
    t = (CORNERS[0] - eye) @ up / (d @ up)
    x = eye + t * d
    return t, x, *leaning(x), up / np.linalg.norm(up)


def leaning(x):
    w = np.linalg.lstsq(np.vstack([CORNERS.T, np.ones(3)]), np.append(x, 1.0), rcond=None)[0]
    n = w @ NORMALS
    return n / np.linalg.norm(n), w @ UV


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_face_is_seen_from_the_side_of_the_eye(side):
    camera = ABOVE if side > 0.0 else BELOW
    at = face_seen(KNOWN, MATTER, camera, jnp.asarray(P), FACE)
    t, x, n, _, up = face_met(camera, P)
    np.testing.assert_allclose(at.view.distance, t, rtol=1e-12)
    np.testing.assert_allclose(at.point.position, x, rtol=1e-12)
    np.testing.assert_allclose(at.point.normal, side * n, rtol=1e-12)
    np.testing.assert_allclose(at.point.base_normal, side * up, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(at.view.to_eye, -ray(camera, P)[1], rtol=1e-12)
    T, h = np.asarray(at.point.tangents), 1e-6
    turn = np.stack([leaning(x + h * a)[0] - leaning(x - h * a)[0] for a in T.T], -1) / (2.0 * h)
    np.testing.assert_allclose(at.point.turning, side * turn, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(at.S, -T.T @ (side * turn), rtol=0.0, atol=1e-8)
    moved = [face_met(camera, P + h * e)[1] - face_met(camera, P - h * e)[1] for e in np.eye(2)]
    np.testing.assert_allclose(at.view.position_D_p, np.stack(moved, -1) / (2.0 * h), rtol=1e-6)
    assert at.lobe.albedo == (0.3 if side > 0.0 else 0.4)
    assert (float(at.lobe.specular), float(at.lobe.exponent)) == (0.2, 1e-6)


def test_a_face_seen_edge_on_is_finite():
    d = CORNERS[1] - CORNERS[0]
    camera = pinhole(CORNERS[0] - 2.0 * d, CORNERS[0], gamma=2.0)
    at = face_seen(KNOWN, MATTER, camera, jnp.zeros(2), FACE)
    assert np.all(np.isfinite(at.point.position))


# --- surface maps --------------------------------------------------------------------------------

RISE, TILT = np.array([0.3, -0.2, 0.1]), np.array([-0.1, 0.25, 0.05])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_bump_is_a_dip_from_behind(side):
    """Of a flat surface whose front is up: normals of both sides are opposite."""
    axes = np.diag([1.0, side, side])
    point = surface_point(jnp.array([0.2, 0.3, 0.4]), axes, np.zeros((2, 2)))
    plain = eqx.tree_at(
        lambda a: (a.point, a.S),
        shape_seen(SCENE, OUT, jnp.asarray(P), INDEX),
        (point, jnp.zeros((2, 2))),
    )
    maps = SurfaceMaps(lambda i, x: x @ RISE * i, lambda i, x: jnp.asarray(TILT) + 0.0 * x)
    at = interaction.apply_surface_maps(
        plain, jnp.array(1), jnp.array(side), maps, lambda x: x[:2], lambda x: jnp.eye(3)[2]
    )
    n = np.array([0.0, 0.0, 1.0])
    for a in (RISE, TILT):  # one on the other
        n = n - a + n * (n @ a)
        n = n / np.linalg.norm(n)
    np.testing.assert_allclose(at.point.normal, side * n, rtol=1e-12)
    np.testing.assert_array_equal(at.S, 0.0)


def test_textures_multiply_and_have_slopes_by_the_rule_of_products():
    def solid(index, x):
        return 0.5 + 0.1 * index * jnp.sin(3.0 * x[0] + x[2])

    def picture(index, uv):
        return 0.4 + 0.2 * uv[0] * uv[1] * index

    maps = SurfaceMaps(albedo=solid, wrapped=UVMaps(albedo=picture))
    at = shape_seen(SCENE, OUT, jnp.asarray(P), INDEX, SurfaceMaps(albedo=solid))
    _, x, _ = met(OUT, P)
    share = 0.5 + 0.1 * np.sin(3.0 * x[0] + x[2])
    slope = 0.1 * np.cos(3.0 * x[0] + x[2]) * np.array([3.0, 0.0, 1.0])
    np.testing.assert_allclose(at.lobe.albedo, 0.3 * share, rtol=1e-12)
    np.testing.assert_allclose(at.lobe.slope, 0.3 * slope, rtol=1e-12)
    both = face_seen(KNOWN, MATTER, ABOVE, jnp.asarray(P), FACE, maps)
    x = face_met(ABOVE, P)[1]

    def factor(x):
        (u, v), waves = leaning(x)[1], np.sin(3.0 * x[0] + x[2])
        return (0.5 + 0.1 * waves) * (0.4 + 0.2 * u * v)

    np.testing.assert_allclose(both.lobe.albedo, 0.3 * factor(x), rtol=1e-12)
    h = 1e-6
    T = np.asarray(both.point.tangents)
    along = [(factor(x + h * t) - factor(x - h * t)) / (2.0 * h) for t in T.T]
    np.testing.assert_allclose(both.lobe.slope @ T, 0.3 * np.array(along), rtol=1e-7)


def test_pictures_of_shapes_are_asked_at_their_own_place_and_normal():
    """A normal map that leans along u alone, on a rectangle: to the east."""
    wall = Scene.of(
        primitive(ellipsoid((9.0, 9.0, 9.0), np.eye(3))),
        primitive(rectangle((0, 0, 0), (2, 0, 0), (0, 1, 0)), albedo=0.5),
    )
    camera = pinhole((0.5, 0.2, 4.0), (0.5, 0.2, 0.0), (0.0, 1.0, 0.0))
    wrapped = UVMaps(
        normals=lambda i, uv: jnp.array([0.6, 0.0, 0.8]), albedo=lambda i, uv: 0.1 + 0.5 * uv[0]
    )
    at = shape_seen(wall, camera, jnp.zeros(2), INDEX, SurfaceMaps(wrapped=wrapped))
    np.testing.assert_allclose(at.point.normal, [0.6, 0.0, 0.8], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(at.lobe.albedo, 0.5 * (0.1 + 0.5 * 0.625), rtol=1e-12)
    np.testing.assert_allclose(at.lobe.slope, [0.5 * 0.5 / 4.0, 0.0, 0.0], rtol=0.0, atol=1e-12)
