"""Roots of smooth functions with period one, and their derivatives.

A period is cut into pieces, and each piece at its own extremum, so that a pair of close roots, as
beside a tangent, falls into two pieces. A root is then bracketed and found by a safeguarded Newton
iteration, without derivative; two more Newton steps with the differentiable function carry exact
first and second derivatives.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

BISECTIONS, NEWTON = 8, 12  # beside a double root Newton only halves the error
# Towards an extremum; each doubles the digits. Two roots on either side of it may be as close as
# 1e-7 of a period, and are missed if it is not found better than that.
STEPS = 6

# s to f, f', f'' and perhaps more.
Function = Callable[[Array], tuple[Array, ...]]


def even(samples: int, dtype) -> Float[Array, " samples_1"]:
    """Ends of so many equal pieces of [0, 1]."""
    return jnp.arange(samples + 1, dtype=dtype) / samples


def brackets(
    f: Function, edge: Float[Array, " n_1"]
) -> tuple[Float[Array, " m"], Float[Array, " m"], Bool[Array, " m"]]:
    """Ends of pieces and whether f changes sign there.

    Args:
        f: f(s) gives f, f', f''.
        edge: between which each piece is cut at its extremum; f has the same sign at the first and
            the last, as at the ends of a period.
    """
    half = 0.5 * jnp.diff(edge)
    middle = edge[:-1] + half

    def towards_extremum(_, s):  # if the piece holds one
        _, first, second, *_ = jax.vmap(f)(s)
        s = s - first / jnp.where(second == 0.0, 1.0, second)
        return jnp.clip(s, middle - half, middle + half)

    s = jax.lax.fori_loop(0, STEPS, towards_extremum, middle)
    cut = jnp.stack([edge[:-1], s], -1).ravel()
    low = cut
    high = jnp.concatenate([cut[1:], edge[-1:]])
    sign = jax.vmap(lambda t: f(t)[0])(cut) > 0.0
    return low, high, sign != jnp.roll(sign, -1)


def bracketed_root(
    f: Function, low: Float[Array, "*n"], high: Float[Array, "*n"]
) -> Float[Array, "*n"]:
    """The root of f between two ends of opposite sign. It has no derivative."""

    def narrow(_, ends):
        a, b, rising = ends
        s = 0.5 * (a + b)
        above = (f(s)[0] > 0.0) == rising
        return jnp.where(above, a, s), jnp.where(above, s, b), rising

    rising = f(high)[0] > f(low)[0]
    a, b, _ = jax.lax.fori_loop(0, BISECTIONS, narrow, (low, high, rising))
    s = jax.lax.fori_loop(0, NEWTON, lambda _, s: jnp.clip(newton(f, s), a, b), 0.5 * (a + b))
    return jax.lax.stop_gradient(s)


def newton(f: Function, s: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """One step of Newton's iteration; none where f is level."""
    value, slope, *_ = f(s)
    return s - value / jnp.where(slope == 0.0, 1.0, slope)
