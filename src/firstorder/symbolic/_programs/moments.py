"""Moments of exponentials: what integrals of `t^m exp(b t)` between ends are made of."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp


def moment(m: int, w: Any, xp: Any = jnp) -> Any:
    """`int_0^1 s^m exp(w s) ds`: a series near 0, integration by parts elsewhere.

    Args:
        m: the power.
        w: numbers, real or complex.
        xp: whose arrays they are, JAX's or NumPy's.

    Example:
        >>> from firstorder.symbolic._programs.moments import moment
        >>> moment(2, 0.0).item(), round(moment(0, 1.0).item(), 6)  # 1/3, e - 1
        (0.3333333333333333, 1.718282)
    """
    w, small = xp.asarray(w), max(1, m // 2)
    terms = 12 + 6 * small  # the next one is below rounding
    near = xp.abs(w) < small
    inside, outside = xp.where(near, w, 0.0), xp.where(near, small, w)
    series = 1.0 / (m + terms + 1)
    for k in range(terms, 0, -1):  # sum of w^k / (k! (m + k + 1))
        series = 1.0 / (m + k) + inside / k * series
    last = xp.exp(outside)
    parts = (last - 1.0) / outside
    for k in range(1, m + 1):
        parts = (last - k * parts) / outside
    return xp.where(near, series, parts)
