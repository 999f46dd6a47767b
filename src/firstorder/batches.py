"""Maps over many rows, as many at a time as the memory nearest to the processor holds."""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp

from firstorder.errors import check_positive

X = TypeVar("X")
Y = TypeVar("Y")


def in_batches(f: Callable[[X], Y], rows: X, most: int) -> Y:
    """Calls f on each row, in batches of one size.

    `jax.lax.map` makes batches of the size it is told and one of what is left over, for which f is
    traced and compiled a second time: up to half of the time of a first call. Here the size
    gives way, and fewer rows than there are batches fill the last one up.

    Args:
        f: of one row.
        rows: an array, or a tree of arrays, with the rows along the leading axis.
        most: rows in a batch.

    Returns:
        What f returns, with the rows along a new leading axis.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.batches import in_batches
        >>> in_batches(lambda x: x**2, jnp.arange(5.0), 2).tolist()
        [0.0, 1.0, 4.0, 9.0, 16.0]
    """
    check_positive("most", most)
    count = jax.tree.leaves(rows)[0].shape[0]
    batches = -(-count // most)
    if batches < 2:
        return jax.vmap(f)(rows)
    size = -(-count // batches)
    fill = batches * size - count
    if fill:
        rows = jax.tree.map(lambda x: jnp.concatenate([x, jnp.repeat(x[-1:], fill, 0)]), rows)
    found = jax.lax.map(f, rows, batch_size=size)
    return jax.tree.map(lambda y: y[:count], found)
