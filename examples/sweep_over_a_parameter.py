"""Irradiance behind a disc over the disc's radius: values and slopes of a whole sweep."""

import jax
import jax.numpy as jnp

from firstorder import flatland as world
from firstorder import session

session.start()
floor = world.Receiver.at((0.3, 0.0))


def irradiance(radius):
    """At the floor, behind a disc of that radius [W/m]."""
    lamp = world.primitive(world.Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
    disc = world.primitive(world.Circles((0.1, 0.5), radius))
    return world.irradiance(world.Scene.of(lamp, disc), floor)


radii = jnp.linspace(0.05, 0.15, 5)
values, slopes = jax.jit(jax.vmap(jax.value_and_grad(irradiance)))(radii)
for row in zip(radii, values, slopes, strict=True):
    print("radius {:.3f} m: E = {:.9f} W/m, dE/dradius = {:.9f} W/m^2".format(*row))
