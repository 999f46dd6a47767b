"""Rotation by curvature, to the local frame and back, in flatland and with a matrix in space."""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import SPACE
from firstorder.fields import Gaussian, Grid
from firstorder.laws import Move
from firstorder.transport import Curvature

# In space: four correlated coordinates, and a shape operator whose principal axes are not x and y.
CENTER_4D = np.array([0.2, -0.1, 0.15, -0.05])
SPREAD_4D = np.array(
    [
        [0.30, 0.03, 0.02, -0.02],
        [0.03, 0.25, 0.02, 0.03],
        [0.02, 0.02, 0.28, -0.03],
        [-0.02, 0.03, -0.03, 0.22],
    ]
)
PRECISION_4D = np.linalg.inv(SPREAD_4D)
SHAPE = np.array([[0.3, 0.08], [0.08, -0.2]])


def bell_4d(u) -> float:
    """The light in space, in plain NumPy."""
    h = np.asarray(u) - CENTER_4D
    return float(np.exp(-0.5 * h @ PRECISION_4D @ h))


def light_4d(frame=SPACE) -> Gaussian:
    """Light in space as a field."""
    return Gaussian(CENTER_4D, PRECISION_4D, 1.0, frame)


def space_grid(spread, center, size=(24, 25, 24, 25)) -> Grid:
    """Box of 6.5 standard deviations of a Gaussian."""
    return Grid.spanning(
        size, tuple((6.5 * np.sqrt(np.diag(spread))).tolist()), tuple(center.tolist())
    )


TO_LOCAL = np.block([[np.eye(2), np.zeros((2, 2))], [SHAPE, np.eye(2)]])
BACK = np.linalg.inv(TO_LOCAL)  # the local light is centred at, and spread by, the inverse
RAYS_4D = np.array([[0.3, 0.1, -0.2, 0.15], [-0.25, 0.3, 0.1, -0.2]])
FREQUENCIES_4D = tuple(np.array(a) for a in ([-0.3, 0.1], [0.2], [-0.1, 0.35], [0.0, 0.25]))

REFUSED = {"wavelet": "refused"}
CASES = (
    Case(
        "curvature",
        Curvature(0.7),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        lambda u: bell(u[0], u[1] + 0.7 * u[0]),
        expected=REFUSED,
    ),
    Case(
        "curvature back",
        Curvature(-0.4, back=True),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        lambda u: bell(u[0], u[1] + 0.4 * u[0]),
        expected=REFUSED,
    ),
    Case(
        "curvature in space",
        Curvature(SHAPE),
        light_4d(),
        space_grid(BACK @ SPREAD_4D @ BACK.T, BACK @ CENTER_4D),
        FREQUENCIES_4D,
        RAYS_4D,
        lambda u: bell_4d(
            [
                u[0],
                u[1],
                u[2] + 0.3 * u[0] + 0.08 * u[1],
                u[3] + 0.08 * u[0] - 0.2 * u[1],
            ]
        ),
        expected=REFUSED,
    ),
)

EVERY = ("value", "gradient", "hessian", "spectrum", "covariance")
FAULTS = (
    Fault("valley for hill", lambda s: Curvature(-s.kappa, s.back), EVERY),
    Fault("rows for columns", lambda s: twin_law(s, lambda m: Move(m.M.T)), EVERY),
    Fault("twice the curvature", lambda s: Curvature(2 * s.kappa, s.back), EVERY),
    Fault(
        "shear the spectrum like the light",
        lambda s: twin_law(
            s, lambda m: twin(m, spectrum=lambda self, F, w: F.at(jnp.sum(self.M * w, axis=-1)))
        ),
        ("spectrum",),
    ),
)
