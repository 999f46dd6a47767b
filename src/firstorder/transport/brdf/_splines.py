"""Cubic B-splines, the kernels of tabulated profiles."""

import jax.numpy as jnp


def cubic_b_spline(u):
    """The cubic B-spline with integer knots, `b(0) = 2/3`, and its first two derivatives."""
    a = jnp.abs(u)
    inner, rest = a < 1.0, jnp.maximum(2.0 - a, 0.0)
    b = jnp.where(inner, 2.0 / 3.0 - a**2 + 0.5 * a**3, rest**3 / 6.0)
    d = jnp.where(inner, -2.0 * u + 1.5 * u * a, -jnp.sign(u) * rest**2 / 2.0)
    return b, d, jnp.where(inner, -2.0 + 3.0 * a, rest)
