"""Derivatives of a function of few numbers, in one pass."""

from __future__ import annotations

from collections.abc import Callable

import jax
from jaxtyping import Array


def twice(f: Callable[[Array], Array], u: Array) -> tuple[Array, Array, Array]:
    """Value, first and second derivatives by all numbers, which come last; f is traced once.

    Args:
        f: of a vector, with any result.
        u: where.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._derivatives import twice
        >>> [a.tolist() for a in twice(lambda u: u[0] ** 2 * u[1], jnp.array([1.0, 3.0]))]
        [3.0, [6.0, 1.0], [[6.0, 2.0], [2.0, 0.0]]]
    """

    def first(u: Array):
        gradient, value = jax.jacfwd(lambda u: (f(u),) * 2, has_aux=True)(u)
        return gradient, (value, gradient)

    hessian, (value, gradient) = jax.jacfwd(first, has_aux=True)(u)
    return value, gradient, hessian
