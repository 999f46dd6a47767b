"""Vectors of the plane."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float


def cross_2d(a: Float[Array, "*n 2"], b: Float[Array, "*n 2"]) -> Float[Array, "*n"]:
    """The signed area `a_x b_y - a_y b_x`: positive if b is counter-clockwise from a."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def dot_2d(a: Float[Array, "*n 2"], b: Float[Array, "*n 2"]) -> Float[Array, "*n"]:
    """The scalar product of vectors in the plane."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def left(a: Float[Array, "*n 2"]) -> Float[Array, "*n 2"]:
    """A vector turned by a right angle counter-clockwise: the side on which normals lie."""
    return jnp.stack([-a[..., 1], a[..., 0]], -1)
