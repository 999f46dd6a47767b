"""Radiance that arrives along traced rays, and from points of curves."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from firstorder.flatland.direct_lighting import Radiance
from firstorder.flatland.intersect import nearest
from firstorder.flatland.scene import Frenet, Scene
from firstorder.flatland.visible import Receiver
from firstorder.numerics._planar import dot_2d
from firstorder.scene._intersect import rounding, tie
from firstorder.scene._primitives import BACK, FRONT


def seen_from(
    scene: Scene, at: Receiver, number: Int[Array, " n"], frames: Frenet
) -> Bool[Array, " n"]:
    """Whether a receiver sees points of shapes; of several in one place, the shape that counts.

    A straight shape never shows itself. One that bends may, but not beside the receiver, where the
    directions between two of its points are a matter of rounding.

    Args:
        scene: all shapes.
        at: the receiver.
        number: of the shape of each point.
        frames: of the shapes there.
    """
    scene, at, frames = jax.lax.stop_gradient((scene, at, frames))
    way = frames.position - at.position
    r = jnp.sqrt(dot_2d(way, way))
    least = 32.0 * jnp.finfo(r.dtype).eps ** 0.5
    start = jnp.broadcast_to(at.position, way.shape)
    hits = nearest(scene, start, way / jnp.where(r > 0.0, r, 1.0)[:, None], at.on)
    # A ray to the very end of a shape may miss it; what it meets then lies behind.
    free = hits.t > r * (1.0 + tie(r.dtype)) + rounding(start)
    met = (hits.index == number) & (hits.t > r * (1.0 - least))
    bent = (number != at.on) | (r * jnp.abs(frames.kappa) > least)
    return (r > 0.0) & (free | met) & bent


def incident_radiance(
    scene: Scene, radiance: Radiance | None, index, s, front, along
) -> Float[Array, ""]:
    """Radiance that arrives along a ray: from the shape it hits, or from the sky."""
    number = jnp.maximum(index, 0)
    if radiance is None:
        L = scene.material.emission[number, jnp.where(front, FRONT, BACK)]
    else:
        L = radiance(number, s, front, along)
    sky = jnp.zeros((), along.dtype)
    if scene.environment is not None:
        sky = scene.environment(jnp.arctan2(-along[0], along[1]))
    return jnp.where(index >= 0, L, sky)
