"""Straight and curved pieces of silhouettes."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder._display import Module

TURN = 2.0 * np.pi  # of the parameter of a closed arc [rad]


class SilhouetteSegments(Module):
    """Segments of silhouettes.

    Attributes:
        start, end: [m].
        owner: number of the shape.
        live: whether this is a silhouette from here; if not, the points mean nothing.
    """

    start: Float[Array, "*m 3"]
    end: Float[Array, "*m 3"]
    owner: Int[Array, "*m"]
    live: Bool[Array, "*m"]

    def point(self, t: Float[Array, "*t"]) -> Float[Array, "*t 3"]:
        """The point at t in [0, 1] of one segment."""
        return self.start + t[..., None] * (self.end - self.start)


class SilhouetteArcs(Module):
    """Elliptic arcs of silhouettes: `p(t) = center + a cos t + b sin t`.

    Attributes:
        center: [m].
        a, b: conjugate radii [m].
        first, last: where the arc starts and ends [rad].
        owner: number of the shape.
        live: whether this is a silhouette from here; if not, the points mean nothing.
    """

    center: Float[Array, "*m 3"]
    a: Float[Array, "*m 3"]
    b: Float[Array, "*m 3"]
    first: Float[Array, "*m"]
    last: Float[Array, "*m"]
    owner: Int[Array, "*m"]
    live: Bool[Array, "*m"]

    def point(self, t: Float[Array, "*t"]) -> Float[Array, "*t 3"]:
        """The point at t of one arc."""
        return self.center + self.a * jnp.cos(t)[..., None] + self.b * jnp.sin(t)[..., None]

    def velocity(self, t: Float[Array, "*t"]) -> Float[Array, "*t 3"]:
        """Derivative in t of the point."""
        return self.b * jnp.cos(t)[..., None] - self.a * jnp.sin(t)[..., None]
