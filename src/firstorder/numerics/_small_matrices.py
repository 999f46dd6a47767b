"""Products of small matrices, written out: over the few coordinates of a ray they fuse."""

import functools
import operator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder.numerics._host import hosted
from firstorder.typing import Matrix, Scalar, Vector, as_array


def inner(a, b) -> Scalar:
    """`a . b`, written out."""
    pairs = zip(_each(a), _each(b), strict=True)
    return functools.reduce(operator.add, [one * other for one, other in pairs])


def product(P: Float[Array, "m n"], h: Vector) -> list[Scalar]:
    """`P h` as separate sums: over the two or four coordinates of a ray they fuse into one loop.

    A reduction over so short an axis does not, and is ten times slower on a batch of rays.
    """
    h = _each(h)
    return [inner(row, h) for row in _each(P)]


def quadratic(P: Matrix, h: Vector) -> Scalar:
    """`h . P . h`."""
    return inner(product(P, h), h)


def congruence(M: Array, H: Array) -> Array:
    """`M^T H M`, as sums that fuse under `vmap` for the tiny matrices of light fields."""
    turned, rows = ([_each(row) for row in _each(a)] for a in (M.T, H))
    columns = [[inner(row, column) for row in rows] for column in turned]
    return jnp.stack([jnp.stack([inner(row, c) for c in columns]) for row in turned])


def _each(a: Any) -> Any:
    """The entries of a vector, or the rows of a matrix, in one equation."""
    return jnp.unstack(a) if isinstance(a, jax.Array) else a


def identity_with(n: int, rows: Any, columns: Any, entries: Any) -> Array:
    """The identity with other entries in some places: most moves of light are one.

    Args:
        n: rows and columns.
        rows: of the places, in NumPy's indices.
        columns: of the places.
        entries: what stands there; the matrix is of its precision.
    """
    xp, entries = hosted(entries)
    if xp is jnp:
        return jnp.eye(n, dtype=entries.dtype).at[rows, columns].set(entries)
    matrix = np.eye(n, dtype=jnp.result_type(entries))
    matrix[rows, columns] = entries
    return as_array(matrix)
