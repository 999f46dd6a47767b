"""Compiled programs of the renderer, each of a block of pixels.

What a block shows, what shapes hide from it (`scene._intersect.free_ways`) and its shading are
three programs whose arrays stay on the device; between them Embree traces what models hide.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from firstorder._display import Module
from firstorder.imaging._area_lights import SurfaceReflectance
from firstorder.imaging._interaction import (
    SurfaceInteraction,
    facet_interaction,
    surface_interaction,
)
from firstorder.imaging._light_terms import Light, LightFrame, light_frame, light_terms
from firstorder.imaging._point_shading import OF_SHADED, ShadedPixels, shaded_pixel
from firstorder.imaging._reflection import SurfacePoint
from firstorder.imaging.camera import Pinhole, PixelFootprint
from firstorder.scene._bands import by_band
from firstorder.scene._intersect import end_slack, free_ways
from firstorder.space.intersect import nearest
from firstorder.space.scene import Scene


@eqx.filter_jit
def directions(camera: Pinhole, p):
    """Unit vectors of camera rays."""
    return jax.vmap(camera.direction)(p)


@eqx.filter_jit
def met(scene: Scene, eye, along):
    """Distances and numbers of the shapes that camera rays meet."""
    hits = nearest(scene, jnp.broadcast_to(eye, along.shape), along)
    return hits.t, hits.index


@eqx.filter_jit
@by_band((-1, -2))
def sky_of(sky, camera: Pinhole, p):
    """The sky behind everything, and its gradient in the image."""
    return jax.vmap(jax.value_and_grad(lambda p: sky(camera.direction(p))))(p)


class LookedAt(Module):
    """Surface interactions of a block of pixels, and what shapes may hide from them.

    Attributes:
        point, view, S: as in `imaging._interaction.SurfaceInteraction`.
        specular, exponent: of the lobes.
        albedo: of the lobes; bands last.
        slope: its gradient in space; bands last.
        up: base normals.
        on: number of the shape on which each lies, -1 for a model.
    """

    BANDED: ClassVar = {"albedo": 1, "slope": 2}

    point: SurfacePoint
    view: PixelFootprint
    S: jax.Array
    specular: jax.Array
    exponent: jax.Array
    up: jax.Array
    on: jax.Array
    albedo: jax.Array
    slope: jax.Array

    @property
    def interaction(self) -> SurfaceInteraction:
        """Surface interactions of one band."""

        def one(point, view, S, *lobe):
            return SurfaceInteraction(point, view, SurfaceReflectance(*lobe), S)

        lobe = self.albedo, self.specular, self.exponent, self.slope
        return jax.vmap(one)(self.point, self.view, self.S, *lobe)


def interactions(given) -> SurfaceInteraction:
    """Surface interactions of shapes and of models; both are made, and the right one is kept.

    Args:
        given: scene, faces, materials, camera, surface maps; places, shapes and faces of pixels.
    """
    scene, known, material, camera, finish, p, index, face = given

    def one(p, i, f):
        if scene is None:
            return facet_interaction(known, material, camera, p, f, finish)
        if known is None:
            return surface_interaction(scene, camera, p, i, finish)
        shape = surface_interaction(scene, camera, p, jnp.where(f < 0, i, 0), finish)
        facet = facet_interaction(known, material, camera, p, jnp.maximum(f, 0), finish)
        return jax.tree.map(lambda a, b: jnp.where(f < 0, a, b), shape, facet)

    return jax.vmap(one)(p, index, face)


@eqx.filter_jit
@by_band((None,) * 14 + (-1, -1))
def looked_at(given) -> LookedAt:
    """Surface interactions of a block, as `interactions` takes it, and what else shadows ask."""
    *_, p, index, face = given
    at, on = interactions(given), jnp.where(face < 0, index, -1)
    up = jax.vmap(lambda point: point.base_normal)(at.point)
    lobe = at.lobe
    slope = jnp.broadcast_to(lobe.slope, (len(p), 3))
    return LookedAt(
        at.point, at.view, at.S, lobe.specular, lobe.exponent, up, on, lobe.albedo, slope
    )


class Ways(NamedTuple):
    """Ways from points to the nodes of a light, for a tracer of models.

    Attributes:
        way: to each node, (n, k, 3) [m].
        lit: whether the node is above the surface and sends light to it.
    """

    way: jax.Array
    lit: jax.Array


@eqx.filter_jit
def ways(at: LookedAt, lights: Sequence[Light]) -> list[Ways]:
    """Ways to the nodes of each light."""

    def to(light):
        nodes = light_frame(light, at.point.position, at.up)
        lit = (nodes.along(at.up) > 0.0) & (nodes.share > 0.0)
        if nodes.facing is not None:
            lit &= (nodes.facing > 0.0)[:, None]
        way = jnp.stack([jnp.broadcast_to(a, lit.shape) for a in nodes.ways], -1)
        return Ways(way, lit)

    return [to(light) for light in lights]


@eqx.filter_jit
def shares(at: LookedAt, scene: Scene, lights: Sequence[Light]) -> list[jax.Array]:
    """Share of the way at which shapes hide the nodes of each light, infinity where none does.

    A program of its own: fused with what is made of it, the rays would be traced for each use.
    """
    x = at.point.position
    nodes = [light_frame(light, x, at.up) for light in lights]
    return [free_ways(scene.groups, x, each.ways, at.on) for each in nodes]


@eqx.filter_jit
@by_band(OF_SHADED)
def pixels(at: LookedAt, lights: Sequence[Light], hidden) -> ShadedPixels:
    """Shading of a block.

    Args:
        at: what it shows.
        lights: the light.
        hidden: for each light the share of the way at which its nodes are hidden, infinity for
            those that are seen; None if all are.
    """
    each, found = at.interaction, []
    for k, light in enumerate(lights):
        if hidden is None:
            found.append(light_terms(light, each))
            continue
        nodes = light_frame(light, at.point.position, at.up)
        found.append(light_terms(light, each, *_occlusion(nodes, hidden[k], at.point.position)))
    return jax.vmap(shaded_pixel)(each, found)


def _occlusion(nodes: LightFrame, share, x):
    """Whether nodes are seen, and the depths of blockers as `shadow_edge_terms` wants them."""
    near, far = nodes.light.near, jnp.sqrt(sum(a * a for a in nodes.ways))
    hidden = share < (1.0 - end_slack(x[:, None], far) / far if near else jnp.inf)
    share = jnp.where(hidden, share, 0.0)
    depth = share if near else share * far
    return (~hidden).astype(share.dtype), depth


@eqx.filter_jit
def values(at: LookedAt, lights: Sequence[Light], hidden) -> ShadedPixels:
    """Values alone: gradients are not computed."""
    found = pixels(at, lights, hidden)
    zeros = jax.tree.map(jnp.zeros_like, found)
    return eqx.tree_at(lambda a: a.value, zeros, found.value)
