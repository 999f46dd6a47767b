"""Irradiance as an integral over angles: J12 (16) and (40), evaluated without sampling."""

from __future__ import annotations

from derivations.flatland._radiometry_proofs import light_overhead
from derivations.flatland._scenes import built
from derivations.flatland.estimators._measured import HERE, truth
from derivations.flatland.radiometry import PLAIN, crossed_strings
from firstorder.ledger import Check, Row, na


def angular() -> float:
    """(40): the library's irradiance in scene B against 30 digits."""
    from firstorder.flatland import Receiver, irradiance

    scene, radiance = built("B")
    return float(abs(irradiance(scene, Receiver(*HERE["B"]), radiance=radiance) - truth("B")[0]))


ROWS = [
    Row(
        "J12.16",
        "identity",
        implements="firstorder.flatland.direct_lighting.irradiance",
        symbolic=light_overhead,
        **PLAIN,
        brute_force=Check(crossed_strings, 1e-12),
    ),
    Row(
        "J12.40",
        "identity",
        implements="firstorder.flatland.direct_lighting.irradiance",
        symbolic=light_overhead,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(angular, 1e-12),
    ),
]
