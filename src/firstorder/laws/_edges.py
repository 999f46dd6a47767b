"""Edges that survive an integral."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer

from firstorder.conventions import Frame
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.typing import Array, Ray, Scalar


def surviving_edges(edges: tuple[Edge, ...], a: int) -> tuple[Edge, ...]:
    """The edges that do not change along axis a, hence outlive an integral over it.

    For a straight edge whose normal can be looked at that is a fact. For any other, the jump is
    put to zero wherever the level does change: such an edge is carried along in vain, but none is
    lost.
    """
    found = []
    for e in edges:
        level = e.level
        if not isinstance(level, Affine) or isinstance(level.normal, Tracer):
            found.append(Edge(level, _Along(e.jump, level, a)))
        elif level.normal[a] == 0:
            found.append(e)
    return tuple(found)


class _Along(Field):
    """A jump where the level does not change along axis a, zero elsewhere."""

    jump: Field
    level: Field
    a: int = eqx.field(static=True)

    @property
    def frame(self) -> Frame:
        """Frame of the jump."""
        return self.jump.frame

    def _here(self, u: Ray) -> Array:
        return self.level.jet(u).gradient[self.a] == 0

    def at(self, u: Ray) -> Scalar:
        """The jump, or zero."""
        return jnp.where(self._here(u), self.jump.at(u), 0.0)

    def jet(self, u: Ray) -> Jet:
        """Jet of the jump, or zeros."""
        here = self._here(u)
        return jax.tree.map(lambda leaf: jnp.where(here, leaf, 0.0), self.jump.jet(u))

    def edges(self) -> tuple[Edge, ...]:
        """Edges of the jump."""
        return self.jump.edges()
