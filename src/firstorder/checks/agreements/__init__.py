"""One scene, all portraits: the same numbers found in independent ways, side by side.

`agreements(scene, at)` measures the light that one receiver of a flatland scene gets directly, as
gradient, spectrum, cache and brute force have it, and judges each way beside one reference.
"""

from __future__ import annotations

from firstorder.checks.agreements._irradiances import irradiance_rows
from firstorder.checks.agreements._record import Agreements, Found, Row, judged
from firstorder.checks.agreements._spectra import spectrum_rows
from firstorder.checks.agreements._wedge import wedge_rows
from firstorder.checks.agreements.sizes import FULL, QUICK, Sizes
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver
from firstorder.scene._arguments import check_asked_one

__all__ = ["agreements", "Agreements", "Row", "Found", "judged", "Sizes", "QUICK", "FULL"]


def agreements(
    scene: Scene,
    at: Receiver,
    *,
    sizes: Sizes = FULL,
    seed: int = 0,
    name: str = "a scene",
    ways: tuple[str, ...] | None = None,
    spectrum: bool = True,
) -> Agreements:
    """One table of what a receiver gets directly: every quantity in every way that applies.

    Quantities: irradiance E [W/m] with E' and E'' along the receiver's tangent (its normal fixed);
    one number F of the spectrum of the light field under a Gaussian window about the receiver
    (`Re F`, `Im F`) [W m / rad]; `int |f'|^2` of the irradiance f under the same window along the
    line, which Parseval ties to the second moment of its spectrum; and the share of the shadows'
    spectral energy outside E11's wedge. A way that does not apply says why.

    Valid for: direct light. Derivatives at a visual event (two edges in line) are one-sided, and
    ways that straddle it refuse.

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        sizes: how much work each way may be; `QUICK` or `FULL`.
        seed: of paths and photons.
        name: of the scene, for the title.
        ways: beginnings of the names of the ways to E that are wanted; all if left out.
        spectrum: whether the rows of the spectrum are wanted.

    Returns:
        The table; print it, or read its rows.

    Raises:
        ValueError: if there is not one receiver, it lies at a point light, or the scene has bands.

    Reference: J12 §3-6; R07 §6; E11 §3; D05 §5.

    Example:
        >>> from firstorder.checks.agreements import QUICK, agreements
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.library import scene_a
        >>> at = Receiver((0.3, 0.0), 0.0)
        >>> table = agreements(scene_a(), at, sizes=QUICK, ways=("visible",), spectrum=False)
        >>> table.agrees, table.row("E'", "visible").verdict
        (True, 'agrees')
    """
    check_asked_one(scene, Scene, at, Receiver)
    rows = irradiance_rows(scene, at, sizes, seed, ways)
    notes = ()
    if spectrum:
        rows += spectrum_rows(scene, at, sizes) + wedge_rows(scene, at, sizes)
    x, y = (float(p) for p in at.position)
    where = f"{name} at ({x:.4g}, {y:.4g}) m, normal at {float(at.n):.4g} rad: direct light"
    return Agreements(where, rows, notes)
