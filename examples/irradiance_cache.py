"""An irradiance cache along a floor in flatland, and how far off it is between its records."""

import jax
import jax.numpy as jnp

from firstorder import caching, session
from firstorder import flatland as world

session.start()
scene = world.Scene.of(
    world.primitive(world.Segments((-1.0, 0.0), (1.0, 0.0)), name="floor"),
    world.primitive(world.Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0),
)
(floor,) = scene.named("floor")
some = caching.scene_candidates(scene, floor, jnp.linspace(0.0, 1.0, 65), derivatives=2)
size = caching.derivative_norm(some.derivative(2), 2)  # |E''| says how far a record may serve
reach = caching.circular_regions(caching.radius_for(size, 1e-3), 1 / 64, 1.0)
(visits,) = caching.random_orders(65, orders=1, seed=1)
cache = caching.Cache.of(some, reach, caching.fill(some, reach, visits))

s = jnp.linspace(0.01, 0.99, 99)
true = jax.vmap(lambda s: world.irradiance(scene, world.receiver(scene, floor, s)))(s)
found = cache(2.0 * s[:, None])  # places have an axis of coordinates; the floor is 2 m long
print("records", cache.count)
print("covered", bool(found.covered.all()))
print("at x = -0.4 m", found.value[29])
print("largest error", jnp.max(jnp.abs(found.value - true)))
