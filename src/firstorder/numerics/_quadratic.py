"""The first root ahead of a quadratic equation: what ray tests of round shapes share.

A ray meets a round shape where `a t^2 + 2 b t + c = 0`, with c positive outside. With the root r
of `b^2 - a c` the roots are `(r - b) / a` and `c / (r - b)`, without cancellation unless b is large
and positive: then the ray leaves from inside, and `-c / (r + b)` has the digits of the first.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Bool

from firstorder.numerics._select import either, grazing

# Part of the root up to which b is taken off it. At b = 0, where many rays start (in the middle of
# a ball all of them), a compiler may round b to both signs in one program: what is chosen by its
# sign would have the derivative of neither choice. No ray of a plain scene starts at this number.
PART = 0.37


def root_sum(b: Array, square: Array, most: Array) -> tuple[Array, Bool[Array, "..."]]:
    """`r - b`, or `r + b` where b is large and positive, with the root r of `square`.

    Both are positive. Where `square` is not positive, r is the root of its rounding.

    Args:
        b: half of the linear coefficient.
        square: `b^2 - a c`, or the same difference of other terms that keep its digits.
        most: the first of those terms (`grazing`).

    Returns:
        The sum, and whether it is `r - b`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._quadratic import root_sum
        >>> total, taken_off = root_sum(jnp.array(-3.0), jnp.array(4.0), jnp.array(4.0))
        >>> total.item(), taken_off.item()
        (5.0, True)
    """
    root = jnp.sqrt(either(square > 0.0, square, grazing(most)))
    taken_off = b < PART * root
    return root + either(taken_off, -b, b), taken_off


def first_root(
    a: Array, b: Array, c: Array, square: Array, most: Array
) -> tuple[Array, Array, Bool[Array, "..."]]:
    """The first root ahead as a quotient of two numbers, and whether one is, if roots are real.

    From inside or from the shape itself, `c <= 0`, only the farther of the two roots can lie ahead.

    Args:
        a: square coefficient, positive.
        b: half of the linear coefficient.
        c: constant one.
        square: as for `root_sum`.
        most: likewise.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._quadratic import first_root
        >>> b, c = jnp.array(-3.0), jnp.array(5.0)  # roots 1 and 5
        >>> over, under, ahead = first_root(jnp.array(1.0), b, c, b * b - c, b * b)
        >>> (over / under).item(), ahead.item()
        (1.0, True)
    """
    total, taken_off = root_sum(b, square, most)
    leaves = taken_off & (c <= 0.0)
    over, under = either(leaves, total, jnp.abs(c)), either(leaves, a, total)
    return over, under, (b < 0.0) | (c < 0.0)
