"""Ellipses of validity on a plane, from the irradiance Hessian.

A linear expansion errs by `|x^T H x| / 2` to leading order; over a disc this integrates to
`(pi / 4) k R^4` where k is the mean of `|x^T H x|` over the unit circle. Of all ellipses of equal
error the largest is one whose axes are as `|lambda|^(-1/2)`: a level set of the integrand if H is
definite, stretched until both curvatures have one size if it is not.
"""

from __future__ import annotations

import math

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import check_broadcast
from firstorder.caching.radii import (
    _kind,
    _length,
    _parts,
    _unit,
    _unit_of_matrix,
    derivative_norm,
    radius_for,
)
from firstorder.caching.regions import CUT, FREE, RAISED, ValidityRegion, _clamped
from firstorder.numerics._select import either
from firstorder.typing import as_float


def semi_axes(
    H: ArrayLike,
    tolerance: ArrayLike,
    *,
    definition: str = "total",
    value: ArrayLike | None = None,
    most: float = 8.0,
    printed: bool = False,
) -> tuple[Float[Array, "... 2"], Float[Array, "... 2 2"]]:
    """Semi-axes of the largest ellipse whose expected error is the tolerance, and their directions.

    A stretch `x = T y` of determinant 1 along the eigenvectors turns the ellipse into a disc and H
    into `T^T H T`. Its mean curvature over the directions is least where both eigenvalues have one
    size; so are the root mean square and the largest curvature. That gives axes as
    `|lambda|^(-1/2)`; where `most` forbids that, the nearest ratio. The radius of the disc is then
    that of `radius_for`, exact for every definition, whatever the signs.

    Printed are axes as `|lambda|^(-1/4)`: if H is definite they have the same area, but more error
    than the tolerance, `(q + 1/q) / 2` times for `q = |lambda_1 / lambda_2|^(1/4)`.

    Args:
        H: Hessian of irradiance in the tangent plane, shape (..., 2, 2) [W/m^4].
        tolerance: the error that is accepted, positive; a number, or one for each Hessian.
        definition: what is meant by error, one of `DEFINITIONS`.
        value: E at the record, for "relative"; likewise a number or an array.
        most: largest ratio of the axes, at least 1 and finite.
        printed: whether to use J12's axes (the total error only; `most` does not act).

    Returns:
        Lengths, the shorter first (infinite where H vanishes) [m], and unit axes as columns.

    Raises:
        ValueError: for Hessians of a line, a ratio out of range, or printed axes of another
            definition.

    Reference: J12 eq. 73, corrected.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import semi_axes
        >>> lengths, _ = semi_axes(jnp.diag(jnp.array([16.0, 1.0])), jnp.pi)
        >>> lengths.tolist()
        [0.5, 2.0]
    """
    lengths, axes = _axes(H, tolerance, definition, value, most, printed)
    shorter = (lengths[..., 0] <= lengths[..., 1])[..., None]
    first = jnp.where(shorter, axes[..., 0], axes[..., 1])
    other = jnp.stack([-first[..., 1], first[..., 0]], -1)
    return jnp.where(shorter, lengths, lengths[..., ::-1]), jnp.stack([first, other], -1)


def _axes(
    H: ArrayLike,
    tolerance: ArrayLike,
    definition: str,
    value: ArrayLike | None,
    most: float,
    printed: bool,
) -> tuple[Float[Array, "... 2"], Float[Array, "... 2 2"]]:
    """`semi_axes`, that of the larger eigenvalue first.

    Not the shorter one: those of a saddle may be equal but for rounding, and a compiler may find
    each of them the shorter one within one program.
    """
    H = as_float(H)
    if H.shape[-2:] != (2, 2):
        raise ValueError(
            f"Argument `H` must have shape (..., 2, 2), but has {H.shape}: a line has no ellipses."
        )
    if not 1.0 <= most < math.inf:
        raise ValueError(f"Argument `most` must be at least 1 and finite, but is {most!r}.")
    unit = _unit_of_matrix(H)
    values, axes = _principal(H / unit[..., None, None])
    a, b = jnp.abs(values[..., 0]), jnp.abs(values[..., 1])
    if printed:
        if definition != "total":
            raise ValueError(
                f"Argument `definition` must be 'total' for the printed axes, "
                f"but is {definition!r}."
            )
        # At order 1 and in total, radius_for of an eigenvalue is (4 eps / (pi lambda))^(1/4).
        return jnp.stack([radius_for(unit * size, tolerance, dims=2) for size in (a, b)], -1), axes
    # The stretch, (b / a)^(1/4) along the first axis; bounds keep its slope finite.
    least, largest = most**-2.0, most * most
    steep = (b > 0.0) & ~(b <= largest * a)
    ratio = jnp.where(steep, largest, b / jnp.where(steep | (a == 0.0), 1.0, a))
    stretch = either(ratio > least, ratio, least) ** 0.25
    stretched = jnp.stack([values[..., 0] * stretch**2, values[..., 1] / stretch**2], -1)
    diagonal = stretched[..., None] * jnp.eye(2, dtype=stretched.dtype)
    even = derivative_norm(diagonal, 2, _kind(definition))
    R = radius_for(unit * even, tolerance, definition=definition, value=value, dims=2)
    return jnp.stack([R * stretch, R / stretch], -1), axes


