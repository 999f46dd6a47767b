"""Quadrature that splits where the integrand breaks.

`composite_gauss_legendre` cuts an interval at the breaks and puts a Gauss-Legendre rule on each
piece. Nodes move with the breaks, so automatic differentiation of the sum contains the boundary
terms.
"""

from __future__ import annotations

import functools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import check_integer
from firstorder.numerics._order import order_of


def gauss_legendre(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of the n-point Gauss-Legendre rule on [-1, 1].

    Args:
        n: number of nodes; exact for polynomials up to the degree 2 n - 1.

    Returns:
        Nodes and weights, shape (n,) each, not to be written to.

    Raises:
        ValueError: if there is no node.

    Example:
        >>> from firstorder.numerics import gauss_legendre
        >>> t, w = gauss_legendre(2)
        >>> round(float(w @ t**2), 12)  # 2 / 3
        0.666666666667
    """
    check_integer("nodes", n)
    if n < 1:
        raise ValueError(f"Argument `nodes` must be positive, but is {n}.")
    return _rule(n)


@functools.cache
def _rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Found once for each number of nodes."""
    rule = np.polynomial.legendre.leggauss(n)
    for a in rule:
        a.flags.writeable = False  # the next caller gets the same arrays
    return rule


def sorted_breaks(
    lower: Float[Array, ""], upper: Float[Array, ""], breaks: list[Array]
) -> tuple[Float[Array, " m"], Int[Array, " m"]]:
    """The ends of the pieces of [lower, upper] in order, and where each stood in the input.

    The ends of the interval are never sorted with the breaks, so that an empty interval keeps its
    derivatives.

    Args:
        lower: end at which the integral starts.
        upper: end at which it stops, above or below.
        breaks: where to cut; those outside the interval are clipped to its ends.

    Returns:
        `[lower, breaks from lower to upper, upper]`, and the index of each in
        `[lower, *breaks, upper]`.
    """
    m = len(breaks)
    if not m:
        return jnp.stack([lower, upper]), jnp.arange(2)
    low, high = jnp.minimum(lower, upper), jnp.maximum(lower, upper)
    inner = jnp.clip(jnp.stack(breaks), low, high)
    order = order_of(jnp.where(upper < lower, -inner, inner))
    ends = jnp.concatenate([lower[None], inner[order], upper[None]])
    return ends, jnp.concatenate([jnp.array([0]), order + 1, jnp.array([m + 1])])


def composite_gauss_legendre(
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
        >>> t, w = composite_gauss_legendre(jnp.array(-1.0), jnp.array(1.0), [jnp.array(0.0)], 4)
        >>> round(float(jnp.sum(w * jnp.abs(t))), 12)
        1.0
    """
    ends, _ = sorted_breaks(lower, upper, breaks)
    t, w = (jnp.asarray(a, ends.dtype) for a in gauss_legendre(nodes))
    half = 0.5 * (ends[1:] - ends[:-1])[:, None]
    middle = 0.5 * (ends[1:] + ends[:-1])[:, None]
    return (middle + half * t).ravel(), (half * w).ravel()


def periodic_trapezoid(period: float, nodes: int) -> tuple[np.ndarray, float]:
    """Nodes and the common weight of the trapezoid rule on one period, exponentially convergent."""
    h = period / nodes
    return h * np.arange(nodes), h


def inverse_sqrt_panels(
    ends: Float[Array, " m_1"], nodes: int
) -> tuple[Float[Array, "m n"], Float[Array, "m n"], Float[Array, "m n"]]:
    """Nodes and weights for integrands that go as an inverse square root at the ends of panels.

    `t = a + (b - a) (1 - cos s) / 2` and a Gauss-Legendre rule in s: dt cancels
    `(t - a)^(-1/2)` and `(b - t)^(-1/2)`, and powers of the root become smooth functions of s.

    Args:
        ends: of the panels, in order; two that coincide make a panel of no length.
        nodes: on each panel.

    Returns:
        The nearer end of each node's panel, how far the node lies from it (exact, however small:
        what is singular at the end should be computed from this), and the weights.

    Example:
        >>> import jax.numpy as jnp
        >>> base, lag, weight = inverse_sqrt_panels(jnp.array([0.0, 1.0]), 8)
        >>> t = base + lag
        >>> round(float(jnp.sum(weight / jnp.sqrt(t * (1.0 - t)))), 12)  # pi
        3.14159265359
    """
    x, w = gauss_legendre(nodes)
    s = 0.5 * np.pi * (1.0 + x)
    near = s < 0.5 * np.pi
    share = np.where(near, np.sin(0.5 * s) ** 2, -(np.cos(0.5 * s) ** 2))
    weight = 0.25 * np.pi * w * np.sin(s)
    share, weight = (jnp.asarray(a, ends.dtype) for a in (share, weight))
    length = (ends[1:] - ends[:-1])[:, None]
    base = jnp.where(jnp.asarray(near), ends[:-1, None], ends[1:, None])
    return base, share * length, weight * length
