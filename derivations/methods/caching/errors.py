"""The error of a record, as J12 defines it (§6.4), against adaptive quadrature."""

from __future__ import annotations

from derivations.ledger import Check, Row, na
from derivations.methods.caching._light import lamp, scene_a_columns
from derivations.methods.caching.radii import PLACES, true_total


def quadrature_error() -> float:
    """Largest relative error of the library's total error, below the lamp of scene A."""
    import jax.numpy as jnp

    from firstorder.methods.caching import true_error

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
        implements="firstorder.methods.caching.true_error",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=Check(quadrature_error, 1e-9),
        note="Its E' is the expansion and no derivative, which (33) writes as grad E.",
    ),
]
