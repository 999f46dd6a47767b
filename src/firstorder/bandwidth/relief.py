"""Waves in flatland under light of a given band: when they are geometry, bumps, or a BRDF.

Waves of a surface, `h(x) = a sin(2 pi f x)`, mirror light to a distant eye. Three things can stand
for them, and each drops something:

    flat     no relief at all             drops the turn of the normals and the parallax
    bumps    its normals on a flat base   drops the parallax: meso-geometry
    a BRDF   the normals' distribution    drops their places too: micro-geometry

What none of the three can replace is macro-geometry. The errors follow from the calculus. Over a
height h the light travels, which shifts it by `h (tan theta_in - tan theta_out)` along the base,
`2 pi Omega_x` radians of phase per metre; a normal that turns by n mirrors light from 2 n farther
away, `4 pi Omega_theta` radians of phase per radian. The bounds are those of any shape, in
`relief_shapes`.
"""

from __future__ import annotations

from jaxtyping import Array, Float

from firstorder.bandwidth.relief_numbers import Relief
from firstorder.bandwidth.relief_shapes import (
    ReliefCutoffs,
    brdf_shape_error,
    bump_shape_error,
    flat_shape_error,
    shape_cutoffs,
)
from firstorder.typing import RealLike


def flat_relief_error(
    amplitude: RealLike,
    frequency: RealLike,
    cutoff: RealLike,
    cutoff_x: RealLike,
    *,
    view: RealLike,
    reach: RealLike,
) -> Float[Array, "..."]:
    """How far a flat mirror may be from one in waves, relative to the light's amplitude.

    `2 pi (cutoff_x a (|tan view| + tan reach) + 2 cutoff m)` with the largest slope `m = 2 pi f a`:
    the parallax, and the normals' turn, doubled by the mirror. At most 2.

    A bound, for light of one frequency or of all up to the cutoffs; its amplitude is then the sum
    of all amplitudes, which is its peak if the spectrum is positive. It is 2 where light is
    shadowed, `m tan reach >= 1`: there the relief sees itself. Arguments are numbers, or arrays
    that broadcast.

    Args:
        amplitude: a, of the height [m].
        frequency: f, of the waves [cycles per metre].
        cutoff: angular frequency of the light, or of the lobe if it ends before [cycles per rad].
        cutoff_x: frequency of the light along the base [cycles per metre]; 0 for distant light, and
            `cutoff / d` for a lamp that stands at a distance d.
        view: angle from the base's normal to the eye, in (-pi / 2, pi / 2) [rad].
        reach: largest angle of the light that counts, from 0 to below pi / 2: `|view|`, twice the
            normals' largest turn and half the lobe's width, together [rad].

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §7 ("the frequency cutoff for micro, meso, and macro-geometry"), which asks.

    Example:
        >>> from firstorder.bandwidth import flat_relief_error
        >>> round(flat_relief_error(1e-4, 10.0, 1.0, 0.0, view=0.0, reach=0.1).item(), 4)
        0.079
    """
    waves = Relief.waves(amplitude, frequency)
    return flat_shape_error(waves, cutoff, cutoff_x, view=view, reach=reach)


def bump_relief_error(
    amplitude: RealLike,
    frequency: RealLike,
    cutoff: RealLike,
    cutoff_x: RealLike,
    *,
    view: RealLike,
    reach: RealLike,
) -> Float[Array, "..."]:
    """How far bumps on a flat base may be from waves, relative to the light's amplitude.

    `2 pi (cutoff_x a (|tan view| + tan reach) + 2 cutoff m^2 |tan view|)` with `m = 2 pi f a`: the
    light's parallax, and the eye's, by which it sees the normal of a place `a |tan view|` away.

    The second term depends on the slope alone. Seen from the side, waves of one slope keep an error
    however small they are. Bound, arguments and errors as in `flat_relief_error`.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import bump_relief_error
        >>> bump_relief_error(0.01, 1.0, 9.0, 0.0, view=0.0, reach=0.2).item()  # seen from above
        0.0
    """
    waves = Relief.waves(amplitude, frequency)
    return bump_shape_error(waves, cutoff, cutoff_x, view=view, reach=reach)


