"""Multiply by a mask with an edge: jets between edges, the spectrum by a square wave."""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, RAYS, bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Grid, HalfPlane, half_plane
from firstorder.laws import Move, Multiply

# The edge lies between two samples: the grid error is then of second order in the step.
GRID = Grid.spanning((384, 97), (6.0, 5.5))
EDGE, DARK = 0.25, 0.3


def brute(u):
    """The light, dimmed on the left of the edge."""
    return bell(*u) * (1.0 if u[0] > EDGE else DARK)


CASES = (
    Case(
        "multiply, an edge",
        Multiply(half_plane(EDGE, DARK), Grid.spanning((256, 256), (6.0, 6.0))),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        Grid.spanning((8, 16), (2.0, 2.0)),
        bounds={"spectrum": 1e-4},  # step^2 / 24 times the slope at the edge
        expected={"covariance": "refused"},
    ),
)


def with_mask(change):
    """Fault that changes the mask of the law."""
    return lambda s: Multiply(change(s.factor), s.window)


EVERY = ("value", "gradient", "hessian", "spectrum", "wavelet")
FAULTS = (
    Fault("exchange the sides", with_mask(lambda g: HalfPlane(g.level, g.above, g.below)), EVERY),
    Fault("edge along the other axis", with_mask(lambda g: Move(np.eye(2)[::-1])(g)), EVERY),
    Fault("forget the mask", with_mask(lambda g: HalfPlane(g.level, 1.0, 1.0)), EVERY),
    Fault("edge without its offset", with_mask(lambda g: half_plane(0.0, DARK)), ("spectrum",)),
    Fault(
        "shift the samples by half a step",
        lambda s: twin(
            s,
            spectrum=lambda m, F, w: (
                Multiply.spectrum(m, F, w) * jnp.exp(1j * jnp.pi * w[0] * GRID.step[0])
            ),
        ),
        ("spectrum",),
    ),
)
