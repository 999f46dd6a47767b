"""The root of a level between two places, with its derivatives."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array

from firstorder.typing import Scalar

BISECTIONS, NEWTON = 26, 3


def root_between(
    level: Callable[[Scalar], Scalar], lower: Scalar, upper: Scalar
) -> tuple[Scalar, Array]:
    """The place at which a level is zero, and whether there is one; if there is none, `upper`.

    By bisection, which is blind to derivatives, and then by Newton steps, each of which carries one
    more derivative.

    Args:
        level: with at most one zero in between.
        lower: start of the interval.
        upper: its end.
    """
    # Slightly inside the interval: a level may have its pole on an end (the tangent at pi / 2).
    # In roundings of the ends, not of the way between them, and towards each other.
    epsilon = 4.0 * jnp.finfo(lower.dtype).eps * (abs(lower) + abs(upper))
    epsilon = epsilon * jnp.sign(upper - lower)
    a, b = jax.lax.stop_gradient((lower + epsilon, upper - epsilon))
    sign = jax.lax.stop_gradient(jnp.sign(level(b)))
    met = jax.lax.stop_gradient(level(a)) * sign < 0

    def halve(_, ends):
        a, b = ends
        middle = 0.5 * (a + b)
        right = jax.lax.stop_gradient(level(middle)) * sign > 0
        return jnp.where(right, a, middle), jnp.where(right, middle, b)

    a, b = jax.lax.fori_loop(0, BISECTIONS, halve, (a, b))
    t = jax.lax.stop_gradient(0.5 * (a + b))
    for _ in range(NEWTON):
        value, slope = jax.value_and_grad(level)(t)
        # The bisected root is nearly right: a step that is not small is that of a level that jumps.
        goes = met & (slope != 0) & (abs(value) <= 1e-3 * abs(slope * (upper - lower)))
        t = t - jnp.where(goes, value, 0.0) / jnp.where(goes, slope, 1.0)
    return jnp.where(met, t, upper), met
