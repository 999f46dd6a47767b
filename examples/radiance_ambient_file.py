"""Irradiance with gradients as an ambient file of Radiance, and such a file as a cache."""

import pathlib
import tempfile

import jax
import numpy as np

from firstorder import io, session, space

session.start()
lamp = space.rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
scene = space.Scene.of(space.primitive(lamp, emission=1.0))


def below(x):
    """Irradiance at a place of the floor."""
    return space.irradiance(scene, space.Receiver.at(x))


k = (np.arange(8) + 0.5) / 4.0 - 1.0
floor = np.stack(np.meshgrid(k, k, [0.0], indexing="ij"), -1).reshape(-1, 3)
E, gradient = map(np.asarray, jax.vmap(jax.value_and_grad(below))(floor))
n, (t, _, up) = len(floor), np.eye(3)
every = dict(level=0, weight=1.0, normal=up, u=t, radii=(0.3, 0.3), turning=(0.0, 0.0), corral=0)
every = {name: np.tile(a, (n, *[1] * np.ndim(a))) for name, a in every.items()}
grey, share = np.repeat(E[:, None], 3, 1) / np.pi, gradient[:, :2] / E[:, None]
records = io.AmbientRecords(position=floor, value=grey, gradient=share, **every)
file = pathlib.Path(tempfile.mkdtemp(), "floor.txt")
io.write_ambient(file, records)  # for `lookamb -d -r floor.txt > floor.amb`

cache = io.cache_from_ambient(io.read_ambient(file), np.zeros(3), np.eye(3))
at = np.random.default_rng(0).uniform(-0.9, 0.9, (200, 2))
found, true = cache(at), jax.vmap(below)(np.column_stack([at, np.zeros(200)]))
print("records", n, "covered", found.covered.mean())
print("largest error", np.max(np.abs(found.value - true)), "of", np.max(true))
