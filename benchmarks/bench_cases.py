"""Every law and event: first call and later calls, closed-form jet against autodiff.

`make bench` runs this with the compilation cache off, so that a first call compiles.
"""

import time

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import session
from firstorder.checks.registry import all_cases
from firstorder.fields import autodiff_jet

RAYS = 10_000


@pytest.fixture(autouse=True, scope="module")
def _float64():
    session.start(cache="off")


def _rays(case):
    """Rays about those of the case, the same every time."""
    rng = np.random.default_rng(0)
    around = case.rays[rng.integers(len(case.rays), size=RAYS)]
    return jnp.asarray(around + 0.01 * rng.standard_normal(around.shape))


def _first_and_later(function, *args):
    start = time.perf_counter()
    compiled = eqx.filter_jit(function).lower(*args).compile()
    first = time.perf_counter() - start
    jax.block_until_ready(compiled(*args))
    later = []
    for _ in range(5):
        start = time.perf_counter()
        jax.block_until_ready(compiled(*args))
        later.append(time.perf_counter() - start)
    return first, min(later)


@pytest.mark.parametrize("name", list(all_cases()))
def test_closed_form_jets_beside_autodiff(name, capsys):
    case = all_cases()[name]
    light = case.step(case.field)
    rays = _rays(case)
    contenders = {
        "value": lambda f, u: jax.vmap(f.at)(u),
        "jet": lambda f, u: jax.vmap(f.jet)(u),
        "autodiff": lambda f, u: jax.vmap(lambda r: autodiff_jet(f.at, r, f.frame))(u),
    }
    times = {key: _first_and_later(run, light, rays) for key, run in contenders.items()}
    with capsys.disabled():
        columns = "  ".join(f"{k} {a:5.2f} s, {1e3 * b:8.2f} ms" for k, (a, b) in times.items())
        ratio = times["jet"][1] / times["autodiff"][1]
        print(f"\n{name:24} (first, later at {RAYS} rays)  {columns}  jet/autodiff {ratio:5.2f}")
    assert all(np.isfinite(later) for _, later in times.values())
