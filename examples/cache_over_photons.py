"""A photon map, and an irradiance cache on a floor that gathers from it."""

import jax
import numpy as np

from firstorder import caching, session
from firstorder.space import bounces, library

session.start()
box = library.j12_box()  # the light of a grey wall on a black floor
(floor,) = box.named("floor")
photons = bounces.photon_map(box, bounces.trace_photons(box, jax.random.key(0), 200_000, 4))
how = bounces.DensityEstimator(k=300, cut=True)
walls = bounces.photon_radiance_maps(photons, how, cells=32)
brightest = caching.largest_radiance(bounces.photon_radiances(photons, how))

k = (np.arange(48) + 0.5) / 48
place = np.stack(np.meshgrid(k, k, indexing="ij"), -1).reshape(-1, 2)
rays = caching.gather_directions(32, 128)
table = caching.tabulate_candidates(walls, place, rays, floor)
# Every surface as bright as the brightest: then the threshold is an irradiance times an area.
size = caching.derivative_norm(brightest * table.geometric, 2)
reach = caching.circular_regions(caching.radius_for(size, 2e-5, dims=2), 0.03, 0.5, dims=2)
some, (visits,) = table.candidates(), caching.random_orders(len(place), orders=1)
cache = caching.Cache.of(some, reach, caching.fill(some, reach, visits))

true = bounces.solve_radiosity(box, cells=64)
other = caching.tabulate_candidates(true, place, rays, floor).E
error = caching.rms(cache(place).value[None], other)
print("records", cache.count, "of", len(place))
print("brightest", brightest, "of the lamp's 1")
print("rms error", error, "of a mean of", other.mean())
