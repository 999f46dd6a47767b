"""What things wear by their numbers; pixels of pictures against differences of pixels."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging._bumps import chart, normal_mapped
from firstorder.imaging._interaction import facet_interaction, surface_interaction
from firstorder.imaging._point_shading import shade_point
from firstorder.imaging._textures import HeightMap, ImageTexture, image_normal_map, shape_uv
from firstorder.imaging.camera import pinhole
from firstorder.imaging.facets import mesh_facets
from firstorder.imaging.surface_maps import PerPrimitive, SurfaceMaps, UVMaps
from firstorder.space import Scene, ellipsoid, primitive, rectangle, sphere
from firstorder.space.meshes.triangle_mesh import mesh

ROWS, COLUMNS = np.arange(6)[:, None], np.arange(8)[None]
PIXELS = 0.5 + 0.4 * np.sin(2 * np.pi * ROWS / 6) * np.cos(2 * np.pi * COLUMNS / 8)
NORMALS = 0.5 + np.stack([0.2 * PIXELS, -0.1 * PIXELS, 0.35 + 0.0 * PIXELS], -1)
CAMERA = pinhole((0.4, -2.0, 2.5), (0.1, 0.1, 0.2), gamma=2.0)
LAMP = Lamp((0.0, 0.5, 3.0), (0.3, 0.0, 0.0), (0.0, -0.3, 0.0), 8.0, 3)
MATTER = dict(albedo=0.6, specular=0.3, exponent=20.0)
BALL = Scene.of(
    primitive(sphere((0.0, 0.0, 0.3), 0.7), **MATTER),
    primitive(rectangle((0.0, 0.0, -3.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))),
)
U, V = (0.9, 0.1, 0.1), (0.0, 0.8, -0.1)
WALL = Scene.of(primitive(rectangle((0.1, 0.1, 0.2), U, V), **MATTER))
# The same wall as two faces, with (u, v) at their corners.
_ENDS = np.array([0.1, 0.1, 0.2]) + np.array(
    [a * np.array(U) + b * np.array(V) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
)
_FACES = np.array([[0, 1, 2], [0, 2, 3]])
_UV = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])[_FACES]
FACES = mesh_facets(mesh(_ENDS, _FACES), uv=_UV)
FINISHES = {
    "texture": SurfaceMaps(
        wrapped=UVMaps(albedo=PerPrimitive((1.0,), ((0,),), (ImageTexture(PIXELS),)))
    ),
    "bump": SurfaceMaps(
        wrapped=UVMaps(PerPrimitive((0.0,), ((0,),), (HeightMap.of(0.03 * PIXELS),)))
    ),
    "normal map": SurfaceMaps(
        wrapped=UVMaps(None, PerPrimitive((0.0, 0.0, 1.0), ((0,),), (image_normal_map(NORMALS),)))
    ),
}


@eqx.filter_jit
def pixel(p, finish, how):
    if how == "mesh":
        at = facet_interaction(FACES, WALL.material, CAMERA, p, jnp.array(0), finish)
    else:
        at = surface_interaction(BALL if how == "ball" else WALL, CAMERA, p, jnp.array(0), finish)
    return shade_point(at, [LAMP])


P = np.array([0.21, -0.13])


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("worn", "how"), [*((worn, "wall") for worn in FINISHES), ("normal map", "ball")]
)
def test_gradients_of_pictures_are_those_of_pixels(worn, how):
    """Closed form against central differences, within a cell of the picture.

    Differences err by h^2 = 1e-10 and by rounding of 1e-16 / h = 1e-11, both times the third or no
    derivative, some hundreds here.
    """
    finish, h = FINISHES[worn], 1e-5
    found, bare = (pixel(jnp.asarray(P), f, how) for f in (finish, SurfaceMaps()))
    assert abs(found.value / bare.value - 1.0) > 0.01
    steps = h * np.eye(2)
    ahead, behind = (
        np.array([pixel(jnp.asarray(P + s), finish, how).value for s in sign * steps])
        for sign in (1, -1)
    )
    slope = (ahead - behind) / (2 * h)
    np.testing.assert_allclose(found.gradient, slope, rtol=0.0, atol=1e-7 * np.linalg.norm(slope))


@pytest.mark.parametrize("worn", FINISHES)
def test_a_wall_and_its_faces_wear_alike(worn):
    a, b = (pixel(jnp.asarray(P), FINISHES[worn], how) for how in ("wall", "mesh"))
    np.testing.assert_allclose(a.value, b.value, rtol=1e-12)
    np.testing.assert_allclose(a.gradient, b.gradient, rtol=1e-10)


def test_the_pixel_shows_the_texel_that_lies_there():
    """Diffuse light is proportional to the albedo: the picture's own value, read by hand."""
    matte = eqx.tree_at(lambda s: s.material.specular, WALL, jnp.zeros(1))

    def value(finish):
        return shade_point(
            surface_interaction(matte, CAMERA, jnp.asarray(P), jnp.array(0), finish), [LAMP]
        ).value

    x = surface_interaction(matte, CAMERA, jnp.asarray(P), jnp.array(0)).point.position
    s, *_ = np.linalg.lstsq(np.stack([U, V], -1), np.asarray(x) - [0.1, 0.1, 0.2], rcond=None)
    col, row = (s[0] + 1) / 2 * 8 - 0.5, (1 - (s[1] + 1) / 2) * 6 - 0.5
    j, i = int(col), int(row)
    a, b = col - j, row - i
    block = PIXELS[i : i + 2, j : j + 2]
    expected = np.array([1 - b, b]) @ block @ np.array([1 - a, a])
    np.testing.assert_allclose(value(FINISHES["texture"]) / value(None), expected, rtol=1e-10)


