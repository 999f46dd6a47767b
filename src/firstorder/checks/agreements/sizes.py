"""How much work a table of agreements may be: a quick size for tests, a full one for figures."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Sizes:
    """How many rays, paths, photons and samples there are.

    Attributes:
        rays: of the traced ways, even.
        paths: for each receiver and run.
        photons: of all runs.
        runs: independent repetitions that give error bars.
        width: of the photons' density, to each side [m].
        reach: the most that differences and records step aside [m].
        samples: receivers along the window of the spectrum; even.
        window: half the length of that window [m].
        tolerance: of the adaptive quadrature along it, relative.
        places: receivers that it may ask; laws may ask a quarter of them.
    """

    rays: int = 16384
    paths: int = 16384
    photons: int = 1 << 20
    runs: int = 32
    width: float = 0.05
    reach: float = 0.05
    samples: int = 1024
    window: float = 0.6
    tolerance: float = 1e-13
    places: int = 1 << 14


FULL = Sizes()
QUICK = Sizes(
    rays=1024, paths=512, photons=1 << 14, runs=16, samples=256, tolerance=1e-8, places=2048
)
