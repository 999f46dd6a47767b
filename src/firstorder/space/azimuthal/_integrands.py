"""Integrands over the visible part of a vertical slice: T |sin(theta)|.

An integrand answers two questions. `inside(low, high, phi)` is the integral over what the intervals
[low, high] of theta leave visible of a slice, and its derivative by a step of the receiver with the
edges held. `edge(w)` is T in the directions w.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from firstorder._argument_checks import check_one, check_real
from firstorder._display import Module
from firstorder.conventions import polar
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.space.receiver import Receiver
from firstorder.visibility._intervals import HORIZON, blocked_measure, visible_gaps

# What light from a local direction w adds per solid angle, at a receiver: T(at, w).
Transport = Callable[[Receiver, Array], Array]


def check_transport(transport: Any, at: Receiver) -> None:
    """Refuse what gives no real number for a direction at a receiver; nothing is computed.

    Raises:
        TypeError: if it is no function.
        ValueError: if it gives something else.
    """
    if not callable(transport):
        raise TypeError(  # a number is traced by now, and its kind says nothing
            "Argument `transport` must be a function of a receiver and a direction, but is none."
        )
    given = jax.eval_shape(transport, at, at.normal)
    check_real("transport", given)
    check_one("transport", given)


class Uniform(Module):
    """T = 1: closed over theta, without an interior derivative."""

    def inside(self, low, high, phi):
        """Integral over the visible part of a slice, and its derivative with the edges held."""
        start, end = (self.primitive(jnp.asarray(h, low.dtype)) for h in HORIZON)
        value = end - start - blocked_measure(low, high, self.primitive)
        return value, jnp.zeros(2, low.dtype)

    def primitive(self, theta):
        """Primitive of |sin(theta)|: smooth but for its second derivative at the pole."""
        return jnp.where(theta < 0.0, -2.0, 2.0) * jnp.sin(0.5 * theta) ** 2

    def edge(self, w):
        """T at the edges."""
        return jnp.ones(w.shape[:-1], w.dtype)


class Cosine(Uniform):
    """T = cos(theta)."""

    def primitive(self, theta):
        """Primitive of |sin(theta)| cos(theta)."""
        return jnp.where(theta < 0.0, -0.5, 0.5) * jnp.sin(theta) ** 2

    def edge(self, w):
        """T at the edges: the cosine."""
        return w[..., 2]


class Varying(Module):
    """Any T: quadrature on the visible pieces.

    Attributes:
        transport: T, of a receiver and a direction of its frame.
        at: the receiver.
        inner: nodes on each piece.
    """

    transport: Transport = eqx.field(static=True)
    at: Receiver
    inner: int = eqx.field(static=True)

    def inside(self, low, high, phi):
        """Integral and its derivative by quadrature between the blockers."""
        start, stop = visible_gaps(low, high)
        # |sin| has a corner at the pole: each gap is cut there.
        starts = jnp.concatenate([jnp.minimum(start, 0.0), jnp.maximum(start, 0.0)])
        stops = jnp.concatenate([jnp.minimum(stop, 0.0), jnp.maximum(stop, 0.0)])
        x, weight = (jnp.asarray(a, low.dtype) for a in gauss_legendre(self.inner))
        half = 0.5 * (stops - starts)[:, None]
        theta = (starts[:, None] + half * (1.0 + x)).ravel()
        weight = (half * weight).ravel() * jnp.abs(jnp.sin(theta))
        w = polar(theta, phi)
        value = jax.vmap(lambda w: self.transport(self.at, w))(w)
        still = jnp.zeros(2, low.dtype)
        rate = jax.vmap(lambda w: jax.jacfwd(lambda x: self.transport(self.at.moved(x), w))(still))(
            w
        )
        return weight @ value, weight @ rate

    def edge(self, w):
        """T at the edges."""
        return jax.vmap(lambda w: self.transport(self.at, w))(w)
