"""What depends on a field that jumps: the field on either side of its edges, and those edges."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.conventions import Frame
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.numerics._host import hosted
from firstorder.typing import Ray, Scalar


def inherited_edges(field: Field, make: Callable[[Field], Field]) -> tuple[Edge, ...]:
    """The edges that a parameter gives to what is made of it.

    Args:
        field: the parameter: a normal, a width, an end of an integral.
        make: the light, or the kernel, that one without this edge would give.
    """
    return tuple(
        Edge(e.level, make(OneSided(field, k, 1.0)) - make(OneSided(field, k, 0.0)))
        for k, e in enumerate(field.edges())
    )


def still(level: Field, frame: Frame) -> Field:
    """A level at the position of a ray, and at direction zero; a straight one stays straight."""
    if isinstance(level, Affine):
        xp, normal = hosted(level.normal)
        place = np.array([i not in frame.directions for i in range(frame.dims)])
        return Affine(xp.where(place, normal, 0.0), level.offset, frame)
    return _Still(level, frame)


class OneSided(Field):
    """A field with one of its edges taken away: it goes on across that as it is on one side.

    Args:
        field: with edges.
        k: which of them.
        side: 1 for the side on which the level is positive, 0 for the other.
    """

    field: Field
    k: int = eqx.field(static=True)
    side: float = eqx.field(static=True)

    @property
    def frame(self) -> Frame:
        """Frame of the field."""
        return self.field.frame

    def _share(self, u: Ray) -> Scalar:
        """The share of the jump that is missing at a ray."""
        return self.side - 0.5 * (1.0 + jnp.sign(self.field.edges()[self.k].level.at(u)))

    def at(self, u: Ray) -> Scalar:
        """The field, or what it would be."""
        return self.field.at(u) + self._share(u) * self.field.edges()[self.k].jump.at(u)

    def jet(self, u: Ray) -> Jet:
        """Likewise: between edges the share does not change."""
        share = self._share(u)
        missing = self.field.edges()[self.k].jump.jet(u)
        return jax.tree.map(lambda a, b: a + share * b, self.field.jet(u), _named(missing, self))

    def edges(self) -> tuple[Edge, ...]:
        """The others."""
        edges = self.field.edges()
        return edges[: self.k] + edges[self.k + 1 :]


def _named(jet: Jet, field: Field) -> Jet:
    """The jet over the coordinates of a field, as its jets have them."""
    return Jet(jet.value, jet.gradient, jet.hessian, field.frame)


class _Still(Field):
    """A level at direction zero."""

    level: Field
    frame: Frame = eqx.field(static=True)

    def _place(self, u: Ray) -> Ray:
        return u * np.array([i not in self.frame.directions for i in range(self.frame.dims)])

    def at(self, u: Ray) -> Scalar:
        """The level there."""
        return self.level.at(self._place(u))

    def jet(self, u: Ray) -> Jet:
        """Its jet there, which does not change along directions."""
        jet, one = self.level.jet(self._place(u)), self._place(jnp.ones_like(u))
        hessian = jet.hessian * one[:, None] * one
        return Jet(jet.value, jet.gradient * one, hessian, self.frame)
