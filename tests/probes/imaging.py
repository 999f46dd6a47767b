"""Probes of imaging: the camera, surfaces and their maps, and light from lamps and skies."""

import jax.numpy as jnp

from firstorder import imaging, space
from firstorder.space.library import sphere_over_plane


def bent(s):
    """A point of a curved surface."""
    return imaging.surface_point(jnp.stack([0.1 * s, 0.0, s]), jnp.eye(3), -s * jnp.eye(2))


def seen(s):
    """What a pixel shows of a curved mirror."""
    camera = imaging.pinhole((0.0, 0.1, 4.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0 + s)
    point = bent(s)
    view = camera.view(jnp.stack([0.1 * s, 0.0]), 4.0 - s, point.normal)
    B = imaging.reflected_radiance(lambda x, w: x[0] + s * w[0] + 2.0, point, view.to_eye)
    place = jnp.stack([jnp.stack([0.0 * s, 0.1])])
    labels = imaging.pixel_labels(sphere_over_plane(radius=0.4 + 0.1 * s), camera, place)
    return {
        "imaging.Pinhole": camera.axes,
        "imaging.pinhole": camera.direction(jnp.stack([s, 0.1])),
        "imaging.PixelFootprint": (view.position_D_p, view.to_eye_D_p),
        "imaging.SurfacePoint": point.base_normal,
        "imaging.surface_point": point.turning,
        "imaging.ReflectedRadiance": (B.spatial, B.angular),
        "imaging.reflected_radiance": B.value,
        "imaging.image_gradient": imaging.image_gradient(view, point, B),
        "imaging.pixel_labels": s * labels[0],
    }


def maps(s):
    """Textures and bumps at a place."""
    x, uv = jnp.stack([0.2, s, 0.1]), jnp.stack([0.3 + 0.2 * s, 0.1 + 0.1 * s])
    waves = imaging.SolidWaves(jnp.stack([jnp.stack([s, 1.0, 0.0])]), 0.2 * s, 0.5)
    wrapped = imaging.UVMaps(albedo=lambda i, uv: s * uv[0])
    worn = imaging.SurfaceMaps(height=lambda i, x: s * x[0], wrapped=wrapped)
    assert worn.height
    assert wrapped.albedo
    pixels = jnp.full((4, 4, 3), 0.4 + 0.1 * s).at[..., 2].set(1.0)
    return {
        "imaging.SolidWaves": waves(x),
        "imaging.SolidSlopes": imaging.SolidSlopes(jnp.stack([s, 0.1, 0.0]), waves)(x),
        "imaging.ImageTexture": imaging.ImageTexture(jnp.stack([jnp.stack([0.5, s])]))(uv),
        "imaging.HeightMap": imaging.HeightMap.of(s * jnp.eye(4))(uv),
        "imaging.NormalMap": imaging.NormalMap.of(pixels)(uv),
        "imaging.image_normal_map": imaging.image_normal_map(pixels)(uv),
        "imaging.PerPrimitive": imaging.PerPrimitive((1.0,), ((0,),), (lambda x: s * x[0],))(
            jnp.array(0), x
        ),
        "imaging.SurfaceMaps": worn.height(0, x),
        "imaging.UVMaps": wrapped.albedo(0, uv),
        "imaging.SurfaceReflectance": imaging.SurfaceReflectance(0.5 * s).albedo,
    }


def nodes(s):
    """Nodes of lamps and skies, and where light comes from as a point sees them."""
    x, n = jnp.stack([0.1 * s, 0.2, 0.0]), jnp.stack([0.1 * s, 0.0, 1.0])
    n = n / jnp.sqrt(n @ n)
    lamp = imaging.Lamp(jnp.stack([0.0, s, 2.0]), (0, 1, 0), jnp.stack([s, 0.0, 0.0]), count=2)
    sky = space.ConstantSky(1.0 + s)
    return {
        "imaging.Lamp": (lamp.position, lamp.area, lamp.toward(x)),
        "imaging.distant_lamp": imaging.distant_lamp(lamp, x).toward(x),
        "imaging.DistantLight": imaging.sky_light(sky, "even", 2).slide(x),
        "imaging.sky_light": imaging.sky_light(sky, "even", 2).radiance,
        "imaging.CosineSkyLight": imaging.CosineSkyLight(sky, 2).about(n),
    }


def faces(s):
    """A triangle of a mesh with its normals, and a pixel of it."""
    corners = jnp.stack([jnp.zeros(3), jnp.stack([1.0, s, 0.0]), jnp.stack([0.0, 1.0, s])])
    known = imaging.mesh_facets(space.meshes.mesh(corners, [[0, 1, 2]]))
    up = known.normals[0, 0]
    pixel = imaging.GBuffer(corners[0], up, up, 2.0 + s, s, s * jnp.eye(2))
    return {
        "imaging.Facets": known.corners,
        "imaging.mesh_facets": known.normals,
        "imaging.GBuffer": pixel,
    }


def named(probe, *names):
    return dict.fromkeys((f"imaging.{name}" for name in names), probe)


PROBES = {
    **named(
        seen, "Pinhole", "pinhole", "PixelFootprint", "SurfacePoint", "surface_point",
        "ReflectedRadiance", "reflected_radiance", "image_gradient", "pixel_labels",
    ),
    **named(
        maps, "SolidWaves", "SolidSlopes", "ImageTexture", "HeightMap", "NormalMap",
        "image_normal_map", "PerPrimitive", "SurfaceMaps", "UVMaps", "SurfaceReflectance",
    ),
    **named(nodes, "Lamp", "distant_lamp", "DistantLight", "sky_light", "CosineSkyLight"),
    **named(faces, "Facets", "mesh_facets", "GBuffer"),
}  # fmt: skip
