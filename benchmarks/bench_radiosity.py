"""Indirect E, E' and E'' of scene D, given the solved radiosity: one pass against E alone.

Both are the same functional, jitted, over the same receivers in blocks; the derivatives come by
nested forward differentiation along the receiver's tangent. First calls and later calls apart.
"""

import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import session
from firstorder.flatland.bounces._panels import Discretization
from firstorder.flatland.bounces.radiosity import solve_radiosity
from firstorder.flatland.library._scenes import named_scene
from firstorder.flatland.visible import receiver

RECEIVERS = 10_000
BLOCKS = (64, 256)
REPEATS = 3
AT_MOST = 3.0


@pytest.fixture(autouse=True, scope="module")
def _float64():
    session.start(cache="off")


def contenders(solution):
    def E(s):
        return solution.indirect(receiver(solution.scene, 0, s))

    def first(s):
        return jax.jvp(E, (s,), (jnp.ones_like(s),))

    def all_three(s):
        (value, slope), (_, bend) = jax.jvp(first, (s,), (jnp.ones_like(s),))
        return value, slope, bend

    return {"E": E, "E, E', E''": all_three}


def test_derivatives_cost_less_than_three_times_the_value(capsys):
    solution = solve_radiosity(named_scene("scene_d"), fineness=Discretization(6, 1e-4))
    s = jnp.asarray(np.random.default_rng(0).uniform(0.0, 1.0, RECEIVERS))
    runs, first = {}, {}
    for name, f in contenders(solution).items():
        for block in BLOCKS:
            run = jax.jit(lambda s, f=f, block=block: jax.lax.map(f, s, batch_size=block))
            start = time.perf_counter()
            runs[name, block] = run.lower(s).compile()
            first[name, block] = time.perf_counter() - start
    later = dict.fromkeys(runs, np.inf)
    for _ in range(REPEATS):  # in turn: a busy moment is bad for all
        for key, run in runs.items():
            start = time.perf_counter()
            jax.block_until_ready(run(s))
            later[key] = min(later[key], time.perf_counter() - start)
    best = {name: min(later[name, b] for b in BLOCKS) for name in contenders(solution)}
    ratio = best["E, E', E''"] / best["E"]
    with capsys.disabled():
        print(f"\n{RECEIVERS} receivers of scene D, {solution.E.size} nodes")
        for key in runs:
            seconds = f"first {first[key]:6.1f} s, later {later[key]:6.2f} s"
            print(f"{key[0]:12} block {key[1]:4}: {seconds}")
        print(f"E, E', E'' / E: {ratio:.2f} (under {AT_MOST:g})")
    assert ratio < AT_MOST
