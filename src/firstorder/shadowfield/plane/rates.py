"""Sampling rates of the shadow light field at which replicas miss the filter.

Samples on a grid over (x, y) repeat the spectrum at all multiples of the two rates. Reconstruction
is right if no replica of the blockers' wedge overlaps the filter. E11's Appendix B gives the rate
along the receiver; the one along the light that it prints clears one corner of the filter and not
the opposite one, and is corrected here.
"""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_count,
    check_finite,
    check_not_negative,
    check_one,
    check_positive,
    check_shape,
    nan_unless,
)
from firstorder._display import Module
from firstorder.shadowfield.plane.filters import RayFilter, _check_beyond
from firstorder.shadowfield.plane.spectra import Wedge
from firstorder.typing import Scalar, as_float


class SamplingRates(Module):
    """Samples for each metre along the receiver (x) and along the light (y).

    Attributes:
        x: [1/m].
        y: [1/m].

    Raises:
        ValueError: if one is not one real number, or negative.

    Example:
        >>> from firstorder.shadowfield import SamplingRates
        >>> SamplingRates(6.0, 4.0).x.item()
        6.0
    """

    x: Scalar = eqx.field(converter=as_float)
    y: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse what are no two rates."""
        for name, rate in vars(self).items():
            check_one(name, rate)
            check_not_negative(name, rate)


def wedge_corners(d1, d2_min, d2_max, Omega_g) -> Float[Array, "3 2"]:
    """The wedge's half with Omega_x > 0, cut at the blockers' band limit: a triangle.

    A wave of frequency Omega_g on a plane at depth d2 stands at
    `Omega_g (d2 / d1, 1 - d2 / d1)` over (x, y). The other half is its mirror image in zero.

    Args:
        d1: distance of the receiver from the light [m].
        d2_min: distance of the nearest blocker from the light [m].
        d2_max: distance of the farthest one [m].
        Omega_g: band limit of the blockers on their own planes [cycles/m].

    Returns:
        Zero and the two other corners, (Omega_x, Omega_y) each [cycles/m].

    Raises:
        ValueError: if a distance or the band limit is not positive.

    Reference: E11 App. B.

    Example:
        >>> from firstorder.shadowfield import wedge_corners
        >>> wedge_corners(1.0, 0.25, 0.5, 8.0).tolist()
        [[0.0, 0.0], [2.0, 6.0], [4.0, 4.0]]
    """
    check_positive("Omega_g", Omega_g)
    wedge = Wedge(d2_min, d2_max)
    ends = [as_float(Omega_g) * wedge.direction(d2, d1) for d2 in (d2_min, d2_max)]
    return jnp.stack([jnp.zeros_like(ends[0]), *ends])


def receiver_rate(filter: RayFilter, corners: Float[ArrayLike, "3 2"]) -> Scalar:
    """`Omega_x* = Omega_x_max + Omega_y_max / a`: wedge and filter, side by side along Omega_x.

    Enough whatever the rate along the light, and needed if that may be anything: no replica that is
    shifted along Omega_x then meets the filter.

    Args:
        filter: sheared or simple.
        corners: of the wedge (`wedge_corners`) [cycles/m].

    Reference: E11 eq. 17, where `Omega_x_max = Omega_g d2_max / d1`, `a = d1 / d2_max - 1`.

    Example:
        >>> from firstorder.shadowfield import receiver_rate, sheared_filter, wedge_corners
        >>> k = sheared_filter(1.0, 0.25, 0.5, Omega_y_max=2.0, Omega_pix=16.0)
        >>> round(float(receiver_rate(k, wedge_corners(1.0, 0.25, 0.5, 8.0))), 12)
        6.0
    """
    corners = _three(corners)
    return jnp.max(corners[:, 0]) + jnp.max(filter.corners()[:, 0])


def light_rate(filter: RayFilter, corners: Float[ArrayLike, "3 2"]) -> Scalar:
    """Least rate along the light at which no replica shifted along Omega_y meets the filter.

    The largest t for which (0, t) is a sum of a point of the filter and one of the wedge (either
    half). Both are convex, so that is where the hull of the sums of their corners meets the axis.

    Args:
        filter: sheared or simple.
        corners: of the wedge (`wedge_corners`) [cycles/m].

    Reference: E11 eq. 18, corrected: see `light_rate_of_endless_wedge`.

    Example:
        >>> from firstorder.shadowfield import light_rate, sheared_filter, wedge_corners
        >>> k = sheared_filter(1.0, 0.25, 0.5, Omega_y_max=2.0, Omega_pix=16.0)
        >>> round(light_rate(k, wedge_corners(1.0, 0.25, 0.5, 8.0)).item(), 9)
        4.0
    """
    corners = _three(corners)
    return jnp.maximum(*(_height(filter.corners(), s * corners) for s in (1.0, -1.0)))


def light_rate_of_endless_wedge(d1, d2_min, d2_max, Omega_y_max) -> Scalar:
    """`Omega_y* = Omega_y_max b (1/a - 1/b)`, for blockers without band limit.

    With `a = d1 / d2_max - 1 < b = d1 / d2_min - 1`; the same is `Omega_y_max (b/a - 1)`. The
    replica's lower edge has slope b where Omega_x < 0, and must pass above the filter's corner
    (-Omega_y_max / a, -Omega_y_max). E11 has a in front of the bracket: `Omega_y_max (1 - a/b)`
    clears the corner on the other side only.

    Raises:
        ValueError: if a distance or the band limit is not positive, or `d1` not beyond the
            blockers: there is no sheared filter then. NaN if they are traced.

    Reference: E11 eq. 18, corrected.

    Example:
        >>> from firstorder.shadowfield import light_rate_of_endless_wedge
        >>> round(light_rate_of_endless_wedge(1.0, 1 / 3, 2 / 3, 1.0).item(), 12)  # a = 1/2, b = 2
        3.0
    """
    check_positive("Omega_y_max", Omega_y_max)
    wedge = Wedge(d2_min, d2_max)
    _check_beyond(d1, d2_max, "among the blockers there is no sheared filter.")
    a, b = wedge.slopes(d1)
    high = as_float(Omega_y_max)
    ok = (a > 0) & (b >= a) & (high > 0)
    a, b = jnp.where(ok, a, 1.0), jnp.where(ok, b, 2.0)
    return nan_unless(ok, high * b * (1.0 / a - 1.0 / b))


def sampling_rates(filter: RayFilter, corners: Float[ArrayLike, "3 2"]) -> SamplingRates:
    """Both rates; together they keep every replica off the filter.

    Replicas shifted along Omega_x miss it by the first rate, whatever their shift along Omega_y;
    the others by the second.

    Args:
        filter: sheared or simple.
        corners: of the wedge (`wedge_corners`) [cycles/m].

    Reference: E11 App. B.

    Example:
        >>> from firstorder.shadowfield import sampling_rates, sheared_filter, wedge_corners
        >>> k = sheared_filter(1.0, 0.25, 0.5, Omega_y_max=2.0, Omega_pix=16.0)
        >>> round(sampling_rates(k, wedge_corners(1.0, 0.25, 0.5, 8.0)).x.item(), 9)
        6.0
    """
    return SamplingRates(receiver_rate(filter, corners), light_rate(filter, corners))


def samples_per_receiver(filter: RayFilter, rates: SamplingRates) -> Scalar:
    """Number of samples under the filter: the density of samples over its area in frequency.

    A footprint has the area `1 / area` in space. E11 divides the rates by the filter's "volume in
    (x1, x2, y1, y2)", which has the unit of a density squared: the volume meant is that in
    frequency. In space, with two coordinates each, the count is the square.

    Reference: E11 App. B.

    Example:
        >>> from firstorder.shadowfield import SamplingRates, axis_aligned_filter
        >>> from firstorder.shadowfield import samples_per_receiver
        >>> k = axis_aligned_filter(2.0, 8.0)  # 16 by 4 cycles/m
        >>> samples_per_receiver(k, SamplingRates(32.0, 8.0)).item()
        4.0
    """
    return rates.x * rates.y / filter.area


def replicas_overlap(filter: RayFilter, corners, rates: SamplingRates, reach: int = 24) -> bool:
    """Whether some replica of the wedge overlaps the filter: by brute force over all shifts.

    On the host, by separating axes. Sets that touch do not overlap; the line of energy of blockers
    at a single depth overlaps what it runs through.

    Args:
        filter: sheared or simple.
        corners: of the wedge (`wedge_corners`).
        rates: of the samples.
        reach: replicas in each direction that are looked at.

    Raises:
        ValueError: if `reach` is no positive integer, or a corner is not finite.

    Example:
        >>> from firstorder.shadowfield import SamplingRates, replicas_overlap, sampling_rates
        >>> from firstorder.shadowfield import sheared_filter, wedge_corners
        >>> k = sheared_filter(1.0, 0.25, 0.5, Omega_y_max=2.0, Omega_pix=16.0)
        >>> wedge = wedge_corners(1.0, 0.25, 0.5, 8.0)
        >>> enough, few = sampling_rates(k, wedge), SamplingRates(1.0, 1.0)
        >>> [replicas_overlap(k, wedge, rates, 3) for rates in (enough, few)]
        [False, True]
    """
    check_count("reach", reach)
    check_finite("corners", corners)
    body = np.asarray(filter.corners())
    half = np.asarray(_three(corners))
    for m in range(-reach, reach + 1):
        for n in range(-reach, reach + 1):
            shift = np.array([m * float(rates.x), n * float(rates.y)], half.dtype)
            if (m, n) != (0, 0) and any(_meet(body, s * half + shift) for s in (1.0, -1.0)):
                return True
    return False


def _height(body: Float[Array, "k 2"], other: Float[Array, "m 2"]) -> Scalar:
    """Height at which the upper hull of all sums of two sets of corners meets the axis x = 0.

    Of all chords between sums on either side, the highest.
    """
    points = (body[:, None] + other).reshape(-1, 2)
    x, y = points[:, 0], points[:, 1]
    beside = (x[:, None] > 0.0) | (x < 0.0)
    run = jnp.where(beside, 1.0, x - x[:, None])
    upright = run == 0.0
    t = jnp.where(upright, 0.0, -x[:, None]) / jnp.where(upright, 1.0, run)
    met = jnp.where(upright, jnp.maximum(y, y[:, None]), y[:, None] + t * (y - y[:, None]))
    return jnp.max(jnp.where(beside, -jnp.inf, met))


def _meet(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two convex polygons share more than their borders; one may be as thin as a line."""
    scale = max(np.abs(a).max(), np.abs(b).max())
    # Corners and shifts are rounded to their own precision.
    epsilon = max(1e-9, 64.0 * float(max(np.finfo(x.dtype).eps for x in (a, b)))) * scale
    for polygon in (a, b):
        sides = np.roll(polygon, -1, 0) - polygon
        for side in sides[np.any(sides != 0.0, axis=1)]:
            normal = np.array([-side[1], side[0]]) / np.linalg.norm(side)
            first, second = a @ normal, b @ normal
            if min(first.max() - second.min(), second.max() - first.min()) <= epsilon:
                return False
    return True


def _three(corners: Any) -> Float[Array, "3 2"]:
    """Three corners, as `wedge_corners` gives them."""
    corners = as_float(corners)
    check_shape("corners", corners, (3, 2))
    return corners
