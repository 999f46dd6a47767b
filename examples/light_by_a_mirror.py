"""Irradiance by way of a flat mirror, and how it changes as the mirror is moved and tilted."""

import jax
import jax.numpy as jnp

from firstorder import session
from firstorder.flatland import Receiver, Scene, Segments, mirror_irradiance, primitive

session.start()
lamp = primitive(Segments((-0.5, 1.0), (-1.5, 1.0)), emission=1.0)
floor = Receiver.at((0.2, 0.0))


def irradiance(place, top):
    """At the floor, off a mirror from (place, 0) to (top, 0.3) that reflects 80 % [W/m]."""
    mirror = primitive(
        Segments(jnp.stack([place, 0.0]), jnp.stack([top, 0.3])), mirror=0.8, name="mirror"
    )
    scene = Scene.of(lamp, mirror)
    return mirror_irradiance(scene, floor, mirrors=scene.named("mirror"))


E, (by_foot, by_top) = jax.value_and_grad(irradiance, argnums=(0, 1))(
    jnp.array(1.0), jnp.array(1.0)
)
print("E", E)
print("by the foot of the mirror", by_foot)
print("by its top", by_top)