def test_a_pixel_of_an_ellipsoid_leans_as_its_chart():
    """Its u and v change along the normal too, which no tangent knows of."""
    axes = jnp.diag(jnp.array([0.9, 0.6, 0.4]))
    scene = Scene.of(primitive(ellipsoid((0.0, 0.0, 0.3), axes), **MATTER))
    place, index, normals = jnp.asarray(P), jnp.array(0), image_normal_map(NORMALS)

    def surface(uv):
        phi, theta = 2.0 * jnp.pi * (uv[0] - 0.5), jnp.pi * (uv[1] - 0.5)
        level = jnp.cos(theta)
        way = jnp.stack([level * jnp.cos(phi), level * jnp.sin(phi), jnp.sin(theta)])
        return jnp.array([0.0, 0.0, 0.3]) + axes @ way

    @jax.jit
    def both():
        at = surface_interaction(scene, CAMERA, place, index, FINISHES["normal map"]).point
        uv = shape_uv(jax.tree.map(lambda a: a[0], scene.groups[0]), at.position)
        return at, normal_mapped(chart(surface, uv), normals, uv)

    found, expected = both()
    np.testing.assert_allclose(found.position, expected.position, rtol=1e-12)
    np.testing.assert_allclose(found.normal, expected.normal, rtol=1e-10)


def test_others_wear_nothing():
    only = PerPrimitive((1.0,), ((1, 3),), (lambda x: x[0],))
    found = [only(jnp.array(k), jnp.array([0.5, 2.0])).item() for k in range(4)]
    assert found == [1.0, 0.5, 1.0, 0.5]
    slopes = PerPrimitive((0.0, 0.0, 0.0), ((2,),), (lambda x: 2.0 * x,))
    np.testing.assert_array_equal(slopes(jnp.array(2), jnp.ones(3)), 2.0)
    np.testing.assert_array_equal(slopes(jnp.array(0), jnp.ones(3)), 0.0)


def test_textures_multiply():
    """One in space and one over (u, v): the albedo's slope is that of the product."""
    both = SurfaceMaps(albedo=lambda i, x: 0.5 + 0.2 * jnp.sin(3.0 * x[0]),
                  wrapped=FINISHES["texture"].wrapped)  # fmt: skip
    at = surface_interaction(WALL, CAMERA, jnp.asarray(P), jnp.array(0), both)
    (first, second) = both.factors(jnp.array(0), lambda x: jnp.linalg.pinv(
        jnp.stack([jnp.array(U), jnp.array(V)], -1)) @ (x - jnp.array([0.1, 0.1, 0.2])) / 2 + 0.5
    )  # fmt: skip
    x = at.point.position
    np.testing.assert_allclose(at.lobe.albedo, 0.6 * first(x) * second(x), rtol=1e-12)
    slope = jax.grad(lambda x: 0.6 * first(x) * second(x))(x)
    T = at.point.tangents
    np.testing.assert_allclose(at.lobe.slope @ T, slope @ T, rtol=1e-10)
