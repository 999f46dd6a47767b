"""How much of a profile's energy lies below a frequency."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from firstorder._display import in_print
from firstorder.conventions import fourier_kernel
from firstorder.errors import Refused
from firstorder.numerics._quadrature import gauss_legendre

FEWEST, MOST = 64, 512  # nodes on each half of the profile
STILL = 1e-7  # share of a band limit by which it may move when the nodes are doubled


class LobeBandLimit(NamedTuple):
    """A band limit of a lobe, as it was measured.

    Attributes:
        Omega: the frequency, in cycles per unit of the lobe's axis.
        error: by how much it moved when the nodes were doubled for the last time, and what rounding
            the energies may have moved it.
        share: of the energy, that lies beyond it.
    """

    Omega: float
    error: float
    share: float

    __repr__ = in_print


def measured_band_limit(profile: Callable, end: float, share: float) -> LobeBandLimit:
    """The frequency beyond which a share of the energy of a profile on `[-end, end]` lies."""
    if not 0.0 < share < 1.0:
        raise ValueError(f"Argument `share` must lie between 0 and 1, but is {share:g}.")
    nodes, (before, _) = FEWEST, _band_limit(profile, end, share, FEWEST)
    moved = rounding = 0.0
    while nodes < MOST:
        nodes *= 2
        Omega, rounding = _band_limit(profile, end, share, nodes)
        moved, before = abs(Omega - before), Omega
        if moved + rounding <= STILL * Omega:
            return LobeBandLimit(Omega, moved + rounding, share)
    reason = (
        "what jumps has energy at all frequencies"
        if moved > rounding
        else "so small a share of the energy is lost in rounding"
    )
    raise Refused(
        f"no band limit for a share of {share:g} is found: {reason}; ask for a larger share"
    )


def _band_limit(profile: Callable, end: float, share: float, nodes: int) -> tuple[float, float]:
    """The band limit by a quadrature, up to the frequency that its nodes resolve; and rounding."""
    x, weights = gauss_legendre(nodes)
    half = 0.5 * end * (x + 1.0)
    t, w = np.concatenate([-half, half]), 0.5 * end * np.concatenate([weights, weights])
    p = np.asarray(profile(t), float)
    amplitude, gap, total = w * p, t[:, None] - t, np.sum(w * p * p)

    def beyond(Omega: float) -> float:
        kernel = 2.0 * Omega * np.sinc(2.0 * Omega * gap)
        return float(1.0 - amplitude @ kernel @ amplitude / total) - share

    highest, noise = 0.25 * nodes / end, nodes * float(np.finfo(float).eps)
    if (left := beyond(highest)) > 0.0:
        return highest, 0.0 if left + share > noise else math.inf
    Omega = float(brentq(beyond, 0.0, highest, xtol=1e-13 / end))
    F = np.abs(np.asarray(fourier_kernel(np.array([Omega]), t[:, None])) @ amplitude)
    density = 2.0 * float(F) ** 2 / float(total)  # of the energy, at Omega
    return Omega, noise / density if density > 0.0 else math.inf
