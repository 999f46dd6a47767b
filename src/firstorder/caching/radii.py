"""Radii of cache records: how far one may be used for a tolerated error of extrapolation.

A Taylor expansion of order p errs by its first missing term, `|E^(q)| |x|^q / q!` with q = p + 1.
So the value alone is judged by E', the value with its gradient by E'', and second-order
extrapolation by E'''. What is meant by the error of a record decides how that term is summed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder.caching._records import checked_order
from firstorder.errors import check_not_negative, check_positive, is_concrete, nan_unless
from firstorder.typing import as_float

DEFINITIONS = (
    "total", "average", "average squared", "integrated squared", "relative", "largest"
)  # fmt: skip

# What acted on a radius.
FREE, RAISED, CUT = 0, -1, 1
CLAMPS = {FREE: "", RAISED: "raised", CUT: "cut"}


class _Law(NamedTuple):
    """`error = factor * size^power * R^exponent`, size = |E^(q)| / q! (over E for "relative")."""

    factor: float
    power: int
    exponent: int


def _law(definition: str, order: int, dims: int = 1) -> _Law:
    """Law of an error definition: integral of `size |x|^q`, its square, or a mean, on |x| < R."""
    q = checked_order(order) + 1
    if dims not in (1, 2):
        raise ValueError(f"Argument `dims` must be 1 or 2, but is {dims!r}.")
    # Two directions on a line, 2 pi of them in a plane; the volume grows as r^(dims - 1) dr.
    around = 2.0 if dims == 1 else 2.0 * math.pi
    laws = {
        "total": _Law(around / (q + dims), 1, q + dims),
        "average": _Law(dims / (q + dims), 1, q),
        "average squared": _Law(dims / (2 * q + dims), 2, 2 * q),
        "integrated squared": _Law(around / (2 * q + dims), 2, 2 * q + dims),
        "relative": _Law(around / (q + dims), 1, q + dims),
        "largest": _Law(1.0, 1, q),
    }
    if definition not in laws:
        raise ValueError(
            f"Argument `definition` must be one of {list(laws)}, but is {definition!r}."
        )
    return laws[definition]


def expected_error(
    derivative: ArrayLike,
    radius: ArrayLike,
    *,
    order: int = 1,
    definition: str = "total",
    value: ArrayLike | None = None,
    dims: int = 1,
) -> Float[Array, "..."]:
    """Error of a record's extrapolation within its radius, from the first missing Taylor term.

    With `a = |E^(q)| / q!` and `q = order + 1`:

    ================== ===================== ================================= =========
    total              int |a x^q| dx        2 a R^(q+1) / (q+1)               [W]
    average            total / (2 R)         a R^q / (q+1)                     [W/m]
    average squared    int (a x^q)^2 / (2 R) a^2 R^(2q) / (2q+1)               [W^2/m^2]
    integrated squared int (a x^q)^2 dx      2 a^2 R^(2q+1) / (2q+1)           [W^2/m]
    relative           total / E             2 a R^(q+1) / ((q+1) E)           [m]
    largest            max |a x^q|           a R^q                             [W/m]
    ================== ===================== ================================= =========

    On a surface (`dims=2`) the same is integrated over a disc, and the total is
    `2 pi a R^(q+2) / (q+2)`; the derivative is then one number for all directions, such as
    `hessian_norm` gives.

    Valid to first order in R: of the terms left out the odd ones cancel between the two sides as
    long as the first one decides the sign, so that the total errs by `O(R^2)` of itself. Wrong at
    inflections, where the term vanishes, and across kinks of E, which it does not know; for both
    see `expected_error_with_events`.

    Args:
        derivative: `E^(order+1)` at the record, in arc length, of either sign [W/m^(q+1)].
        radius: R [m].
        order: of the extrapolation, 0, 1 or 2.
        definition: what is meant by error, one of `DEFINITIONS`.
        value: E at the record, positive; for "relative" only [W/m].
        dims: 1 for a line, 2 for a surface (units: one metre more above or below the line).

    Raises:
        ValueError: for another order or definition, a negative radius, or "relative" without a
            positive value.

    Reference: J12 eqs. 53-54 (order 1, total), 69 on a surface; its footnote 1 and §9 name the
    others.

    Example:
        >>> from firstorder.caching import expected_error
        >>> expected_error(-6.0, 0.5).item()
        0.25
    """
    law = _law(definition, order, dims)
    check_not_negative("radius", radius)
    R = as_float(radius)
    R = nan_unless(R >= 0, R)
    return law.factor * _size(derivative, order, definition, value) ** law.power * R**law.exponent


def radius_for(
    derivative: ArrayLike,
    tolerance: ArrayLike,
    *,
    order: int = 1,
    definition: str = "total",
    value: ArrayLike | None = None,
    dims: int = 1,
) -> Float[Array, "..."]:
    """The radius at which the expected error reaches the tolerance: `expected_error` inverted.

    For first-order extrapolation and the total error, `R = (3 tolerance / |E''|)^(1/3)`. At equal
    numbers of records only the power of the derivative tells definitions apart: `|E''|^(-1/3)` for
    the total, `-2/5` for the integrated squared, `-1/2` for average, average squared and
    largest, which therefore place the same records.

    Where the derivative is zero the radius is infinite, and the derivative of the radius with
    respect to it is given as zero: clamp it (`clamped`).

    Args:
        derivative: `E^(order+1)` at the record: exact, or from the arc-length or stratified form.
        tolerance: the error that is accepted, positive, in the unit of the definition.
        order: of the extrapolation, 0, 1 or 2.
        definition: what is meant by error, one of `DEFINITIONS`.
        value: E at the record, positive; for "relative" only [W/m].
        dims: 1 for a line, 2 for a surface.

    Returns:
        R in metres. A traced tolerance that is not positive gives NaN.

    Raises:
        ValueError: for another order or definition, a tolerance that is not positive, or "relative"
            without a positive value.

    Reference: J12 eq. 55 (order 1, total), 70 on a surface.

    Example:
        >>> from firstorder.caching import radius_for
        >>> radius_for(-6.0, 0.25).item()
        0.5
    """
    law = _law(definition, order, dims)
    check_positive("tolerance", tolerance)
    size = _size(derivative, order, definition, value)
    tolerance = as_float(tolerance)
    flat = size == 0.0
    safe = jnp.where(flat, 1.0, size)
    ratio = nan_unless(tolerance > 0, tolerance) / (law.factor * safe**law.power)
    return jnp.where(flat, jnp.inf, ratio ** (1.0 / law.exponent))


def _size(derivative: ArrayLike, order: int, definition: str, value: ArrayLike | None) -> Array:
    """Coefficient of the first missing term, over the value where the error is relative."""
    size = jnp.abs(as_float(derivative)) / math.factorial(order + 1)
    if definition != "relative":
        return size
    if value is None:
        raise ValueError("Argument `value` must be given for the relative error, but is missing.")
    check_positive("value", value)
    value = as_float(value)
    return size / nan_unless(value > 0, value)


class Clamped(NamedTuple):
    """Radii inside their limits, and what acted on each: `FREE`, `RAISED` or `CUT`."""

    radius: Float[Array, "..."]
    clamp: Int[Array, "..."]


def clamped(radius: ArrayLike, low: ArrayLike, high: ArrayLike) -> Clamped:
    """Radii held within [low, high], with the limit that acted on each.

    No metric does without: the distance to the nearest surface is zero in a corner, and the Hessian
    vanishes at an inflection, where the radius is infinite.

    Args:
        radius: not negative, may be infinite [m].
        low: smallest radius, positive [m].
        high: largest radius, at least `low` and finite [m].

    Returns:
        The radii, and codes: 0 where none acted, -1 where the radius was raised to `low`, 1 where
        it was cut at `high`. A NaN stays NaN.

    Raises:
        ValueError: if `low` is not positive, or above `high`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import clamped
        >>> clamped(jnp.array([0.01, 0.2, jnp.inf]), 0.05, 1.0).clamp.tolist()
        [-1, 0, 1]
    """
    check_positive("low", low)
    check_positive("high", high)
    radius, low, high = as_float(radius), as_float(low), as_float(high)
    if is_concrete((low, high)) and bool(jnp.any(low > high)):
        raise ValueError(
            f"Argument `high` must be at least {float(low):g}, but is {float(high):g}."
        )
    code = jnp.where(radius < low, RAISED, jnp.where(radius > high, CUT, FREE))
    held = jnp.where(code == RAISED, low, jnp.where(code == CUT, high, radius))
    return Clamped(held, code)
