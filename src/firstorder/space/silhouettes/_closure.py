"""Whether the visible edges of light close: a check of every answer that is made of them.

Light is one function of direction, and the edge of each of its regions is closed. So over all
pieces of edges, those of the horizon among them,

    sum of (L_left - L_right) (w_end - w_start) = 0,

where w are the directions in which a piece ends and starts. The sum is rounding unless an edge is
missing or out of place. Shapes that run into each other meet in one that is nobody's silhouette;
within rounding of a surface its edges are taken for some before it and for others behind it.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from firstorder.numerics._vectors import unit


def chords(ends: Float[Array, "2 p 3"], azimuths: Float[Array, " h_1"]) -> Float[Array, "p_h 3"]:
    """The way in direction from the start to the end of each piece, and of each of the horizon's.

    Args:
        ends: where pieces start and where they end, of any length.
        azimuths: ends of the horizon's pieces [rad].
    """
    start, end = jnp.unstack(unit(ends))
    level = jnp.stack([jnp.cos(azimuths), jnp.sin(azimuths), jnp.zeros_like(azimuths)], -1)
    return jnp.concatenate([end - start, level[1:] - level[:-1]])


def edges_close(
    jumps: Sequence[Array], ways: Float[Array, "p_h 3"], shown: Float[Array, " n_1"], eps: float
) -> Bool[Array, ""]:
    """Whether all edges of light are there, but for as much as edges in line may be mistaken.

    Args:
        jumps: light to the left of each piece less that to its right, of some behind each other.
        ways: `chords` of all pieces.
        shown: light of all shapes, and of the sky.
        eps: of the precision.
    """
    rest = jnp.concatenate(jumps) @ ways
    return jnp.max(jnp.abs(rest)) <= eps**0.4 * jnp.max(jnp.abs(shown))
