"""Separable BRDF: a factor of the incoming angle, a lobe, a factor of the outgoing angle."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FLATLAND, FREQUENCIES, RAYS, bell, light
from firstorder.checks.cases.products.reflection import OUT, gauss
from firstorder.checks.faults import Fault
from firstorder.checks.squares import Case
from firstorder.conventions import Frame
from firstorder.fields import GaussianProfile, Grid
from firstorder.transport import Angular, separable

LOBE = GaussianProfile(0.3, frame=OUT)
WINDOW = Grid.spanning((8, 72), (6.0, 6.0))


class Slope(Angular):
    """`1 + height tanh(theta)`: neither even nor odd, to expose a wrong sign of an angle."""

    height: float
    frame: Frame = eqx.field(static=True, default=FLATLAND)
    axis: str = eqx.field(static=True, default="theta")
    periodic: bool = eqx.field(static=True, default=False)

    def derivatives(self, t):
        """`tanh' = 1 - tanh^2`."""
        p = jnp.tanh(t)
        d = 1.0 - p**2
        return 1.0 + self.height * p, self.height * d, -2.0 * self.height * p * d


def brute(u):
    """`int f(i) l(x, i) rho(o + i) di g(o)`, by the trapezoid rule."""
    i = np.linspace(-6.0, 6.0, 4001)
    light_there = np.array([bell(u[0], a) for a in i])
    inside = (1.0 + 0.6 * np.tanh(i)) * light_there * gauss(u[1] + i, 0.3)
    return float(np.sum(inside) * (i[1] - i[0]) * (1.0 - 0.4 * np.tanh(u[1])))


def _chain(incoming=0.6, outgoing=-0.4, lobe=LOBE):
    return separable(lobe, Slope(incoming), Slope(outgoing, OUT), nodes=80, window=WINDOW)


CASES = (
    Case(
        "separable BRDF",
        _chain(),
        light(),
        Grid.spanning((48, 65), (4.5, 5.0)),
        FREQUENCIES,
        RAYS,
        brute,
        expected={"covariance": "refused", "wavelet": "refused"},
    ),
)

EVERY = ("value", "gradient", "hessian", "spectrum")
FAULTS = (
    Fault("f after the mirror without its flip", lambda s: _chain(incoming=-0.6), EVERY),
    Fault("g before the mirror", lambda s: _chain(outgoing=0.4), EVERY),
    Fault("forget f", lambda s: _chain(incoming=0.0), EVERY),
    Fault("twice as rough", lambda s: _chain(lobe=GaussianProfile(0.6, frame=OUT)), EVERY),
)
