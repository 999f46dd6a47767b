"""Roots of a smooth periodic function that is a polynomial on each of many pieces of its period.

On each piece the variable u runs from -1 to 1. A piece on which the function turns near zero is cut
at its extremum, so that a pair of close roots, as beside a tangent, falls into two parts
(`numerics._roots` does the same for a function that has no pieces).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from firstorder.numerics._order import order_of

# Towards an extremum; each doubles the digits. Two roots on either side of it may be as close as
# 1e-7 of a piece, and are missed if it is not found better than that.
STEPS = 5

# What it needs of some pieces, and u on each, to f, f', f''.
Function = Callable[[Array, Array], tuple[Array, ...]]


class Brackets(NamedTuple):
    """Parts of pieces."""

    piece: Int[Array, " n"]
    low: Float[Array, " n"]
    high: Float[Array, " n"]
    found: Bool[Array, " n"]


def degree(reach: float, eps: float) -> int:
    """The degree from which the Taylor series of `exp(i reach u)` differs by less than rounding.

    Example:
        >>> from firstorder.numerics._piecewise_roots import degree
        >>> degree(1.0, 2.0**-52)
        18
    """
    n, term = 0, 1.0
    while term > 0.25 * eps:
        n += 1
        term *= reach / n
    return n - 1


def taylor(coefficients: Float[Array, "m *n"], u: Float[Array, "*n"], orders: int):
    """A polynomial and so many derivatives, by Horner's scheme.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._piecewise_roots import taylor
        >>> [a.item() for a in taylor(jnp.array([1.0, 2.0, 3.0]), jnp.array(2.0), 3)]
        [17.0, 14.0, 6.0]
    """
    *lower, last = jnp.unstack(coefficients)
    found = [last] + [jnp.zeros_like(last)] * (orders - 1)
    for c in reversed(lower):
        found = [found[0] * u + c] + [high * u + low for low, high in itertools.pairwise(found)]
    return tuple(math.factorial(k) * a for k, a in enumerate(found))


def brackets(
    f: Function,
    ends: tuple[Float[Array, " p"], Float[Array, " p"]],
    rows: Callable[[Array], Array],
    pairs: int,
) -> Brackets:
    """Where f changes sign: on whole pieces, and on both sides of an extremum inside of a piece.

    Args:
        f: f(rows, u) gives f, f', f'' of pieces.
        ends: f and f' where the pieces start. What is the end of one and the start of the next has
            one sign.
        rows: what f needs of some pieces, by their numbers.
        pairs: how many pieces may hold two roots; those where f is nearest to zero are looked at.
    """
    value, slope = ends
    after, later = (jnp.roll(a, -1) for a in ends)
    same = (value > 0.0) == (after > 0.0)
    turns = same & ((slope > 0.0) != (later > 0.0))
    key = jnp.where(turns, jnp.abs(value) + jnp.abs(after), jnp.inf)
    which = order_of(key)[:pairs]
    some, rising, falling = rows(which), slope[which], later[which]

    def towards_extremum(_, u):
        _, first, second = f(some, u)
        return jnp.clip(u - first / jnp.where(second == 0.0, 1.0, second), -1.0, 1.0)

    # The slope as a straight line is the first guess.
    cut = (rising + falling) / jnp.where(rising == falling, 1.0, rising - falling)
    cut = jax.lax.fori_loop(0, STEPS, towards_extremum, cut)
    crossed = turns[which] & ((f(some, cut)[0] > 0.0) != (value[which] > 0.0))
    ones = jnp.ones_like(value)
    return Brackets(
        jnp.concatenate([jnp.arange(value.size), which, which]),
        jnp.concatenate([-ones, -ones[:pairs], cut]),
        jnp.concatenate([ones, cut, ones[:pairs]]),
        jnp.concatenate([~same, crossed, crossed]),
    )
