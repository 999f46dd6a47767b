"""Regions of validity of records on a surface: circles and ellipses from the irradiance Hessian.

A linear expansion errs by `|x^T H x| / 2` to leading order. Over a disc this integrates to
`(pi / 4) k R^4` where k is the mean of `|x^T H x|` over the unit circle; the largest absolute
eigenvalue bounds k. Of all ellipses of equal error the largest is one whose axes are as
`|lambda|^(-1/2)`: a level set of the integrand if H is definite, stretched until both curvatures
have one size if it is not.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder.caching.radii import CUT, FREE, RAISED, clamped, radius_for
from firstorder.errors import check_not_negative
from firstorder.typing import as_float

CURVATURES = ("largest", "mean")


class ValidityRegion(NamedTuple):
    """Region in which each record is valid: the steps dx with `|matrix @ dx| < 1`.

    Attributes:
        matrix: identity over the radius for a circle [1/m].
        clamp: what acted on it: `FREE`, `RAISED` or `CUT`.
    """

    matrix: Float[Array, "... 2 2"]
    clamp: Int[Array, "..."]


def _principal(H: Float[Array, "... 2 2"]) -> tuple[Float[Array, "... 2"], Float[Array, "... 2 2"]]:
    """Eigenvalues of symmetric matrices, the larger modulus first, and unit axes as columns.

    In closed form. For a multiple of the identity, whose axes are any, those of the coordinates.

    Args:
        H: symmetric; the mean of the off-diagonal entries is used.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching.ellipses import _principal
        >>> _principal(jnp.array([[1.0, 0.0], [0.0, -3.0]]))[0].tolist()
        [-3.0, 1.0]
    """
    mean, d, b = _parts(H)
    apart = _length(d, b)
    up = mean >= 0.0
    values = jnp.stack([jnp.where(up, mean + apart, mean - apart), mean], -1)
    values = values.at[..., 1].set(jnp.where(up, mean - apart, mean + apart))
    round_ = apart == 0.0
    angle = 0.5 * jnp.arctan2(jnp.where(round_, 0.0, b), jnp.where(round_, 1.0, d))
    c, s = jnp.cos(angle), jnp.sin(angle)
    first = jnp.where(up[..., None], jnp.stack([c, s], -1), jnp.stack([-s, c], -1))
    other = jnp.stack([-first[..., 1], first[..., 0]], -1)
    return values, jnp.stack([first, other], -1)


def _parts(H: Array) -> tuple[Array, Array, Array]:
    """Mean of the eigenvalues, half the difference of the diagonal, off-diagonal."""
    return (
        0.5 * (H[..., 0, 0] + H[..., 1, 1]),
        0.5 * (H[..., 0, 0] - H[..., 1, 1]),
        0.5 * (H[..., 0, 1] + H[..., 1, 0]),
    )


def _length(d: Array, b: Array) -> Array:
    """Length of (d, b); its derivative at zero is zero rather than NaN."""
    square = d * d + b * b
    there = square > 0.0
    return jnp.where(there, jnp.sqrt(jnp.where(there, square, 1.0)), 0.0)


def hessian_norm(H: Float[Array, "... 2 2"], kind: str = "largest") -> Float[Array, "..."]:
    """One number for a Hessian, to be given to `radius_for` with `dims=2`.

    "largest" is `|lambda_1|`, by which J12 bounds the error of a disc. "mean" is the mean of
    `|x^T H x|` over the unit circle, with which (68) integrates exactly: with
    `s, d = (lambda_1 +- lambda_2) / 2` it is `|s|` if the eigenvalues have one sign, and
    `(2 / pi) (s asin(s / d) + sqrt(d^2 - s^2))` if not. It lies between `0.4705 |lambda_1|` and
    `|lambda_1|`, so that the bound costs up to a factor 1.21 of the radius.

    Args:
        H: Hessian of irradiance in the tangent plane [W/m^4].
        kind: "largest" or "mean".

    Raises:
        ValueError: for another kind.

    Reference: J12 eqs. 68-69; the mean is derived here.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import hessian_norm
        >>> H = jnp.diag(jnp.array([2.0, 1.0]))
        >>> hessian_norm(H).item(), hessian_norm(H, "mean").item()
        (2.0, 1.5)
    """
    if kind not in CURVATURES:
        raise ValueError(f"Argument `kind` must be one of {list(CURVATURES)}, but is {kind!r}.")
    mean, half, b = _parts(H)
    d = _length(half, b)
    s = jnp.abs(mean)
    if kind == "largest":
        return s + d
    mixed = d > s
    ratio = jnp.where(mixed, s, 0.0) / jnp.where(mixed, d, 1.0)
    # sqrt(d^2 - s^2) as d sqrt(1 - ratio^2), whose derivative is finite where it is used.
    root = jnp.sqrt(jnp.where(mixed, 1.0 - ratio * ratio, 1.0))
    return jnp.where(mixed, (2.0 / math.pi) * (s * jnp.arcsin(ratio) + d * root), s)


def third_derivative_norm(
    T: Float[Array, "... 2 2 2"], directions: int = 96
) -> Float[Array, "..."]:
    """The mean of `|T[x, x, x]|` over the unit circle, for `radius_for` with `order=2, dims=2`.

    Args:
        T: third derivatives of irradiance in the tangent plane [W/m^5].
        directions: equally spaced over half the circle; the modulus has six kinks, so that the
            error falls as `1 / directions^2`.

    Reference: derived here; J12 §9 names the principle and expects it not to pay.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import third_derivative_norm
        >>> T = jnp.zeros((2, 2, 2)).at[0, 0, 0].set(3.0)
        >>> round(third_derivative_norm(T).item(), 3)  # 3 times the mean of |cos|^3, 4 / (3 pi)
        1.273
    """
    phi = np.pi * (np.arange(directions) + 0.5) / directions
    x = jnp.asarray(np.stack([np.cos(phi), np.sin(phi)], -1), T.dtype)
    return jnp.mean(jnp.abs(jnp.einsum("...abc,ka,kb,kc->...k", T, x, x, x)), axis=-1)


def circular_regions(radius: ArrayLike, low: ArrayLike, high: ArrayLike) -> ValidityRegion:
    """Discs of the given radii, held within [low, high].

    Args:
        radius: not negative, may be infinite [m].
        low: smallest, positive [m].
        high: largest, finite [m].

    Raises:
        ValueError: if `low` is not positive, or above `high`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import circular_regions
        >>> circular_regions(jnp.array([0.5]), 0.1, 2.0).matrix.tolist()
        [[[2.0, 0.0], [0.0, 2.0]]]
    """
    held = clamped(radius, low, high)
    inverse = 1.0 / held.radius
    return ValidityRegion(inverse[..., None, None] * jnp.eye(2, dtype=inverse.dtype), held.clamp)


def semi_axes(
    H: Float[Array, "... 2 2"],
    tolerance: ArrayLike,
    *,
    definition: str = "total",
    value: ArrayLike | None = None,
    most: float = 8.0,
    printed: bool = False,
) -> tuple[Float[Array, "... 2"], Float[Array, "... 2 2"]]:
    """Semi-axes of the largest ellipse whose expected error is the tolerance, and their directions.

    A stretch `x = T y` of determinant 1 along the eigenvectors turns the ellipse into a disc and H
    into `T^T H T`. The mean curvature of that is least where both eigenvalues have one size, which
    gives axes as `|lambda|^(-1/2)`; where `most` forbids that, the nearest ratio. The radius of the
    disc is then that of `radius_for`, exact for (68) whatever the signs.

    Printed are axes as `|lambda|^(-1/4)`: they have the same area, but more error than the
    tolerance, `(q + 1/q) / 2` times for `q = |lambda_1 / lambda_2|^(1/4)`.

    Args:
        H: Hessian of irradiance in the tangent plane [W/m^4].
        tolerance: the error that is accepted, positive.
        definition: what is meant by error, one of `DEFINITIONS`.
        value: E at the record, for "relative".
        most: largest ratio of the axes, at least 1.
        printed: whether to use J12's axes (the total error only; `most` does not act).

    Returns:
        Lengths, the shorter first (infinite where H vanishes) [m], and unit axes as columns.

    Raises:
        ValueError: for a ratio below 1, or printed axes of another definition.

    Reference: J12 eq. 73, corrected.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import semi_axes
        >>> lengths, _ = semi_axes(jnp.diag(jnp.array([16.0, 1.0])), jnp.pi)
        >>> lengths.tolist()
        [0.5, 2.0]
    """
    if not most >= 1.0:
        raise ValueError(f"Argument `most` must be at least 1, but is {most!r}.")
    values, axes = _principal(H)
    big, small = jnp.abs(values[..., 0]), jnp.abs(values[..., 1])
    if printed:
        if definition != "total":
            raise ValueError(
                f"Argument `definition` must be 'total' for the printed axes, "
                f"but is {definition!r}."
            )
        # At order 1 and in total, radius_for of an eigenvalue is (4 eps / (pi lambda))^(1/4).
        lengths = [radius_for(size, tolerance, dims=2) for size in (big, small)]
        return jnp.stack(lengths, -1), axes
    flat = big == 0.0
    ratio = jnp.where(flat, 1.0, small) / jnp.where(flat, 1.0, big)
    # The stretch, (small / big)^(1/4) along the stronger axis; a bound keeps its slope finite.
    stretch = jnp.maximum(ratio, most**-2.0) ** 0.25
    stretched = jnp.stack([values[..., 0] * stretch**2, values[..., 1] / stretch**2], -1)
    even = hessian_norm(stretched[..., None] * jnp.eye(2, dtype=stretched.dtype), "mean")
    R = radius_for(even, tolerance, definition=definition, value=value, dims=2)
    return jnp.stack([R * stretch, R / stretch], -1), axes


def elliptic_regions(
    H: Float[Array, "... 2 2"],
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
        H: Hessian of irradiance in the tangent plane [W/m^4].
        tolerance: the error that is accepted, positive.
        low: shortest semi-axis, positive [m].
        high: longest, finite [m].
        definition: what is meant by error, one of `DEFINITIONS`.
        value: E at the record, for "relative".
        most: largest ratio of the axes, before the limits act.
        printed: whether to use J12's axes.

    Returns:
        Their matrices, and what acted: raised if the shorter axis was, else cut if the longer was.

    Raises:
        ValueError: as `semi_axes` and `clamped` do.

    Reference: J12 eq. 73, corrected.
    """
    lengths, axes = semi_axes(
        H, tolerance, definition=definition, value=value, most=most, printed=printed
    )
    held = clamped(lengths, low, high)
    raised = jnp.any(held.clamp == RAISED, axis=-1)
    cut = jnp.any(held.clamp == CUT, axis=-1)
    code = jnp.where(raised, RAISED, jnp.where(cut, CUT, FREE))
    # Symmetric, so that a circle is a multiple of the identity.
    return ValidityRegion((axes / held.radius[..., None, :]) @ jnp.swapaxes(axes, -1, -2), code)


