"""Radii from more than one derivative, and from the kinks of E on either side of the record.

In flatland E' jumps where two edges are seen in line, even under a light of finite size. The
pointwise metric looks at one derivative at one place; it misses the jump, and is blind at an
inflection. Both are finite sums in closed form, so the metric that includes them costs one root.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import check_not_negative, check_positive, nan_unless
from firstorder.caching._records import checked_order
from firstorder.caching.regions import _checked_limits
from firstorder.typing import as_float

NONE = np.zeros(0)
_KINDS = ("total", "average", "relative", "largest")


def expected_error_with_events(
    radius: ArrayLike,
    derivatives: Sequence[ArrayLike],
    distances: ArrayLike = NONE,
    kinks: ArrayLike = NONE,
    steps: ArrayLike | None = None,
    *,
    order: int = 1,
    definition: str = "total",
    value: ArrayLike = 1.0,
) -> Float[Array, "..."]:
    """Error of extrapolation within a radius, from several derivatives and all kinks there.

    Behind a kink at the distance d, where E' jumps by J, linear extrapolation goes wrong by
    `J (|x| - d)`, to the right of the record and to the left alike. The total error is at most

        2 sum_k |E^(k)| R^(k+1) / (k+1)! + sum_j |J_j| (R - d_j)_+^2 / 2 + sum_j |S_j| (R - d_j)_+

    with k from `order + 1` on, and S the jumps of E itself (under point lights). Signs are dropped:
    an upper bound where the terms compensate, exact for one term or one kink. All are numbers, or
    arrays that broadcast.

    Args:
        radius: R [m].
        derivatives: `E^(order+1)`, and as many after it as are known [W/m^(k+1)].
        distances: of the kinks from the record, along the last axis, of either sign [m]; an
            infinite one is a kink that is not there.
        kinks: jumps of E' there [W/m^2].
        steps: jumps of E there [W/m]; none if not given.
        order: of the extrapolation, 0, 1 or 2.
        definition: "total", "average", "relative" or "largest". The squared ones do not add.
        value: E at the record, for "relative".

    Raises:
        ValueError: for another order or definition, a negative radius, or a value that is asked for
            and not positive.

    Reference: derived here; J12 eq. 54 is the first term of the sum.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching import expected_error_with_events
        >>> expected_error_with_events(0.5, [0.0], np.array([-0.25]), np.array([2.0])).item()
        0.0625
    """
    check_not_negative("radius", radius)
    if definition == "relative":
        check_positive("value", value)
    R = as_float(radius)
    terms = _terms(derivatives, order)
    d, J, S = _events(distances, kinks, steps)
    return _error(nan_unless(R >= 0, R), terms, d, J, S, _checked(definition), as_float(value))


def radius_with_events(
    derivatives: Sequence[ArrayLike],
    tolerance: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    distances: ArrayLike = NONE,
    kinks: ArrayLike = NONE,
    steps: ArrayLike | None = None,
    *,
    order: int = 1,
    definition: str = "total",
    value: ArrayLike = 1.0,
) -> Float[Array, "..."]:
    """The radius at which `expected_error_with_events` reaches the tolerance.

    The error grows with the radius, so the root is bracketed and halved, and polished by two Newton
    steps, which also carry its first and second derivatives; where the largest error jumps over the
    tolerance, with E itself, the radius is the distance of that jump, and has none. All are
    numbers, or arrays that broadcast.

    Args:
        derivatives: `E^(order+1)`, and as many after it as are known [W/m^(k+1)].
        tolerance: the error that is accepted, positive.
        low: a smaller radius is not looked for [m].
        high: nor a larger one [m].
        distances: of the kinks from the record, along the last axis [m].
        kinks: jumps of E' there [W/m^2].
        steps: jumps of E there [W/m].
        order: of the extrapolation, 0, 1 or 2.
        definition: "total", "average", "relative" or "largest".
        value: E at the record, for "relative".

    Returns:
        R [m]; 0 where the error at `low` already exceeds the tolerance, infinity where that at
        `high` does not reach it, for `circular_regions` to hold and to report.

    Raises:
        ValueError: for another order or definition, a tolerance or limit that is not positive, or
            limits that are not in order.

    Reference: derived here; J12 eq. 55 without kinks and for one derivative.

    Example:
        >>> from firstorder.caching import radius_with_events
        >>> round(radius_with_events([-6.0], 0.25, 0.01, 2.0).item(), 12)
        0.5
    """
    check_positive("tolerance", tolerance)
    low, high = _checked_limits(low, high)
    terms = _terms(derivatives, order)
    d, J, S = _events(distances, kinks, steps)
    tolerance = as_float(tolerance)
    definition, value = _checked(definition), as_float(value)
    if definition == "relative":
        check_positive("value", value)

    def error(R, given):
        terms, d, J, S, value = given
        return _error(R, terms, d, J, S, definition, value)

    return _radius_of_error(error, (terms, d, J, S, value), tolerance, low, high)


def _radius_of_error(
    error: Callable[[Array, Any], Array],
    given: Any,
    tolerance: Array,
    low: Array,
    high: Array,
    halvings: int = 50,
) -> Array:
    """The radius at which an error that grows with it reaches the tolerance.

    Args:
        error: of a radius and of what else is given.
        given: that, any tree of arrays; derivatives with respect to it are those of the root.
        tolerance: the error that is accepted.
        low: a smaller radius is not looked for.
        high: nor a larger one.
        halvings: of the bracket. Where the error has a slope throughout, fewer do: a step by
            Newton's method doubles the digits of the radius.

    Returns:
        0 where the error at `low` exceeds the tolerance, infinity where that at `high` does not
        reach it; NaN for a tolerance that is not positive, or an error that is none.
    """
    fixed = jax.lax.stop_gradient(given)
    least, most = error(low, fixed), error(high, fixed)
    shape = jnp.broadcast_shapes(least.shape, most.shape, tolerance.shape)
    goal = nan_unless(tolerance > 0, tolerance)
    aim = jax.lax.stop_gradient(goal)

    def halve(_, ends):
        a, b = ends
        m = jnp.sqrt(a * b)
        over = error(m, fixed) > aim
        return jnp.where(over, a, m), jnp.where(over, m, b)

    ends = (jnp.broadcast_to(low, shape), jnp.broadcast_to(high, shape))
    a, b = jax.lax.stop_gradient(jax.lax.fori_loop(0, halvings, halve, ends))
    root = 0.5 * (a + b)

    def nearer(R):
        value, slope = jax.jvp(lambda R: error(R, given), (R,), (jnp.ones_like(R),))
        sloped = slope > 0.0
        return R - jnp.where(sloped, (value - goal) / jnp.where(sloped, slope, 1.0), 0.0)

    once = nearer(root)
    # Where E itself jumps over the tolerance, the radius is the distance of that jump.
    near = jnp.abs(once - root) <= b - a + 1e-6 * root
    polished = jnp.where(near, nearer(jnp.where(near, once, root)), root)
    inside = jnp.where(least >= aim, 0.0, jnp.where(most <= aim, jnp.inf, polished))
    return nan_unless(~jnp.isnan(goal + least + most), inside)


def _terms(derivatives: Sequence[ArrayLike], order: int) -> tuple[tuple[int, Array], ...]:
    """Sizes of the missing Taylor terms with their powers."""
    first = checked_order(order) + 1
    if len(derivatives) == 0:
        raise ValueError("Argument `derivatives` must hold at least one, but is empty.")
    return tuple(
        (k, jnp.abs(as_float(D)) / math.factorial(k)) for k, D in enumerate(derivatives, first)
    )


def _events(distances, kinks, steps) -> tuple[Array, Array, Array]:
    d, J = (jnp.abs(jnp.atleast_1d(as_float(a))) for a in (distances, kinks))
    S = jnp.zeros_like(J) if steps is None else jnp.abs(jnp.atleast_1d(as_float(steps)))
    for name, jumps in (("kinks", J), ("steps", S)):
        if jumps.shape[-1] != d.shape[-1]:
            raise ValueError(
                f"Argument `{name}` must hold {d.shape[-1]} jumps, but holds {jumps.shape[-1]}."
            )
    return d, J, S


def _checked(definition: str, known: tuple[str, ...] = _KINDS) -> str:
    if definition not in known:
        raise ValueError(
            f"Argument `definition` must be one of {list(known)}, but is {definition!r}."
        )
    return definition


def _error(R, terms, d, J, S, definition: str, value) -> Array:
    """The sum, in the definition's way; an infinite distance counts for nothing."""
    there = ~jnp.isinf(d)
    over = jnp.where(there, jnp.maximum(R[..., None] - jnp.where(there, d, 0.0), 0.0), 0.0)
    if definition == "largest":
        smooth = sum(a * R**k for k, a in terms)
        return smooth + jnp.sum(J * over + S * (over > 0.0), axis=-1)
    smooth = sum(2.0 * a * R ** (k + 1) / (k + 1) for k, a in terms)
    total = smooth + jnp.sum(0.5 * J * over**2 + S * over, axis=-1)
    if definition == "average":
        return total / jnp.where(R > 0.0, 2.0 * R, 1.0)
    return total / nan_unless(value > 0, value) if definition == "relative" else total
