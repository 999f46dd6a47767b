"""Vectors of the plane."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def cross_2d(a: Float[Array, "*#n 2"], b: Float[Array, "*#n 2"]) -> Float[Array, "*#n"]:
    """The signed area `a_x b_y - a_y b_x`: positive if b is counter-clockwise from a."""
    (ax, ay), (bx, by) = jnp.unstack(a, axis=-1), jnp.unstack(b, axis=-1)
    return ax * by - ay * bx


def dot_2d(a: Float[Array, "*#n 2"], b: Float[Array, "*#n 2"]) -> Float[Array, "*#n"]:
    """The scalar product of vectors in the plane."""
    (ax, ay), (bx, by) = jnp.unstack(a, axis=-1), jnp.unstack(b, axis=-1)
    return ax * bx + ay * by


def left(a: Float[Array, "*n 2"]) -> Float[Array, "*n 2"]:
    """A vector turned by a right angle counter-clockwise: the side on which normals lie."""
    x, y = jnp.unstack(a, axis=-1)
    return jnp.stack([-y, x], -1)


@jax.custom_jvp
def sine_and_cosine(
    side: Float[Array, "*n"], up: Float[Array, "*n"]
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Sine and cosine of the angle of a vector that is not zero, `(side, up) / |(side, up)|`.

    They are turned as the vector turns, `dtheta = (up dside - side dup) / |(side, up)|^2`: so
    derivatives of every order keep their digits where the sine or the cosine is near one.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._planar import sine_and_cosine
        >>> [round(a.item(), 6) for a in sine_and_cosine(jnp.array(3.0), jnp.array(4.0))]
        [0.6, 0.8]
    """
    length = jnp.sqrt(side * side + up * up)
    return side / length, up / length


@sine_and_cosine.defjvp
def _turned(vector, step):
    (side, up), (d_side, d_up) = vector, step
    sine, cosine = sine_and_cosine(side, up)
    turn = (up * d_side - side * d_up) / (side * side + up * up)
    return (sine, cosine), (cosine * turn, -sine * turn)
