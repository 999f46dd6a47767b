"""The surface point that a pixel sees, with its footprint, lobes and surface maps."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from firstorder._display import Module
from firstorder.conventions import shape_operator
from firstorder.imaging._area_lights import SurfaceReflectance
from firstorder.imaging._bumps import solid_tilted
from firstorder.imaging._reflection import SurfacePoint, surface_point
from firstorder.imaging._textures import shape_uv
from firstorder.imaging.camera import Pinhole, PixelFootprint
from firstorder.imaging.facets import Facets
from firstorder.imaging.surface_maps import SurfaceMaps
from firstorder.numerics._vectors import cross, dot, near_one, orthonormal_frame, unit
from firstorder.scene._primitives import BACK, FRONT
from firstorder.space.primitives import Material
from firstorder.space.scene import Scene


class SurfaceInteraction(Module):
    """A surface point seen by a pixel, with its footprint, reflectance and curvature.

    Attributes:
        point: of the surface, bumps included.
        view: the camera's ray.
        lobe: how the surface reflects.
        S: shape operator of the surface without bumps [1/m].
    """

    point: SurfacePoint
    view: PixelFootprint
    lobe: SurfaceReflectance
    S: Float[Array, "2 2"]


def surface_interaction(
    scene: Scene,
    camera: Pinhole,
    p: Float[Array, "2"],
    index: Int[Array, ""],
    finish: SurfaceMaps | None = None,
) -> SurfaceInteraction:
    """Surface point of a pixel, with curvature, bumps and the camera's footprint.

    Args:
        scene: shapes and materials.
        camera: the eye.
        p: image coordinates.
        index: of the shape that is seen there; it must be met.
        finish: bumps and textures, by the shape's number.
    """
    d = camera.direction(p)
    x, n, distance = scene.surface(index, camera.eye, d)
    back = dot(n, d) > 0.0
    front = jnp.where(back, -1.0, 1.0)
    axes = orthonormal_frame(front * n)
    T = axes[:, :2]
    S = shape_operator(T, front * jax.jacfwd(lambda x: scene.normal(index, x))(x) @ T)
    view = camera.view(p, distance, axes[:, 2])
    m = scene.material
    side = jnp.where(back, BACK, FRONT)
    lobe = SurfaceReflectance(
        m.albedo[index, side], m.specular[index], jnp.maximum(m.exponent[index], 1e-6)
    )
    plain = SurfaceInteraction(surface_point(x, axes, S), view, lobe, S)

    def uv(x):
        return scene.ask(index, lambda a: shape_uv(a, x))

    return apply_surface_maps(plain, index, front, finish, uv, lambda x: scene.normal(index, x))


def apply_surface_maps(
    at: SurfaceInteraction,
    index: Int[Array, ""],
    front: Array,
    finish: SurfaceMaps | None,
    uv: Callable[[Array], Array],
    up: Callable[[Array], Array],
) -> SurfaceInteraction:
    """Surface point with its bumps and its texture, from one without.

    Args:
        at: what is seen there of the surface by itself.
        index: the primitive's number.
        front: 1 or -1, for its front or back: a bump is a dip from behind, also in a normal map.
        finish: what it has on it.
        uv: of a position on it, where `finish` has pictures.
        up: the unit normal of its front there, of the surface by itself.
    """
    if finish is None:
        return at
    point, lobe, x = at.point, at.lobe, at.point.position
    for tilt in finish.leanings(index, uv, up):
        point = solid_tilted(point, lambda x, tilt=tilt: front * tilt(x))
    for factor in finish.factors(index, uv):
        share, slope = factor(x), jax.jacfwd(factor)(x)
        lobe = eqx.tree_at(
            lambda a: (a.albedo, a.slope),
            lobe,
            (lobe.albedo * share, lobe.slope * share + lobe.albedo * slope),
        )
    return SurfaceInteraction(point, at.view, lobe, at.S)


def facet_interaction(
    known: Facets,
    material: Material,
    camera: Pinhole,
    p: Float[Array, "2"],
    face: Int[Array, ""],
    finish: SurfaceMaps | None = None,
) -> SurfaceInteraction:
    """Surface interaction of a pixel with a mesh; twin of `surface_interaction`.

    Args:
        known: the faces.
        material: one row for each primitive, by the numbers of `known.part`.
        camera: the eye.
        p: image coordinates.
        face: that is seen there; it must be met.
        finish: bumps and textures, by the primitive's number.

    Reference: R07 §9.1, "curvature on meshes".
    """
    d, A = camera.direction(p), known.corners[face, 0]
    up = unit(near_one(cross(known.corners[face, 1] - A, known.corners[face, 2] - A)))
    against = dot(up, d)
    distance = dot(A - camera.eye, up) / jnp.where(against == 0.0, jnp.inf, against)
    x = camera.eye + distance * d
    plain = known.point(face, x)
    back = against > 0.0
    front = jnp.where(back, -1.0, 1.0)
    T = orthonormal_frame(front * up)[:, :2]
    turning = front * plain.turning @ (plain.tangents.T @ T)
    point = SurfacePoint(x, T, front * plain.normal, turning)
    view = camera.view(p, distance, front * up)
    index = known.part[face]
    side = jnp.where(back, BACK, FRONT)
    exponent = jnp.maximum(material.exponent[index], 1e-6)
    lobe = SurfaceReflectance(material.albedo[index, side], material.specular[index], exponent)
    at = SurfaceInteraction(point, view, lobe, shape_operator(T, turning))
    return apply_surface_maps(
        at, index, front, finish, lambda x: known.uv_at(face, x), lambda x: up
    )
