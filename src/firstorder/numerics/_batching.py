"""Maps over many rows, as many at a time as the memory nearest to the processor holds."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import jax
import jax.custom_batching
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_positive

S = TypeVar("S")
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

    Raises:
        ValueError: if `most` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics import in_batches
        >>> in_batches(lambda x: x**2, jnp.arange(5.0), 2).tolist()
        [0.0, 1.0, 4.0, 9.0, 16.0]
    """
    check_positive("most", most)
    count = jax.tree.leaves(rows)[0].shape[0]
    batches = max(1, -(-count // most))
    return in_blocks(jax.vmap(f), rows, max(1, -(-count // batches)))


def in_blocks(f: Callable[[X], Y], rows: X, block: int) -> Y:
    """Calls f on whole blocks of rows; copies of the first row fill the last block up.

    Args:
        f: of one block, or of all rows where they are no more than that.
        rows: an array, or a tree of arrays, with the rows along the leading axis.
        block: rows in a block.

    Returns:
        What f returns, with the rows along its leading axis.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._batching import in_blocks
        >>> in_blocks(jnp.square, jnp.arange(5.0), 2).tolist()
        [0.0, 1.0, 4.0, 9.0, 16.0]
    """
    count = jax.tree.leaves(rows)[0].shape[0]
    if count <= block:
        return f(rows)
    blocks = -(-count // block)

    def cut(a):
        more = jnp.broadcast_to(a[:1], (blocks * block - count, *a.shape[1:]))
        return jnp.concatenate([a, more]).reshape(blocks, block, *a.shape[1:])

    found = jax.lax.map(f, jax.tree.map(cut, rows))
    return jax.tree.map(lambda a: a.reshape(-1, *a.shape[2:])[:count], found)


def one_list(f: Callable[[S, X], Y]) -> Callable[[S, X], Y]:
    """A function of many rows to which the rows of all batches under `vmap` are one long list.

    A loop over what the rows share then runs over blocks that fit the cache, and not over all
    batches at every step. Where `vmap` batches what they share too, f is mapped as it is.

    Args:
        f: of what all rows share, and of the rows; it returns as many rows. No derivative is asked.

    Example:
        >>> import jax, jax.numpy as jnp
        >>> from firstorder.numerics._batching import one_list
        >>> seen = []
        >>> def double(s, x):
        ...     seen.append(x.shape)
        ...     return s * x
        >>> each = jax.vmap(lambda x: one_list(double)(2.0, x))(jnp.ones((4, 3)))
        >>> each.shape, seen[-1]
        ((4, 3), (12,))
    """
    listed = jax.custom_batching.custom_vmap(f)

    @listed.def_vmap
    def _(size, batched, shared, rows):
        over_shared, over_rows = batched
        each = jax.tree.leaves(jax.tree.map(lambda a, b: a.shape[b], rows, over_rows))[0]
        if any(jax.tree.leaves(over_shared)):
            axes = jax.tree.map(lambda b: 0 if b else None, (over_shared, over_rows))
            found = jax.vmap(f, in_axes=axes, axis_size=size)(shared, rows)
        else:
            whole = jax.tree.map(
                lambda a, b: a if b else jnp.broadcast_to(a, (size, *a.shape)), rows, over_rows
            )
            found = listed(
                shared, jax.tree.map(lambda a: a.reshape(size * each, *a.shape[2:]), whole)
            )
            found = jax.tree.map(lambda a: a.reshape(size, each, *a.shape[1:]), found)
        return found, jax.tree.map(lambda _: True, found)

    return listed


def host_blocks(f: Callable[[X], Any], rows: X, block: int, abreast: int = 1) -> Any:
    """Calls f on blocks of one size, one after another, and keeps what it returns on the host.

    A compiled f is compiled once, however many rows there are; copies of the first row, or zeros
    if there is none, fill the last block up. What f does on the host may go on beside what it has
    compiled, if several blocks are at work; the first is done alone, so that it compiles once.

    Args:
        f: of one block.
        rows: an array, or a tree of arrays, with the rows along the leading axis.
        block: rows in a block.
        abreast: blocks that are at work at a time, in threads.

    Returns:
        What f returns, as arrays of NumPy with the rows along their leading axis.

    Raises:
        ValueError: if `block` or `abreast` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> import numpy as np
        >>> from firstorder.numerics import host_blocks
        >>> host_blocks(jnp.square, np.arange(5.0), 2).tolist()
        [0.0, 1.0, 4.0, 9.0, 16.0]
    """
    check_positive("block", block)
    check_positive("abreast", abreast)
    rows = jax.tree.map(np.asarray, rows)
    count = jax.tree.leaves(rows)[0].shape[0]
    blocks = max(1, -(-count // block))

    def filled(a):
        first = a[:1] if count else np.zeros((1, *a.shape[1:]), a.dtype)
        a = np.concatenate([a, np.repeat(first, blocks * block - count, 0)])
        return a.reshape(blocks, block, *a.shape[1:])

    leaves, tree = jax.tree.flatten(jax.tree.map(filled, rows))

    def done(cut):
        return jax.tree.map(np.asarray, f(tree.unflatten([jnp.asarray(a) for a in cut])))

    first, *rest = zip(*leaves, strict=True)
    parts = [done(first)]
    if abreast == 1 or not rest:
        parts += map(done, rest)
    else:
        with ThreadPoolExecutor(abreast) as pool:
            parts += pool.map(done, rest)
    return jax.tree.map(lambda *a: np.concatenate(a)[:count], *parts)


def host_rows(f: Callable[[X], Any], rows: X, least: int = 64) -> Any:
    """Calls f once, on rows filled up to a power of two, and keeps what it returns on the host.

    A compiled f is compiled for few lengths; copies of the first row, or zeros if there is none,
    fill the rows up.

    Args:
        f: of all rows.
        rows: an array, or a tree of arrays, with the rows along the leading axis.
        least: rows at least, a power of two.

    Returns:
        What f returns, as arrays of NumPy with the rows along their leading axis.

    Raises:
        ValueError: if `least` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> import numpy as np
        >>> from firstorder.numerics._batching import host_rows
        >>> host_rows(jnp.square, np.arange(5.0)).tolist()
        [0.0, 1.0, 4.0, 9.0, 16.0]
    """
    check_positive("least", least)
    count = len(jax.tree.leaves(rows)[0])
    return host_blocks(f, rows, max(least, 1 << max(count - 1, 0).bit_length()))


def batched(function: Callable) -> Callable:
    """Map a function of one ray over any leading axes.

    Args:
        function: of one ray, shape (n,).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics import batched
        >>> batched(jnp.sum)(jnp.ones((4, 3, 2))).shape
        (4, 3)
    """

    def mapped(u: Float[Array, "*b n"]):
        flat = jax.vmap(function)(u.reshape(-1, u.shape[-1]))
        return jax.tree.map(lambda a: a.reshape(u.shape[:-1] + a.shape[1:]), flat)

    return mapped
