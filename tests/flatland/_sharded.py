"""One process of `test_sharding.py`: irradiance, its gradient and path tracing of receivers.

Without arguments: on one device, on two of this process, and on two with other receivers. With a
port and a rank: one of two processes. Prints for each result rows of numbers, exactly, and which
receivers they are of.
"""

import json
import sys

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from firstorder import session
from firstorder.flatland import Receiver, Scene, Segments, irradiance, primitive
from firstorder.flatland.bounces.pathtrace import path_irradiance

X = np.array([-0.7, -0.11, 0.3, 0.8])


def measured(x):
    """Everything about a row of receivers on the floor."""
    scene = Scene.of(
        primitive(Segments((-1.0, 0.0), (1.0, 0.0)), albedo=0.5),
        primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0, albedo=0.3),
        primitive(Segments((-0.2, 0.5), (0.2, 0.5))),
    )
    at = Receiver(jnp.stack([x, 0.0 * x], -1), 0.0 * x, jnp.zeros(x.shape, int))
    E, slope = jax.vmap(
        jax.value_and_grad(
            lambda x: irradiance(scene, Receiver(jnp.stack([x, 0.0 * x]), 0.0 * x, 0))
        )
    )(x)
    found = path_irradiance(scene, at, key=jax.random.key(3), paths=4000, lanes=64)
    return E, slope, found.mean, found.error


def spread(compiled, x):
    """The same on all devices of all processes: what this process holds of the result."""
    over = NamedSharding(Mesh(np.array(jax.devices()), ("x",)), PartitionSpec("x"))
    results = compiled(jax.make_array_from_callback(x.shape, over, lambda i: x[i]))
    assert len(results[0].sharding.device_set) == 2
    rows = [[], *([] for _ in results)]
    for shards in zip(*(r.addressable_shards for r in results), strict=True):
        rows[0].extend(range(len(x))[shards[0].index[0]])
        for row, shard in zip(rows[1:], shards, strict=True):
            row.extend(np.asarray(shard.data).tolist())
    return rows


def main(*arguments):
    session.start()
    if arguments:
        port, rank = arguments
        jax.distributed.initialize(f"127.0.0.1:{port}", 2, int(rank))
    assert len(jax.devices()) == 2
    compiled = jax.jit(measured)
    out = {"spread": spread(compiled, X)}
    if not arguments:
        whole = compiled(jax.device_put(jnp.asarray(X), jax.devices()[0]))
        out["whole"] = [[0, 1, 2, 3], *(np.asarray(a).tolist() for a in whole)]
        out["moved"] = spread(compiled, X + 1e-6 * np.array([0.0, 0.0, 1.0, 1.0]))
    print("result", json.dumps(out))


if __name__ == "__main__":
    main(*sys.argv[1:])
