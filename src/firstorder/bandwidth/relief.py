"""Relief under light of a given band: when it is geometry, when bumps, and when a BRDF.

Waves of a surface, `h(x) = a sin(2 pi f x)`, mirror light to a distant eye. Three things can stand
for them, and each drops something:

    flat     no relief at all             drops the turn of the normals and the parallax
    bumps    its normals on a flat base   drops the parallax: meso-geometry
    a BRDF   the normals' distribution    drops their places too: micro-geometry

What none of the three can replace is macro-geometry. The errors follow from the calculus. Over a
height h the light travels, which shifts it by `h (tan theta_in - tan theta_out)` along the base,
`2 pi Omega_x` radians of phase per metre; a normal that turns by n mirrors light from 2 n farther
away, `4 pi Omega_theta` radians of phase per radian.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from firstorder._argument_checks import (
    check_below,
    check_between,
    check_finite,
    check_inside,
    check_not_negative,
    check_positive,
    nan_unless,
)
from firstorder._display import in_print
from firstorder.bandwidth._spectral_norm import reach as times
from firstorder.typing import RealLike, as_float

_PLACES = 512  # on a quarter of a wave; its harmonics fall below rounding before that
_MOST_TURNS = 200.0  # radians of phase by which a wave may modulate light


class ReliefCutoffs(NamedTuple):
    """Amplitudes up to which something simpler stands for relief of a frequency [m].

    Attributes:
        flat: up to here a flat surface does.
        bumps: up to here its normals do, on a flat base.
        brdf: up to here the distribution of its normals does, averaged over a pixel; 0 where the
            pixel sees the waves.
        frequency: from here on a BRDF does for relief of any slope, if its parallax is nothing;
            in cycles per metre.

    Example:
        >>> from firstorder.bandwidth import ReliefCutoffs
        >>> ReliefCutoffs(0.0, 0.1, 0.2, 3.0).bumps
        0.1
    """

    flat: Float[Array, "..."]
    bumps: Float[Array, "..."]
    brdf: Float[Array, "..."]
    frequency: Float[Array, "..."]

    __repr__ = in_print


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
    waves = _Waves(amplitude, frequency, cutoff, cutoff_x, view, reach)
    return waves.limited(waves.parallax + waves.turn)


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
    waves = _Waves(amplitude, frequency, cutoff, cutoff_x, view, reach)
    return waves.limited(waves.parallax + waves.shifted)


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
    check_positive("width", width)
    waves = _Waves(amplitude, frequency, cutoff, cutoff_x, view, reach)
    w, f = as_float(width), waves.frequency - waves.cutoff_x
    left, share = waves.left(w), jnp.minimum(1.0, waves.modulation)
    error = jnp.where(f > 0, 0.25 * waves.parallax**2 + times(share, left), 2.0)
    error = jnp.where(waves.slope * jnp.abs(jnp.tan(waves.view)) < 1.0, error, 2.0)
    return nan_unless(w > 0, waves.limited(error))


def relief_transfer(
    Omega: RealLike, slope: RealLike, view: RealLike = 0.0
) -> Complex[Array, "..."]:
    """Transfer of the BRDF of fine waves: the share of each angular frequency that it keeps.

    `T(Omega) = mean of exp(4 pi i Omega n) (1 + h' tan view)` over a wave, with `h' = m cos(phase)`
    and `n = arctan h'`: the transform of the mirrored normals' distribution, each by the area that
    it shows to the eye. The radiance towards the eye is `T(Omega)` times that of a flat mirror, and
    times the transform of the lobe if there is one, for these are convolutions.

    Near zero it is `1 + 2 pi i Omega m^2 tan view`: fine waves turn the mirror by half of
    `m^2 tan view`. Where slopes are small it is `J_0(4 pi Omega m)` and `i m tan view J_1` of it.

    Args:
        Omega: angular frequency of the light, numbers or an array [cycles per rad].
        slope: the largest, `m = 2 pi f a`, with `m |tan view| < 1`: the eye sees all of the waves.
        view: angle from the base's normal to the eye [rad].

    Raises:
        ValueError: if an argument lies outside its range, or `4 pi Omega arctan(m)` is above 200;
            traced ones give NaN.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import relief_transfer
        >>> print(f"{relief_transfer(0.5, 0.1).real:.3f} {relief_transfer(2.0, 0.1).real:.3f}")
        0.904 -0.052
    """
    check_finite("Omega", Omega)
    check_not_negative("slope", slope)
    check_inside("view", view, -0.5 * np.pi, 0.5 * np.pi)
    Omega, slope, view = jnp.broadcast_arrays(*(as_float(a) for a in (Omega, slope, view)))
    shown, turns = slope * jnp.abs(jnp.tan(view)), 4.0 * np.pi * Omega * jnp.arctan(slope)
    check_below("slope * |tan(view)|", shown, 1.0)
    check_between("4 pi Omega arctan(slope)", jnp.abs(turns), 0.0, _MOST_TURNS)
    rise, share = _quarter(slope[..., None])
    turned = 4.0 * np.pi * Omega[..., None] * jnp.arctan(rise)
    even = jnp.mean(share * jnp.cos(turned), -1)
    odd = jnp.mean(share * rise * jnp.sin(turned), -1)
    mean = even + 1j * jnp.tan(view) * odd
    valid = (slope >= 0) & (shown < 1) & (jnp.abs(view) < 0.5 * np.pi)
    valid &= jnp.abs(turns) <= _MOST_TURNS
    return mean * nan_unless(valid, jnp.ones_like(slope))


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
    check_positive("width", width)
    check_inside("share", share, 0.0, 1.0)
    waves = _Waves(1.0, frequency, cutoff, cutoff_x, view, reach)  # per metre of amplitude
    e, w = as_float(share), as_float(width)
    left, pixel = waves.left(w), _averaged(e) / w
    apart = waves.frequency > waves.cutoff_x
    steep = jnp.maximum(jnp.tan(waves.reach), jnp.abs(jnp.tan(waves.view)))
    lit = _over(1.0, waves.slope * jnp.tan(waves.reach))
    seen = _over(1.0, waves.slope * steep)
    valid = waves.valid & (w > 0) & (e > 0) & (e < 1)
    found = ReliefCutoffs(
        jnp.minimum(_over(e, waves.parallax + waves.turn), lit),
        jnp.minimum(_root(waves.parallax, waves.shifted, e), lit),
        jnp.minimum(jnp.where(apart, _broken_root(waves, left, e), 0.0), seen),
        waves.cutoff_x + pixel + 0.0 * waves.slope,
    )
    return ReliefCutoffs(*(nan_unless(valid, a) for a in found))


class _Waves:
    """Checked numbers of waves under light, and what the three errors share."""

    def __init__(self, amplitude, frequency, cutoff, cutoff_x, view, reach):
        check_not_negative("amplitude", amplitude)
        check_positive("frequency", frequency)
        check_not_negative("cutoff", cutoff)
        check_not_negative("cutoff_x", cutoff_x)
        check_inside("view", view, -0.5 * np.pi, 0.5 * np.pi)
        check_not_negative("reach", reach)
        check_below("reach", reach, 0.5 * np.pi)
        given = (amplitude, frequency, cutoff, cutoff_x, view, reach)
        a, f, B, Bx, view, reach = (as_float(g) for g in given)
        self.frequency, self.cutoff_x, self.view, self.reach = f, Bx, view, reach
        self.slope = 2.0 * np.pi * f * a
        self.parallax = 2.0 * np.pi * Bx * a * (jnp.abs(jnp.tan(view)) + jnp.tan(reach))
        self.turn = 4.0 * np.pi * B * self.slope  # of the mirrored normal
        self.shifted = self.turn * self.slope * jnp.abs(jnp.tan(view))  # by the eye's parallax
        square = 0.5 * (self.turn**2 + self.parallax**2)
        some = square > 0.0  # a root has no slope at zero
        self.modulation = jnp.where(some, jnp.sqrt(jnp.where(some, square, 1.0)), 0.0)
        self.valid = (a >= 0) & (f > 0) & (B >= 0) & (Bx >= 0)
        self.valid &= (jnp.abs(view) < 0.5 * np.pi) & (reach >= 0) & (reach < 0.5 * np.pi)

    def limited(self, error: Array) -> Array:
        """At most 2, and that where the relief shadows itself."""
        lit = self.slope * jnp.tan(self.reach) < 1.0
        return nan_unless(self.valid, jnp.where(lit, jnp.minimum(error, 2.0), 2.0))

    def left(self, width: Array) -> Array:
        """`sqrt(2 / (1 - q^6)) q`: what a pixel leaves of waves that are all modulation."""
        apart = jnp.maximum(self.frequency - self.cutoff_x, 0.0)
        fall = 2.0 * (np.pi * width * apart) ** 2  # q = exp(-fall)
        some = fall > 0.0
        fall = jnp.where(some, fall, 1.0)
        return jnp.where(some, jnp.exp(-fall) * jnp.sqrt(-2.0 / jnp.expm1(-6.0 * fall)), jnp.inf)


def _quarter(slope: Array) -> tuple[Array, Array]:
    """Slopes h' of places on a quarter of a wave, up to the largest, and their shares of it.

    `h' = sinh(S sin(t))` at even t, with `sinh(S)` the largest: the normals of steep waves turn
    within a small share of the wave, and there the places lie close.
    """
    most = jnp.arcsinh(slope)
    s = most * np.sin(0.5 * np.pi * (np.arange(_PLACES) + 0.5) / _PLACES)
    # sinh(S)^2 - sinh(s)^2 = sinh(S - s) sinh(S + s), a difference without its loss of digits.
    share = jnp.cosh(s) / jnp.sqrt(_sinh_over(most - s) * _sinh_over(most + s))
    return jnp.sinh(s), share


def _sinh_over(x: Array) -> Array:
    """`sinh(x) / x`, by a series where its derivatives are differences of large numbers."""
    near = jnp.abs(x) < 0.1
    y = jnp.where(near, x, 0.0) ** 2
    series = 1.0 + y / 6.0 * (1.0 + y / 20.0 * (1.0 + y / 42.0 * (1.0 + y / 72.0)))
    far = jnp.where(near, 1.0, x)
    return jnp.where(near, series, jnp.sinh(far) / far)


def _averaged(share: Array) -> Array:
    """Cycles per standard deviation of a pixel at which it leaves at most a share of any waves.

    `2 y / (1 - y^3) <= share^2` for `y = q^2 = e (1 - e^3)`, `e = share^2 / 2`.
    """
    e = 0.5 * jnp.where((share > 0) & (share < 1), share, 0.5) ** 2
    return jnp.sqrt(-0.25 * jnp.log(e * (1.0 - e**3))) / np.pi


def _over(a: Array | float, b: Array) -> Array:
    """Quotient, infinite where b is 0."""
    return jnp.where(b > 0, a / jnp.where(b > 0, b, 1.0), jnp.inf)


def _root(first: Array, second: Array, e: Array) -> Array:
    """Where `first a + second a^2 = e`, infinite if both are 0."""
    square = first**2 + 4.0 * second * e
    root = jnp.sqrt(jnp.where(square > 0, square, 1.0))
    return _over(2.0 * e, jnp.where(square > 0, first + root, 0.0))


def _broken_root(waves: _Waves, left: Array, e: Array) -> Array:
    """Where `(parallax a)^2 / 4 + left min(1, modulation a) = e`."""
    finite = jnp.isfinite(left)
    left = jnp.where(finite, left, 1.0)
    second = 0.25 * waves.parallax**2
    early = _root(left * waves.modulation, second, e)
    late = _root(0.0 * second, second, jnp.maximum(e - left, 0.0))
    found = jnp.where(early * waves.modulation <= 1.0, early, late)
    return jnp.where(finite, found, 0.0)
