"""Periodic blockers: their waves in the shadow, and when average occlusion is accurate.

A plane of bars of period p at depth d2 throws on the receiver waves of period p d1 / d2. Wave n
has the height of its Fourier coefficient times the light's spectrum at `(1 - d2/d1) n / p`: a
light that is wide against the bars, seen through them, averages them away. That holds for one
plane. Two planes whose periods look alike from the receiver leave a moire of full height however
fine they are.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from firstorder._argument_checks import check_between, check_positive, is_concrete, nan_unless
from firstorder.fields.spectrum import Spectrum
from firstorder.typing import Scalar, as_float


def _bars_coefficient(harmonic, open) -> Float[Array, "*n"]:
    """Fourier coefficient of an endless grating, open on the fraction `open` about zero.

    `c_n = sin(pi n open) / (pi n)`, and `c_0 = open`.
    """
    open = as_float(open)
    return open * jnp.sinc(as_float(harmonic) * open)


def shadow_harmonic(harmonic, period, open, light: Spectrum, d1, d2) -> Array:
    """Complex height of one wave of the shadow: `c_n L(-(1 - d2/d1) n / p)`.

    `h(x) = sum_n h_n exp(2 pi i n x d2 / (d1 p))`; the form factor is left out.

    Args:
        harmonic: number n of the wave; 0 for the average.
        period: p of the bars, on their own plane [m].
        open: fraction of a period that is open.
        light: spectrum L of the light's intensity over `PLANE`.
        d1: distance of the receiver from the light [m].
        d2: distance of the bars from the light, less than d1 [m].

    Returns:
        One complex number.

    Raises:
        ValueError: if a length is not positive, `d2 < d1` does not hold or `open` is outside
            [0, 1].

    Reference: D05 §3.4 ("most high frequencies are effectively removed by integration"); E11 eq. 8.

    Example:
        >>> from firstorder.fields import BoxProfile, Separable
        >>> from firstorder.shadowfield import PLANE, shadow_harmonic
        >>> light = Separable([0.0], (BoxProfile(0.5, "y", PLANE),)).spectrum()
        >>> coarse, fine = (abs(shadow_harmonic(1, p, 0.5, light, 1.0, 0.5)) for p in (4.0, 0.15))
        >>> round(float(coarse), 3), round(float(fine), 3)
        (0.31, 0.026)
    """
    _check(period, d1, d2)
    check_between("open", open, 0.0, 1.0)
    n, period, open, d1, d2 = (as_float(a) for a in (harmonic, period, open, d1, d2))
    ok = _in_order(period, d1, d2) & (open >= 0) & (open <= 1)
    Omega = nan_unless(ok, -(1.0 - d2 / d1) * n / period)
    return _bars_coefficient(n, open) * light(Omega)


def average_occlusion_bound(period, open, width, d1, d2) -> Scalar:
    """Largest error of the average occlusion, relative to it: `(1 - open) p / ((1 - d2/d1) w)`.

    For a uniform light of width w. From one receiver the light is seen through a stretch of the
    bars of length `(1 - d2/d1) w`; whole periods of it pass exactly their share, and the rest, less
    than a period, at most `open (1 - open) p` too much or too little. Reached where the rest is one
    opening. A light with soft ends does better: its spectrum falls faster than the box's.

    Args:
        period: p of the bars [m].
        open: fraction of a period that is open.
        width: w of the light [m].
        d1: distance of the receiver from the light [m].
        d2: distance of the bars from the light, less than d1 [m].

    Raises:
        ValueError: if a length is not positive, `d2 < d1` does not hold or `open` is outside
            [0, 1].

    Reference: D05 §3.4 (average occlusion); the bound is ours.

    Example:
        >>> from firstorder.shadowfield import average_occlusion_bound
        >>> average_occlusion_bound(0.01, 0.5, 1.0, 1.0, 0.5).item()
        0.01
    """
    _check(period, d1, d2)
    check_positive("width", width)
    check_between("open", open, 0.0, 1.0)
    period, open, width, d1, d2 = (as_float(a) for a in (period, open, width, d1, d2))
    seen = (1.0 - d2 / d1) * width
    ok = _in_order(period, d1, d2) & (width > 0) & (open >= 0) & (open <= 1)
    return nan_unless(ok, (1.0 - open) * period / seen)


def coarsest_average_period(tolerance, open, width, d1, d2) -> Scalar:
    """The period up to which average occlusion is good to a relative tolerance, uniform light.

    `p = tolerance (1 - d2/d1) w / (1 - open)`, from `average_occlusion_bound`.

    Args:
        tolerance: of the irradiance, as a share of the average.
        open: fraction of a period that is open.
        width: w of the light [m].
        d1: distance of the receiver from the light [m].
        d2: distance of the bars from the light, less than d1 [m].

    Returns:
        A length on the bars' own plane [m].

    Raises:
        ValueError: if `tolerance` is not positive.

    Example:
        >>> from firstorder.shadowfield import coarsest_average_period
        >>> round(coarsest_average_period(0.1, 0.5, 1.0, 1.0, 0.5).item(), 9)
        0.1
    """
    check_positive("tolerance", tolerance)
    tolerance = as_float(tolerance)
    coarsest = tolerance / average_occlusion_bound(1.0, open, width, d1, d2)
    return nan_unless(tolerance > 0, coarsest)


def moire(x, period, d1, d2, other) -> Float[Array, "*n"]:
    """Share of an endless light that passes two matched planes of bars, each half open.

    A triangle wave between 0 and 1/2: the overlap of two combs, one slid by
    `x (other / (d1 - other) - d2 / (d1 - d2))` against the other, of the common period
    `p d1 / (d1 - d2)` on the light. Its height does not depend on p: no bars are fine enough for
    their average, 1/4.

    Args:
        x: positions on the receiver; at 0 both planes have the middle of an opening at 0 [m].
        period: of the plane at d2 [m].
        d1: distance of the receiver from the light [m].
        d2: distance of one plane from the light [m].
        other: distance of the second plane from the light [m].

    Raises:
        ValueError: if a length is not positive, or a plane is not before the receiver.

    Reference: E11 §7, Fig. 18 (a).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.shadowfield import moire
        >>> moire(jnp.array([0.0, 0.05, 0.1]), 0.1, 1.0, 0.25, 0.5).round(6).tolist()
        [0.5, 0.25, 0.0]
    """
    _check(period, d1, d2, other)
    x, period, d1, d2, other = (as_float(a) for a in (x, period, d1, d2, other))
    common = nan_unless(_in_order(period, d1, d2, other), period * d1 / (d1 - d2))
    slid = x * (other / (d1 - other) - d2 / (d1 - d2)) / common
    away = jnp.abs(slid - jnp.round(slid))
    return 0.5 - away


def moire_frequency(period, d1, d2, other) -> Scalar:
    """Frequency of `moire` along the receiver [cycles/m]: grows without limit for fine bars.

    Args:
        period: of the bars [m].
        d1: distance of the receiver from the light [m].
        d2: distance of the bars from the light [m].
        other: distance that is taken for d2 [m].

    Raises:
        ValueError: if a length is not positive, or a distance not less than `d1`.

    Example:
        >>> from firstorder.shadowfield import moire_frequency
        >>> [moire_frequency(p, 1.0, 0.5, 0.75).item() for p in (0.5, 0.25)]
        [2.0, 4.0]
    """
    _check(period, d1, d2, other)
    period, d1, d2, other = (as_float(a) for a in (period, d1, d2, other))
    slide = jnp.abs(other / (d1 - other) - d2 / (d1 - d2))
    ok = _in_order(period, d1, d2, other)
    return nan_unless(ok, slide * (d1 - d2) / (period * d1))


def _check(period, d1, *planes) -> None:
    """Lengths are positive, and the planes of bars stand between light and receiver."""
    check_positive("period", period)
    check_positive("d1", d1)
    for name, d in zip(("d2", "other"), planes, strict=False):
        check_positive(name, d)
        if is_concrete((d, d1)) and np.any(np.asarray(d) >= np.asarray(d1)):
            raise ValueError(f"Argument `{name}` must be less than `d1` = {d1}, but is {d}.")


def _in_order(period, d1, *planes) -> Bool[Array, "..."]:
    """Whether numbers, traced ones too, are as `_check` asks."""
    ok = (period > 0) & (d1 > 0)
    for d in planes:
        ok &= (d > 0) & (d < d1)
    return ok
