"""Radiance that arrives along traced rays."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder.flatland.direct_lighting import Radiance
from firstorder.flatland.scene import Scene
from firstorder.scene._primitives import BACK, FRONT


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
