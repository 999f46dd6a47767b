"""Numbers in [0, 1), one in each of equal strata."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from firstorder._argument_checks import check_integer, check_key


def midpoints(count: int) -> Float[Array, " n"]:
    """The middle of each of `count` equal strata of [0, 1).

    Raises:
        ValueError: if there is no stratum.

    Example:
        >>> from firstorder.sampling import midpoints
        >>> midpoints(4).tolist()
        [0.125, 0.375, 0.625, 0.875]
    """
    _check(count)
    return (jnp.arange(count) + 0.5) / count


def jittered(key: PRNGKeyArray, count: int) -> Float[Array, " n"]:
    """One number, uniform and independent, in each of `count` equal strata of [0, 1).

    The mean of f over them is unbiased. Its error falls with `count` to the power -3/2 where f is
    smooth, -1 where it jumps, against -1/2 without strata. The numbers are not independent of the
    stratum they lie in, so their sample variance overstates that of the mean: take error bars
    from several independent sets.

    Args:
        key: of JAX.
        count: how many strata.

    Raises:
        ValueError: if there is no stratum.
        TypeError: if the key is none, such as its seed.

    Example:
        >>> import jax
        >>> from firstorder.sampling import jittered
        >>> (4 * jittered(jax.random.key(0), 4)).astype(int).tolist()
        [0, 1, 2, 3]
    """
    _check(count)
    check_key("key", key)
    k = jnp.arange(count)
    u = (k + jax.random.uniform(key, (count,))) / count
    # A sum that was rounded up to the next stratum stays below it.
    return jnp.minimum(u, jnp.nextafter((k + 1) / count, 0.0))


def _check(count: int) -> None:
    check_integer("count", count)
    if count < 1:
        raise ValueError(f"Argument `count` must be positive, but is {count}.")
