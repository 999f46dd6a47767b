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

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from firstorder.numerics._vectors import dot

# Share of the largest light, with eps^0.4, by which the sum may differ from zero. A ray beside an
# edge overlooks others nearer than eps^0.7; in single precision that makes sums of 0.007.
ROUNDINGS = 8.0


def chords(
    lines: Float[Array, "m 2 3"],
    arcs: Float[Array, "c 3 3"],
    straight: Float[Array, "m k"],
    curved: Float[Array, "c l"],
    azimuths: Float[Array, " h_1"],
) -> Float[Array, "p 3"]:
    """The way in direction from the start to the end of each piece; it has no derivative.

    Args:
        lines: start and end of segments, of any unit.
        arcs: centre and conjugate radii of arcs, likewise.
        straight: where the pieces of each segment begin and end, in order, in [0, 1].
        curved: where those of each arc do [rad].
        azimuths: where those of the horizon do, which come last [rad].
    """
    lines, arcs, straight, curved, azimuths = jax.lax.stop_gradient(
        (lines[:, :, None], arcs[:, :, None], straight[..., None], curved[..., None], azimuths)
    )
    start, end = jnp.unstack(lines, axis=1)
    center, a, b = jnp.unstack(arcs, axis=1)
    ends = (
        _directions(start + straight * (end - start)),
        _directions(center + a * jnp.cos(curved) + b * jnp.sin(curved)),
        jnp.stack([jnp.cos(azimuths), jnp.sin(azimuths), jnp.zeros_like(azimuths)], -1),
    )
    return jnp.concatenate([(w[..., 1:, :] - w[..., :-1, :]).reshape(-1, 3) for w in ends])


def _directions(p: Float[Array, "*p 3"]) -> Float[Array, "*p 3"]:
    """`unit` in half the equations, for points near one in size that need no derivative."""
    square = jnp.maximum(dot(p, p), jnp.finfo(p.dtype).tiny)
    return p / jnp.sqrt(square)[..., None]


def edges_close(
    jumps: Sequence[Array], ways: Float[Array, "p_h 3"], shown: Float[Array, " n_1"], eps: float
) -> Bool[Array, ""]:
    """Whether all edges of light are there, up to `8 eps^0.4` of the largest light.

    Args:
        jumps: light to the left of each piece less that to its right, of some behind each other.
        ways: `chords` of all pieces.
        shown: light of all shapes, and of the sky.
        eps: of the precision.
    """
    rest = jnp.concatenate(jumps) @ ways
    return jnp.max(jnp.abs(rest)) <= ROUNDINGS * eps**0.4 * jnp.max(jnp.abs(shown))
