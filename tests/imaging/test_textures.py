"""Pictures and waves on surfaces: known texels, gradients by differences, charts as references."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging._bumps import bumped, chart, normal_mapped, solid_tilted
from firstorder.imaging._textures import (
    HeightMap,
    ImageTexture,
    SolidSlopes,
    SolidWaves,
    height_slopes,
    image_normal_map,
    normal_map_slopes,
    shape_uv,
)
from firstorder.imaging.facets import mesh_facets
from firstorder.numerics._vectors import cross, unit
from firstorder.space import box, cylinder, disc, plane, rectangle, sphere
from firstorder.space.meshes.triangle_mesh import mesh
from firstorder.space.shapes.build import triangle
from firstorder.space.shapes.kinds import Boxes, Cylinders, Ellipsoids

RNG = np.random.default_rng(7)
PIXELS = RNG.uniform(0.2, 0.9, (3, 5))
SMOOTH = 0.5 + 0.4 * np.sin(2 * np.pi * (np.arange(8)[:, None] + 0.5) / 8 + np.arange(6)[None])


def one(shape):
    """The only row."""
    return jax.tree.map(lambda a: a[0], shape)


# --- textures ------------------------------------------------------------------------------------


@pytest.mark.smoke
def test_middles_of_pixels_are_met():
    """Rows from the top, u to the right; repeated, and held at the border."""
    found = ImageTexture(PIXELS, (2.0, 3.0))
    for i in range(3):
        for j in range(5):
            uv = jnp.array([(j + 0.5) / 5, 1.0 - (i + 0.5) / 3])
            np.testing.assert_allclose(ImageTexture(PIXELS)(uv), PIXELS[i, j], rtol=1e-14)
            again = uv / jnp.array([2.0, 3.0]) + jnp.array([1.5, -1.0 / 3.0])
            np.testing.assert_allclose(found(again), PIXELS[i, j], rtol=1e-12)
    held = ImageTexture(PIXELS, hold=True)
    np.testing.assert_allclose(held(jnp.array([-3.0, 7.0])), PIXELS[0, 0])
    np.testing.assert_allclose(held(jnp.array([1.0, 0.0])), PIXELS[2, 4])


def test_between_pixels_it_is_bilinear_and_so_is_its_gradient():
    texture = jax.jit(lambda uv: ImageTexture(PIXELS)(uv))
    slope = jax.jit(jax.grad(lambda uv: ImageTexture(PIXELS)(uv)))
    for uv in RNG.uniform(-0.5, 1.5, (6, 2)):
        x, y = uv[0] * 5 - 0.5, (1.0 - uv[1]) * 3 - 0.5
        j, i = int(np.floor(x)), int(np.floor(y))
        s, t = x - j, y - i
        A = PIXELS[np.ix_([i % 3, (i + 1) % 3], [j % 5, (j + 1) % 5])]
        expected = np.array([1 - t, t]) @ A @ np.array([1 - s, s])
        np.testing.assert_allclose(texture(jnp.asarray(uv)), expected, rtol=1e-13)
        across = 5 * np.array([1 - t, t]) @ A @ np.array([-1.0, 1.0])
        upward = -3 * np.array([-1.0, 1.0]) @ A @ np.array([1 - s, s])
        np.testing.assert_allclose(slope(jnp.asarray(uv)), [across, upward], rtol=1e-12)


def test_the_gradient_jumps_on_middles_of_pixels():
    """The side of larger u, as it is said."""
    slope = jax.grad(ImageTexture([[0.0, 1.0, 0.5, 0.5]], hold=True))
    found = [slope(jnp.array([u, 0.5]))[0] for u in (0.375 - 1e-9, 0.375, 0.375 + 1e-9)]
    np.testing.assert_allclose(found, [4.0, -2.0, -2.0])


def test_pixels_are_differentiable():
    """A sum of weights, 1 in all."""
    found = jax.grad(lambda a: ImageTexture(a)(jnp.array([0.33, 0.41])))(jnp.asarray(PIXELS))
    np.testing.assert_allclose(found.sum(), 1.0, rtol=1e-12)
    assert np.count_nonzero(found) == 4


# --- where u and v are ---------------------------------------------------------------------------


def test_shapes_know_their_u_and_v():
    x = jnp.array
    wall = one(rectangle((1, 2, 3), (0.0, 2.0, 0.0), (0.0, 0.0, 0.5)))
    np.testing.assert_allclose(shape_uv(wall, x([1.0, 4.0, 2.75])), [1.0, 0.25])
    three = one(triangle((0, 0, 0), (2, 0, 0), (0, 4, 0)))
    np.testing.assert_allclose(shape_uv(three, x([0.5, 1.0, 0.0])), [0.25, 0.25])
    ball = one(sphere((0, 0, 1), 2.0))
    np.testing.assert_allclose(
        shape_uv(ball, x([0.0, 2.0, 1.0])), [0.75, 0.5], rtol=0.0, atol=1e-15
    )
    np.testing.assert_allclose(shape_uv(ball, x([0.0, 0.0, 3.0])), [0.5, 1.0])
    high = 1.0 + np.sqrt(2.0)
    np.testing.assert_allclose(shape_uv(ball, x([np.sqrt(2.0), 0.0, high])), [0.5, 0.75])
    tin = one(cylinder((0, 0, 0), (0, 0, 4), 1.0))
    np.testing.assert_allclose(shape_uv(tin, x([1.0, 0.0, 1.0]))[1], 0.25)
    crate = one(box((0, 0, 0), (1, 2, 4)))
    np.testing.assert_allclose(shape_uv(crate, x([1.0, 0.5, 1.0])), [0.25, 0.25])
    round_ = one(disc((0, 0, 0), (0, 0, 1), 2.0))
    np.testing.assert_allclose(shape_uv(round_, jnp.zeros(3)), [0.5, 0.5])
    ground = one(plane((0, 0, 0), (0, 0, 1)))
    step = shape_uv(ground, x([3.0, 4.0, 0.0])) - shape_uv(ground, jnp.zeros(3))
    np.testing.assert_allclose(jnp.linalg.norm(step), 5.0, rtol=1e-12)


def test_poles_have_finite_derivatives():
    ball = one(sphere((0, 0, 0), 1.0))
    for mode in (jax.jacfwd, jax.jacrev):
        for z in (1.0, 0.0):  # and the middle
            found = mode(lambda x: shape_uv(ball, x))(jnp.array([0.0, 0.0, z]))
            assert np.all(np.isfinite(found))


def test_normal_maps_are_differentiable_in_their_pixels():
    """A spline's weights are 1 in all, and channels are twice the colours."""
    pixels = jnp.full((4, 4, 3), 0.75)
    slope = jax.jit(jax.grad(lambda p: image_normal_map(p)(jnp.array([0.3, 0.6]))[2]))(pixels)
    np.testing.assert_allclose(slope.sum((0, 1)), [0.0, 0.0, 2.0], rtol=0.0, atol=1e-12)