def elliptic_regions(
    H: ArrayLike,
    tolerance: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    *,
    definition: str = "total",
    value: ArrayLike | None = None,
    most: float = 8.0,
    printed: bool = False,
) -> ValidityRegion:
    """Ellipses of `semi_axes`, with each axis held within [low, high].

    Args:
        H: Hessian of irradiance in the tangent plane, shape (..., 2, 2) [W/m^4].
        tolerance: the error that is accepted, positive; a number, or one for each Hessian.
        low: shortest semi-axis, a positive number [m].
        high: longest, a finite number [m].
        definition: what is meant by error, one of `DEFINITIONS`.
        value: E at the record, for "relative"; a number, or one for each Hessian.
        most: largest ratio of the axes, before the limits act.
        printed: whether to use J12's axes.

    Returns:
        Their matrices, and what acted: raised if the shorter axis was, else cut if the longer was.

    Raises:
        ValueError: as `semi_axes` and `circular_regions` do.

    Reference: J12 eq. 73, corrected.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import elliptic_regions
        >>> region = elliptic_regions(jnp.diag(jnp.array([16.0, 1.0])), jnp.pi, 0.1, 1.0)
        >>> region.matrix.tolist(), region.clamp.item()  # 0.5 m, and 2 m cut at 1 m
        ([[2.0, 0.0], [0.0, 1.0]], 1)
    """
    lengths, axes = _axes(H, tolerance, definition, value, most, printed)
    return _ellipses(lengths, axes, low, high)


def _ellipses(lengths: Array, axes: Array, low: ArrayLike, high: ArrayLike) -> ValidityRegion:
    """Ellipses with each semi-axis held within limits, and what acted on them."""
    low, high = as_float(low)[..., None], as_float(high)[..., None]
    held, codes = _clamped(lengths, low, high)
    raised = jnp.any(codes == RAISED, axis=-1)
    cut = jnp.any(codes == CUT, axis=-1)
    code = jnp.where(raised, RAISED, jnp.where(cut, CUT, FREE))
    # Symmetric, so that a circle is a multiple of the identity.
    return ValidityRegion((axes / held[..., None, :]) @ jnp.swapaxes(axes, -1, -2), code)


def gradient_regions(
    gradient: ArrayLike,
    radius: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    *,
    ratio: float = 2.0,
) -> ValidityRegion:
    """Ellipses of one eccentricity, the shorter axis along the gradient.

    The longer semi-axis is the radius that other metrics give, such as a split sphere's, and
    `radius / ratio` is the one along the gradient. The eccentricity is the user's guess:
    `elliptic_regions` takes it from the Hessian, which alone says how the expansion errs. Where the
    gradient vanishes there is no direction, and the region is a disc.

    Args:
        gradient: of irradiance in the tangent plane, shape (..., 2) [W/m^3].
        radius: across the gradient, an array, not negative, may be infinite [m].
        low: shortest semi-axis, a positive number, or one for each [m].
        high: longest, a positive number, or one for each [m].
        ratio: of the axes, at least 1 and finite.

    Returns:
        Their matrices, and what acted: raised if the shorter axis was, else cut if the longer was.

    Raises:
        ValueError: for a ratio out of range, gradients of a line or of space, radii that are not as
            many, and as `circular_regions` does.

    Reference: Herzog et al. 2009, as J12 §8.4 tells it.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import gradient_regions
        >>> gradient_regions(jnp.array([0.0, 3.0]), 0.5, 0.01, 1.0, ratio=4.0).matrix.tolist()
        [[2.0, 0.0], [0.0, 8.0]]
    """
    if not 1.0 <= ratio < math.inf:
        raise ValueError(f"Argument `ratio` must be at least 1 and finite, but is {ratio!r}.")
    gradient = as_float(gradient)
    if gradient.shape[-1:] != (2,):
        raise ValueError(
            f"Argument `gradient` must have shape (..., 2), but has {gradient.shape}: a line has "
            "no ellipses."
        )
    check_broadcast("radius", radius, gradient.shape[:-1])
    gradient = gradient / _unit(gradient)[..., None]
    gx, gy = gradient[..., 0], gradient[..., 1]
    size = _length(gx, gy)
    none = size == 0.0
    c, s = (jnp.where(none, rest, a / jnp.where(none, 1.0, size)) for a, rest in ((gx, 1), (gy, 0)))
    axes = jnp.stack([jnp.stack([c, s], -1), jnp.stack([-s, c], -1)], -1)
    long = jnp.broadcast_to(as_float(radius).astype(size.dtype), size.shape)
    short = jnp.where(none, long, long / ratio)
    return _ellipses(jnp.stack([short, long], -1), axes, low, high)


def _principal(H: Float[Array, "... 2 2"]) -> tuple[Float[Array, "... 2"], Float[Array, "... 2 2"]]:
    """Eigenvalues of symmetric matrices, the larger first, and unit axes as columns.

    In closed form. For a multiple of the identity, whose axes are any, those of the coordinates.

    Args:
        H: symmetric; the mean of the off-diagonal entries is used.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching.ellipses import _principal
        >>> _principal(jnp.array([[1.0, 0.0], [0.0, -3.0]]))[0].tolist()
        [1.0, -3.0]
    """
    mean, d, b = _parts(H)
    apart = _length(d, b)
    values = jnp.stack([mean + apart, mean - apart], -1)
    round_ = apart == 0.0
    angle = 0.5 * jnp.arctan2(jnp.where(round_, 0.0, b), jnp.where(round_, 1.0, d))
    c, s = jnp.cos(angle), jnp.sin(angle)
    return values, jnp.stack([jnp.stack([c, s], -1), jnp.stack([-s, c], -1)], -1)
