"""Lights as lattices of nodes: what shading asks of them, and the lamp, a rectangle that shines."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol, runtime_checkable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_coordinates,
    check_count,
    check_finite,
    check_not_negative,
    is_concrete,
)
from firstorder._display import Module
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.numerics._vectors import cross, dot, near_one
from firstorder.typing import as_float

Direction = Float[Array, "3"]


@runtime_checkable
class SampledLight(Protocol):
    """Protocol of lights given as nodes in rows and columns (`Lamp`, `sky_lights.DistantLight`)."""

    @property
    def radiance(self) -> Array:
        """Radiance of each node, or of all."""
        ...

    @property
    def near(self) -> bool:
        """Whether nodes stay where they are when the point moves; distant ones move with it."""
        ...

    @property
    def even(self) -> bool:
        """Whether the nodes are the middles of equal cells."""
        ...

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of nodes."""
        ...

    @property
    def wraps(self) -> bool:
        """Whether the last column is a neighbour of the first."""
        ...

    def toward(self, x: Direction) -> tuple[Float[Array, "k 3"], Float[Array, "k 3"]]:
        """Vectors from a point to the nodes [m], and each node's area vector [m^2]."""
        ...

    def slide(self, x: Direction, nodes: Any = slice(None)) -> Float[Array, "k 2 3"]:
        """Rate at which half-way shadows move over nodes, in cells along rows and columns."""
        ...


class Lamp(Module):
    """A rectangle or parallelogram that emits from its side u x v, as a lattice of nodes.

    Args:
        center: shape (3,) [m].
        u: half of an edge, shape (3,) [m].
        v: half of the other edge [m].
        radiance: emitted, the same everywhere; or one for each band [W/(m^2 sr)].
        count: nodes along each edge.
        even: whether nodes stand in the middles of equal cells, as shadows want it; if not, they
            are those of Gauss and Legendre, which smooth light wants.
        shift: of even nodes out of the middles of their cells, in cells along u and v.

    Raises:
        ValueError: if `count` is not positive, a vector not finite, a radiance negative, or u and v
            span no area.

    Example:
        >>> from firstorder.imaging import Lamp
        >>> lamp = Lamp((0, 0, 2), (0, 1, 0), (1, 0, 0), count=4)
        >>> lamp.position.shape, round(-lamp.area[:, 2].sum().item(), 12)
        ((16, 3), 4.0)
    """

    BANDED: ClassVar = {"radiance": 0}

    center: Direction = eqx.field(converter=as_float)
    u: Direction = eqx.field(converter=as_float)
    v: Direction = eqx.field(converter=as_float)
    radiance: Float[Array, "*bands"] = eqx.field(converter=as_float, default=1.0)
    count: int = eqx.field(static=True, default=8)
    even: bool = eqx.field(static=True, default=False)
    shift: Float[Array, "2"] = eqx.field(converter=as_float, default=(0.0, 0.0))

    def __check_init__(self):
        """Refuse a lamp without nodes, without a place or with negative light."""
        check_count("count", self.count)
        for name in ("center", "u", "v"):
            check_coordinates(name, getattr(self, name))
            check_finite(name, getattr(self, name))
        check_finite("shift", self.shift)
        check_not_negative("radiance", self.radiance)
        if is_concrete((self.u, self.v)) and not _span(np.asarray(self.u), np.asarray(self.v)):
            raise ValueError("Arguments `u` and `v` must span an area, but do not.")

    @property
    def near(self) -> bool:
        """Whether nodes stay in place when the point moves: they do."""
        return True

    @property
    def wraps(self) -> bool:
        """Whether the last column is a neighbour of the first: it is not."""
        return False

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of nodes."""
        return self.count, self.count

    @property
    def _rule(self) -> tuple[np.ndarray, np.ndarray]:
        if not self.even:
            return gauss_legendre(self.count)
        k = np.arange(self.count)
        return (2.0 * k + 1.0) / self.count - 1.0, np.full(self.count, 2.0 / self.count)

    @property
    def position(self) -> Float[Array, "k 3"]:
        """Positions of the nodes; `v` varies fastest [m]."""
        x = self._rule[0]
        s, t = (jnp.asarray(a.ravel(), self.center.dtype) for a in np.meshgrid(x, x, indexing="ij"))
        if self.even:
            s, t = (a + 2.0 / self.count * k for a, k in zip((s, t), self.shift, strict=True))
        return self.center + s[:, None] * self.u + t[:, None] * self.v

    @property
    def area(self) -> Float[Array, "k 3"]:
        """Area vectors of the nodes' cells, along the side that emits [m^2]."""
        w = self._rule[1]
        return jnp.asarray(np.outer(w, w).ravel(), self.u.dtype)[:, None] * cross(self.u, self.v)

    def toward(self, x: Direction) -> tuple[Float[Array, "k 3"], Float[Array, "k 3"]]:
        """Vectors from a point to the nodes [m], and their area vectors [m^2]."""
        return self.position - x, self.area

    def slide(self, x: Direction, nodes: Any = slice(None)) -> Float[Array, "k 2 3"]:
        """Rate of half-way shadows, `(I - d m^T / (m . d)) dx` in u and v, m the lamp's normal."""
        area = cross(self.u, self.v)
        m = near_one(area)  # its length is of no matter
        dual = jnp.stack([cross(self.v, m), cross(m, self.u)]) / dot(area, m)  # shares of u and v
        d = self.position[nodes] - x
        reach = d @ m
        along = (d @ dual.T) / jnp.where(reach == 0.0, jnp.inf, reach)[:, None]
        return 0.5 * self.count * (dual - along[..., None] * m)


def _span(u: np.ndarray, v: np.ndarray) -> bool:
    """Whether two vectors are not parallel, but for rounding."""
    area, long = np.linalg.norm(np.cross(u, v)), np.linalg.norm(u) * np.linalg.norm(v)
    return bool(area > 8.0 * np.finfo(u.dtype).eps * long)
