"""Radii of cache records: how far one may be used for a tolerated error of extrapolation.

A Taylor expansion of order p errs by its first missing term, `T[x, ..., x] / q!` with q = p + 1 and
T the q-th derivatives. So the value alone is judged by the gradient, the value with its gradient by
the Hessian, and second-order extrapolation by the third derivatives. What is meant by the error of
a record decides how that term is summed over its region, and which norm of T counts.

Radii from the lengths of rays alone, such as Ward's, are in `caching.distances`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_count,
    check_not_negative,
    check_positive,
    nan_unless,
    not_negative,
)
from firstorder.caching._records import checked_order
from firstorder.caching.regions import ValidityRegion, _checked_dims, _determinant
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import either, larger, safe_sqrt
from firstorder.typing import as_float

DEFINITIONS = (
    "total", "average", "average squared", "integrated squared", "relative", "largest"
)  # fmt: skip
_KINDS = ("largest", "mean", "rms")


class _Law(NamedTuple):
    """`error = factor * size^power * R^exponent`, size = |E^(q)| / q! (over E for "relative")."""

    factor: float
    power: int
    exponent: int


def _law(definition: str, order: int, dims: int = 1) -> _Law:
    """Law of an error definition: integral of `size |x|^q`, its square, or a mean, on |x| < R."""
    q = checked_order(order) + 1
    _checked_dims(dims)
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


def derivative_norm(
    derivative: ArrayLike, order: int, kind: str = "largest", directions: int = 96
) -> Float[Array, "..."]:
    """One number for derivatives of one order: a norm of `|T[x, ..., x]|` over unit steps x.

    "largest" is the maximum, by which J12 bounds the error of a disc: for a Hessian `|lambda_1|`.
    "mean" is the mean, with which (68) integrates exactly, and "rms" the root mean square. Along a
    line all three are |T|. In closed form up to order 2: with `s, d = (lambda_1 +- lambda_2) / 2` a
    Hessian's mean is `|s|` if the eigenvalues have one sign, and
    `(2 / pi) (s asin(s / d) + sqrt(d^2 - s^2))` if not. It lies between `0.4705 |lambda_1|` and
    `|lambda_1|`, so that the bound costs up to a factor 1.21 of the radius.

    Args:
        derivative: gradients, Hessians or third derivatives (..., d, ..., d), d = 1 or 2.
        order: 1, 2 or 3: how many of the last axes belong to a derivative.
        kind: "largest", "mean" or "rms".
        directions: for third derivatives on a plane, equally spaced over half the circle; the
            modulus has six kinks, so that the error falls as `1 / directions^2`.

    Returns:
        A size for `radius_for`.

    Raises:
        ValueError: for another kind or order, or axes of other lengths.

    Reference: J12 eqs. 68-69; the means are derived here. J12 §9 names the principle of third order
    and expects it not to pay.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import derivative_norm
        >>> H = jnp.diag(jnp.array([2.0, 1.0]))
        >>> derivative_norm(H, 2).item(), derivative_norm(H, 2, "mean").item()
        (2.0, 1.5)
        >>> derivative_norm(jnp.array([[-6.0]]), 2).item()
        6.0
    """
    if kind not in _KINDS:
        raise ValueError(f"Argument `kind` must be one of {list(_KINDS)}, but is {kind!r}.")
    if order not in (1, 2, 3):
        raise ValueError(f"Argument `order` must be 1, 2 or 3, but is {order!r}.")
    T = as_float(derivative)
    d = T.shape[-1] if T.ndim >= order else 0
    if d not in (1, 2) or T.shape[-order:] != (d,) * order:
        raise ValueError(
            f"Argument `derivative` must end in {order} axes of one length, 1 or 2, "
            f"but has shape {T.shape}."
        )
    if d == 1:
        return jnp.abs(T.reshape(T.shape[:-order]))
    if order == 1:
        return {"largest": 1.0, "mean": 2.0 / math.pi, "rms": 0.5**0.5}[kind] * _length(
            T[..., 0], T[..., 1]
        )
    check_count("directions", directions)
    return _hessian_norm(T, kind) if order == 2 else _third_norm(T, kind, directions)


def _hessian_norm(H: Float[Array, "... 2 2"], kind: str) -> Float[Array, "..."]:
    unit = _unit_of_matrix(H)
    mean, half, b = _parts(H / unit[..., None, None])
    d = _length(half, b)
    s = jnp.abs(mean)
    if kind == "largest":
        return unit * (s + d)
    if kind == "rms":
        return unit * _length(s, 0.5**0.5 * d)
    mixed = ~(d <= s)  # a NaN stays one
    ratio = jnp.where(mixed, s, 0.0) / jnp.where(mixed, d, 1.0)
    # sqrt(d^2 - s^2) as d sqrt(1 - ratio^2), whose derivative is finite where it is used.
    root = jnp.sqrt(jnp.where(mixed, 1.0 - ratio * ratio, 1.0))
    return unit * jnp.where(mixed, (2.0 / math.pi) * (s * jnp.arcsin(ratio) + d * root), s)


def _third_norm(T: Float[Array, "... 2 2 2"], kind: str, directions: int) -> Float[Array, "..."]:
    phi = np.pi * (np.arange(directions) + 0.5) / directions
    x = jnp.asarray(np.stack([np.cos(phi), np.sin(phi)], -1), T.dtype)
    form = jnp.einsum("...abc,ka,kb,kc->...k", T, x, x, x)
    if kind == "rms":
        return _root_of_sum(form) / math.sqrt(directions)
    form = jnp.abs(form)
    return jnp.mean(form, axis=-1) if kind == "mean" else jnp.max(form, axis=-1)


def expected_error(
    derivative: ArrayLike,
    region: ValidityRegion,
    *,
    order: int = 1,
    definition: str = "total",
    value: ArrayLike | None = None,
) -> Float[Array, "..."]:
    """Error of a record's extrapolation within its region, from the first missing Taylor term.

    With `m(x) = |T[x, ..., x]| / q!` and `q = order + 1`; on the right for a line, |x| < R, where
    `a = |E^(q)| / q!`:

    ================== ========================== ================================= =========
    total              int m dx                   2 a R^(q+1) / (q+1)               [W]
    average            total / |region|           a R^q / (q+1)                     [W/m]
    average squared    int m^2 dx / |region|      a^2 R^(2q) / (2q+1)               [W^2/m^2]
    integrated squared int m^2 dx                 2 a^2 R^(2q+1) / (2q+1)           [W^2/m]
    relative           total / E                  2 a R^(q+1) / ((q+1) E)           [m]
    largest            max m                      a R^q                             [W/m]
    ================== ========================== ================================= =========

    An ellipse is the image of the unit disc under `S = matrix^-1`; T is pulled back by S, so that
    the total of order 1 is `(pi / 4) |det S| k`, k the mean of `|x^T S^T H S x|` around the circle.

    Along a line valid to first order in R: of the terms left out the odd ones cancel between the
    two sides as long as the first one decides the sign, so that the total errs by `O(R^2)` of
    itself. Wrong at inflections, where the term vanishes, and across kinks of E, which it does not
    know; for both see `expected_error_with_events`.

    Args:
        derivative: the derivatives of order `order + 1` at each record, (..., d, ..., d).
        region: of each record.
        order: of the extrapolation, 0, 1 or 2.
        definition: what is meant by error, one of `DEFINITIONS`.
        value: E at the record, positive, a number or an array; for "relative" only.

    Raises:
        ValueError: for another order or definition, derivatives and regions of different
            dimensions, or "relative" without a positive value.

    Reference: J12 eqs. 53-54 (order 1, total, a line), 68 (a plane); its footnote 1 and §9 name the
    others.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import ValidityRegion, expected_error
        >>> expected_error(jnp.array([[-6.0]]), ValidityRegion(jnp.array([[2.0]]))).item()
        0.25
        >>> round(expected_error(4.0 * jnp.eye(2), ValidityRegion(jnp.eye(2))).item(), 6)
        3.141593
    """
    matrix = as_float(region.matrix)
    d = matrix.shape[-1]
    law = _law(definition, order, d)
    T = as_float(derivative)
    if T.ndim <= order or T.shape[-1] != d:
        raise ValueError(
            f"Argument `derivative` must end in {order + 1} axes of length {d}, "
            f"but has shape {T.shape}."
        )
    det = _determinant(matrix)
    size = derivative_norm(_pulled_back(T, matrix, det, order + 1), order + 1, _kind(definition))
    error = law.factor * _coefficient(size, order, definition, value) ** law.power
    # What is integrated, and not averaged, counts the size of the region.
    return error if definition in ("average", "average squared", "largest") else error / abs(det)


def _kind(definition: str) -> str:
    """The norm of derivatives with which a definition integrates exactly."""
    if definition == "largest":
        return "largest"
    return "rms" if "squared" in definition else "mean"


def _pulled_back(T: Array, matrix: Array, det: Array, order: int) -> Array:
    """`T[S x, ..., S x]` as derivatives in x, S the inverse of the matrix."""
    if matrix.shape[-1] == 1:
        return T / (det**order).reshape(det.shape + (1,) * order)
    turned = jnp.stack([matrix[..., 1, 1], -matrix[..., 0, 1], -matrix[..., 1, 0],
                        matrix[..., 0, 0]], -1)  # fmt: skip
    S = turned.reshape(matrix.shape) / det[..., None, None]
    pull = {1: "...i,...ia->...a", 2: "...ij,...ia,...jb->...ab",
            3: "...ijk,...ia,...jb,...kc->...abc"}[order]  # fmt: skip
    return jnp.einsum(pull, T, *[S] * order)


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

    For first-order extrapolation along a line and the total error,
    `R = (3 tolerance / |E''|)^(1/3)`. On a plane (`dims=2`) it is a disc's, and the size one number
    for all directions (`derivative_norm`). At equal
    numbers of records only the power of the derivative tells definitions apart: `|E''|^(-1/3)` for
    the total, `-2/5` for the integrated squared, `-1/2` for average, average squared and
    largest, which therefore place the same records.

    Where the derivative is zero the radius is infinite, and the derivative of the radius with
    respect to it is given as zero: `circular_regions` holds it within limits.

    Args:
        derivative: `E^(order+1)` at the records, an array: exact, or from the arc-length or
            stratified form; on a plane its `derivative_norm`.
        tolerance: the error that is accepted, a positive number, in the unit of the definition.
        order: of the extrapolation, 0, 1 or 2.
        definition: what is meant by error, one of `DEFINITIONS`.
        value: E at the records, an array, positive; for "relative" only [W/m].
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
    size = _coefficient(derivative, order, definition, value)
    tolerance = as_float(tolerance)
    flat = (size == 0.0) & (tolerance > 0)
    safe = jnp.where(flat, 1.0, size)
    # Roots before the quotient: the square of a derivative may leave the range of float32.
    reach = (nan_unless(tolerance > 0, tolerance) / law.factor) ** (1.0 / law.exponent)
    return jnp.where(flat, jnp.inf, reach / safe ** (law.power / law.exponent))


def _coefficient(
    derivative: ArrayLike, order: int, definition: str, value: ArrayLike | None
) -> Array:
    """Coefficient of the first missing term, over the value where the error is relative."""
    size = jnp.abs(as_float(derivative)) / math.factorial(order + 1)
    if definition != "relative":
        return size
    if value is None:
        raise ValueError("Argument `value` must be given for the relative error, but is missing.")
    check_positive("value", value)
    value = as_float(value)
    return size / nan_unless(value > 0, value)


def largest_radiance(radiances: Any, quantile: float = 1.0) -> Float[Array, ""]:
    """The largest radiance in a scene, from samples: of photons, of gather rays, of emitters.

    The largest of n noisy samples grows with n. With a quantile below 1 it does not, but is no
    bound either; since one factor for all radii changes no ranking, this often matters little.

    Args:
        radiances: samples, of any shape, not negative [W/(m^2 sr)].
        quantile: share of samples that it exceeds, 1 for the maximum.

    Returns:
        A number, in the unit of the samples [W/(m^2 sr)].

    Raises:
        ValueError: if there is no radiance, one is negative, or the quantile is not within (0, 1].
            A traced one that is negative gives NaN.

    Reference: J12 footnote 2 (the maximum of the photons' precomputed radiances).

    Example:
        >>> from firstorder.caching import largest_radiance
        >>> largest_radiance([0.5, 2.0, 1.0]).item()
        2.0
    """
    samples = as_float(radiances)
    if not samples.size:
        raise ValueError("Argument `radiances` must hold at least one, but is empty.")
    check_not_negative("radiances", samples)
    if not 0.0 < quantile <= 1.0:
        raise ValueError(f"Argument `quantile` must lie in (0, 1], but is {quantile!r}.")
    return jnp.quantile(jnp.ravel(not_negative(samples)), quantile)


def geometric_bound(hessians: ArrayLike, weights: ArrayLike = 1.0) -> Float[Array, "... 2 2"]:
    """A matrix B with `|x^T H x| <= L x^T B x` for all light with radiances between 0 and L.

    The printed bound replaces every radiance by its maximum. But the geometry term curves both
    ways, and what cancels under even light need not under uneven: in a closed room the printed
    Hessian is zero. Here the pieces are added apart by sign, `P = sum w H_+` and
    `N = sum w (-H)_+`, the two extremes of any light; `B = (P + N + |P - N|) / 2` is above both.
    Visibility is held fixed, as there.

    Args:
        hessians: of the geometry term, one for each ray or piece of surface, shape (..., k, 2, 2)
            [1/m^4 times area].
        weights: of the pieces, an array, not negative.

    Returns:
        B, to be used as a Hessian after scaling by the largest radiance.

    Raises:
        ValueError: if a weight is negative.

    Reference: derived here, in the place of J12 eq. 71.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import geometric_bound
        >>> geometric_bound(jnp.stack([jnp.eye(2), -jnp.eye(2)])).tolist()
        [[1.0, 0.0], [0.0, 1.0]]
    """
    check_not_negative("weights", weights)
    H = as_float(hessians)
    w = jnp.broadcast_to(not_negative(as_float(weights)), H.shape[:-2])[..., None, None]
    up = jnp.sum(w * _positive_part(H), axis=-3)
    down = jnp.sum(w * _positive_part(-H), axis=-3)
    difference = up - down
    size = _positive_part(difference) + _positive_part(-difference)
    return 0.5 * (up + down + size)


def _positive_part(H: Float[Array, "... 2 2"]) -> Float[Array, "... 2 2"]:
    """Symmetric matrices with their negative eigenvalues set to zero.

    `a I + c (H - mean I)`, a the mean of both eigenvalues' positive parts, and c in [0, 1]. Where
    one of them is zero but for rounding, either of its signs gives the same matrix: a compiler may
    find both in one program.
    """
    unit = _unit_of_matrix(H)[..., None, None]
    H = H / unit
    mean, d, b = _parts(H)
    apart = _length(d, b)
    most = larger(jnp.abs(mean), apart)
    share = 0.5 + 0.5 * mean / jnp.where(most > 0.0, most, 1.0)
    high, low = (either(a > 0.0, a, 0.0) for a in (mean + apart, mean - apart))
    middle = 0.5 * (high + low)
    eye = jnp.eye(2, dtype=H.dtype)
    mean, share, middle = (a[..., None, None] for a in (mean, share, middle))
    return unit * (middle * eye + share * (H - mean * eye))


def _parts(H: Array) -> tuple[Array, Array, Array]:
    """Mean of the eigenvalues, half the difference of the diagonal, off-diagonal."""
    return (
        0.5 * (H[..., 0, 0] + H[..., 1, 1]),
        0.5 * (H[..., 0, 0] - H[..., 1, 1]),
        0.5 * (H[..., 0, 1] + H[..., 1, 0]),
    )


def _length(d: Array, b: Array) -> Array:
    """Length of (d, b), whose squares would leave the range of float32 in most units."""
    return _root_of_sum(jnp.stack(jnp.broadcast_arrays(d, b), -1))


def _root_of_sum(a: Float[Array, "... k"]) -> Float[Array, "..."]:
    """The root of a sum of squares, at zero with the slope zero."""
    unit = _unit(a)
    return unit * safe_sqrt(jnp.sum((a / unit[..., None]) ** 2, -1))


def _unit(a: Float[Array, "... k"]) -> Float[Array, "..."]:
    """A power of two near the largest of some numbers; quotients by others may leave the range."""
    unit = power_of_two(a)
    return jnp.where(jnp.isfinite(unit), unit, 1.0)


def _unit_of_matrix(H: Float[Array, "... 2 2"]) -> Float[Array, "..."]:
    """`_unit` of all entries of each matrix."""
    return _unit(H.reshape(*H.shape[:-2], 4))
