"""Bump: a base curvature with ripples on it, to the local frame and back."""

import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin_law
from firstorder.checks.squares import Case
from firstorder.fields import Affine
from firstorder.laws import Move, Warp
from firstorder.transport import Bump, wave

NORMALS = Affine([0.3, 0.0], 0.05) + wave(0.4, amplitude=0.25, phase=0.6)
REFUSED = dict.fromkeys(("spectrum", "covariance", "wavelet"), "refused")


def n(x: float) -> float:
    """The normal's angle."""
    return 0.3 * x + 0.05 + 0.25 * float(np.cos(0.8 * np.pi * x + 0.6))


CASES = (
    Case(
        "bump",
        Bump(NORMALS),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        lambda u: bell(u[0], u[1] + n(u[0])),
        expected=REFUSED,
    ),
    Case(
        "bump back",
        Bump(NORMALS, back=True),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        lambda u: bell(u[0], u[1] - n(u[0])),
        expected=REFUSED,
    ),
)

JETS = ("gradient", "hessian")
FAULTS = (
    Fault("to local for back", lambda s: Bump(s.normal, not s.back), ("value", *JETS)),
    Fault("forget the base shape", lambda s: Bump(s.normal.fields[1], s.back), ("value", *JETS)),
    Fault(
        "the wave upside down",
        lambda s: Bump(s.normal.fields[0] + (-1.0) * s.normal.fields[1], s.back),
        ("value", *JETS),
    ),
    Fault(
        "forget the bend of the map (n_xx)",
        lambda s: twin_law(s, lambda w: _StraightWarp(w.map, w.to)),
        ("hessian",),
    ),
)


class _StraightWarp(Warp):
    """A warp whose Hessian forgets that the map itself bends."""

    def push(self, jet, u):
        """Jet pushed as if the map were its own linearisation."""
        _, J, _ = self.map.derivatives(u)
        return Move(J).push(jet, u)
