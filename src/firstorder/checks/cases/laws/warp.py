"""Warp: a map that bends both coordinates, and is not its own mirror image."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Jet
from firstorder.laws import Map, Warp
from firstorder.typing import Scalar, as_float


class Bend(Map):
    """`(x + a sin(theta), theta + b x^2 - x / 5)`."""

    a: Scalar = eqx.field(converter=as_float)
    b: Scalar = eqx.field(converter=as_float)

    def __call__(self, u):
        """The map."""
        return jnp.stack([u[0] + self.a * jnp.sin(u[1]), u[1] + self.b * u[0] ** 2 - 0.2 * u[0]])

    def derivatives(self, u):
        """In closed form."""
        one = jnp.ones_like(u[0])
        J = jnp.stack(
            [
                jnp.stack([one, self.a * jnp.cos(u[1])]),
                jnp.stack([2.0 * self.b * u[0] - 0.2, one]),
            ]
        )
        second = jnp.zeros((2, 2, 2), u.dtype)
        second = second.at[0, 1, 1].set(-self.a * jnp.sin(u[1])).at[1, 0, 0].set(2.0 * self.b)
        return self(u), J, second


def brute(u):
    """`f(T(u))`, written out."""
    x, t = u
    return bell(x + 0.4 * np.sin(t), t + 0.3 * x * x - 0.2 * x)


CASES = (
    Case(
        "warp",
        Warp(Bend(0.4, 0.3)),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        expected={p: "refused" for p in ("spectrum", "covariance", "wavelet")},
    ),
)


def without_bend(w, jet, u):
    """The chain rule of a linear map: no second derivatives of T."""
    _, J, _ = w.map.derivatives(u)
    right = Warp.push(w, jet, u)
    return Jet(right.value, right.gradient, J.T @ jet.hessian @ J, right.frame)


def untransposed(w, jet, u):
    """J for its transpose."""
    _, J, _ = w.map.derivatives(u)
    return Jet(jet.value, J @ jet.gradient, J @ jet.hessian @ J.T, w.frame(jet.frame))


JETS = ("gradient", "hessian")
FAULTS = (
    Fault("rows for columns", lambda s: twin(s, push=untransposed), JETS),
    Fault("drop the second derivatives", lambda s: twin(s, push=without_bend), ("hessian",)),
    Fault("flip the bend", lambda s: Warp(Bend(-s.map.a, s.map.b)), ("value", *JETS)),
    Fault("exchange the bends", lambda s: Warp(Bend(s.map.b, s.map.a)), ("value", *JETS)),
    Fault(
        "linearise at the origin",
        lambda s: s.linearise(jnp.zeros(2)).move,
        ("value", *JETS),
    ),
)
