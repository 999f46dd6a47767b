"""Points of meshes: the interpolated normal's turning, and pixels against differences of pixels."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import fitted_order
from firstorder.imaging import Lamp
from firstorder.imaging._interaction import facet_interaction
from firstorder.imaging._point_shading import shade_point
from firstorder.imaging.camera import Pinhole, pinhole
from firstorder.imaging.facets import Facets, mesh_facets
from firstorder.imaging.shading import SurfaceMaps
from firstorder.space import primitive, sphere
from firstorder.space.meshes.triangle_mesh import mesh, vertex_normals
from tests.precision import as_dtype

CORNERS = np.array([(0.1, 0.0, 0.2), (1.2, 0.1, 0.0), (0.2, 0.9, 0.4)])
NORMALS = np.array([(-0.2, 0.1, 1.0), (0.4, 0.0, 1.0), (0.1, 0.5, 0.8)])
NORMALS = NORMALS / np.linalg.norm(NORMALS, axis=1)[:, None]
ONE = mesh(CORNERS, [[0, 1, 2]])
CAMERA = pinhole((0.4, -2.0, 2.5), (0.5, 0.3, 0.2), gamma=2.0)
LAMP = Lamp((0.0, 0.5, 2.0), (0.3, 0.0, 0.0), (0.0, -0.3, 0.0), 8.0, 3)
MATTER = primitive(sphere((0, 0, 0), 1.0), albedo=0.6, specular=0.3, exponent=20.0).material


def normal_at(x):
    """Interpolated over the triangle by solving for the weights."""
    A = np.vstack([CORNERS.T, np.ones(3)])
    w = np.linalg.lstsq(A, np.append(x, 1.0), rcond=None)[0]
    n = w @ NORMALS
    return n / np.linalg.norm(n)


@pytest.mark.smoke
def test_the_normal_turns_as_differences_say():
    x = CORNERS.mean(0)
    at = mesh_facets(ONE, NORMALS).point(jnp.array(0), jnp.asarray(x))
    np.testing.assert_allclose(at.normal, normal_at(x), rtol=1e-12)
    for k in (0, 1):
        t, h = np.asarray(at.tangents[:, k]), 1e-5
        slope = (normal_at(x + h * t) - normal_at(x - h * t)) / (2 * h)
        np.testing.assert_allclose(at.turning[:, k], slope, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("left_out", [False, True])
def test_faces_without_a_picture_have_zeros(left_out):
    known = mesh_facets(ONE, NORMALS)
    known = Facets(known.corners, known.normals, known.part) if left_out else known
    at = known.uv_at(jnp.array(0), jnp.asarray(CORNERS.mean(0)))
    np.testing.assert_array_equal(at, np.zeros(2))


def test_each_face_knows_its_corners_normals_primitive_and_picture():
    faces = [[0, 1, 2], [2, 1, 3], [3, 1, 0]]
    four = mesh(np.vstack([CORNERS, (1.0, 1.0, -0.3)]), faces)
    normals = np.vstack([NORMALS, (0.6, 0.0, 0.8)])
    uv = np.random.default_rng(0).uniform(size=(3, 3, 2))
    known = mesh_facets(four, normals, [4, 0, 2], uv)
    np.testing.assert_array_equal(known.part, [4, 0, 2])
    np.testing.assert_array_equal(known.normals, normals[faces])
    np.testing.assert_array_equal(known.corners, np.asarray(four.vertices)[faces])
    weights = np.array([0.5, 0.2, 0.3])
    for face in range(3):
        at = known.uv_at(jnp.array(face), jnp.asarray(weights @ known.corners[face]))
        np.testing.assert_allclose(at, weights @ uv[face], rtol=1e-12)
    np.testing.assert_array_equal(mesh_facets(four, normals).part, [0, 0, 0])


def pixel(p, finish=None, face=0, known=None):
    known = mesh_facets(ONE, NORMALS) if known is None else known
    at = facet_interaction(known, MATTER, CAMERA, p, jnp.array(face), finish)
    return shade_point(at, [LAMP])


def texture(index, x):
    return 0.6 + 0.3 * jnp.sin(5.0 * x[0]) * jnp.cos(4.0 * x[1])


def height(index, x):
    return 0.01 * jnp.sin(9.0 * x[0] + x[1]) * jnp.sin(8.0 * x[1])


def slopes(index, x):
    return jnp.stack([0.2 * jnp.sin(6.0 * x[1]), 0.1 * x[0] ** 2, 0.3 * x[2]])


FINISHES = {
    "plain": None,
    "all": SurfaceMaps(height, slopes, texture),
}


@pytest.mark.parametrize("name", FINISHES)
def test_the_gradient_is_the_images(name):
    """Autodiff of the value alone: bumps, normal maps and textures on interpolated normals."""
    p = jnp.array([0.05, -0.02])

    @eqx.filter_jit
    def both(p):
        slope = jax.grad(lambda p: pixel(p, FINISHES[name]).value)(p)
        return slope, pixel(p, FINISHES[name])

    slope, found = both(p)
    np.testing.assert_allclose(found.gradient, slope, rtol=1e-10)
    assert np.linalg.norm(found.gradient) > 1e-2
    assert float(found.CDV[1]) > 0.0


def test_the_back_is_the_front_of_the_face_turned_over():
    other = mesh_facets(mesh(CORNERS, [[0, 2, 1]]), -NORMALS)
    p = jnp.array([0.05, -0.02])
    for a, b in zip(jax.tree.leaves(pixel(p)), jax.tree.leaves(pixel(p, known=other)), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14)


def ball(n):
    u, v = np.meshgrid(
        np.arange(2 * n) * np.pi / n, (np.arange(n) + 0.5) * np.pi / n, indexing="ij"
    )
    X = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], -1).reshape(-1, 3)
    k = np.arange(2 * n * n).reshape(2 * n, n)
    a, b = k[:, :-1], np.roll(k, -1, 0)[:, :-1]
    c, d = np.roll(k, -1, 0)[:, 1:], k[:, 1:]
    quads = [np.stack(f, -1).reshape(-1, 3) for f in ((a, d, c), (a, c, b))]
    return mesh(X, np.concatenate(quads))


@eqx.filter_jit
def points(known, face, x):
    return jax.vmap(lambda f, x: known.point(f, x))(face, x)


def test_a_finer_ball_bends_more_like_a_ball():
    """The shape operator of interpolated normals comes to -1/R with the edges' length.

    They are the points themselves here, 1 - s / 18 long at a face's middle with s the sum of its
    squared edges; the normal turns by as much more. Orders to come are s / 6 of that: 0.3 %.
    """
    errors, sizes, s = [], [8, 16, 32], np.inf
    for n in sizes:
        known = mesh_facets(ball(n))
        up = np.asarray(known.corners).mean(1)
        middle = np.flatnonzero(abs(up[:, 2]) < 0.6)
        at = points(known, jnp.asarray(middle), jnp.asarray(up[middle]))
        S = -np.swapaxes(at.tangents, 1, 2) @ at.turning
        errors.append(np.abs(S + np.eye(2)).max())
        corners = np.asarray(known.corners)[middle]
        s = np.sum((corners - np.roll(corners, 1, 1)) ** 2, (1, 2)).max()
    assert errors[-1] == pytest.approx(s / 18.0, rel=0.01)
    assert fitted_order(sizes, errors) < -1.5


def test_flat_facets_keep_their_own_normals():
    at = mesh_facets(ONE, np.zeros((3, 3))).point(jnp.array(0), jnp.asarray(CORNERS[0]))
    np.testing.assert_allclose(at.normal, at.base_normal, rtol=1e-12)
    np.testing.assert_allclose(at.turning, 0.0, rtol=0.0, atol=1e-14)


def test_a_vertex_without_a_normal_takes_the_faces():
    known = mesh_facets(ONE, np.zeros((3, 3)))
    flat = np.asarray(ONE.area_vectors)
    flat = flat / np.linalg.norm(flat, axis=-1, keepdims=True)
    np.testing.assert_allclose(known.normals, np.broadcast_to(flat[:, None], (1, 3, 3)))
    assert vertex_normals(ONE).shape == (3, 3)


def test_normals_must_be_one_for_each_vertex():
    with pytest.raises(ValueError, match=r"`normals` must have shape \(3, 3\)"):
        mesh_facets(ONE, np.zeros((4, 3)))


@pytest.mark.parametrize("unit", [1e-10, 1e-9, 1e9])
def test_the_unit_of_length_is_of_no_matter_in_single_precision(unit):
    def shown(unit):
        x = unit * CORNERS.mean(0)
        one = as_dtype(mesh(unit * CORNERS, [[0, 1, 2]]), "float32")
        known, plain = mesh_facets(one, jnp.asarray(NORMALS, "float32")), mesh_facets(one).normals
        at = known.point(jnp.array(0), jnp.asarray(x, "float32"))
        camera = Pinhole(unit * CAMERA.eye, CAMERA.axes, CAMERA.gamma)
        given = as_dtype((known, MATTER, camera, jnp.zeros(2)), "float32")
        here = facet_interaction(*given, jnp.array(0)).point
        return [at.normal, unit * at.turning, plain, here.normal, here.position / unit]

    for a, b in zip(shown(unit), shown(1.0), strict=True):
        assert a.dtype == jnp.float32
        np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-5)
