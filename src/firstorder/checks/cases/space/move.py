"""Move in space: two principal curvatures, a travel and a shift in one matrix of four rows."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases.space._light import (
    CENTER,
    FREQUENCIES,
    RAYS,
    SPREAD,
    bell,
    box,
    light,
)
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.laws import Move

TRAVEL = np.eye(4)
TRAVEL[:2, 2:] = -0.3 * np.eye(2)
BENDING = np.eye(4)
BENDING[2:, :2] = [[0.25, 0.08], [0.08, -0.15]]  # two principal curvatures, of either sign
M, C = BENDING @ TRAVEL @ np.diag([1.1, 0.9, 1.0, 0.95]), np.array([0.15, -0.2, 0.05, 0.1])
BACK = np.linalg.inv(M)


def brute(u):
    """`f(M u + c)`."""
    return bell(M @ u + C)


CASES = tuple(
    Case(
        f"move in space, {size}^4",
        Move(M, C),
        light(),
        box(size, BACK @ (CENTER - C), BACK @ SPREAD @ BACK.T),
        FREQUENCIES,
        RAYS,
        brute,
        expected={"wavelet": "refused"},
    )
    for size in (24, 25)
)

EVERY = ("value", "gradient", "hessian", "spectrum", "covariance")
FAULTS = (
    Fault("rows for columns", lambda s: Move(s.M.T, s.c), EVERY),
    Fault("invert M", lambda s: Move(jnp.linalg.inv(s.M), s.c), EVERY),
    Fault("bend the other way", lambda s: Move(s.M.at[2:, :2].multiply(-1.0), s.c), EVERY),
    Fault("exchange the curvatures", lambda s: Move(s.M[:, [1, 0, 3, 2]], s.c), EVERY),
    Fault(
        "drop the 2 pi of the phase",
        lambda s: eqx.tree_at(lambda m: m.c, s, s.c / (2 * np.pi)),
        ("spectrum",),
    ),
    Fault(
        "forget 1 / |det M|",
        lambda s: twin(s, spectrum=lambda m, F, w: Move.spectrum(m, F, w) * jnp.linalg.det(m.M)),
        ("spectrum",),
    ),
)
