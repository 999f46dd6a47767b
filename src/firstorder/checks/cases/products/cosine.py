"""Cosine: light that straddles the horizon, where the clamped cosine has its kink."""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, SIGMA
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.fields import Function, Gaussian, Grid, gaussian
from firstorder.fields._series import axis_series
from firstorder.laws import Multiply
from firstorder.transport import ClampedCosine, Cosine

CENTER = (0.21, 1.1)
RAYS = np.array([[0.3, 0.9], [-0.4, 1.3], [0.7, 1.9], [0.2, -0.3]])
GRID = Grid.spanning((64, 2048), (5.0, 5.0), (0.0, 0.5))
# Samples of a kink of slope s miss its integral by at most s h^2 / 12, here with s < 1.
GRID_ERROR = GRID.step[1] ** 2 / 12.0
WINDOW = Grid.spanning((64, 96), (6.0, 6.0))


def slanting() -> Gaussian:
    """Correlated light from 63 degrees."""
    return gaussian(CENTER, SIGMA, 0.35, 1.3)


def brute(u) -> float:
    """The product in plain NumPy."""
    a, b = (u[0] - CENTER[0]) / SIGMA[0], (u[1] - CENTER[1]) / SIGMA[1]
    hat = float(np.exp(-0.5 * (a * a - 0.7 * a * b + b * b) / (1.0 - 0.35**2)))
    return 1.3 * hat * max(float(np.cos(u[1])), 0.0) if abs(u[1]) < 3 else 0.0


CASES = (
    Case(
        "cosine",
        Cosine(window=WINDOW),
        slanting(),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        wavelet_grid=Grid.spanning((16, 16), (3.0, 3.0)),
        bounds={"spectrum": GRID_ERROR},
        expected={"covariance": "refused"},
    ),
)

EVERY = ("value", "gradient", "hessian", "spectrum", "wavelet")


def _factor(function):
    """A twin that multiplies by another function of the angle."""
    wrong = Function(lambda x, theta: function(theta))
    return lambda s: twin_law(s, lambda m: Multiply(wrong, m.window))


FAULTS = (
    Fault("forget the clamp", _factor(jnp.cos), EVERY),
    Fault("from the surface, not the normal", _factor(lambda t: jnp.clip(jnp.sin(t), 0)), EVERY),
    Fault("cosine twice", _factor(lambda t: jnp.clip(jnp.cos(t), 0) ** 2), EVERY),
    Fault(
        "forget f grad g",
        lambda s: twin_law(
            s, lambda m: twin(m, push=lambda self, j, u: j.scaled(self.factor.at(u)))
        ),
        ("gradient", "hessian"),
    ),
    Fault(
        "D05's printed transform of the cosine",
        lambda s: twin_law(s, lambda m: Multiply(_Printed(frame=m.factor.frame), m.window)),
        ("spectrum",),
    ),
)


class _Printed(ClampedCosine):
    """D05 eq. 13 as printed, `2 cos(pi/2 W) / (1 - (2 pi W)^2)`."""

    def series(self, window):
        """The printed formula in place of the right one."""

        def coefficients(k, period):
            W = k / period
            return 2.0 * np.cos(0.5 * np.pi * W) / (1.0 - (2.0 * np.pi * W) ** 2) / period

        return axis_series(coefficients, jnp.eye(2)[1], window, 1)
