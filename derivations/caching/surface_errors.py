"""The error that defines everything else in J12 §8: an integral over a record's support."""

from __future__ import annotations

import numpy as np
from scipy.integrate import dblquad

from derivations.ledger import Check, Row, na


def adaptive_error() -> float:
    """Relative error of `surface_error` against adaptive sums: a cubic with a plane, one ellipse.

    The cubic is positive where it is integrated, so that its modulus has no kinks.
    """
    import jax
    import jax.numpy as jnp

    from firstorder.caching import surface_error

    def E(x):
        return 3.0 + 2.0 * x[0] + x[0] ** 2 * (2.0 + x[1]) + x[1] ** 2

    a, b = 0.5, 0.8

    def miss(py, px):
        return abs(E((px, py)) - 3.0 - 2.0 * px)

    def side(px):
        return b * np.sqrt(max(1.0 - (px / a) ** 2, 0.0))

    true = dblquad(miss, -a, a, lambda px: -side(px), side, epsabs=1e-11)[0]
    record = jnp.zeros(2), jnp.asarray(3.0), jnp.array([2.0, 0.0]), jnp.zeros((2, 2))
    M = jnp.diag(jnp.array([1.0 / a, 1.0 / b]))
    ours = jax.jit(lambda M: surface_error(E, *record, M))(M)
    return abs(float(ours) / true - 1.0)


ROWS = [
    Row(
        "J12.67",
        "definition",
        implements="firstorder.caching.surface_error",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("no spectrum"),
        brute_force=Check(adaptive_error, 1e-9),
        note="Over any ellipse, for orders 0 to 2 and six definitions; by quadrature.",
    ),
]
