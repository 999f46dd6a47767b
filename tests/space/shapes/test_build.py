"""Shapes by name: where they are, and what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.scene._arguments import check_kind, check_primitives
from firstorder.space import (
    Primitive,
    Receiver,
    Scene,
    Shape,
    box,
    cylinder,
    disc,
    ellipsoid,
    irradiance,
    plane,
    polygon,
    primitive,
    rectangle,
    sphere,
    triangle,
    triangles,
)
from firstorder.space.meshes import mesh


def test_the_half_axes_of_a_ball_are_its_radius():
    found = sphere((1.0, 0.0, 3.0), 0.5)
    np.testing.assert_allclose(found.center, [[1.0, 0.0, 3.0]])
    np.testing.assert_allclose(found.axes, [0.5 * np.eye(3)])


def needle(wide):
    """Corners of a triangle a metre long, from the tip on, and E beside it by quadrature."""
    corners = np.array([(0.0, 0.0, 1.0), (1.0, 0.5 * wide, 1.0), (1.0, -0.5 * wide, 1.0)])
    at, n = np.array([0.3, 0.2, 0.0]), np.array([0.1, 0.0, 1.0]) / np.hypot(0.1, 1.0)
    x, w = np.polynomial.legendre.leggauss(40)
    x = 0.5 + 0.5 * x
    r = np.stack([x, 0.0 * x, 0.0 * x + 1.0], -1) - at
    E = 0.5 * np.sum(w * wide * x * (r @ n) / np.sum(r * r, -1) ** 2)
    return corners, Receiver.at(at, n), E


BUILT = {
    "triangle": lambda p: triangle(*p),
    "traced": jax.jit(lambda p: triangle(*p)),
    "polygon": polygon,
    "triangles": lambda p: triangles(mesh(p, [[0, 1, 2]])),
}


@pytest.mark.parametrize("wide", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("built", BUILT)
def test_a_needle_shines_the_same_from_each_corner_on(built, wide):
    corners, at, E = needle(wide)
    for first in range(3):
        shape = BUILT[built](np.roll(corners, -first, 0))
        found = irradiance(Scene.of(primitive(shape, emission=1.0, two_sided=True)), at)
        # Corners are rounded by eps / wide of the width; E is a line's, but for the width squared.
        rounding = np.finfo(float).eps / wide
        np.testing.assert_allclose(found, E, rtol=rounding + 0.1 * wide**2)


def test_a_box_has_the_precision_of_that_corner_that_has_one():
    low, high = jnp.broadcast_to(jnp.asarray(0.0), (3,)), jnp.ones(3, jnp.float32)
    assert low.weak_type
    assert box(low, high).axes.dtype == jnp.float32


def test_a_cylinder_that_leans_has_its_caps_across_its_axis():
    base, half = np.array([1.0, 0.0, 0.0]), np.array([0.3, -0.4, 1.2])
    found = cylinder(base, base + 2.0 * half, 0.5)
    np.testing.assert_allclose(found.center, [base + half])
    np.testing.assert_allclose(found.axes[0, :, 2], half)
    np.testing.assert_allclose(half @ found.axes[0, :, :2], 0.0, rtol=0.0, atol=1e-15)


def test_a_cylinder_stands_on_its_base():
    found = cylinder((1.0, 0.0, 0.0), (1.0, 0.0, 3.0), 0.5)
    np.testing.assert_allclose(found.center, [[1.0, 0.0, 1.5]])
    np.testing.assert_allclose(np.linalg.norm(found.axes[0], axis=0), [0.5, 0.5, 1.5])
    np.testing.assert_allclose(found.axes[0].T @ found.axes[0], np.diag([0.25, 0.25, 2.25]))


@pytest.mark.parametrize("normal", [(0.0, 0.0, 2.0), (1.0, -1.0, 0.5), (0.0, 0.0, -1.0)])
def test_flat_shapes_look_along_their_normal(normal):
    n = np.array(normal) / np.linalg.norm(normal)
    for shape in (disc((0.0, 1.0, 0.0), normal, 0.4), plane((0.0, 1.0, 0.0), normal)):
        row = jax.tree.map(lambda a: a[0], shape)
        np.testing.assert_allclose(row.normal(row.center), n, rtol=0.0, atol=1e-15)


def test_corners_counter_clockwise_face_the_viewer():
    row = jax.tree.map(lambda a: a[0], triangle((0, 0, 0), (1, 0, 0), (0, 1, 0)))
    np.testing.assert_allclose(row.normal(row.center), [0.0, 0.0, 1.0])


SAW = [(0, 0), (4, 0), (4, 3), (3, 1), (2, 3), (1, 1), (0, 3)]


@pytest.mark.parametrize(
    "outline", [SAW, [(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 0), (2, 0), (0, 1)]]
)
def test_a_polygon_is_cut_into_triangles_that_cover_it_once(outline):
    v = np.array([(x, y, 0.5 * x - 0.2 * y + 1.0) for x, y in outline], float)
    found = polygon(v)
    assert found.count == len(outline) - 2
    area = np.cross(found.axes[:, :, 0], found.axes[:, :, 1])
    after = np.roll(v, -1, 0)
    true = 0.5 * np.sum(np.cross(v, after), 0)
    np.testing.assert_allclose(0.5 * area.sum(0), true, rtol=1e-12)
    normal = true / np.linalg.norm(true)
    assert np.all(area @ normal > 0.0)  # none is turned over: none overlaps


@pytest.mark.parametrize("size", [1e-100, 1e100])
def test_a_polygon_may_have_any_size(size):
    found = polygon(size * np.array([(x, y, 0.5 * x) for x, y in SAW], float))
    assert found.count == len(SAW) - 2


def test_traced_arguments_that_are_no_shape_give_nan():
    assert np.isnan(jax.jit(lambda r: sphere((0.0, 0.0, 0.0), r).axes)(-1.0)).any()
    assert np.isnan(jax.jit(lambda h: box((0.0, 0.0, 0.0), (1.0, 1.0, h)).axes)(-1.0)).any()


def test_traced_half_edges_that_are_parallel_have_no_normal():
    bent = jax.jit(lambda v: rectangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), v).axes[0, :, 2])
    assert bent(jnp.array([2.0, 0.0, 0.0])).tolist() == [0.0, 0.0, 0.0]


def test_vectors_that_are_parallel_but_for_rounding_span_nothing():
    along = (
        np.random.default_rng(0).normal(size=(1000, 3)) * 10.0 ** np.arange(-20, 20, 0.04)[:, None]
    )
    span = jax.jit(jax.vmap(lambda u, v: rectangle((0.0, 0.0, 0.0), u, v).axes[0, :, 2]))
    assert not np.any(span(along, 3.3 * along))
    aside = np.roll(along, 1, -1) * 1e-12
    np.testing.assert_allclose(np.linalg.norm(span(along, along + aside), axis=-1), 1.0)


NOT_OF_SPACE = "must have three coordinates, but has shape (2,)."


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sphere((0, 0, 0), -1.0), "Argument `radius` must be positive, but is -1.0."),
        (
            lambda: box((0, 0, 0), (1, 0, 1)),
            "Argument `high` must be above `low` in every coordinate, but is not.",
        ),
        (
            lambda: disc((0, 0, 0), (0, 0, 0), 1.0),
            "Argument `normal` must have a length, but is the zero vector.",
        ),
        (
            lambda: rectangle((0, 0, 0), (1, 0, 0), (2, 0, 0)),
            "Arguments `u` and `v` must not be parallel, but are.",
        ),
        (
            lambda: polygon([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1)]),
            "Argument `vertices` must lie in a plane, but does not.",
        ),
        (
            lambda: polygon([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1.5, 0)]),
            "Argument `vertices` must be a polygon without crossings, but is not.",
        ),
        (
            lambda: polygon([(0, 0, 0), (1, 1, 0)]),
            "Argument `vertices` must have shape (k >= 3, 3), but has (2, 3).",
        ),
        (lambda: sphere((0, 0), 1.0), f"Argument `center` {NOT_OF_SPACE}"),
        (
            lambda: ellipsoid((0, 0, 0), np.eye(2)),
            "Argument `axes` must have shape (..., 3, 3), but has (2, 2).",
        ),
        (lambda: box((0, 0), (1, 1)), f"Argument `low` {NOT_OF_SPACE}"),
        (lambda: cylinder((0, 0, 0), (0, 1), 0.1), f"Argument `top` {NOT_OF_SPACE}"),
        (lambda: disc((0, 0, 0), (0, 1), 0.1), f"Argument `normal` {NOT_OF_SPACE}"),
        (lambda: plane((0, 0), (0, 0, 1)), f"Argument `point` {NOT_OF_SPACE}"),
        (lambda: rectangle((0, 0, 0), (1, 0), (0, 1)), f"Argument `u` {NOT_OF_SPACE}"),
        (lambda: triangle((0, 0), (1, 0), (0, 1)), f"Argument `a` {NOT_OF_SPACE}"),
    ],
)
def test_bad_shapes_are_refused_in_one_sentence(make, words):
    with pytest.raises(ValueError, match="Argument") as found:
        make()
    assert str(found.value) == words


CORNERS = np.array([(x, y, z) for x in (0.0, 0.3) for y in (-0.1, 0.2) for z in (0.4, 0.7)])
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
CUBE = mesh(CORNERS, [f for a, b, c, d in FACES for f in ((a, b, c), (a, c, d))])


def test_light_behind_the_triangles_of_a_mesh_is_that_behind_the_box():
    lamp = primitive(rectangle((0.0, 0.0, 1.5), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)), emission=1.0)

    def behind(shape):
        return irradiance(Scene.of(lamp, primitive(shape)), Receiver.at((0.05, 0.02, 0.0)))

    step = jnp.array([0.01, -0.02, 0.03])
    faces = jax.jit(jax.value_and_grad(lambda s: behind(triangles(CUBE.at(CUBE.vertices + s)))))
    solid = jax.jit(jax.value_and_grad(lambda s: behind(box(CORNERS[0] + s, CORNERS[-1] + s))))
    for found, true in zip(faces(step), solid(step), strict=True):
        np.testing.assert_allclose(found, true, rtol=1e-11, atol=1e-13)


def test_a_mesh_without_any_area_is_refused():
    line = mesh([[0.0, 0.0, 0.5], [0.1, 0.0, 0.5], [0.2, 0.0, 0.5]], [[0, 1, 2]])
    with pytest.raises(ValueError, match="must have a face with an area, but has none"):
        triangles(line)


def test_a_mesh_of_many_faces_comes_with_the_memory_that_irradiance_takes():
    corners, faces = CORNERS, FACES * 20
    many = mesh(corners, [f for a, b, c, d in faces for f in ((a, b, c), (a, c, d))])
    with pytest.warns(UserWarning, match=r"240 faces: irradiance.* some 6.9 s"):
        assert triangles(many).count == 240


def test_a_face_without_an_area_hides_nothing():
    corners = np.array([[-0.1, -0.1, 0.5], [0.2, -0.1, 0.5], [0.0, 0.2, 0.5], [0.05, -0.1, 0.5]])
    lamp = primitive(rectangle((0.0, 0.0, 1.5), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)), emission=1.0)

    def behind(faces):
        scene = Scene.of(lamp, primitive(triangles(mesh(corners, faces))))
        return irradiance(scene, Receiver.at((0.05, 0.0, 0.0)))

    np.testing.assert_allclose(behind([[0, 1, 2], [0, 1, 3]]), behind([[0, 1, 2]]), rtol=1e-14)


def test_a_mesh_in_the_place_of_a_shape_is_told_how_to_be_one():
    with pytest.raises(TypeError, match=r"must be a shape, but is a Mesh: write triangles\(mesh\)"):
        check_kind("shape", CUBE, Shape)
    with pytest.raises(TypeError, match=r"is a Mesh: write primitive\(triangles\(mesh\), "):
        check_primitives([CUBE], Primitive, Shape)