# --- bumps and normals against charts ------------------------------------------------------------

MIDDLE = jnp.array([0.1, 0.2, 0.3])


def round_(uv):
    phi, theta = 2.0 * jnp.pi * (uv[0] - 0.5), jnp.pi * (uv[1] - 0.5)
    level = jnp.cos(theta)
    return jnp.stack([level * jnp.cos(phi), level * jnp.sin(phi), jnp.sin(theta)])


def upright_(uv):
    phi = 2.0 * jnp.pi * (uv[0] - 0.5)
    return jnp.stack([jnp.cos(phi), jnp.sin(phi), 2.0 * uv[1] - 1.0])


def lid(uv):
    return jnp.append(2.0 * uv - 1.0, 1.0)


# Shapes, and their own surfaces by (u, v) as `shape_uv` counts them, before their axes.
CHARTS = {
    "sphere": (Ellipsoids, round_, np.diag([0.7, 0.7, 0.7])),
    "ellipsoid": (Ellipsoids, round_, np.diag([1.0, 0.5, 0.3])),
    "elliptic cylinder": (Cylinders, upright_, np.diag([1.0, 0.5, 1.0])),
    "sheared box": (Boxes, lid, np.array([[1.0, 0.5, 0.3], [0.0, 1.0, 0.4], [0.0, 0.0, 1.0]])),
}


