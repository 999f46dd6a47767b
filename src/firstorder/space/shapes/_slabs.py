"""What ray tests of shapes with flat faces share: slabs, level rays, and what rounding spares.

All numbers are coordinates of a canonical shape, which reaches from -1 to 1 or from 0 to 1.
"""

from __future__ import annotations

from typing import TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder.numerics._select import either
from firstorder.numerics._vectors import Coordinates

# How far a hit may lie from its place by rounding, by coordinate.
Slack: TypeAlias = Coordinates | tuple[float, float, float]
EXACT = (0.0, 0.0, 0.0)


def level_along(d: Coordinates) -> list[Array]:
    """Along which coordinates a ray is level: they change by rounding alone across the shape.

    Not only where they are zero: a compiler may round a number in two ways in one program, and
    whether a quotient is taken and whether it counts must be decided alike.
    """
    size = [jnp.abs(a) for a in jax.lax.stop_gradient(d)]
    least = 4.0 * jnp.finfo(d[0].dtype).eps * (size[0] + size[1] + size[2])
    return [a <= least for a in size]


def beside(turn: Float[Array, "*n 3 3"], center: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
    """How far a hit may lie from its place by rounding, by coordinate, if rays start at the shape.

    Args:
        turn: matrix that makes the shape canonical.
        center: what it takes to the origin.
    """
    far = jnp.sum(jnp.abs(turn * center[..., None, :]), -1)
    return jax.lax.stop_gradient(8.0 * jnp.finfo(far.dtype).eps * (1.0 + far))


def slack(o: Array, near: Array) -> Array:
    """The same for rays that start anywhere.

    Args:
        o: where they start, canonically.
        near: `beside`.
    """
    return near + 8.0 * jnp.finfo(o.dtype).eps * jnp.abs(jax.lax.stop_gradient(o))


def slab(o: Array, d: Array, level: Array, spare: ArrayLike) -> tuple[Array, Array]:
    """Interval of a ray between -1 and 1, of one coordinate."""
    sign = either(d < 0.0, jnp.full_like(d, -1.0), 1.0)
    o, size = o * sign, either(level, 1.0, d * sign)
    between = either(jnp.abs(o) <= 1.0 + spare, jnp.full_like(o, -jnp.inf), jnp.inf)
    near = either(level, between, (-1.0 - o) / size)
    return near, either(level, jnp.inf, (1.0 - o) / size)
