"""Multiply by a smooth factor: a bell, for which covariances add, and one for which they do not."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND, Frame
from firstorder.fields import (
    Covariance,
    Field,
    Function,
    Grid,
    Jet,
    covariance_of,
    gaussian,
)
from firstorder.laws import Move, Multiply

WINDOW = Grid.spanning((48, 50), (6.5, 7.0))
WAVELETS = Grid.spanning((8, 16), (2.0, 2.0))


class Softbox(Field):
    """`1 / (1 + q)^2` of a tilted quadratic q: smooth, off-centre, and no Gaussian."""

    frame: Frame = eqx.field(static=True, default=FLATLAND)

    def _function(self):
        def box(x, t):
            a, b = (x + 0.3) / 0.5, (t - 0.25) / 0.6
            return (1.0 + a * a + 0.8 * a * b + b * b) ** -8

        return Function(box)

    def at(self, u):
        """The value."""
        return self._function().at(u)

    def jet(self, u):
        """By autodiff."""
        return self._function().jet(u)

    def covariance(self):
        """Measured on a grid: it has no closed form."""
        return covariance_of(self, Grid.spanning((128, 128), (6.0, 6.0)))


def brute(u):
    """Two bells, written out."""
    a, b = (u[0] + 0.3) / 0.7, (u[1] - 0.25) / 0.9
    return bell(*u) * 0.8 * np.exp(-0.5 * (a * a + 0.8 * a * b + b * b) / (1.0 - 0.16))


def brute_box(u):
    """A bell and a soft box, written out."""
    a, b = (u[0] + 0.3) / 0.5, (u[1] - 0.25) / 0.6
    return bell(*u) * (1.0 + a * a + 0.8 * a * b + b * b) ** -8


CASES = (
    Case(
        "multiply",
        Multiply(gaussian((-0.3, 0.25), (0.7, 0.9), -0.4, 0.8), WINDOW),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        WAVELETS,
    ),
    Case(
        "multiply, not a bell",
        Multiply(Softbox(), Grid.spanning((160, 160), (5.0, 5.0))),
        light(),
        Grid.spanning((160, 161), (5.0, 5.0)),
        FREQUENCIES,
        RAYS,
        brute_box,
        WAVELETS,
        # The sum of covariances is exact for bells only; this is what it costs here.
        bounds={"covariance": 0.03},
        expected={"covariance": "approximate"},
    ),
)


def moved(M):
    """The factor seen through a linear map that should not be there."""

    def wrong(s):
        factor = Move(M)(s.factor)
        if isinstance(s.factor, Softbox):  # its covariance is measured: give the image a rule
            factor = twin(factor, covariance=lambda f: Move(M)(Softbox().covariance()))
        return Multiply(factor, s.window)

    return wrong


def without_cross_terms(m, jet, u):
    """Leibniz without `grad f grad g^T` and its transpose."""
    right, g = Multiply.push(m, jet, u), m.factor.jet(u)
    cross = jet.gradient[:, None] * g.gradient
    return Jet(right.value, right.gradient, right.hessian - cross - cross.T, right.frame)


def only_the_first_term(m, jet, u):
    """`g grad f` without `f grad g`, and `g Hess f` alone."""
    return jet.scaled(m.factor.at(u))


JETS = ("gradient", "hessian")
EVERY = ("value", *JETS, "spectrum", "wavelet")
FAULTS = (
    Fault("flip the angle of the factor", moved(np.diag([1.0, -1.0])), EVERY),
    Fault("exchange the factor's axes", moved(np.eye(2)[::-1]), EVERY),
    Fault("stretch the factor by half", moved(1.5 * np.eye(2)), (*EVERY, "covariance")),
    Fault("forget the factor's derivatives", lambda s: twin(s, push=only_the_first_term), JETS),
    Fault("forget the cross terms", lambda s: twin(s, push=without_cross_terms), ("hessian",)),
    Fault(
        "keep the covariance",
        lambda s: twin(s, covariance=lambda m, S: S),
        ("covariance",),
    ),
    Fault(
        "add standard deviations",
        lambda s: twin(
            s,
            covariance=lambda m, S: Covariance(
                (jnp.sqrt(jnp.abs(S.matrix)) + jnp.sqrt(jnp.abs(m.factor.covariance().matrix)))
                ** 2,
                S.frame,
            ),
        ),
        ("covariance",),
    ),
    Fault(
        "multiply wavelet coefficients",
        lambda s: twin(
            s,
            wavelet=lambda m, W: eqx.tree_at(
                lambda w: w.coefficients, W, W.coefficients * m.factor.at(jnp.zeros(2))
            ),
        ),
        ("wavelet",),
    ),
)
