"""Vertices of random paths in space: where rays arrive, the BRDF there, and the next direction.

Shared by paths from receivers and photons from lamps.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder.conventions import cylindrical
from firstorder.numerics._vectors import dot, matvec, orthonormal_frame
from firstorder.scene._intersect import MISS, rounding
from firstorder.space.intersect import nearest
from firstorder.space.scene import BACK, FRONT, Scene

Rows = Float[Array, "n 3"]


class Vertex(NamedTuple):
    """Current vertices of paths: leading axis n.

    Attributes:
        position: [m]; a `step` before the side that was met.
        normal: on the side from which the path came.
        on: number of the shape, -1 for none.
        back: unit vector to where the path came from; zero at a receiver.
        albedo, specular, exponent: of the surface; a receiver's albedo is pi, so that its radiance
            is its irradiance.
        own: number of the shape that rays from here do not meet; -1 for none, and within a closed
            one, whose other side they meet.
    """

    position: Rows
    normal: Rows
    on: Int[Array, " n"]
    back: Rows
    albedo: Float[Array, " n"]
    specular: Float[Array, " n"]
    exponent: Float[Array, " n"]
    own: Int[Array, " n"]


def step(scene: Scene, place: Rows) -> Float[Array, "n 1"]:
    """By which rays start before their surface, so that others in its place lie behind [m].

    By the sizes of the shapes: places on any but planes have coordinates of up to four times them.
    """
    sizes = [jnp.max(jnp.abs(a)) for g in scene.groups for a in (g.center, g.axes)]
    return jnp.maximum(2.0 * rounding(jnp.stack(sizes)), 0.5 * rounding(place))[:, None]


def unmet(scene: Scene, on: Int[Array, " n"], back: Bool[Array, " n"]) -> Int[Array, " n"]:
    """Numbers of the shapes that rays from these sides do not meet: see `Vertex.own`."""
    closed = np.concatenate([np.full(group.count, group.closed) for group in scene.groups])
    return jnp.where(back & jnp.asarray(closed)[jnp.maximum(on, 0)], MISS, on)


def meet(scene: Scene, origin: Rows, along: Rows, on) -> tuple[Vertex, Array, Array]:
    """Hits of rays, whether there is one, and the emission there (of the sky, if there is none)."""
    hits = nearest(scene, origin, along, on)
    there = hits.index >= 0
    index = jnp.maximum(hits.index, 0)
    point = origin + jnp.where(there, hits.t, 0.0)[:, None] * along
    normal = jax.vmap(scene.normal)(index, point)
    back = dot(normal, along) > 0.0
    side = jnp.where(back, BACK, FRONT)
    sky = jax.vmap(scene.sky)(along)
    L = jnp.where(there, scene.material.emission[index, side], sky)
    m = scene.material
    normal = jnp.where(back[:, None], -normal, normal)
    vertex = Vertex(point + step(scene, point) * normal, normal, hits.index, -along,
                    m.albedo[index, side], m.specular[index], m.exponent[index],
                    unmet(scene, hits.index, back))  # fmt: skip
    return vertex, there, L


def _mirrored(here: Vertex) -> Rows:
    return 2.0 * dot(here.normal, here.back)[:, None] * here.normal - here.back


def brdf(here: Vertex, along: Rows) -> tuple[Array, Array]:
    """`f cos` of directions, and the density with which they are drawn."""
    up = jnp.maximum(dot(along, here.normal), 0.0)
    across = jnp.maximum(dot(along, _mirrored(here)), 0.0)
    e = here.exponent
    gloss = here.specular > 0.0
    power = jnp.where(gloss, across ** jnp.maximum(e, 1e-6), 0.0)
    f = here.albedo / jnp.pi + here.specular * (e + 2.0) / (2.0 * jnp.pi) * power
    p = _glossy_share(here)
    density = (1.0 - p) * up / jnp.pi + p * (e + 1.0) / (2.0 * jnp.pi) * power
    return f * up, density


def _glossy_share(here: Vertex) -> Array:
    total = here.albedo + here.specular
    return here.specular / jnp.where(total > 0.0, total, 1.0)


def scattered(here: Vertex, u: Float[Array, "n 3"]) -> tuple[Rows, Array, Array]:
    """Random direction, `f cos / density`, and the density."""
    gloss = u[:, 0] < _glossy_share(here)
    e = jnp.where(gloss, here.exponent, 1.0)
    height = u[:, 1] ** (1.0 / (e + 1.0))
    rho, phi = jnp.sqrt(jnp.maximum(1.0 - height**2, 0.0)), 2.0 * jnp.pi * u[:, 2]
    axis = jnp.where(gloss[:, None], _mirrored(here), here.normal)
    local = cylindrical(rho, phi, height)
    along = matvec(orthonormal_frame(axis), local)
    value, density = brdf(here, along)
    return (
        along,
        jnp.where(density > 0.0, value / jnp.where(density > 0.0, density, 1.0), 0.0),
        density,
    )
