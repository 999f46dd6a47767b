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

    By bisection and Newton steps, all blind to derivatives; those of the root `t(p)` of
    `level(t, p)` are those of the implicit function, `dt/dp = -level_p / level_t`.

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
    # Traced once; `read` is what it reads from outside and may be differentiated by.
    of, read = jax.closure_convert(level, a)
    still = jax.lax.stop_gradient(read)
    t, met, smooth = _found(lambda t: of(t, *still), a, b)
    t = jax.lax.custom_root(
        lambda s: jnp.where(smooth, of(s, *read), s - t),
        t,
        lambda f, t: t,
        lambda slope, value: value / slope(jnp.ones_like(value)),
    )
    return jnp.where(met, t, upper), met


def _found(level: Callable[[Scalar], Scalar], a: Scalar, b: Scalar) -> tuple[Array, Array, Array]:
    """The root, whether there is one, and whether the level passes through zero there smoothly."""
    sign = jnp.sign(level(b))
    met, most = level(a) * sign < 0, 1e-3 * abs(b - a)

    def halve(_, ends):
        a, b = ends
        middle = 0.5 * (a + b)
        right = level(middle) * sign > 0
        return jnp.where(right, a, middle), jnp.where(right, middle, b)

    def polish(_, found):
        t, _ = found
        value, slope = jax.value_and_grad(level)(t)
        # The bisected root is nearly right: a step that is not small is that of a level that jumps.
        smooth = met & (slope != 0) & (abs(value) <= most * abs(slope))
        return t - jnp.where(smooth, value, 0.0) / jnp.where(smooth, slope, 1.0), smooth

    a, b = jax.lax.fori_loop(0, BISECTIONS, halve, (a, b))
    t, smooth = jax.lax.fori_loop(0, NEWTON, polish, (0.5 * (a + b), met))
    return t, met, smooth