def surface_expected_error(
    H: Float[Array, "... 2 2"], matrix: Float[Array, "... 2 2"]
) -> Float[Array, "..."]:
    """The total error that the Hessian expects within an ellipse: (68), in closed form.

    With `S = matrix^-1` the ellipse is the image of the unit disc, and the error is
    `(pi / 4) |det S| k`, k the mean curvature of `S^T H S`.

    Args:
        H: Hessian of irradiance in the tangent plane [W/m^4].
        matrix: of the ellipse, as in `ValidityRegion` [1/m].

    Reference: J12 eq. 68, integrated.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import surface_expected_error
        >>> round(surface_expected_error(jnp.eye(2) * 4.0, jnp.eye(2)).item(), 6)
        3.141593
    """
    det = matrix[..., 0, 0] * matrix[..., 1, 1] - matrix[..., 0, 1] * matrix[..., 1, 0]
    turned = jnp.stack(
        [
            jnp.stack([matrix[..., 1, 1], -matrix[..., 0, 1]], -1),
            jnp.stack([-matrix[..., 1, 0], matrix[..., 0, 0]], -1),
        ],
        -2,
    )
    S = turned / det[..., None, None]
    k = hessian_norm(jnp.swapaxes(S, -1, -2) @ H @ S, "mean")
    return 0.25 * math.pi * k / jnp.abs(det)


