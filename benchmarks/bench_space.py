"""Rays through meshes and analytic shapes, and the gradient of a soft shadow beside differences.

Rates are per core: every measurement is a process of its own, pinned to one before JAX starts.
Embree is asked on the host and its
hits are met again in double precision; both rates are printed. The soft shadow is that of a sphere
under a rectangular light; its gradient from silhouettes stands beside central differences of the
same renderer with sampled light, at the same error.
"""

import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest

RAYS = 1 << 16
SIZES = (4, 64, 512)
TRIANGLES = (1280, 20480)


def best(run, *args, repeats=3):
    """The shortest of several later calls."""
    import jax

    jax.block_until_ready(run(*args))
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        jax.block_until_ready(run(*args))
        times.append(time.perf_counter() - start)
    return min(times)


def rays(seed=0):
    rng = np.random.default_rng(seed)
    d = rng.normal(size=(RAYS, 3))
    return rng.uniform(-1.0, 1.0, (RAYS, 3)), d / np.linalg.norm(d, axis=1)[:, None]


def icosphere(triangles):
    import trimesh

    from firstorder.space.mesh import mesh

    ball = trimesh.creation.icosphere(round(np.log(triangles / 20) / np.log(4)))
    return mesh(0.5 * ball.vertices, ball.faces)


def rates():
    """Lines to print, and the analytic rates."""
    import jax
    import jax.numpy as jnp

    from firstorder.io import Embree
    from firstorder.space import Scene, nearest, thing
    from firstorder.space.shapes import Boxes, Ellipsoids

    o, d = rays()
    lines = []
    for triangles in TRIANGLES:
        tracer = Embree(icosphere(triangles))
        hits = best(tracer.nearest, o, d)
        alone = best(tracer._propose, o, d, np.zeros(RAYS), np.inf)
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
                thing(Ellipsoids(center[:half], axes[:half])),
                thing(Boxes(center[half:], axes[half:])),
            )
            t = best(jax.jit(nearest), scene, jnp.asarray(o, dtype), jnp.asarray(d, dtype))
            slow[dtype.__name__, count] = 1e-6 * RAYS / t
            lines.append(
                f"analytic, {count:4} shapes, {dtype.__name__}: {1e-6 * RAYS / t:6.2f} M rays/s "
                f"({1e-9 * count * RAYS / t:5.2f} G tests/s)"
            )
    return ["rays per second on one core", *lines], list(slow.values())


def soft_shadow():
    """Silhouettes give the gradient exactly; differences need a step and rays.

    The renderer that is differenced gathers light along stratified rays to the light, the same
    random numbers at both ends of a step, which is the best that differences can do. For each
    number of rays the best step of many is taken, as if one knew it.
    """
    import equinox as eqx
    import jax
    import jax.numpy as jnp

    from firstorder.space import Scene, occluded, receiver, rectangle, sphere, thing
    from firstorder.space.irradiance import irradiance

    lamp = rectangle((0.0, 0.0, 3.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))  # looks down
    ball = thing(sphere((0.1, 0.0, 1.5), 0.4))
    scene = Scene.of(thing(lamp, emission=1.0), ball)
    alone = Scene.of(ball)
    x = np.random.default_rng(2).uniform(-0.6, 0.6, (64, 2))
    at = jnp.asarray(np.concatenate([x, np.zeros((64, 1))], 1))

    def exact(position):
        def E(q):
            return irradiance(scene, eqx.tree_at(lambda r: r.position, receiver(position), q))

        return jax.grad(E)(position)[:2]

    gradient = jax.jit(lambda at: jax.lax.map(exact, at, batch_size=16))
    ours, truth = best(gradient, at), np.asarray(gradient(at))

    def sampled(position, key, n):
        """E by n x n strata of the light's area."""
        u = (jnp.stack(jnp.meshgrid(jnp.arange(n), jnp.arange(n)), -1).reshape(-1, 2)
             + jax.random.uniform(key, (n * n, 2))) / n - 0.5  # fmt: skip
        target = jnp.concatenate([u, jnp.full((n * n, 1), 3.0)], 1)
        way = target - position
        far = jnp.sum(way**2, 1)
        seen = ~occluded(alone, jnp.broadcast_to(position, target.shape), target)
        return jnp.mean(jnp.where(seen, way[:, 2] ** 2 / far**2, 0.0))

    def differences(n):
        def one(args):
            position, key, h = args
            ends = [
                [sampled(position.at[k].add(s * h), key, n) for s in (-1.0, 1.0)] for k in (0, 1)
            ]
            return jnp.stack([b - a for a, b in ends]) / (2.0 * h)

        return jax.jit(
            lambda at, keys, h: jax.lax.map(one, (at, keys, jnp.full(len(at), h)), batch_size=1)
        )

    keys = jax.random.split(jax.random.key(0), len(at))
    scale, lines, ratios = np.sqrt(np.mean(truth**2)), [], []
    for n in (16, 32, 64, 128):
        run = differences(n)
        error = min(
            np.sqrt(np.mean((np.asarray(run(at, keys, h)) - truth) ** 2))
            for h in (0.02, 0.05, 0.1, 0.2)
        )
        t = best(run, at, keys, 0.1, repeats=1)
        ratios.append(t / ours)
        lines.append(f"{n * n:6} rays: error {error / scale:.1e} of the RMS, {t / ours:8.1f} times")
    head = (
        f"gradient of a soft shadow, {len(at)} receivers, {1e3 * ours / len(at):.3f} ms each; "
        "central differences of sampled light, and their time over ours:"
    )
    return [head, *lines, "(ours errs by rounding: differences never reach it)"], ratios


def main(what):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    from firstorder import session

    session.start(cache="off")
    print(json.dumps({"rates": rates, "soft_shadow": soft_shadow}[what]()))


@pytest.mark.parametrize("what", ["rates", "soft_shadow"])
def test_one_core(what, capsys):
    done = subprocess.run(
        [sys.executable, __file__, what], capture_output=True, text=True, check=True
    )
    lines, numbers = json.loads(done.stdout.splitlines()[-1])
    with capsys.disabled():
        print("\n" + "\n  ".join(lines))
    assert np.all(np.isfinite(numbers))
    # The rays that come closest to the exact gradient cost more than it.
    assert what == "rates" or numbers[-1] > 1.0


if __name__ == "__main__":
    main(sys.argv[1])
