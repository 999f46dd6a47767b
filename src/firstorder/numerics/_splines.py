"""Cubic B-splines, of which tables of light and of lobes are made."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float


def cubic_b_spline(u: Float[ArrayLike, "*n"]) -> tuple[Array, Array, Array]:
    """The cubic B-spline with integer knots, `b(0) = 2/3`, and its first two derivatives.

    Value and slope are written with `u u` and `u |u|`: their derivatives at u = 0, where a node of
    a table lies, do not depend on the sign of u. The third derivative jumps there.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._splines import cubic_b_spline
        >>> [round(a.item(), 6) for a in cubic_b_spline(jnp.array(0.0))]
        [0.666667, -0.0, -2.0]
    """
    a, square = jnp.abs(u), u * u
    inner, rest = a < 1.0, jnp.maximum(2.0 - a, 0.0)
    b = jnp.where(inner, 2.0 / 3.0 - square + 0.5 * a * square, rest**3 / 6.0)
    d = jnp.where(inner, (1.5 * a - 2.0) * u, -0.5 * jnp.sign(u) * rest**2)
    return b, d, jnp.where(inner, 3.0 * a - 2.0, rest)
