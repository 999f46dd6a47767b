"""Probes of space's parts: reflected light, gathered rays, meshes, azimuths, its library."""

import jax
import jax.numpy as jnp

from firstorder.space import (
    Scene,
    azimuthal,
    bounces,
    estimators,
    library,
    light_field,
    meshes,
    primitive,
    receiver,
    rectangle,
    silhouettes,
)  # fmt: skip
from tests.probes.flatland_parts import scaled
from tests.probes.space import ball, under


def scenes(s):
    """The scenes of the library, by the number that they are made from where there is one."""
    return {
        "space.library.j12_box": library.j12_box(radiance=s).material.emission,
        "space.library.j12_occluder": library.j12_occluder(albedo=s).material.albedo,
        "space.library.clutter": library.clutter(s, 2.0 * s).material.albedo,
        "space.library.tables": library.tables(s, 2.0 * s).material.albedo,
        "space.library.sphere_over_plane": library.sphere_over_plane(1.0 + s, s).groups,
        "space.library.three_spheres": scaled(s, library.three_spheres()),
    }


def gathered(s):
    """Rays through the cells of a hemisphere, and derivatives that are made of them."""
    where = estimators.hemisphere_strata(2, 4, jax.random.key(0))
    lamp = rectangle(jnp.stack([0.1 * s, 0.0, 1.0]), (0.0, 5.0, 0.0), (5.0, 0.0, 0.0))
    rays = estimators.trace_strata(Scene.of(primitive(lamp, emission=s)), under(s), where=where)
    net = estimators.hemisphere_triangulation(9)
    distance = 1.0 / net.directions[:, 2] * (1.0 + s)
    aware = estimators.occlusion_aware_estimate(
        s * net.directions[:, 2], net.directions, distance, net.triangles, net.neighbours
    )
    return {
        "space.estimators.Strata": s * where.projected,
        "space.estimators.hemisphere_strata": s * where.directions,
        "space.estimators.Samples": (rays.radiance, rays.cosine),
        "space.estimators.trace_strata": rays.normal,
        "space.estimators.surface_area_estimate": estimators.surface_area_estimate(rays),
        "space.estimators.stratified_estimate": estimators.stratified_estimate(rays),
        "space.estimators.HemisphereTriangulation": s * net.directions,
        "space.estimators.hemisphere_triangulation": s * net.directions[:, 0],
        "space.estimators.occlusion_aware_estimate": aware,
    }


def traced(s):
    """Paths, which are drawn and have no derivative, and maps of a room that moves."""
    with jax.ensure_compile_time_eval():  # which shapes are lights is asked before paths start
        room, key = library.j12_box(), jax.random.key(0)
    at = receiver(jnp.stack([jnp.stack([0.3 + 0.2 * s, 0.5, 0.0])]), on=0)
    rays = jnp.stack([jnp.stack([s, 0.5, 0.5])]), jnp.array([[0.0, 0.0, 1.0]]) + 0.0 * s
    corners = jnp.stack([
        jnp.stack([0.0, 0.0, 1.0 + s]), jnp.stack([0.0, s, 1.0]), jnp.stack([s, s, 1.0 - s]),
    ])  # fmt: skip
    corners = jnp.concatenate([corners, corners[:1] + corners[2:] - corners[1:2]])
    maps = bounces.RadianceMaps(room, s * jnp.ones((4, 2, 2)))
    place = tuple(jnp.stack([a]) for a in (0.5 + 0.1 * s, 0.5 + 0.0 * s, 0.0 * s))
    up = tuple(jnp.zeros(1) + a for a in (0.0 * s, 0.0, 1.0))
    photons = bounces.trace_photons(room, key, 32, 1)
    return {
        "space.bounces.Photons": s * photons.flux,
        "space.bounces.trace_photons": s * photons.position,
        "space.bounces.path_irradiance": bounces.path_irradiance(
            room, at, key=key, paths=4, bounces=1, lanes=4
        ).mean,
        "space.bounces.path_radiance": bounces.path_radiance(
            room, *rays, key=key, paths=4, bounces=1, lanes=4
        ).mean,
        "space.bounces.rectangle_irradiance": bounces.rectangle_irradiance(
            jnp.stack([s, 0.1, 0.0]), jnp.array([0.0, 0.0, 1.0]), corners
        ),
        "space.bounces.RadianceMaps": maps.L,
        "space.bounces.trace_maps": bounces.trace_maps(maps, place, up, 0).radiance,
        "space.bounces.refine_maps": bounces.refine_maps(maps, 4).L,
    }


