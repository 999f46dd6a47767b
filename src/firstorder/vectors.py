"""Vectors of space, their frames, and 3x3 matrices by their columns."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

Vectors = Float[Array, "*n 3"]
Numbers = Float[Array, "*n"]


def dot(a: Vectors, b: Vectors) -> Numbers:
    """The scalar product."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def cross(a: Vectors, b: Vectors) -> Vectors:
    """The vector product, right-handed."""
    return jnp.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        -1,
    )


def norm(a: Vectors) -> Numbers:
    """Length; zero, with zero derivative, for the zero vector."""
    square = dot(a, a)
    there = square > 0.0
    return jnp.where(there, jnp.sqrt(jnp.where(there, square, 1.0)), 0.0)


def unit(a: Vectors) -> Vectors:
    """The vector of length one along a; the zero vector stays what it is."""
    length = norm(a)
    return a / jnp.where(length > 0.0, length, 1.0)[..., None]


def frame(normal: Vectors) -> Float[Array, "*n 3 3"]:
    """A right-handed frame (t, b, n) with the axes as columns, local to global.

    t and b are smooth in n but for a jump at n_z = 0: on neither side do they degenerate.

    Example:
        >>> import jax.numpy as jnp
        >>> frame(jnp.array([0.0, 0.0, 1.0])).tolist()
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    x, y, z = normal[..., 0], normal[..., 1], normal[..., 2]
    sign = jnp.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    t = jnp.stack([1.0 + sign * x * x * a, sign * b, -sign * x], -1)
    s = jnp.stack([b, sign + y * y * a, -y], -1)
    return jnp.stack([t, s, normal], -1)


def inverse(axes: Float[Array, "*n 3 3"]) -> Float[Array, "*n 3 3"]:
    """The inverse of a matrix, from the vector products of its columns."""
    a, b, c = axes[..., 0], axes[..., 1], axes[..., 2]
    rows = jnp.stack([cross(b, c), cross(c, a), cross(a, b)], -2)
    return rows / dot(a, cross(b, c))[..., None, None]


def times(matrix: Float[Array, "*n 3 3"], a: Vectors) -> Vectors:
    """Matrix times vector, written out: three products cost less than a call."""
    return matrix[..., 0] * a[..., :1] + matrix[..., 1] * a[..., 1:2] + matrix[..., 2] * a[..., 2:]
