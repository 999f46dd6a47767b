"""Radiance that arrives along traced rays, and from points of curves."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from firstorder.flatland.direct_lighting import Radiance
from firstorder.flatland.scene import Frenet, Scene
from firstorder.flatland.visible import Receiver
from firstorder.numerics._planar import dot_2d
from firstorder.scene._primitives import BACK, FRONT


def off_the_receiver(at: Receiver, number: Int[Array, " n"], frames: Frenet) -> Bool[Array, " n"]:
    """Whether points of shapes can be seen from a receiver, as far as its own shape goes.

    A straight shape never shows itself. One that bends may, but not beside the receiver, where the
    directions between two of its points are a matter of rounding.

    Args:
        at: the receiver.
        number: of the shape of each point.
        frames: of the shapes there.
    """
    way = frames.position - at.position
    least = 32.0 * jnp.finfo(way.dtype).eps ** 0.5
    return (number != at.on) | (jnp.sqrt(dot_2d(way, way)) * jnp.abs(frames.kappa) > least)


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
