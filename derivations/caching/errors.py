"""The error of a record, as J12 defines it (§6.4), against adaptive quadrature."""

from __future__ import annotations

from derivations.caching._light import lamp, scene_a_columns
from derivations.caching.radii import PLACES, true_total
from derivations.ledger import Check, Row, na


def quadrature_error() -> float:
    """Largest relative error of the library's total error, below the lamp of scene A."""
    import jax.numpy as jnp

    from firstorder.caching import true_error

    worst = 0.0
    for at in PLACES:
        columns = jnp.asarray(scene_a_columns(at))
        for radius in (0.1, 0.25):
            ours = float(true_error(lamp, at, columns, radius))
            worst = max(worst, abs(ours / true_total(at, radius) - 1.0))
    return worst


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
]
