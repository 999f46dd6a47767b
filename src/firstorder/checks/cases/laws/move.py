"""Move: a shear, scale and shift at once, so that no wrong twin is right by symmetry."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Jet
from firstorder.laws import Move

M, C = np.array([[0.9, -0.6], [0.3, 1.1]]), np.array([0.15, -0.2])


def brute(u):
    """`f(M u + c)`, written out."""
    x, t = u
    return bell(0.9 * x - 0.6 * t + 0.15, 0.3 * x + 1.1 * t - 0.2)


CASES = (
    Case(
        "move",
        Move(M, C),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        expected={"wavelet": "refused"},
    ),
)

EVERY = ("gradient", "hessian", "spectrum", "covariance")
FAULTS = (
    Fault("rows for columns", lambda s: Move(s.M.T, s.c), ("value", *EVERY)),
    Fault("invert M", lambda s: Move(jnp.linalg.inv(s.M), s.c), ("value", *EVERY)),
    Fault(
        "flip the shear", lambda s: Move(s.M * jnp.array([[1, -1], [1, 1]]), s.c), ("value", *EVERY)
    ),
    Fault("forget the shift", lambda s: Move(s.M), ("value", "gradient", "hessian", "spectrum")),
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
    Fault(
        "do not pull the gradient back",
        lambda s: twin(s, push=lambda m, j, u: Jet(j.value, j.gradient, j.hessian, j.frame)),
        ("gradient", "hessian"),
    ),
)
