"""Pits under light of a given band: relief so steep that it shadows itself and lights itself.

Below a plane lie pits of any shape and depth, of any material that creates no energy; between them
the surface touches the plane. A distant eye looks at the plane at u. What it sees is a sum over the
light L that comes in by the opening of the same pit, with weights that are not negative:

    seen(u) = sum over places x of the opening and directions w of K(u; x, w) L(x, w)

for each bounce weighs light with a BRDF, and every way out of the pit leads through its opening.
The weights add up to what the eye sees under light that is 1 everywhere: no more than the albedo,
by induction over the bounces. And `|x - u|` is no more than the opening is wide. So light that
varies slowly along the plane hardly knows where in the opening it comes in, however deep the pit,
however often light is sent on, and however fast it varies with its direction:

    texture  a BRDF for each place u      drops the way along the plane inside the pit
    a BRDF   their mean over a period     drops the places too
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_between,
    check_inside,
    check_not_negative,
    check_positive,
    nan_unless,
)
from firstorder._display import in_print
from firstorder.bandwidth._harmonics import (
    averaged_from,
    check_frequency_across,
    left_by_pixel,
    over,
)
from firstorder.typing import RealLike, as_float


class PitCutoffs(NamedTuple):
    """Openings of pits up to which something simpler stands for them [m].

    Attributes:
        texture: up to here a BRDF for each place does, the light's way inside a pit left out.
        brdf: up to here their mean does, averaged over a pixel; 0 where the pixel sees the pits.
        frequency: from here on a pixel averages pits of any kind, if their parallax is nothing; in
            cycles per metre.

    Example:
        >>> from firstorder.bandwidth import PitCutoffs
        >>> PitCutoffs(0.1, 0.2, 3.0).brdf
        0.2
    """

    texture: Float[Array, "..."]
    brdf: Float[Array, "..."]
    frequency: Float[Array, "..."]

    __repr__ = in_print


def pit_texture_error(
    opening: RealLike, cutoff_x: RealLike, *, albedo: RealLike = 1.0
) -> Float[Array, "..."]:
    """How far BRDFs, one for each place, may be from pits, relative to the light's amplitude.

    `2 albedo sin(min(pi cutoff_x opening, pi / 2))`: light that comes in an opening's width away
    from the place that the eye looks at. It is reached: a right-angled groove of two mirrors sends
    light that comes in at its one end out at the other.

    A bound, for pits of any shape, depth and material that create no energy, and for any light up
    to the cutoff along the plane that the pits open in; its amplitude is as in `flat_shape_error`.
    Of grooves in space it holds for light that does not vary along them, by their width.

    Args:
        opening: the largest distance of two points of one pit's opening [m].
        cutoff_x: frequency of the light along the plane, as in `flat_shape_error` [cycles per
            metre].
        albedo: the most that a point of the surface sends any way, under light that is 1 from
            everywhere, in [0, 1]; of a reciprocal BRDF it is the largest share of any light that
            is reflected.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §7 ("local shadowing"), which asks.

    Example:
        >>> from firstorder.bandwidth import pit_texture_error
        >>> round(pit_texture_error(0.01, 2.0, albedo=0.5).item(), 4)  # 20 pits a wave
        0.0628
    """
    D, Bx, rho, valid = _checked(opening, cutoff_x, albedo)
    return nan_unless(valid, rho * _chord(D * Bx))


def pit_brdf_error(
    opening: RealLike,
    frequency: RealLike,
    cutoff_x: RealLike,
    *,
    width: RealLike,
    frequency_across: RealLike = np.inf,
    albedo: RealLike = 1.0,
    share: RealLike = 1.0,
) -> Float[Array, "..."]:
    """How far one BRDF may be from pits that a pixel averages, relative to the light's amplitude.

    `albedo (share 2 sin(min(pi cutoff_x opening, pi / 2)) + sqrt(t + u + t u))`, at most
    `2 albedo`, with t and u what the pixel leaves of harmonics along the two frequencies, as in
    `brdf_shape_error`: pits multiply light by something periodic of at most the albedo.

    The BRDF is the mean over a period of what the eye sees under light that is the same all along
    the plane. Bound as in `pit_texture_error`; it is `2 albedo` if a frequency is not above
    `cutoff_x`. It is that of the worst pit, safe and not sharp: ways to the left and to the right
    cancel in most, and of random ones it is some ten times too large.

    Args:
        opening: as in `pit_texture_error` [m].
        frequency: of the pits, as of a `Relief` [cycles per metre].
        cutoff_x: as in `pit_texture_error` [cycles per metre].
        width: standard deviation of the pixel's Gaussian filter on the plane, the smaller one if
            it has two [m].
        frequency_across: as of a `Relief` [cycles per metre].
        albedo: as in `pit_texture_error`.
        share: of the plane that is open, in [0, 1].

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import pit_brdf_error
        >>> error = lambda w: pit_brdf_error(0.01, 100.0, 1.0, width=w, albedo=0.5).item()
        >>> print(f"{error(0.001):.2f} {error(0.01):.3f}")  # a tenth of a pit, and a pit
        0.73 0.031
    """
    D, Bx, rho, valid = _checked(opening, cutoff_x, albedo)
    check_not_negative("frequency", frequency)
    check_frequency_across(frequency_across)
    check_positive("width", width)
    check_between("share", share, 0.0, 1.0)
    f, across, w, s = (as_float(a) for a in (frequency, frequency_across, width, share))
    valid &= (f >= 0) & (across > 0) & (w > 0) & (s >= 0) & (s <= 1)
    error = s * _chord(D * Bx) + left_by_pixel(w, Bx, f, across)
    return nan_unless(valid, rho * jnp.minimum(error, 2.0))


def pit_cutoffs(
    share: RealLike,
    frequency: RealLike,
    cutoff_x: RealLike,
    *,
    width: RealLike,
    frequency_across: RealLike = np.inf,
    albedo: RealLike = 1.0,
) -> PitCutoffs:
    """Up to which openings pits may be replaced, for an error of at most a share of the light.

    The bounds of `pit_texture_error` and `pit_brdf_error` of a plane that is all pits, solved for
    the opening. Above both the pits are geometry, to be traced.

    Args:
        share: the error to be allowed, in (0, 1), relative to the light's amplitude.
        frequency: of the pits, as of a `Relief` [cycles per metre].
        cutoff_x: as in `pit_texture_error` [cycles per metre].
        width: standard deviation of the pixel's Gaussian filter on the plane [m].
        frequency_across: as of a `Relief` [cycles per metre].
        albedo: as in `pit_texture_error`; of black pits nothing limits the opening.

    Returns:
        Openings in metres, and the frequency from which a pixel averages; infinite where nothing
        limits them.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import pit_cutoffs
        >>> found = pit_cutoffs(0.1, 100.0, 1.0, width=0.01, albedo=0.5)
        >>> print(f"{1e3 * found.texture:.1f} {1e3 * found.brdf:.1f} mm, {found.frequency:.0f} / m")
        31.9 31.9 mm, 32 / m
    """
    check_inside("share", share, 0.0, 1.0)
    _, Bx, rho, valid = _checked(0.0, cutoff_x, albedo)
    check_not_negative("frequency", frequency)
    check_frequency_across(frequency_across)
    check_positive("width", width)
    given = (share, frequency, frequency_across, width)
    e, f, across, w = (as_float(a) for a in given)
    valid &= (e > 0) & (e < 1) & (f >= 0) & (across > 0) & (w > 0)
    e = over(e, rho)  # of what is sent on at all
    left = jnp.where(e < 2.0, left_by_pixel(w, Bx, f, across), 0.0)  # no error is above 2
    brdf = jnp.where(left < e, e - jnp.where(left < e, left, 0.0), 0.0)
    pixel = averaged_from(jnp.minimum(e, 1.0), jnp.isfinite(across)) / w
    found = PitCutoffs(_wide(e, Bx), _wide(brdf, Bx), Bx + pixel + 0.0 * f)
    return PitCutoffs(*(nan_unless(valid, a) for a in found))


def _checked(opening, cutoff_x, albedo) -> tuple[Array, Array, Array, Array]:
    """Numbers of pits and light, and whether they can be."""
    check_not_negative("opening", opening)
    check_not_negative("cutoff_x", cutoff_x)
    check_between("albedo", albedo, 0.0, 1.0)
    D, Bx, rho = (as_float(a) for a in (opening, cutoff_x, albedo))
    return D, Bx, rho, (D >= 0) & (Bx >= 0) & (rho >= 0) & (rho <= 1)


def _chord(cycles: Array) -> Array:
    """How far two phases are apart that differ by up to so many cycles."""
    return 2.0 * jnp.sin(np.pi * jnp.minimum(cycles, 0.5))


def _wide(error: Array, cutoff_x: Array) -> Array:
    """Opening at which the chord is an error; infinite if it cannot be so long."""
    short = error < 2.0
    cycles = jnp.where(short, jnp.arcsin(0.5 * jnp.where(short, error, 1.0)) / np.pi, jnp.inf)
    finite = short & (cutoff_x > 0)
    wide = jnp.where(short, cycles, 1.0) / jnp.where(cutoff_x > 0, cutoff_x, 1.0)
    return jnp.where(finite, wide, jnp.where(cycles > 0, jnp.inf, 0.0))