def facets(s):
    """A triangle, its outline and what it hides."""
    corners = jnp.stack([
        jnp.stack([0.0, 0.0, 1.0 + s]), jnp.stack([1.0, s, 1.0]), jnp.stack([0.0, 1.0, 1.0]),
    ])  # fmt: skip
    one, at = meshes.mesh(corners, [[0, 1, 2]]), receiver(jnp.stack([0.2, 0.3 * s, 0.0]))
    with jax.ensure_compile_time_eval():  # what is seen of a mesh is found on the host
        still = meshes.mesh([[0.0, 0.0, 1.5], [1.0, 0.5, 1.0], [0.0, 1.0, 1.0]], [[0, 1, 2]])
        rim = silhouettes.visible_mesh_silhouettes(still, (0.2, 0.15, 0.0))
    outline = silhouettes.mesh_silhouette(one, at.position)
    return {
        "space.meshes.Mesh": one.area,
        "space.meshes.mesh": one.corners,
        "space.meshes.vertex_normals": meshes.vertex_normals(one),
        "space.silhouettes.mesh_silhouette": outline.start,
        "space.silhouettes.mesh_net_visibility": silhouettes.mesh_net_visibility(one, rim, at),
    }


def slices(s):
    """Integrals by azimuth, slice by slice."""
    scene, at = ball(s), under(s)
    few = {"nodes": 4, "most": 8}
    seen = azimuthal.visibility_by_azimuth(scene, at, **few)
    return {
        "space.azimuthal.AzimuthalIntegral": seen.gradient,
        "space.azimuthal.visibility_by_azimuth": seen.value,
        "space.azimuthal.irradiance_by_azimuth": azimuthal.irradiance_by_azimuth(scene, at, **few),
        "space.azimuthal.transport_by_azimuth": azimuthal.transport_by_azimuth(
            scene, at, transport=lambda at, w: w[2] * (2.0 + s * w[0]), inner=4, **few
        ),
    }


def jumps(s):
    """The light of a ball, and its jump across the outline."""
    light, u = light_field(ball(s), under(s)), jnp.stack([0.1 * s, 0.0, 0.1, 0.1])
    return {
        "space.light_fields.LightField": light.at(u),
        "space.light_fields.Jump": light.edges()[0].jump.at(u),
    }


def named(folder, probe, *names):
    return dict.fromkeys((f"space.{folder}.{name}" for name in names), probe)


PROBES = {
    **named(
        "library", scenes, "j12_box", "j12_occluder", "clutter", "tables", "sphere_over_plane",
        "three_spheres",
    ),
    **named(
        "estimators", gathered, "Strata", "hemisphere_strata", "Samples", "trace_strata",
        "surface_area_estimate", "stratified_estimate", "HemisphereTriangulation",
        "hemisphere_triangulation", "occlusion_aware_estimate",
    ),
    **named(
        "bounces", traced, "Photons", "trace_photons", "path_irradiance", "path_radiance",
        "rectangle_irradiance",
        "RadianceMaps", "trace_maps", "refine_maps",
    ),
    **named("meshes", facets, "Mesh", "mesh", "vertex_normals"),
    **named("silhouettes", facets, "mesh_silhouette", "mesh_net_visibility"),
    **named(
        "azimuthal", slices, "AzimuthalIntegral", "visibility_by_azimuth",
        "irradiance_by_azimuth", "transport_by_azimuth",
    ),
    **named("light_fields", jumps, "LightField", "Jump"),
}  # fmt: skip
