"""The error of a record, as J12 defines it (§6.4 and §8), against adaptive quadrature."""

from __future__ import annotations

import numpy as np
from scipy.integrate import dblquad

from derivations.caching._light import lamp, scene_a_columns
from derivations.caching.radii import PLACES, true_total
from firstorder.ledger import Check, Row, na


def quadrature_error() -> float:
    """Largest relative error of the library's total error, below the lamp of scene A."""
    from firstorder.caching import Candidates, circular_regions, true_error

    worst = 0.0
    for at in PLACES:
        record = Candidates.on_line(np.array([at]), scene_a_columns([at]))
        for radius in (0.1, 0.25):
            region = circular_regions(np.array([radius]), 0.01, 1.0)
            ours = float(true_error(lamp, record, region)[0])
            worst = max(worst, abs(ours / true_total(at, radius) - 1.0))
    return worst


def adaptive_error() -> float:
    """Relative error of `true_error` against adaptive sums: a cubic with a plane, one ellipse.

    The cubic is positive where it is integrated, so that its modulus has no kinks.
    """
    import jax
    import jax.numpy as jnp

    from firstorder.caching import Candidates, ValidityRegion, true_error

    def E(x):
        return 3.0 + 2.0 * x[0] + x[0] ** 2 * (2.0 + x[1]) + x[1] ** 2

    a, b = 0.5, 0.8

    def miss(py, px):
        return abs(E((px, py)) - 3.0 - 2.0 * px)

    def side(px):
        return b * np.sqrt(max(1.0 - (px / a) ** 2, 0.0))

    true = dblquad(miss, -a, a, lambda px: -side(px), side, epsabs=1e-11)[0]
    record = Candidates.of(np.zeros((1, 2)), np.array([3.0]), np.array([[2.0, 0.0]]))
    M = jnp.diag(jnp.array([1.0 / a, 1.0 / b]))
    ours = jax.jit(lambda M: true_error(E, record, ValidityRegion(M[None]))[0])(M)
    return abs(float(ours) / true - 1.0)


ROWS = [
    Row(
        "J12.53",
        "definition",
        implements="firstorder.caching.true_error",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=Check(quadrature_error, 1e-9),
        note="Its E' is the expansion and no derivative, which (33) writes as grad E.",
    ),
    Row(
        "J12.67",
        "definition",
        implements="firstorder.caching.true_error",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("no spectrum"),
        brute_force=Check(adaptive_error, 1e-9),
        note="Over any ellipse, for orders 0 to 2 and six definitions; by quadrature.",
    ),
]
