"""Order of a table's error, measured over grids of the same light."""

from __future__ import annotations

import functools

import numpy as np

from firstorder.ledger import Check, Row, na


@functools.cache
def _orders() -> tuple[float, float, float]:
    """Fitted orders of value, gradient and Hessian, from the worst of many rays."""
    import equinox as eqx
    import jax
    import jax.numpy as jnp

    from firstorder.checks.cases import light
    from firstorder.checks.tolerance import fitted_order
    from firstorder.fields import Grid
    from firstorder.transport import Tabulate

    f, sizes = light(), np.array([64, 96, 128])
    rays = jnp.asarray(np.random.default_rng(0).uniform(-0.8, 0.8, (400, 2)))
    jets = eqx.filter_jit(lambda g: jax.vmap(g.jet)(rays))
    truth, errors = jets(f), []
    for n in map(int, sizes):
        table = jets(Tabulate(Grid.spanning((n, n), (4.0, 4.0)))(f))
        miss = jax.tree.map(lambda a, b: float(jnp.max(jnp.abs(a - b))), table, truth)
        errors.append((miss.value, miss.gradient, miss.hessian))
    value, gradient, hessian = (fitted_order(1.0 / sizes, e) for e in np.array(errors).T)
    return value, gradient, hessian


def _falls_short() -> float:
    """By how much a fitted order is below 4, 3 or 2; nothing if none is."""
    return max(0.0, *(k - o for k, o in zip((4, 3, 2), _orders(), strict=True)))


ROWS = [
    Row(
        "C.tabulate",
        "approximation",
        implements="firstorder.transport.events.tabulate.Tabulate",
        symbolic=na("measured"),
        autodiff=Check(_falls_short, 0.2),
        fourier=na("no spectrum"),
        brute_force=na("one route"),
        note="Fitted orders on steps from a sixth to a third of the light's width; light that dies "
        "out inside the grid, or is periodic on it. The error given is how far the worst fitted "
        "order falls short.",
    ),
]
