"""Rays through meshes and analytic shapes, and the gradient of a soft shadow beside differences.

Rates are per core: every measurement is a process of its own, pinned to one before JAX starts.
Embree is asked on the host and its hits are met again in double precision; both rates are printed.
The soft shadow is that of a sphere under a rectangular light; its gradient from silhouettes stands
beside central differences of sampled light. Silhouettes have no error but rounding, so "at equal
error" is asked the other way: what differences cost at the error that one would put up with.
"""

import json
import sys

import numpy as np
import pytest

from benchmarks.one_core import answer, best, pinned

RAYS = 1 << 16
SIZES = (4, 64, 512)
TRIANGLES = (1280, 20480)
RECEIVERS, STEPS, STRATA = 256, (0.01, 0.03, 0.1, 0.3), (8, 16, 32, 64)
HEIGHT = 3.0  # of the light


def rays(seed=0):
    rng = np.random.default_rng(seed)
    d = rng.normal(size=(RAYS, 3))
    return rng.uniform(-1.0, 1.0, (RAYS, 3)), d / np.linalg.norm(d, axis=1)[:, None]


def icosphere(triangles):
    import trimesh

    from firstorder.space.meshes.triangle_mesh import mesh

    ball = trimesh.creation.icosphere(round(np.log(triangles / 20) / np.log(4)))
    return mesh(0.5 * ball.vertices, ball.faces)


def rates():
    """Lines to print, and the analytic rates."""
    import jax
    import jax.numpy as jnp

    from firstorder.io import Embree
    from firstorder.space import Scene, nearest, primitive
    from firstorder.space.shapes.kinds import Boxes, Ellipsoids

    o, d = rays()
    lines = []
    for triangles in TRIANGLES:
        tracer = Embree(icosphere(triangles))
        hits = best(tracer.nearest, o, d, repeats=3)
        alone = best(tracer._propose, o, d, np.zeros(RAYS), np.inf, repeats=3)
        lines.append(
            f"Embree, {triangles:6} triangles: {1e-6 * RAYS / hits:6.2f} M rays/s with hits in "
            f"double, {1e-6 * RAYS / alone:6.2f} before them"
        )
    rng = np.random.default_rng(1)
    slow = {}
    for dtype in (jnp.float64, jnp.float32):
        for count in SIZES:
            half = count // 2
            center = jnp.asarray(rng.uniform(-1.0, 1.0, (count, 3)), dtype)
            axes = 0.1 * jnp.broadcast_to(jnp.eye(3, dtype=dtype), (count, 3, 3))
            scene = Scene.of(
                primitive(Ellipsoids(center[:half], axes[:half])),
                primitive(Boxes(center[half:], axes[half:])),
            )
            start, way = jnp.asarray(o, dtype), jnp.asarray(d, dtype)
            t = best(jax.jit(nearest), scene, start, way, repeats=3)
            slow[dtype.__name__, count] = 1e-6 * RAYS / t
            lines.append(
                f"analytic, {count:4} shapes, {dtype.__name__}: {1e-6 * RAYS / t:6.2f} M rays/s "
                f"({1e-9 * count * RAYS / t:5.2f} G tests/s)"
            )
    return ["rays per second on one core", *lines], list(slow.values())


def soft_shadow():
    """Lines to print, and the time of differences over ours, for more and more rays."""
    import jax

    rng = np.random.default_rng(2)
    x = np.append(rng.uniform(-0.6, 0.6, (RECEIVERS, 2)), np.zeros((RECEIVERS, 1)), 1)
    x, keys = jax.numpy.asarray(x), jax.random.split(jax.random.key(0), RECEIVERS)
    ours, truth = by_silhouettes(x)
    scale, lines, ratios = np.sqrt(np.mean(truth**2)), [], []
    for n in STRATA:
        theirs, error = by_differences(x, keys, n, truth)
        ratios.append(theirs / ours)
        lines.append(
            f"{n * n:5} rays at each end: error {error / scale:.1e} of the RMS, "
            f"{theirs / ours:6.1f} times our time"
        )
    head = (
        f"gradient of a soft shadow, {RECEIVERS} receivers: {1e6 * ours / RECEIVERS:.0f} "
        "microseconds each along silhouettes, exact; central differences of sampled light:"
    )
    return [head, *lines], ratios


def shadow():
    """A ball under a rectangular light."""
    from firstorder.space import primitive, rectangle, sphere

    lamp = rectangle((0.0, 0.0, HEIGHT), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))  # looks down
    return primitive(lamp, emission=1.0), primitive(sphere((0.1, 0.0, 1.5), 0.4))


def by_silhouettes(x):
    """Seconds, and the gradients."""
    import jax
    import jax.numpy as jnp

    from firstorder.space import Scene, irradiance, receiver

    scene = Scene.of(*shadow())

    def one(position):
        return jax.grad(lambda s: irradiance(scene, receiver(position).moved(s)))(jnp.zeros(2))

    run = jax.jit(lambda x: jax.lax.map(one, x, batch_size=16))
    return best(run, x, repeats=3), np.asarray(run(x))


def by_differences(x, keys, n, truth):
    """Seconds, and the least error: of all steps the best is taken, as if one knew it.

    Light is gathered along stratified rays to the light, by the same random numbers at both ends of
    a step, which is the best that differences can do.
    """
    import jax
    import jax.numpy as jnp

    from firstorder.space import Scene

    ball = Scene.of(shadow()[1])
    ways = jnp.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]], x.dtype)

    def one(args):
        position, key, h = args
        target = strata(key, n)
        low, high = (
            jax.lax.map(lambda e: light(ball, position + h * e, target), ways).reshape(2, 2).T
        )
        return (high - low) / (2.0 * h)

    run = jax.jit(lambda x, h: jax.lax.map(one, (x, keys, jnp.full(len(x), h))))
    errors = [np.sqrt(np.mean((np.asarray(run(x, h)) - truth) ** 2)) for h in STEPS]
    return best(run, x, STEPS[0], repeats=1), min(errors)


def strata(key, n):
    """A point in each of n x n parts of the light."""
    import jax
    import jax.numpy as jnp

    corner = jnp.stack(jnp.meshgrid(jnp.arange(n), jnp.arange(n)), -1).reshape(-1, 2)
    u = (corner + jax.random.uniform(key, (n * n, 2))) / n - 0.5
    return jnp.concatenate([u, jnp.full((n * n, 1), HEIGHT)], 1)


def light(ball, position, target):
    """E from points of the light that are seen."""
    import jax.numpy as jnp

    from firstorder.space import occluded

    way = target - position
    seen = ~occluded(ball, jnp.broadcast_to(position, target.shape), target)
    return jnp.mean(jnp.where(seen, way[:, 2] ** 2 / jnp.sum(way**2, 1) ** 2, 0.0))


def main(what):
    pinned(1)
    print(json.dumps({"rates": rates, "soft_shadow": soft_shadow}[what]()))


@pytest.mark.parametrize("what", ["rates", "soft_shadow"])
def test_one_core(what, capsys):
    lines, numbers = answer(__file__, what)
    with capsys.disabled():
        print("\n" + "\n  ".join(lines))
    assert np.all(np.isfinite(numbers))
    # The rays that come closest to the exact gradient cost more than it.
    assert what == "rates" or numbers[-1] > 1.0


if __name__ == "__main__":
    main(sys.argv[1])
