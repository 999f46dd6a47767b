"""A bump, linearised at a ray: the move that touches it, through which spectra pass."""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin_law
from firstorder.checks.squares import Case
from firstorder.laws import Move
from firstorder.transport import Bump, wave

AT = np.array([0.35, -0.2])
BUMP = Bump(wave(0.4, amplitude=0.25, phase=0.6))


def brute(u):
    """`L(x, theta + n(x_0) + n'(x_0) (x - x_0))`, with n = 0.25 cos(0.8 pi x + 0.6)."""
    phase = 0.8 * np.pi * AT[0] + 0.6
    n, slope = 0.25 * np.cos(phase), -0.25 * 0.8 * np.pi * np.sin(phase)
    return bell(u[0], u[1] + float(n + slope * (u[0] - AT[0])))


CASES = (
    Case(
        "linearised",
        BUMP.linearised(jnp.asarray(AT)),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        expected={"wavelet": "refused"},
    ),
)

JETS = ("value", "gradient", "hessian")
EVERY = (*JETS, "spectrum", "covariance")
FAULTS = (
    Fault("touch at another ray", lambda s: s.event.linearised(s.ray + 0.3), EVERY),
    Fault("the slope upside down", lambda s: twin_law(s, lambda m: Move(2 * jnp.eye(2) - m.M, m.c)),
          EVERY),
    Fault("turn without the slope", lambda s: twin_law(s, lambda m: Move(jnp.eye(2), m.c)), EVERY),
    Fault("forget where it touches", lambda s: twin_law(s, lambda m: Move(m.M)),
          (*JETS, "spectrum")),
)  # fmt: skip
