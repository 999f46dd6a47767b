"""Quadrature that knows where the integrand breaks.

`panels` cuts an interval at the breaks and puts a Gauss-Legendre rule on each piece. Nodes
move with the breaks, so automatic differentiation of the sum contains the boundary terms.
"""

from __future__ import annotations

import functools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


@functools.cache
def gauss_legendre(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of the n-point Gauss-Legendre rule on [-1, 1]."""
    if n < 1:
        raise ValueError(f"Argument `nodes` must be positive, but is {n}.")
    return np.polynomial.legendre.leggauss(n)


def panels(
    lower: Float[Array, ""], upper: Float[Array, ""], breaks: list[Array], nodes: int
) -> tuple[Float[Array, " k"], Float[Array, " k"]]:
    """Nodes and weights on [lower, upper], one Gauss-Legendre panel per smooth piece.

    Breaks outside the interval are clipped to its ends, where they make panels of no length.
    Where `upper < lower` the weights are negative, as the integral is.

    Args:
        lower: end at which the integral starts.
        upper: end at which it stops.
        breaks: places where the integrand, or a derivative of it, jumps.
        nodes: nodes per panel.

    Returns:
        All nodes and their weights; panels share no node, so the integrand is never asked for
        its value on a break.

    Example:
        >>> import jax.numpy as jnp
        >>> t, w = panels(jnp.array(-1.0), jnp.array(1.0), [jnp.array(0.0)], 4)
        >>> round(float(jnp.sum(w * jnp.abs(t))), 12)
        1.0
    """
    # The ends are not sorted with the breaks: an empty interval keeps its derivatives.
    low, high = jnp.minimum(lower, upper), jnp.maximum(lower, upper)
    inner = jnp.sort(jnp.clip(jnp.stack(breaks), low, high)) if breaks else jnp.zeros(0, low.dtype)
    inner = jnp.where(upper < lower, inner[::-1], inner)
    ends = jnp.concatenate([lower[None], inner, upper[None]])
    t, w = (jnp.asarray(a, ends.dtype) for a in gauss_legendre(nodes))
    half = 0.5 * (ends[1:] - ends[:-1])[:, None]
    middle = 0.5 * (ends[1:] + ends[:-1])[:, None]
    return (middle + half * t).ravel(), (half * w).ravel()


def periodic(period: float, nodes: int) -> tuple[np.ndarray, float]:
    """Nodes and the common weight of the trapezoid rule on one period, exponentially convergent."""
    h = period / nodes
    return h * np.arange(nodes), h
