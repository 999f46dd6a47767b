"""A cache of second order: one gather of rays tells a record its value, gradient and Hessian."""

import jax
import jax.numpy as jnp
import numpy as np

from firstorder import caching, session
from firstorder.space import bounces, library

session.start()
room = library.clutter()  # boxes and balls in a closed room
(floor,) = room.named("floor")
walls = bounces.solve_radiosity(room, cells=32)

k = (np.arange(40) + 0.5) / 40
place = np.stack(np.meshgrid(k, k, indexing="ij"), -1).reshape(-1, 2)
place = place[~jax.vmap(lambda x: room.inside(jnp.append(x, 0.01)))(place)]
true = caching.tabulate_candidates(walls, place, caching.gather_directions(64, 128), floor).E

table = caching.occlusion_table(walls, place, floor, rays=1024)
some, orders = table.candidates(), caching.random_orders(len(place), orders=4)
reach = caching.radius_for(caching.derivative_norm(table.hessian, 2), 1.0, dims=2)
print("mean irradiance", true.mean())


def regions(tolerance, most):
    """Discs of radii that the Hessian says, within a cell and `most`."""
    radius = np.minimum(reach * tolerance**0.25, most)
    return caching.circular_regions(radius, 1 / 40, 1.3, dims=2)


# Beyond a few lengths of the shortest ray the third derivative is what counts.
for order, most in ((1, 1.3), (2, 3.0 * table.minimum)):
    found = caching.fit(
        some, lambda t, most=most: regions(t, most), orders, 240, low=1e-14, high=1e9
    )
    values = found.lookup(some, place, order=order, fade=True).value
    print(f"rms error of 240 records, order {order}", caching.rms(values, true).mean())
