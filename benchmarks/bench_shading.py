"""Closed forms against automatic differentiation: value, gradient and Hessian of reflected light.

Light (R07 Fig. 3's Gaussian) and its jet come as callables, the lobe as a module. Every contender
differentiates the same sum over the same fixed offsets, in both layouts (a sum over a vector of
nodes, a scan over nodes), and is timed in blocks of several sizes; its best one counts. First calls
(with compilation) and later calls are apart. `make bench` turns the compilation cache off.
"""

import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.experimental.jet import jet

from firstorder.fields import Affine
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.transport.brdf.lobes import glossy
from firstorder.transport.events.texture import wave
from firstorder.transport.shading._flat_jets import FlatlandLight
from firstorder.transport.shading.surface import Surface

RAYS = 100_000
BLOCKS = (512, 2048, 16384, RAYS)
REPEATS = 6
CX, CT, PXX, PXT, PTT = 0.21, -0.13, 3.77, -1.81, 7.12
SIGMA = 0.15


def radiance(x, theta):
    a, b = x - CX, theta - CT
    return jnp.exp(-0.5 * (PXX * a * a + 2.0 * PXT * a * b + PTT * b * b))


def derivatives(x, theta):
    a, b = x - CX, theta - CT
    g, h = -(PXX * a + PXT * b), -(PXT * a + PTT * b)
    f = jnp.exp(0.5 * (g * a + h * b))
    return f, f * g, f * h, f * (g * g - PXX), f * (g * h - PXT), f * (h * h - PTT)


def reflected(nodes):
    bumps = Affine([0.3, 0.0], 0.05) + wave(2.0, 0.05)
    return Surface(bumps, (glossy(SIGMA),)).reflect(FlatlandLight(radiance, derivatives), nodes)


def primals(B, dtype):
    """The sum over nodes as an array of nodes and as a scan over them, the lobe evaluated once."""
    t, w = (np.asarray(9.0 * SIGMA * a, dtype) for a in gauss_legendre(B.nodes))
    w = w * np.exp(-0.5 * (t / SIGMA) ** 2).astype(dtype) / dtype(SIGMA * np.sqrt(2.0 * np.pi))
    t, w = jnp.asarray(t), jnp.asarray(w)

    def center(u):
        return 2.0 * B.surface.normal_at(u[0]).value - u[1]

    def summed(u):
        return jnp.sum(w * radiance(u[0], center(u) - t))

    def scanned(u):
        r = center(u)

        def step(total, node):
            return total + node[1] * radiance(u[0], r - node[0]), None

        return jax.lax.scan(step, jnp.zeros_like(u[0]), (t, w), unroll=8)[0]

    return {"sum": summed, "scan": scanned}


def all_at_once(f, inner):
    """Value, gradient and Hessian in one nested pass."""

    def gradient(u):
        value, g = inner(f)(u)
        return g, (value, g)

    return jax.jacfwd(gradient, has_aux=True)


def forward(f):
    def both(u):
        value = f(u)
        return value, value

    def swapped(u):
        g, value = jax.jacfwd(both, has_aux=True)(u)
        return value, g

    return swapped


def taylor(f):
    """Taylor mode along (1, 0), (0, 1), (1, 1); the mixed derivative by polarisation."""

    def series(u):
        def along(d):
            return jet(f, (u,), ((d, jnp.zeros_like(d)),))

        value, (d, dd) = jax.vmap(along)(jnp.asarray([[1, 0], [0, 1], [1, 1]], u.dtype))
        mixed = 0.5 * (dd[2] - dd[0] - dd[1])
        return value[0], d[0], d[1], dd[0], mixed, dd[1]

    return series


def contenders(B, dtype):
    """By what is computed: functions of (x, theta), each with the name of its layout."""

    def rays(f):
        return lambda x, theta: f(jnp.stack([x, theta]))

    found = [
        ("closed", "value+gradient+Hessian, closed form", B.entries),
        ("closed gradient", "value+gradient, closed form", B.gradient),
    ]
    for layout, f in primals(B, dtype).items():
        methods = {
            "jax.hessian": jax.hessian(f),
            "jacfwd(jacfwd)": jax.jacfwd(jax.jacfwd(f)),
            "nested, reverse inside": all_at_once(f, jax.value_and_grad),
            "nested, forward inside": all_at_once(f, forward),
        }
        if layout == "sum":  # Taylor mode has no rule for a scan
            methods["nested, Taylor mode"] = taylor(f)
        found.append(("value", f"value ({layout})", rays(f)))
        found += [("autodiff", f"{name} ({layout})", rays(g)) for name, g in methods.items()]
    return found


def fits(name, nodes, block):
    """Whether the temporaries of an array of nodes stay below some hundred megabytes."""
    return "(sum)" not in name or nodes * block <= 2_000_000


def timed(found, x, theta, nodes):
    """For every contender and block: seconds of the first call, and of the fastest later one.

    Rounds go through all of them in turn, so that a busy moment of the machine is bad for all.
    """
    runs = {}
    for group, name, f in found:
        for block in (b for b in BLOCKS if fits(name, nodes, b)):

            def mapped(x, theta, f=f, block=block):
                if block >= x.size:
                    return jax.vmap(f)(x, theta)
                return jax.lax.map(lambda a: f(*a), (x, theta), batch_size=block)

            runs[group, name, block] = jax.jit(mapped)
    first = {key: _seconds(run, x, theta) for key, run in runs.items()}
    rounds = [{key: _seconds(run, x, theta) for key, run in runs.items()} for _ in range(REPEATS)]
    return {key: (first[key], min(r[key] for r in rounds)) for key in runs}


def _seconds(run, x, theta):
    start = time.perf_counter()
    jax.block_until_ready(run(x, theta))
    return time.perf_counter() - start


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("nodes", [64, 256])
def test_closed_forms_are_cheaper_than_autodiff(nodes, dtype, capsys):
    rng = np.random.default_rng(0)
    x = jnp.asarray(rng.uniform(-1.0, 1.0, RAYS), dtype)
    theta = jnp.asarray(rng.uniform(-0.5, 0.5, RAYS), dtype)
    B = jax.tree.map(lambda a: a.astype(dtype), reflected(nodes))
    times = timed(contenders(B, dtype), x, theta, nodes)
    lines = [f"\n{RAYS} rays, {nodes} nodes, {np.dtype(dtype).name}; milliseconds, best block"]
    lines.append(f"{'':40} {'first':>8} {'later':>8} {'block':>7}")
    best = {}
    for group, name in dict.fromkeys(key[:2] for key in times):
        key = min((k for k in times if k[1] == name), key=lambda k: times[k][1])
        first, later = times[key]
        best[group] = min(best.get(group, np.inf), later)
        lines.append(f"{name:40} {1e3 * first:8.0f} {1e3 * later:8.1f} {key[2]:7}")
    second = best["closed"] / best["autodiff"]
    first = best["closed gradient"] / best["value"]
    lines.append(f"value+gradient+Hessian / fastest autodiff: {second:.2f} (at most 0.5)")
    lines.append(f"value+gradient / fastest value: {first:.2f} (at most 2)")
    with capsys.disabled():
        print("\n".join(lines), flush=True)
    assert second <= 0.5
    assert first <= 2.0