def largest_radiance(radiances: Any, quantile: float = 1.0) -> Float[Array, ""]:
    """The largest radiance in a scene, from samples: of photons, of gather rays, of emitters.

    The largest of n noisy samples grows with n. With a quantile below 1 it does not, but is no
    bound either; since one factor for all radii changes no ranking, this often matters little.

    Args:
        radiances: samples, of any shape, not negative [W/(m^2 sr)].
        quantile: share of samples that it exceeds, 1 for the maximum.

    Raises:
        ValueError: if a radiance is negative, or the quantile is not within (0, 1].

    Reference: J12 footnote 2 (the maximum of the photons' precomputed radiances).

    Example:
        >>> from firstorder.caching import largest_radiance
        >>> largest_radiance([0.5, 2.0, 1.0]).item()
        2.0
    """
    samples = as_float(jnp.asarray(radiances))
    check_not_negative("radiances", samples)
    if not 0.0 < quantile <= 1.0:
        raise ValueError(f"Argument `quantile` must lie in (0, 1], but is {quantile!r}.")
    return jnp.quantile(jnp.ravel(samples), quantile)


def _positive_part(H: Float[Array, "... 2 2"]) -> Float[Array, "... 2 2"]:
    """Symmetric matrices with their negative eigenvalues set to zero."""
    mean, d, b = _parts(H)
    apart = _length(d, b)
    high, low = mean + apart, mean - apart
    eye = jnp.eye(2, dtype=H.dtype)
    mixed = (high > 0.0) & (low < 0.0)
    safe = jnp.where(mixed, apart, 1.0)
    scale = jnp.where(mixed, high / (2.0 * safe), 0.0)[..., None, None]
    projected = scale * (H - jnp.where(mixed, low, 0.0)[..., None, None] * eye)
    return jnp.where(mixed[..., None, None], projected, jnp.where(low[..., None, None] >= 0, H, 0))


def geometric_bound(
    hessians: Float[Array, "... k 2 2"], weights: ArrayLike = 1.0
) -> Float[Array, "... 2 2"]:
    """A matrix B with `|x^T H x| <= L x^T B x` for all light with radiances between 0 and L.

    The printed bound replaces every radiance by its maximum. But the geometry term curves both
    ways, and what cancels under even light need not under uneven: in a closed room the printed
    Hessian is zero. Here the pieces are added apart by sign, `P = sum w H_+` and
    `N = sum w (-H)_+`, the two extremes of any light; `B = (P + N + |P - N|) / 2` is above both.
    Visibility is held fixed, as there.

    Args:
        hessians: of the geometry term, one for each ray or piece of surface [1/m^4 times area].
        weights: of the pieces, not negative.

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
    w = jnp.broadcast_to(as_float(weights), hessians.shape[:-2])[..., None, None]
    up = jnp.sum(w * _positive_part(hessians), axis=-3)
    down = jnp.sum(w * _positive_part(-hessians), axis=-3)
    difference = up - down
    size = _positive_part(difference) + _positive_part(-difference)
    return 0.5 * (up + down + size)