def brdf_relief_error(
    amplitude: RealLike,
    frequency: RealLike,
    cutoff: RealLike,
    cutoff_x: RealLike,
    *,
    width: RealLike,
    view: RealLike,
    reach: RealLike,
) -> Float[Array, "..."]:
    """How far a BRDF may be from waves that a pixel averages, relative to the light's amplitude.

    `p^2 / 4 + sqrt(2 / (1 - q^6)) s q`, where

        p = 2 pi cutoff_x a (|tan view| + tan reach)              the largest phase of the parallax
        s = min(1, sqrt((4 pi cutoff m)^2 / 2 + p^2 / 2))         RMS of all phases, m = 2 pi f a
        q = exp(-2 pi^2 w^2 (f - cutoff_x)^2)                     what the pixel leaves of one wave

    The waves multiply the light by something periodic. So the pixel gets its mean and what the
    filter leaves of its harmonics, by Cauchy and Schwarz. Parallax changes the mean in second order
    only: about the steepest place heights are odd and normals even, so a trough undoes a crest.

    The BRDF's normals are those that the eye *sees*, `relief_transfer`: with all normals alike it
    errs by the slope times `|tan view|`, however fine the relief. Bound, arguments and errors as in
    `flat_relief_error`; it is 2 if `f <= cutoff_x`, or if the eye sees no part of some waves.

    Args:
        amplitude: as in `flat_relief_error` [m].
        frequency: as there [cycles per metre].
        cutoff: as there [cycles per rad].
        cutoff_x: as there [cycles per metre].
        width: standard deviation w of the pixel's Gaussian filter on the base [m].
        view: as in `flat_relief_error` [rad].
        reach: as there [rad].

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import brdf_relief_error
        >>> error = lambda f: brdf_relief_error(1e-3, f, 2.0, 0.0, width=0.01, view=0.0, reach=0.4)
        >>> print(f"{error(5.0):.2f} {error(50.0):.2f}")  # waves of 20 pixels, and of 2
        1.48 0.01
    """
    waves = Relief.waves(amplitude, frequency)
    return brdf_shape_error(waves, cutoff, cutoff_x, width=width, view=view, reach=reach)


def relief_cutoffs(
    share: RealLike,
    frequency: RealLike,
    cutoff: RealLike,
    cutoff_x: RealLike,
    *,
    width: RealLike,
    view: RealLike,
    reach: RealLike,
) -> ReliefCutoffs:
    """Up to which amplitudes waves may be replaced, for an error of at most a share of the light.

    The bounds of `flat_relief_error`, `bump_relief_error` and `brdf_relief_error`, solved for the
    amplitude; none of them beyond `1 / (2 pi f tan reach)`, where the relief shadows itself. Above
    all three it is geometry. Safe, not sharp: the bounds add up what seldom meets.

    Args:
        share: the error to be allowed, in (0, 1), relative to the light's amplitude.
        frequency: of the waves, numbers or an array [cycles per metre].
        cutoff: as in `flat_relief_error` [cycles per rad].
        cutoff_x: as there [cycles per metre].
        width: standard deviation of the pixel's Gaussian filter on the base [m].
        view: as in `flat_relief_error` [rad].
        reach: as there [rad].

    Returns:
        Amplitudes in metres, and the frequency at which a pixel averages the steepest waves;
        infinite where nothing limits them.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import relief_cutoffs
        >>> found = relief_cutoffs(0.1, 20.0, 2.0, 0.5, width=0.01, view=0.5, reach=0.7)
        >>> print(f"{1e3 * found.flat:.3f} {1e3 * found.bumps:.2f} mm, {found.frequency:.0f} / m")
        0.032 0.67 mm, 37 / m
    """
    waves = Relief.waves(1.0, frequency)  # per metre of amplitude
    return shape_cutoffs(share, waves, cutoff, cutoff_x, width=width, view=view, reach=reach)
