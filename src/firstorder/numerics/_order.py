"""The order of a few numbers. JAX's own sort of numbers with their places costs 150 ns a number."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int, Shaped


def order_of(a: Shaped[Array, " n"]) -> Int[Array, " n"]:
    """Indices that put numbers in order, or false before true; of equal ones the earlier first.

    Numbers that differ by less than n roundings count as equal where the program has 64-bit
    integers, for their last bits make room for the index: one sort of integers takes a fifth of
    the time of a sort of pairs. It has no derivative.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._order import order_of
        >>> order_of(jnp.array([0.3, -1.0, 0.3, 0.1])).tolist()
        [1, 3, 0, 2]
    """
    n = a.shape[0]
    index = np.arange(n, dtype=np.int32)
    if a.dtype == bool:
        return jax.lax.rem(jax.lax.sort(a * n + index, is_stable=False), np.int32(n))
    a = jax.lax.stop_gradient(a)
    if not jax.config.read("jax_enable_x64"):
        return jnp.argsort(a, stable=True)
    bits = jax.lax.bitcast_convert_type(a.astype("float64"), jnp.int64)
    rising = bits ^ ((bits >> 63) & np.iinfo(np.int64).max)  # as integers: negative ones turned
    low = (1 << (n - 1).bit_length()) - 1
    return (jax.lax.sort((rising & ~low) | index, is_stable=False) & low).astype(jnp.int32)
