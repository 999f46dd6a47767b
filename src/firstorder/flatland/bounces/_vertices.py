"""One step of any random path of flatland: a vertex, the light sampled from it, and the next one.

Shared by paths from receivers and photons from lights.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder._argument_checks import is_concrete
from firstorder.flatland.bounces._light_sampling import (
    Lights,
    density_of_shape,
    density_of_sky,
    sample_light,
)
from firstorder.flatland.bounces._scatter import Scattered, Surface, reflect
from firstorder.flatland.intersect import nearest, occluded
from firstorder.flatland.scene import Scene
from firstorder.numerics._planar import cross_2d, dot_2d, left
from firstorder.sampling._paths import Lengths
from firstorder.scene._primitives import BACK, FRONT

Scatter = Callable[[Surface, tuple[Array, Array], Array, bool], Scattered]


class Vertex(NamedTuple):
    """Current vertices of paths. Leading axis: lanes.

    Attributes:
        position: [m]; a step of `Lights` before the side that was met.
        tangent: unit; the normal of the side that was met is to its left.
        sine, cosine: of the direction that the ray came from.
        surface: material of that side.
        on: number of the shape.
    """

    position: Float[Array, "n 2"]
    tangent: Float[Array, "n 2"]
    sine: Float[Array, " n"]
    cosine: Float[Array, " n"]
    surface: Surface
    on: Int[Array, " n"]


class NextVertex(NamedTuple):
    """The vertex at the end of a ray, and the light found there.

    Attributes:
        vertex: where it ends.
        there: whether anything is met.
        front: whether its front is met.
        s: the parameter where.
        radiance: emitted against the ray, by a shape or by the sky [W/(m rad)].
        density: with which a light sample would have looked in this direction, per radian.
    """

    vertex: Vertex
    there: Bool[Array, " n"]
    front: Bool[Array, " n"]
    s: Float[Array, " n"]
    radiance: Float[Array, " n"]
    density: Float[Array, " n"]


class Plan(NamedTuple):
    """Options by which paths are made.

    Attributes:
        length: of paths, how it ends.
        next_event: 1 if lights are sampled, 0 if only point lights are.
        glossy: whether any shape has a glossy lobe; decided before compilation.
        scatter: what surfaces do.
    """

    length: Lengths
    next_event: Float[Array, ""]
    glossy: bool
    scatter: Scatter


def sampled_light(scene, where: Lights, here: Vertex, u, survive, plan: Plan) -> Array:
    """Next-event estimation: `f cos L / (pdf + pdf of the surface)`, or `f cos I / (r P)`."""
    look = sample_light(scene, where, here.position, u)
    sine, cosine = -dot_2d(look.along, here.tangent), dot_2d(look.along, left(here.tangent))
    f, density = reflect(here.surface, (here.sine, here.cosine), sine, cosine, plan.glossy)
    own = jnp.where(look.point, 0.0, density * survive)
    amount = f * look.value / (look.density + own)
    lit = ~occluded(scene, here.position, look.end, here.on, look.on)
    return jnp.where(lit & (amount > 0.0), amount, 0.0)


def plane_direction(vertex: Vertex, turned: Scattered) -> Float[Array, "n 2"]:
    """The direction in the plane of a scattered ray."""
    return turned.cosine[:, None] * left(vertex.tangent) - turned.sine[:, None] * vertex.tangent


def meet(
    scene: Scene,
    where: Lights,
    origin: Float[Array, "n 2"],
    on: Int[Array, " n"],
    along: Float[Array, "n 2"],
    plan: Plan,
) -> NextVertex:
    """Next vertices of rays, and the light found there."""
    hits = nearest(scene, origin, along, on)
    there = hits.index >= 0
    index = jnp.maximum(hits.index, 0)
    position, v, _ = jax.vmap(scene.motion)(index, hits.s)
    speed = jnp.sqrt(dot_2d(v, v))
    turn = cross_2d(v, along)  # speed times the cosine, negative if the front is met
    front = turn < 0.0
    side = jnp.where(front, FRONT, BACK)
    tangent = v / speed[:, None] * jnp.where(front, 1.0, -1.0)[:, None]
    m = scene.material
    ior = jnp.where(front | (m.ior[index] == 0.0), m.ior[index], _inverse(m.ior[index]))
    surface = Surface(
        m.albedo[index, side], m.mirror[index], m.specular[index], m.exponent[index], ior
    )
    before = position + where.step * left(tangent)
    vertex = Vertex(
        before, tangent, dot_2d(along, tangent), -dot_2d(along, left(tangent)), surface, index
    )
    L = jnp.where(there, m.emission[index, side], 0.0)
    reach = jnp.where(there, hits.t, 1.0)
    density = density_of_shape(scene, where, index, front, jnp.abs(turn), reach)
    if scene.environment is not None:
        sky = jax.vmap(scene.environment)(jnp.arctan2(-along[:, 0], along[:, 1]))
        L = jnp.where(there, L, sky)
        density = jnp.where(there, density, density_of_sky(where, along))
    return NextVertex(vertex, there, front, hits.s, L, density)


def has_gloss(scene: Scene) -> bool:
    """Whether any shape has a glossy lobe; if nobody can know, yes."""
    lobe = scene.material.specular
    return not is_concrete(lobe) or bool(np.any(np.asarray(lobe) > 0.0))


def _inverse(x: Array) -> Array:
    return 1.0 / jnp.where(x > 0.0, x, 1.0)
