"""The first root ahead of a quadratic equation: what ray tests of round shapes share.

A ray meets a round shape where `a t^2 + 2 b t + c = 0`, with c positive outside. With the sum
`s = |b| + sqrt(b^2 - a c)` the roots are `s / a` and `c / s`, up to signs and without cancellation.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Bool

from firstorder.numerics._select import either, grazing


def root_sum(b: Array, square: Array, most: Array) -> Array:
    """`|b| + sqrt(square)`, positive; where `square` is not, with the root of its rounding.

    Args:
        b: half of the linear coefficient.
        square: `b^2 - a c`, or the same difference of other terms that keep its digits.
        most: the first of those terms (`grazing`).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._quadratic import root_sum
        >>> root_sum(jnp.array(-3.0), jnp.array(4.0), jnp.array(4.0)).item()
        5.0
    """
    return jnp.sqrt(either(square > 0.0, square, grazing(most))) + jnp.abs(b)


def first_root(
    a: Array, b: Array, c: Array, sum_of: Array
) -> tuple[Array, Array, Bool[Array, "..."]]:
    """The first root ahead as a quotient of two numbers, and whether one is, if roots are real.

    From inside or from the shape itself, `c <= 0`, only the farther of the two roots can lie ahead.

    Args:
        a: square coefficient, positive.
        b: half of the linear coefficient.
        c: constant one.
        sum_of: `root_sum`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._quadratic import first_root, root_sum
        >>> b, c = jnp.array(-3.0), jnp.array(5.0)  # roots 1 and 5
        >>> over, under, ahead = first_root(jnp.array(1.0), b, c, root_sum(b, b * b - c, b * b))
        >>> (over / under).item(), ahead.item()
        (1.0, True)
    """
    ahead = b < 0.0
    leaves = ahead & (c <= 0.0)
    over, under = either(leaves, sum_of, jnp.abs(c)), either(leaves, a, sum_of)
    return over, under, ahead | (c < 0.0)
