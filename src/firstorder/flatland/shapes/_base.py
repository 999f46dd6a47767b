"""The interface of every kind of shape of flatland, and constructors of its leaves."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from firstorder._display import Module
from firstorder.numerics._host import hosted
from firstorder.numerics._planar import cross_2d
from firstorder.numerics._scale import power_of_two
from firstorder.scene._sides import closed_front
from firstorder.typing import as_array, as_float

Point = Float[Array, "2"]


class Shape(Module):
    """A kind of shape, many of which lie in one object. All methods are those of one shape."""

    closed = False
    lengths: ClassVar[tuple[str, ...]] = ()  # names of the leaves in metres; others are angles
    silhouette_count: ClassVar[int]  # how many points `silhouettes` gives

    def in_unit(self, unit: Float[Array, ""]) -> Shape:
        """The shapes with their lengths in another unit.

        Args:
            unit: of length, one number [m].
        """
        return eqx.tree_at(
            lambda shape: [getattr(shape, name) for name in self.lengths],
            self,
            [getattr(self, name) / unit for name in self.lengths],
        )

    def turned(self, which: Bool[Array, " n"]) -> Shape:
        """The shapes, those of `which` with front and back exchanged.

        Raises:
            ValueError: if the kind is closed: its front is its outside.
        """
        raise ValueError(closed_front(type(self).__name__))

    def height(self, p: np.ndarray) -> np.ndarray:
        """Where a point lies of each shape, by NumPy: positive before the front, negative behind.

        NaN for kinds that cannot tell it in microseconds. Only the sign means something.
        """
        return np.full(self.count, np.nan)

    @property
    @abc.abstractmethod
    def count(self) -> int:
        """Number of shapes."""

    @abc.abstractmethod
    def motion(self, s: Float[Array, ""]) -> tuple[Point, Point, Point]:
        """Position, first and second derivative in s."""

    @abc.abstractmethod
    def hit(
        self, origin: Point, along: Point, on: Bool[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """Distance to the nearest point of the shape along a unit vector, and its parameter.

        Infinity if there is none. `on` says that the origin lies on this very shape, whose own
        point there is not a hit.
        """

    def prepared(self) -> Any:
        """The shapes as searches ask for their `distance`: what depends on no ray is found once."""
        return self

    def ready(self) -> Shape:
        """The same shapes together with what depends on no ray, for many questions."""
        return self

    def distance(self, origin: Point, along: Point, on: Bool[Array, ""]) -> Float[Array, ""]:
        """The distance of `hit` alone, for searches."""
        prepared = self.prepared()
        if prepared is self:
            return self.hit(origin, along, on)[0]
        return prepared.distance(origin, along, on)

    def front(self, origin: Point, along: Point, on: Bool[Array, ""]) -> Bool[Array, ""]:
        """Whether a ray that meets the shape meets the side that the normal is on."""
        return cross_2d(self.motion(self.hit(origin, along, on)[1])[1], along) < 0.0

    @abc.abstractmethod
    def silhouettes(self, p: Point, on: Bool[Array, ""]) -> tuple[Array, Array]:
        """Points at which the shape may begin or end for an eye at p, and which of them exist."""


def own_unit(groups: Sequence[Shape]) -> Float[Array, ""]:
    """The power of two near the largest length of some shapes, without derivative [m].

    In it no square of a length leaves the range of the precision. Directions do not depend on it.
    """
    leaves = [getattr(group, name) for group in groups for name in group.lengths]
    return power_of_two(jnp.concatenate([jnp.ravel(a) for a in leaves]))


def rows(p: Any) -> Array:
    """Points, one for each shape."""
    p = as_float(p)
    if p.ndim not in (1, 2, 3) or p.shape[-1] != 2:
        raise ValueError(f"A point must have two coordinates, but has shape {p.shape}.")
    return _more(p, 1)


def column(r: Any) -> Array:
    """Numbers, one for each shape."""
    r = as_float(r)
    return _more(r, 0)


def stack(c: Any) -> Array:
    """Series of points, one for each shape."""
    c = as_float(c)
    return _more(c, 2)


def _more(a: Array, dims: int) -> Array:
    """One shape's numbers, if there are so many axes, as a row of many."""
    if a.ndim != dims:
        return a
    _, numbers = hosted(a)
    if isinstance(numbers, float):
        return a[None]  # by JAX, which keeps that it takes the precision of the others
    return as_array(numbers[None])


def spread(shape: Any, *names: str) -> None:
    """Let single numbers of a structure of shapes stand for all of its `center`s."""
    n = shape.center.shape[0] if shape.center.ndim == 2 else 0
    for name in names:
        leaf = getattr(shape, name)
        if n > 1 and leaf.shape[:1] == (1,):
            xp, leaf = hosted(leaf)
            leaves = as_array(xp.broadcast_to(leaf, (n, *leaf.shape[1:])))
            object.__setattr__(shape, name, leaves)


def same(name: str, a: Array, b: Array) -> None:
    """Refuse two leaves of one kind that differ in the number of shapes."""
    if a.shape and b.shape and a.shape[0] != b.shape[0]:
        raise ValueError(
            f"Argument `{name}` must hold {b.shape[0]} shapes, but holds {a.shape[0]}."
        )
