"""What ray tests of shapes with flat faces share: slabs, level rays, and what rounding spares.

All numbers are coordinates of a canonical shape, which reaches from -1 to 1 or from 0 to 1.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder.numerics._select import either
from firstorder.numerics._vectors import Coordinates

Each: TypeAlias = Coordinates | tuple[float, float, float]


class Rounding(NamedTuple):
    """By how much numbers of a ray may be off, by canonical coordinate.

    Attributes:
        place: a hit.
        way: the direction.
    """

    place: Each
    way: Each


# Of how many roundings a number is off at most, but for grazing rays and for slivers.
ROUNDINGS = 4.0
EXACT = Rounding((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def rounding_of(
    turn: Float[Array, "*n 3 3"], center: Float[Array, "*n 3"], axes: Float[Array, "*n 3 k"]
) -> tuple[Float[Array, "*n 3"], Float[Array, "*n 3"]]:
    """Roundings of a hit for rays that start at the origin, and of a direction.

    Args:
        turn: matrix that makes the shape canonical.
        center: what it takes to the origin.
        axes: those columns of its inverse that are lengths [m].
    """
    turn, center, axes = jax.lax.stop_gradient((turn, center, axes))
    size = ROUNDINGS * jnp.finfo(turn.dtype).eps * jnp.sum(jnp.abs(turn), -1)
    reach = 2.0 * far_from(center) + jnp.max(jnp.abs(axes), (-2, -1))
    return size * reach[..., None], size


def far_from(point: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
    """The largest coordinate, by which numbers of a canonical row are rounded."""
    return jnp.max(jnp.abs(point), -1)


def level_along(d: Coordinates, way: Each) -> list[Bool[Array, "..."]]:
    """Along which coordinates a ray is level, but for rounding.

    A compiler may round a number in two ways in one program: whether a quotient is taken and
    whether it counts must be decided alike.
    """
    return [jnp.abs(a) <= b for a, b in zip(d, way, strict=True)]


def slab(o: Array, d: Array, level: Array, spare: ArrayLike) -> tuple[Array, Array]:
    """Interval of a ray between -1 and 1, of one coordinate."""
    sign = either(d < 0.0, jnp.full_like(d, -1.0), 1.0)
    o, size = o * sign, either(level, 1.0, d * sign)
    between = either(jnp.abs(o) <= 1.0 + spare, jnp.full_like(o, -jnp.inf), jnp.inf)
    near = either(level, between, (-1.0 - o) / size)
    return near, either(level, jnp.inf, (1.0 - o) / size)
