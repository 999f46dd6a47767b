"""A cache on the floor below a shelf, whose records know the lines along which its shadow bends."""

import jax
import numpy as np

from firstorder import caching, session, space
from firstorder.space.discontinuities import discontinuity_mesh

session.start()
lamp = space.rectangle((0.5, 0.5, 1.0), (0.0, 0.45, 0.0), (0.45, 0.0, 0.0))
shelf = space.box((0.2, 0.2, 0.33), (0.4, 0.8, 0.36))
scene = space.Scene.of(space.primitive(lamp, emission=1.0), space.primitive(shelf))
middle = space.Receiver.at((0.5, 0.5, 0.0))


def irradiance(x):
    """At a place of the floor."""
    return space.irradiance(scene, middle.moved(x))


k = (np.arange(32) + 0.5) / 32 - 0.5
place = np.stack(np.meshgrid(k, k, indexing="ij"), -1).reshape(-1, 2)
some = jax.jit(lambda x: caching.Candidates.from_function(irradiance, x, derivatives=2))(place)
size = caching.derivative_norm(some.derivative(2), 2, "mean")
lines = caching.EventLines.of(discontinuity_mesh(scene, middle, points=9, reach=0.5), middle)
ways = {
    "Hessian": lambda t: caching.radius_for(size, t, dims=2),
    "Hessian and lines": lambda t: caching.radius_with_lines(size, t, 1e-3, 2.0, place, lines),
}
orders = caching.random_orders(len(place), orders=2)
for name, radius in ways.items():
    regions = jax.jit(lambda t, of=radius: caching.circular_regions(of(t), 1 / 32, 1.5, dims=2))
    found = caching.fit(some, regions, orders, 150, low=1e-9, high=1.0)
    error = caching.rms(found.lookup(some, place).value, some.value).mean()
    print(f"rms error of 150 records, {name}", error)