@pytest.mark.parametrize("name", CHARTS)
@pytest.mark.parametrize("kind", ["heights", "normals"])
def test_pictures_on_a_shape_are_those_of_its_chart(kind, name):
    """Normal and turning by (u, v) of the position, and by the parametrisation of the surface."""
    shape, canonical, axes = CHARTS[name]
    row, uv = one(shape(MIDDLE, axes)), jnp.array([0.31, 0.62])
    heights = HeightMap.of(0.05 * SMOOTH, (2.0, 1.0))
    colours = 0.5 + np.stack([0.2 * SMOOTH, 0.1 * SMOOTH**2, 0.3 + 0.0 * SMOOTH], -1)
    normals = image_normal_map(colours, (1.0, 2.0))

    def place(x):
        return shape_uv(row, x)

    @jax.jit
    def both(uv):
        at = chart(lambda uv: MIDDLE + jnp.asarray(axes) @ canonical(uv), uv)
        if kind == "heights":
            expected, slopes = bumped(at, heights, uv), height_slopes(heights, place)
        else:
            expected, slopes = (
                normal_mapped(at, normals, uv),
                normal_map_slopes(normals, place, row.normal),
            )
        return place(at.position), at.axes[:, 2], expected, solid_tilted(at.point(), slopes)

    there, up, expected, found = both(uv)
    np.testing.assert_allclose(there, uv, rtol=1e-12)
    np.testing.assert_allclose(found.normal, expected.normal, rtol=1e-10)
    assert np.linalg.norm(found.normal - up) > 0.05
    np.testing.assert_allclose(found.turning, expected.turning, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_green_leans_up_the_picture_where_it_lies_mirrored_too(side):
    """The tangent b goes with v, whichever hand u and v make."""
    up = jnp.broadcast_to(jnp.array([0.5, 0.7, 0.9]), (4, 4, 3))

    def place(x):
        return jnp.stack([side * x[0], x[1]])

    slopes = normal_map_slopes(image_normal_map(up), place, lambda x: jnp.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(slopes(jnp.zeros(3)), [0.0, -0.5, 0.0], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize(
    "corners",
    [
        [(0.3, 0.3)] * 3,
        [(0.1, 0.7), (0.4, 0.8), (1.0, 1.0)],
        [(0.0, 0.5), (0.7, 0.5), (0.2, 0.5)],
    ],
)
def test_without_u_and_v_nothing_leans(corners, single):
    """A face whose corners lie at one point of the picture, or in a line; 60 faces in space."""
    normals = image_normal_map(np.full((4, 4, 3), 0.7))
    faces = np.random.default_rng(3).uniform(-1.0, 1.0, (60, 3, 3))

    @jax.jit
    def slopes(corners, uv):
        known = mesh_facets(mesh(np.eye(3), [[0, 1, 2]]), uv=np.zeros((1, 3, 2)))
        known = eqx.tree_at(lambda k: (k.corners, k.uv), known, (corners[None], uv[None]))
        face = jnp.array(0)
        up = unit(cross(corners[1] - corners[0], corners[2] - corners[0]))
        tilt = normal_map_slopes(normals, lambda x: known.uv_at(face, x), lambda x: up)
        x = corners.mean(0)
        return tilt(x), jax.jacfwd(tilt)(x)

    kind = jnp.float32 if single else jnp.float64
    uv = jnp.asarray(corners, kind)
    for face in faces:
        for found in slopes(jnp.asarray(face, kind), uv):
            np.testing.assert_array_equal(found, 0.0)
    good = slopes(jnp.asarray(faces[0], kind), jnp.asarray([(0, 0), (1, 0), (0, 1)], kind))
    assert np.linalg.norm(good[0]) > 0.5


def test_heights_go_through_their_pixels():
    heights = HeightMap.of(SMOOTH)
    uv = jnp.array([(2 + 0.5) / 6, 1.0 - (5 + 0.5) / 8])
    np.testing.assert_allclose(heights(uv), SMOOTH[5, 2], rtol=1e-12)


def test_waves_lean():
    k = np.array([[3.0, 1.0, 0.0], [0.0, 2.0, 5.0]])
    waves, x = SolidWaves(k, 0.3, 0.5, (0.1, 0.0, 0.2)), np.array([0.4, -0.3, 0.7])
    expected = 0.3 * np.prod(np.sin(k @ (x - [0.1, 0.0, 0.2]))) + 0.5
    np.testing.assert_allclose(waves(jnp.asarray(x)), expected, rtol=1e-12)
    lean = SolidSlopes((1.0, 0.0, -2.0), waves)(jnp.asarray(x))
    np.testing.assert_allclose(lean, expected * np.array([1.0, 0.0, -2.0]), rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ImageTexture([0.1, 0.2]), r"`values` must have shape \(rows, columns\)"),
        (lambda: ImageTexture([[0.1, np.nan]]), "`values` must be finite"),
        (lambda: ImageTexture([[0.1]], (0.0, 1.0)), "`repeat` must be positive"),
        (lambda: HeightMap.of(np.zeros(4)), r"`values` must have shape \(rows, columns\)"),
        (lambda: HeightMap.of(np.zeros((4, 4)), (1.0, -1.0)), "`repeat` must be positive"),
        (
            lambda: HeightMap.of(np.zeros((3, 9))),
            "`values` must be at least 4 x 4 pixels, but is 3",
        ),
        (
            lambda: image_normal_map(np.zeros((4, 4))),
            r"`pixels` must have shape \(rows, columns, 3\)",
        ),
        (lambda: image_normal_map(np.full((4, 4, 3), 1.5)), "`pixels` must lie in"),
        (lambda: image_normal_map(np.full((4, 4, 3), 0.5)), "blue above 0.5"),
        (lambda: SolidWaves([[np.inf, 0.0, 0.0]]), "`waves` must be finite"),
        (lambda: SolidSlopes((np.nan, 0.0, 0.0)), "`lean` must be finite"),
    ],
)
def test_what_is_no_picture_is_refused(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


def test_one_number_repeats_a_picture_along_both():
    rng, place = np.random.default_rng(5), jnp.array([0.3, 0.7])
    heights, colours = rng.random((5, 4)), 0.5 + 0.5 * rng.random((5, 4, 3))
    for one in (
        lambda n: ImageTexture(heights, repeat=n),
        lambda n: HeightMap.of(heights, n),
        lambda n: image_normal_map(colours, n),
    ):
        np.testing.assert_array_equal(one(2.0)(place), one((2.0, 2.0))(place))
        with pytest.raises(ValueError, match="`repeat` must be one number or two"):
            one((1.0, 2.0, 3.0))


@pytest.mark.parametrize("level", [0, 3])
def test_in_the_middle_of_a_pixel_it_is_the_pixel_however_u_and_v_are_made(level):
    """A compiler may round such a place to both sides of the middle in one program."""
    rng = np.random.default_rng(6)
    pixels = rng.uniform(1.0, 2.0, (4, 8))
    i, j = rng.integers(0, 4, 3000), rng.integers(0, 8, 3000)
    uv = np.stack([(j + 0.5) / 8, 1.0 - (i + 0.5) / 4], -1)
    axes = rng.normal(size=(3000, 2, 3))

    def seen(q, axes):
        x, y, z = (axes[:, k] * q[k] for k in range(3))
        return ImageTexture(pixels)(x + y + z)

    both = jax.vmap(jax.value_and_grad(seen))
    compiled = jax.jit(both, compiler_options={"xla_backend_optimization_level": level})
    found, _ = compiled(np.einsum("nij,nj->ni", np.linalg.pinv(axes), uv), axes)
    np.testing.assert_allclose(found, pixels[i, j], rtol=1e-9)


@pytest.mark.parametrize("radius", [1e-7, 1e-6, 1e6, 6.4e6])
def test_normal_maps_lean_alike_in_every_unit(radius):
    def leaning(radius, dtype):
        ball = jax.tree.map(lambda a: a[0].astype(dtype), sphere((0.0, 0.0, 0.0), radius))
        slopes = normal_map_slopes(
            lambda uv: jnp.append(0.3 + jnp.sin(uv), jnp.asarray(0.9, dtype)),
            lambda x: shape_uv(ball, x),
            lambda x: x / radius,
        )
        x = jnp.asarray(np.array([0.6, 0.48, 0.64]) * radius, dtype)
        a, da = jax.jvp(slopes, (x,), (jnp.asarray([-0.48, 0.6, 0.0], dtype),))
        return np.append(a, radius * np.asarray(da))

    single, double = leaning(radius, jnp.float32), leaning(1.0, jnp.float64)
    np.testing.assert_allclose(single, double, rtol=0.0, atol=1e-5)
