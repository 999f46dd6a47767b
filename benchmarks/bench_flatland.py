"""The tracer of flatland against other forms of the same search, and exact views against rays.

Every comparison is a ratio within one run. Each number of cores is a process of its own, which pins
itself before JAX starts. NumPy's and numba's forms are written as one would write them; numba is
left out, and said to be, where it is not installed (`pip install numba`).
"""

import functools
import json
import os
import sys

import numpy as np
import pytest

from benchmarks.one_core import answer, best, pinned

RAYS = 1 << 17
SIZES = (4, 64, 512)
# Multiplications, additions and one division of a ray-segment test, comparisons not counted.
OPERATIONS = 18
RECEIVERS, SHAPES = 10_000, 64
RMS = 1e-3


def scattered(count, dtype, seed=0, rays=RAYS):
    """Short segments all over a square, and rays from everywhere to everywhere."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(-1.0, 1.0, (count, 2))
    edge = 0.1 * rng.normal(size=(count, 2))
    angle = rng.uniform(0.0, 2.0 * np.pi, rays)
    origin = rng.uniform(-1.0, 1.0, (rays, 2))
    arrays = start, edge, origin, np.stack([np.cos(angle), np.sin(angle)], -1)
    return [a.astype(dtype) for a in arrays]


# --- contenders ----------------------------------------------------------------------------------


def _distance(p, e, o, d):
    import jax.numpy as jnp

    q = p - o
    det = d[..., 0] * e[..., 1] - d[..., 1] * e[..., 0]
    safe = jnp.where(det == 0.0, 1.0, det)
    t = (q[..., 0] * e[..., 1] - q[..., 1] * e[..., 0]) / safe
    s = (q[..., 0] * d[..., 1] - q[..., 1] * d[..., 0]) / safe
    return jnp.where((det != 0.0) & (t > 0.0) & (s >= 0.0) & (s <= 1.0), t, jnp.inf)


def vmap_argmin(p, e, o, d):
    import jax
    import jax.numpy as jnp

    def one(o, d):
        t = _distance(p, e, o, d)
        k = jnp.argmin(t)
        return t[k], k

    return jax.vmap(one)(o, d)


def all_pairs(p, e, o, d):
    import jax.numpy as jnp

    t = _distance(p, e, o[:, None], d[:, None])
    return jnp.min(t, 1), jnp.argmin(t, 1)


def blocked_scan(p, e, o, d, block=2048):
    import jax
    import jax.numpy as jnp

    def search(rays):
        o, d = rays

        def meet(carry, here):
            t, k = carry
            new = _distance(here[0], here[1], o, d)
            return (jnp.where(new < t, new, t), jnp.where(new < t, here[2], k)), None

        start = jnp.full(block, jnp.inf, o.dtype), jnp.full(block, -1)
        return jax.lax.scan(meet, start, (p, e, jnp.arange(p.shape[0])))[0]

    return jax.lax.map(search, (o.reshape(-1, block, 2), d.reshape(-1, block, 2)))


def numpy_form(p, e, o, d):
    best_t = np.full(len(o), np.inf, o.dtype)
    best_k = np.full(len(o), -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        for k in range(len(p)):
            q = p[k] - o
            det = d[:, 0] * e[k, 1] - d[:, 1] * e[k, 0]
            t = (q[:, 0] * e[k, 1] - q[:, 1] * e[k, 0]) / det
            s = (q[:, 0] * d[:, 1] - q[:, 1] * d[:, 0]) / det
            ok = (t > 0.0) & (s >= 0.0) & (s <= 1.0) & (t < best_t)
            best_t, best_k = np.where(ok, t, best_t), np.where(ok, k, best_k)
    return best_t, best_k


def numba_form():
    try:
        import numba
    except ImportError:
        return None

    @numba.njit(parallel=True)
    def search(p, e, o, d):
        best_t = np.full(len(o), np.inf, o.dtype)
        best_k = np.full(len(o), -1)
        # Numbers of the arrays' own precision: a plain 0.0 would make every test one in double.
        zero = o.dtype.type(0.0)
        one = o.dtype.type(1.0)
        for r in numba.prange(len(o)):
            ox, oy, dx, dy = o[r, 0], o[r, 1], d[r, 0], d[r, 1]
            near, which = best_t[r], -1
            for k in range(len(p)):
                qx, qy = p[k, 0] - ox, p[k, 1] - oy
                det = dx * e[k, 1] - dy * e[k, 0]
                if det != zero:
                    t = (qx * e[k, 1] - qy * e[k, 0]) / det
                    s = (qx * dy - qy * dx) / det
                    if t > zero and s >= zero and s <= one and t < near:
                        near, which = t, k
            best_t[r], best_k[r] = near, which
        return best_t, best_k

    return search


# --- measurements --------------------------------------------------------------------------------


def arithmetic_peak(dtype):
    """Operations per second of a matrix product, which is as fast as arithmetic gets here."""
    import jax
    import jax.numpy as jnp

    n = 1024
    return 2.0 * n**3 / best(jax.jit(jnp.dot), jnp.ones((n, n), dtype), jnp.ones((n, n), dtype))


def contenders(dtype, count, rays=RAYS):
    """What each contender does, as calls without arguments."""
    import jax

    from firstorder.flatland import Scene, Segments, primitive
    from firstorder.flatland.intersect import first_shape
    from firstorder.flatland.shapes._crossings import find_crossings

    arrays = scattered(count, dtype, rays=rays)
    p, e, o, d = map(jax.numpy.asarray, arrays)
    none = find_crossings([Segments(p[:1], p[:1] + e[:1])])
    scene = Scene.of(primitive(Segments(p, p + e)), crossings=none)
    calls = {"ours": functools.partial(jax.jit(first_shape), scene, o, d)}
    for form in (vmap_argmin, all_pairs, blocked_scan):
        calls[form.__name__] = functools.partial(jax.jit(form), p, e, o, d)
    calls["numpy"] = functools.partial(numpy_form, *arrays)
    compiled = numba_form()
    if compiled is not None:
        calls["numba"] = functools.partial(compiled, *arrays)
    return calls


def nearest_hits(dtype, count):
    """Seconds of every contender."""
    calls = contenders(dtype, count).items()
    return {name: best(call, repeats=2 if name == "numpy" else 5) for name, call in calls}


def main(cores):
    pinned(cores)
    table = {}
    for dtype in ("float32", "float64"):
        peak = arithmetic_peak(dtype)
        for count in SIZES:
            table[f"{dtype} {count}"] = {"times": nearest_hits(dtype, count), "peak": peak}
    print(json.dumps(table))


@pytest.mark.parametrize("cores", [1, 2])
def test_nearest_hit_beside_other_forms(cores, capsys):
    if len(os.sched_getaffinity(0)) < cores:
        pytest.skip(f"{cores} cores are not to be had here")
    table, short = answer(__file__, cores), []
    with capsys.disabled():
        print(f"\nnearest hit, {RAYS} rays, {cores} core(s): 10^9 ray-segment tests per second")
        for name, row in table.items():
            times, tests = row["times"], int(name.split()[1]) * RAYS
            rates = "  ".join(f"{k} {1e-9 * tests / t:5.2f}" for k, t in times.items())
            share = OPERATIONS * tests / times["ours"] / row["peak"]
            fastest = min(times[f] for f in ("vmap_argmin", "all_pairs", "blocked_scan"))
            ratio = fastest / times["ours"]
            outside = min(times[f] for f in ("numpy", "numba") if f in times) / times["ours"]
            print(
                f"  {name:12} {rates}  of the fastest JAX form {ratio:4.2f}, of NumPy and numba "
                f"{outside:4.2f}; {100 * share:3.0f} % of {1e-9 * row['peak']:.0f} Gflop/s"
            )
            if "numba" not in times:
                print("  (numba is not installed: its form was not timed)")
            short += [name] * (ratio < 0.8 or outside < 1.0)
    assert not short


def test_an_exact_view_beside_rays(capsys):
    import jax
    import jax.numpy as jnp

    from firstorder import session
    from firstorder.flatland import Receiver, Scene, Segments, irradiance, nearest, primitive, view

    session.start(cache="off")
    rng = np.random.default_rng(3)
    start = rng.uniform((-1.0, 1.0), (1.0, 3.0), (SHAPES, 2))
    segments = Segments(start, start + 0.1 * rng.normal(size=(SHAPES, 2)))
    scene = Scene.of(primitive(segments, emission=rng.uniform(0.0, 1.0, SHAPES), two_sided=True))
    x = jnp.linspace(-1.0, 1.0, RECEIVERS)
    at = Receiver(jnp.stack([x, 0.0 * x], -1), 0.0 * x, jnp.full(RECEIVERS, -1))

    def each(f):
        return jax.jit(lambda scene, at: jax.lax.map(lambda r: f(scene, r), at, batch_size=64))

    def by_rays(n):
        def E(key, position):
            # One ray a stratum of the sine, so that the cosine is in the density.
            s = 2.0 * (jnp.arange(n) + jax.random.uniform(key, (n,))) / n - 1.0
            d = jnp.stack([s, jnp.sqrt(1.0 - s**2)], -1)
            hits = nearest(scene, jnp.broadcast_to(position, d.shape), d)
            return 2.0 * jnp.mean(jnp.where(hits.index >= 0, _radiance(scene, hits, d), 0.0))

        return jax.jit(lambda keys, p: jax.lax.map(lambda a: E(*a), (keys, p)))

    truth = each(irradiance)(scene, at)
    few = 256
    keys = jax.random.split(jax.random.key(0), few)
    picked = at.position[:: RECEIVERS // few][:few]
    wanted = truth[:: RECEIVERS // few][:few]
    n, rms = 64, np.inf
    while rms > RMS * float(jnp.mean(truth)):
        n *= 2
        rms = float(jnp.sqrt(jnp.mean((by_rays(n)(keys, picked) - wanted) ** 2)))
    rays = best(by_rays(n), keys, picked) * RECEIVERS / few
    seen = best(each(lambda scene, r: view(scene, r).seen), scene, at)
    whole = best(each(irradiance), scene, at)
    with capsys.disabled():
        print(
            f"\nwhich of {SHAPES} shapes is seen, {RECEIVERS} receivers: {seen:.3f} s, with E "
            f"{whole:.3f} s; {n} stratified rays each (RMS {rms:.1e}): {rays:.2f} s, "
            f"{rays / seen:.1f} times the view"
        )
    assert rays >= 10.0 * seen


def under_a_lamp(count):
    """Discs of one size that do not overlap, and a lamp above them."""
    from firstorder.flatland import Circles, Scene, Segments, primitive

    rng, radius, centers = np.random.default_rng(0), 0.35 / count**0.5, np.zeros((0, 2))
    while len(centers) < count:
        c = rng.uniform((-1.0, 0.4), (1.0, 1.6))
        if np.all(np.linalg.norm(centers - c, axis=1) > 2.05 * radius):
            centers = np.vstack([centers, c])
    lamp = Segments((1.0, 2.0), (-1.0, 2.0))
    return Scene.of(primitive(Circles(centers, radius)), primitive(lamp, emission=1.0))


def test_many_discs_by_depth_beside_rays(capsys, monkeypatch):
    """E, E' and E'' of discs under a lamp: in order of their depth, and by a ray in each gap."""
    import jax
    import jax.numpy as jnp

    from firstorder import session
    from firstorder.flatland import Receiver, _depth_order, irradiance
    from firstorder.scene._derivatives import line_derivatives

    session.start(cache="off")
    x = jnp.linspace(-1.0, 1.0, 1024)

    def jets(scene):
        def E(x):
            return irradiance(scene, Receiver(jnp.stack([x, 0.0 * x]), 0.0 * x))

        def one(x):
            d = line_derivatives(E, x)
            return d.value, d.gradient, d.hessian

        return best(jax.jit(lambda x: jax.lax.map(one, x, batch_size=16)), x) / x.size

    ratios = []
    for count in (64, 256):
        scene = under_a_lamp(count)
        by_depth = jets(scene)
        with monkeypatch.context() as patch:
            patch.setattr(_depth_order, "MANY", count + 1)
            jax.clear_caches()
            by_rays = jets(scene)
        jax.clear_caches()
        ratios.append(by_rays / by_depth)
        with capsys.disabled():
            print(
                f"\n{count} discs, E, E' and E'' of a receiver: {1e6 * by_depth:.1f} us, "
                f"{ratios[-1]:.1f} times as long by rays"
            )
    assert ratios[0] > 1.2
    assert ratios[1] > 2.5


def _radiance(scene, hits, d):
    import jax
    import jax.numpy as jnp

    return jax.vmap(lambda i: scene.material.emission[jnp.maximum(i, 0), 0])(hits.index)


if __name__ == "__main__":
    main(int(sys.argv[1]))
