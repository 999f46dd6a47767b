"""Numbers that stay positive whatever an optimiser does, by softplus and its inverse."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import check_positive, nan_unless
from firstorder.typing import as_float


def positive(free: ArrayLike, scale: float = 1.0) -> Float[Array, "..."]:
    """A positive number from any number: `scale log(1 + exp(free / scale))`, softplus.

    An optimiser that steps a radius below zero gets NaN, and NaN it keeps. Let it step `free`
    instead and build the scene of `positive(free)`: no step leads out.

    Valid for: all real numbers. Well above `scale` it is `free` itself, so that steps mean what
    they mean without it; far below zero it falls as `scale exp(free / scale)`, and to zero only
    where that is below the smallest number of its precision, beyond `free = -87 scale` in float32.

    Args:
        free: what the optimiser changes, a number or an array; `free_of` finds where to start.
        scale: below which the number is held back from zero, positive, in its own unit.

    Raises:
        ValueError: if `scale` is not positive.

    Example:
        >>> import jax
        >>> from firstorder.flatland import Circles, Receiver, Scene, Segments
        >>> from firstorder.flatland import irradiance, primitive
        >>> from firstorder.numerics import free_of, positive
        >>> lamp = primitive(Segments((0.5, 2.0), (-0.5, 2.0)), emission=1.0)
        >>> def light(free):
        ...     disc = primitive(Circles((0.0, 1.0), positive(free, scale=0.1)))
        ...     return irradiance(Scene.of(lamp, disc), Receiver.at((0.0, 0.0)))
        >>> rate = jax.jit(jax.grad(light))
        >>> free = free_of(0.05, scale=0.1)
        >>> for _ in range(20):  # brighter, so smaller: the plain radius would be negative at once
        ...     free = free + 0.1 * rate(free)
        >>> 0.0 < float(positive(free, scale=0.1)) < 0.01
        True
    """
    check_positive("scale", scale)
    return scale * jax.nn.softplus(as_float(free) / scale)


def free_of(x: ArrayLike, scale: float = 1.0) -> Float[Array, "..."]:
    """The number of which `positive` makes x: `x + scale log(1 - exp(-x / scale))`.

    Args:
        x: a positive number, or an array of them.
        scale: as for `positive`.

    Returns:
        The number; NaN where a traced x is not positive.

    Raises:
        ValueError: if x or `scale` is not positive.

    Example:
        >>> from firstorder.numerics import free_of, positive
        >>> round(positive(free_of(0.25)).item(), 6)
        0.25
    """
    check_positive("x", x)
    check_positive("scale", scale)
    x = as_float(x)
    part = nan_unless(x > 0.0, x) / scale
    return scale * (part + jnp.log(-jnp.expm1(-part)))
