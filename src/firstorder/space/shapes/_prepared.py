"""Shapes as searches ask for them: what depends on no ray is found once, before all rays."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from firstorder._display import Module
from firstorder.numerics._select import either
from firstorder.numerics._vectors import apart, matvec
from firstorder.space.shapes._slabs import EXACT, Rounding, far_from

Point = Float[Array, "3"]
Distance = Float[Array, ""]


class Prepared(Module):
    """Shapes of one kind by the maps that make them canonical.

    Attributes:
        center: what goes to the origin [m].
        turn: matrix of the map, without the shift [1/m].
        place: rounding of a hit for rays that start at the origin, by canonical coordinate.
        way: rounding of a direction, likewise.
        kind: whose ray test it is.
    """

    center: Float[Array, "*n 3"]
    turn: Float[Array, "*n 3 3"]
    place: Float[Array, "*n 3"]
    way: Float[Array, "*n 3"]
    kind: type[Any] = eqx.field(static=True)

    @property
    def count(self) -> int:
        """Number of shapes."""
        return self.center.shape[0]

    def distance(self, origin: Point, along: Point, own: Bool[Array, ""] | bool) -> Distance:
        """Distance at which a ray first meets the shape, infinity for none."""
        o, d = matvec(self.turn, origin - self.center), matvec(self.turn, along)
        t = self.kind.canonical_distance(apart(o), apart(d), self._rounding(origin))
        return either((t > 0.0) & ~jnp.asarray(own), t, jnp.inf)

    def _rounding(self, origin: Point) -> Rounding:
        """Rounding of a ray from there."""
        if not self.kind.faceted:
            return EXACT
        far = far_from(jax.lax.stop_gradient(origin))
        return Rounding(apart(self.place + far * self.way), apart(self.way))
