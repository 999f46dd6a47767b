"""What depends on a field that jumps: the field on either side of its edges, and those edges."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import equinox as eqx
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
        make: makes the light, or the kernel, of such a parameter.
    """
    return tuple(
        Edge(e.level, make(OneSided(field, k, 1.0)) - make(OneSided(field, k, 0.0)))
        for k, e in enumerate(field.edges())
    )


def still(level: Field, frame: Frame) -> Field:
    """A level over rays that is asked at a ray's position and at direction zero.

    A straight one stays straight.
    """
    if isinstance(level, Affine):
        xp, normal = hosted(level.normal)
        return Affine(xp.where(of_position(frame), normal, 0.0), level.offset, frame)
    return _Still(level, frame)


class OneSided(Field):
    """A field with one of its edges taken away: it goes on across that as it is on one side.

    Wrong where the jump of another edge itself jumps at this one, as that of a product of two steps
    does.

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
        missing = self.field.edges()[self.k].jump.jet(u)
        missing = dataclasses.replace(missing, frame=self.frame)
        return self.field.jet(u) + missing.scaled(self._share(u))

    def edges(self) -> tuple[Edge, ...]:
        """The others."""
        edges = self.field.edges()
        return edges[: self.k] + edges[self.k + 1 :]


class _Still(Field):
    """A level that is not straight, asked at direction zero."""

    level: Field
    frame: Frame = eqx.field(static=True)

    def at(self, u: Ray) -> Scalar:
        """The level there."""
        return self.level.at(jnp.where(of_position(self.frame), u, 0.0))

    def jet(self, u: Ray) -> Jet:
        """Its jet there, which does not change along directions."""
        place = of_position(self.frame)
        jet = self.level.jet(jnp.where(place, u, 0.0))
        gradient = jnp.where(place, jet.gradient, 0.0)
        hessian = jnp.where(place & place[:, None], jet.hessian, 0.0)
        return Jet(jet.value, gradient, hessian, self.frame)


def of_position(frame: Frame) -> np.ndarray:
    """Which coordinates are of position."""
    return np.array([i not in frame.directions for i in range(frame.dims)])
