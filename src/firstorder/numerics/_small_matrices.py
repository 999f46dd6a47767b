"""Products of small matrices, written out: over the few coordinates of a ray they fuse."""

import functools
import operator

import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder.typing import Matrix, Scalar, Vector


def inner(a, b) -> Scalar:
    """`a . b`, written out."""
    return functools.reduce(operator.add, [a[i] * b[i] for i in range(len(a))])


def product(P: Float[Array, "m n"], h: Vector) -> list[Scalar]:
    """`P h` as separate sums: over the two or four coordinates of a ray they fuse into one loop.

    A reduction over so short an axis does not, and is ten times slower on a batch of rays.
    """
    rows, columns = P.shape
    return [inner([P[i, j] for j in range(columns)], h) for i in range(rows)]


def quadratic(P: Matrix, h: Vector) -> Scalar:
    """`h . P . h`."""
    return inner(product(P, h), h)


def congruence(M: Array, H: Array) -> Array:
    """`M^T H M`, as sums that fuse under `vmap` for the tiny matrices of light fields."""
    columns = [product(H, column) for column in M.T]
    return jnp.stack([jnp.stack([inner(row, c) for c in columns]) for row in M.T])
