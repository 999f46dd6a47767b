"""Blocked angles as intervals, merged without sorting.

A blocker takes an interval [low, high] of the angles above a receiver. Several overlap: what counts
are the ends that no other interval covers, the *exposed* ends. Between them the union is a sum over
ends, each with its sign, so that integrals and their derivatives need no order.

Who covers whom is decided by comparison, without derivative; equal ends are given to the interval
with the smaller index, and intervals that touch are one. The angles themselves stay differentiable:
on either side of a configuration in which ends change places derivatives are exact, and on it they
are one of the one-sided ones.

All functions take the intervals on the last axis and batch over those before it. An interval with
`high <= low`, or with a NaN for an end, is empty and counts for nothing: pad with those.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from firstorder.typing import as_float

HORIZON = (-0.5 * np.pi, 0.5 * np.pi)

Ends = Float[Array, "*b n"]
Exposed = Bool[Array, "*b n"]


def clip_intervals(
    low: Ends, high: Ends, horizon: tuple[float, float] = HORIZON
) -> tuple[Ends, Ends]:
    """The parts of the intervals above the horizon; what is below, empty or NaN becomes [0, 0].

    Angles are as `interval_between` gives them: of a blocker that reaches below the horizon, beyond
    -pi or pi rather than wrapped. Beyond the horizon an end stops moving: its derivative is zero.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import clip_intervals
        >>> low, high = clip_intervals(jnp.array([0.5, 2.0]), jnp.array([3.0, 3.0]))
        >>> print(low, high)
        [0.5 0. ] [1.5707964 0.       ]
    """
    low, high = as_float(low), as_float(high)
    start, end = (jnp.asarray(h, low.dtype) for h in horizon)
    real = (high > low) & (high > start) & (low < end)
    low, high = jnp.where(real, low, 0.0), jnp.where(real, high, 0.0)
    # Not `clip`, which shares the derivative between the end and the horizon where they meet.
    low, high = jnp.where(low > start, low, start), jnp.where(high < end, high, end)
    return jnp.where(real, low, 0.0), jnp.where(real, high, 0.0)


def interval_between(one: Ends, two: Ends) -> tuple[Ends, Ends]:
    """The interval of less than half a turn between two directions, given in any order.

    What a segment hides lies between its ends, the short way round: this picks the lower end, and
    the turn on which the middle lies in (-pi, pi]. Ends may then lie beyond -pi or pi, and
    `clip_intervals` keeps the part above the horizon, as of a blocker that reaches below it.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import interval_between
        >>> low, high = interval_between(jnp.array([1.0, 3.0]), jnp.array([0.5, -1.0]))
        >>> low.round(3).tolist(), high.round(3).tolist()
        ([0.5, -3.283], [1.0, -1.0])
    """
    turned, shift_one, shift_two = whole_turns(one, two)
    one, two = one - shift_one, two - shift_two
    return jnp.where(turned, two, one), jnp.where(turned, one, two)


def whole_turns(one: Ends, two: Ends) -> tuple[Bool[Array, "*b n"], Ends, Ends]:
    """Whether the second of two directions is the lower, and the whole turns to take off each."""
    one, two = jax.lax.stop_gradient((one, two))
    turn = 2.0 * jnp.pi
    between = two - one
    between = between - turn * jnp.round(between / turn)
    middle = one + 0.5 * between
    shift = turn * jnp.round(middle / turn)
    return between < 0.0, shift, two - (one - shift + between)


def exposed_ends(low: Ends, high: Ends) -> tuple[Exposed, Exposed]:
    """Masks of the lower and of the upper ends on the edge of the union of all intervals.

    `low_i` is covered if some j has `low_j < low_i <= high_j`, or the same low end and a smaller
    index; upper ends likewise. As many lower as upper ends are exposed: one pair for each piece of
    the union.

    Returns:
        Masks of the shape of `low`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import exposed_ends
        >>> low, high = jnp.array([0.0, 0.5, 2.0]), jnp.array([1.0, 1.5, 3.0])
        >>> [e.tolist() for e in exposed_ends(low, high)]
        [[True, False, True], [False, True, True]]
    """
    low, high = jax.lax.stop_gradient((low, high))
    real = high > low
    mine, other = (..., slice(None), None), (..., None, slice(None))
    index = jnp.arange(low.shape[-1])
    first = index[None, :] < index[:, None]
    # Row: the end that is asked for; column: the interval that may cover it.
    starts_before = (low[other] < low[mine]) | ((low[other] == low[mine]) & first)
    ends_after = (high[other] > high[mine]) | ((high[other] == high[mine]) & first)
    covers_low = real[other] & starts_before & (high[other] >= low[mine])
    covers_high = real[other] & ends_after & (low[other] <= high[mine])
    return real & ~jnp.any(covers_low, -1), real & ~jnp.any(covers_high, -1)


def signed_edges(
    low: Ends, high: Ends, horizon: tuple[float, float] = HORIZON
) -> tuple[Float[Array, "*b m"], Float[Array, "*b m"]]:
    """Edges of visibility with R07's signs: +1 from visible to blocked, -1 from blocked to visible.

    Counter-clockwise, as angles grow. Ends that are covered, or lie on the horizon or beyond it,
    where nothing becomes visible, have sign 0.

    Returns:
        Angles and signs, lower ends first, upper ends after them: shape (..., 2 n).

    Reference: R07 Fig. 8.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import signed_edges
        >>> angles, signs = signed_edges(jnp.array([0.0, 0.5]), jnp.array([1.0, 2.0]))
        >>> signs.tolist()  # the second reaches beyond the horizon
        [1.0, 0.0, 0.0, 0.0]
    """
    start, end = horizon
    low, high = clip_intervals(low, high, horizon)
    at_low, at_high = exposed_ends(low, high)
    plus, minus = at_low & (low > start), at_high & (high < end)
    angles = jnp.concatenate([low, high], -1)
    return angles, jnp.concatenate([plus * 1.0, minus * -1.0], -1).astype(low.dtype)


def blocked_measure(
    low: Ends,
    high: Ends,
    primitive: Callable[[Array], Array] = lambda a: a,
    horizon: tuple[float, float] = HORIZON,
) -> Float[Array, "*b"]:
    """Integral over the union of the intervals of a function with the given primitive.

    `sum over exposed ends of F(high) - F(low)`. With `jnp.sin` this is what blockers take of the
    irradiance under a uniform sky; with the identity, the blocked angle. Angles as
    `interval_between` gives them; a NaN counts as no blocker.

    Args:
        low: lower ends [rad].
        high: upper ends [rad].
        primitive: F, elementwise.
        horizon: all that counts lies between.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import blocked_measure
        >>> blocked_measure(jnp.array([0.0, 0.5]), jnp.array([1.0, 1.25])).item()
        1.25
    """
    low, high = clip_intervals(low, high, horizon)
    at_low, at_high = exposed_ends(low, high)
    upper, lower = jnp.where(at_high, primitive(high), 0.0), jnp.where(at_low, primitive(low), 0.0)
    return jnp.sum(upper - lower, -1)


def visible_measure(
    low: Ends,
    high: Ends,
    primitive: Callable[[Array], Array] = lambda a: a,
    horizon: tuple[float, float] = HORIZON,
) -> Float[Array, "*b"]:
    """Integral over what the blockers leave visible between the horizons.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import visible_measure
        >>> print(round(float(visible_measure(jnp.array([0.0]), jnp.array([2.0]), jnp.sin)), 6))
        1.0
    """
    low, high = as_float(low), as_float(high)
    start, end = (primitive(jnp.asarray(h, low.dtype)) for h in horizon)
    return end - start - blocked_measure(low, high, primitive, horizon)


def merge_intervals(
    low: Ends, high: Ends, horizon: tuple[float, float] = HORIZON
) -> tuple[Ends, Ends]:
    """The union as intervals that do not touch: as many slots as came in, the empty ones [0, 0].

    The piece that starts at an exposed low end stands in that end's slot and stops at the nearest
    exposed high end above it.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import merge_intervals
        >>> low, high = merge_intervals(jnp.array([0.0, 0.5]), jnp.array([1.0, 1.25]))
        >>> low.tolist(), high.tolist()
        ([0.0, 0.0], [1.25, 0.0])
    """
    low, high = clip_intervals(low, high, horizon)
    at_low, at_high = exposed_ends(low, high)
    stop, _ = _next(low, high, at_high)
    return jnp.where(at_low, low, 0.0), jnp.where(at_low, stop, 0.0)


def visible_gaps(
    low: Ends, high: Ends, horizon: tuple[float, float] = HORIZON
) -> tuple[Float[Array, "*b k"], Float[Array, "*b k"]]:
    """Visible angles between the blockers, as n + 1 intervals; unused slots are [0, 0].

    The gap that begins at the horizon stands first; after it, in the slot of each blocker whose
    upper end is exposed, the gap above that end.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import visible_gaps
        >>> start, stop = visible_gaps(jnp.array([0.0]), jnp.array([0.5]), (-1.0, 1.0))
        >>> start.tolist(), stop.tolist()
        ([-1.0, 0.5], [0.0, 1.0])
    """
    low, high = as_float(low), as_float(high)
    first, last = (jnp.asarray(h, low.dtype) for h in horizon)
    low, high = clip_intervals(low, high, horizon)
    at_low, at_high = exposed_ends(low, high)
    rim = jnp.broadcast_to(first, (*low.shape[:-1], 1))
    starts = jnp.concatenate([rim, high], -1)
    used = jnp.concatenate([jnp.ones(rim.shape, bool), at_high], -1)
    stops, found = _next(starts, low, at_low)
    stops = jnp.where(found, stops, last)
    used = used & (stops > starts)
    return jnp.where(used, starts, 0.0), jnp.where(used, stops, 0.0)


def _next(
    starts: Float[Array, "*b k"], candidates: Ends, allowed: Exposed
) -> tuple[Float[Array, "*b k"], Bool[Array, "*b k"]]:
    """For each start the nearest allowed candidate not below it, and whether there is one.

    Found without derivative, fetched with it.
    """
    fixed, here = jax.lax.stop_gradient((candidates, starts))
    ahead = allowed[..., None, :] & (fixed[..., None, :] >= here[..., :, None])
    which = jnp.argmin(jnp.where(ahead, fixed[..., None, :], jnp.inf), -1)
    return jnp.take_along_axis(candidates, which, -1), jnp.any(ahead, -1)
