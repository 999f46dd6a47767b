"""Relief of any shape, in flatland and in space: when it is geometry, bumps, or a BRDF.

Heights `h` above a base mirror light to a distant eye. What flat mirrors, bumps and BRDFs drop is
as in `relief`; how much it can be follows from a few numbers of the shape. Over a height h the
light travels, which shifts it along the base by `h (tan view + tan reach)` at most. A normal that
turns by n turns the mirror by 2 n about an axis in the base. That moves the mirrored direction by

    2 sqrt(h_x^2 + (h_y cos view)^2) / sqrt(1 + h_x^2 + h_y^2)

with x in the plane of incidence: by `2 sin n` along it, by less across it, and never by more than
twice the slope. So what holds in flatland holds in space, whatever the azimuths.

Light of a frequency pair is `exp(2 pi i (Omega_x . x + Omega . w))` over places x of the base and
directions w: a wave over the sphere of directions, with `|Omega_x|` up to `cutoff_x` and `|Omega|`
up to `cutoff`.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_below,
    check_inside,
    check_kind,
    check_not_negative,
    check_positive,
    nan_unless,
)
from firstorder._display import in_print
from firstorder.bandwidth._harmonics import averaged_from, left_by_pixel, over, root, times_share
from firstorder.bandwidth.relief_numbers import Relief
from firstorder.numerics._select import safe_sqrt
from firstorder.typing import RealLike, as_float


class ReliefCutoffs(NamedTuple):
    """Amplitudes up to which something simpler stands for relief of a frequency [m].

    Of a shape they are without unit: how many times as high it may be.

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


def flat_shape_error(
    relief: Relief, cutoff: RealLike, cutoff_x: RealLike, *, view: RealLike, reach: RealLike
) -> Float[Array, "..."]:
    """How far a flat mirror may be from one in relief, relative to the light's amplitude.

    `2 pi (cutoff_x H (|tan view| + tan reach) + 2 cutoff M)` with the largest height H and slope M:
    the parallax, and the normals' turn, doubled by the mirror. At most 2.

    A bound, for light of one frequency pair or of all up to the cutoffs; its amplitude is then the
    sum of all amplitudes, which is its peak if the spectrum is positive. It is 2 where light is
    shadowed, `M tan reach >= 1`: there the relief sees itself, and `pit_brdf_error` has a bound. A
    glossy lobe that turns with the mirror averages such light, so the bound is kept.

    Args:
        relief: the numbers of its shape.
        cutoff: angular frequency of the light, or of the lobe if it ends before [cycles per rad].
        cutoff_x: frequency of the light along the base [cycles per metre]; 0 for distant light, and
            `cutoff / d` for a lamp that stands at a distance d.
        view: angle from the base's normal to the eye, in (-pi / 2, pi / 2), at any azimuth [rad].
        reach: largest angle of the light that counts from the base's normal, from 0 to below
            pi / 2: `|view|`, twice the normals' largest turn and half the lobe's width, together
            [rad].

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.
        TypeError: if `relief` is none.

    Reference: D05 §7 ("the frequency cutoff for micro, meso, and macro-geometry"), which asks.

    Example:
        >>> from firstorder.bandwidth import Relief, flat_shape_error
        >>> dents = Relief(height=1e-4, slope=0.01, curvature=2.0)
        >>> round(flat_shape_error(dents, 1.0, 0.0, view=0.3, reach=0.4).item(), 4)
        0.1257
    """
    at = _Lit(relief, cutoff, cutoff_x, view, reach)
    return at.limited(at.parallax + at.turn)


def bump_shape_error(
    relief: Relief, cutoff: RealLike, cutoff_x: RealLike, *, view: RealLike, reach: RealLike
) -> Float[Array, "..."]:
    """How far bumps on a flat base may be from relief, relative to the light's amplitude.

    `2 pi (cutoff_x H (|tan view| + tan reach) + 2 cutoff K H |tan view|)` with the largest height H
    and curvature K: the light's parallax, and the eye's, by which it sees the normal of a place
    `H |tan view|` away.

    Bound and arguments as in `flat_shape_error`, and so is what makes it 2.

    Args:
        relief: as there.
        cutoff: as there [cycles per rad].
        cutoff_x: as there [cycles per metre].
        view: as there [rad].
        reach: as there [rad].

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.
        TypeError: if `relief` is none.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import Relief, bump_shape_error
        >>> dents = Relief(height=1e-4, slope=0.01, curvature=2.0)
        >>> round(bump_shape_error(dents, 1.0, 0.0, view=0.3, reach=0.4).item(), 5)
        0.00078
    """
    at = _Lit(relief, cutoff, cutoff_x, view, reach)
    return at.limited(at.parallax + at.shifted)


def brdf_shape_error(
    relief: Relief,
    cutoff: RealLike,
    cutoff_x: RealLike,
    *,
    width: RealLike,
    view: RealLike,
    reach: RealLike,
) -> Float[Array, "..."]:
    """How far a BRDF may be from relief that a pixel averages, relative to the light's amplitude.

    `m + min(1, s) sqrt(t + u + t u)`, where

        p = 2 pi cutoff_x rms_height (|tan view| + tan reach)    RMS phase of the parallax
        n = 4 pi cutoff rms_slope                                RMS phase of the turn
        m = p^2 / 2,  s = sqrt(n^2 + p^2)                        if the relief is balanced
        t = 2 q^2 / (1 - q^6),  q = exp(-2 pi^2 w^2 (frequency - cutoff_x)^2)
        u: the same of `frequency_across`, 0 if that is infinite.

    Relief multiplies the light by something periodic. So the pixel gets its mean and what the
    filter leaves of its harmonics, by Cauchy and Schwarz: t and u are the filter's squares over
    their lattice. Heights that the eye sees have the mean and the mean square of all heights,
    whatever the shape, for `h^n (1 - V . grad h)` integrates to `h^n`.

    If it is not balanced, slopes that face the eye may count twice, `n = 4 pi cutoff
    sqrt(2) rms_slope` unless `view` is 0, phases may go together, `s = n + p`, and the mean errs by

        m = min(p, p^2 / 2 + n p + 4 pi cutoff_x rms_height sqrt(2) rms_slope / cos(reach)^2).

    The BRDF's normals are those that the eye *sees*: `shape_transfer`, `shape_transfer_in_space`.
    Bound and arguments as in `flat_shape_error`; it is 2 also if a frequency is not above
    `cutoff_x`, or if the eye sees no part of the relief. One wave reaches it; of random patterns it
    is some eight times too large, for it takes all phases to be in the coarsest harmonics.

    Args:
        relief: as there.
        cutoff: as there [cycles per rad].
        cutoff_x: as there [cycles per metre].
        width: standard deviation w of the pixel's Gaussian filter on the base, the smaller one if
            it has two [m].
        view: as there [rad].
        reach: as there [rad].

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.
        TypeError: if `relief` is none.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import Relief, brdf_shape_error
        >>> dents = lambda f: Relief(1e-4, 0.1, 200.0, f, f)
        >>> error = lambda f: brdf_shape_error(dents(f), 2.0, 0.0, width=0.01, view=0.0, reach=0.4)
        >>> print(f"{error(5.0):.2f} {error(50.0):.2f}")
        2.00 0.01
    """
    check_positive("width", width)
    at, w = _Lit(relief, cutoff, cutoff_x, view, reach), as_float(width)
    left = at.left(w)
    error = at.mean_error() + times_share(at.modulation, left)
    seen = (left < jnp.inf) & (at.slope * at.tan_view < 1.0)
    return nan_unless(w > 0, at.limited(jnp.where(seen, error, 2.0)))


def shape_cutoffs(
    share: RealLike,
    relief: Relief,
    cutoff: RealLike,
    cutoff_x: RealLike,
    *,
    width: RealLike,
    view: RealLike,
    reach: RealLike,
) -> ReliefCutoffs:
    """How many times as high relief may be replaced, for an error of at most a share of the light.

    The bounds of `flat_shape_error`, `bump_shape_error` and `brdf_shape_error`, solved for a factor
    of all heights; none of them beyond `1 / (slope tan reach)`, where the relief shadows itself.
    Above all three it is geometry. Safe, not sharp: the bounds add up what seldom meets.

    Args:
        share: the error to be allowed, in (0, 1), relative to the light's amplitude.
        relief: the shape, as in `flat_shape_error`.
        cutoff: as there [cycles per rad].
        cutoff_x: as there [cycles per metre].
        width: standard deviation of the pixel's Gaussian filter on the base [m].
        view: as there [rad].
        reach: as there; of the relief as high as it is found to be allowed [rad].

    Returns:
        Factors, and the frequency from which a pixel averages the steepest relief; infinite where
        nothing limits them.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.
        TypeError: if `relief` is none.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import Relief, shape_cutoffs
        >>> dents = Relief(1e-3, 0.1, 200.0, 50.0, 50.0)
        >>> found = shape_cutoffs(0.1, dents, 2.0, 0.5, width=0.006, view=0.5, reach=0.7)
        >>> print(f"{found.flat:.3f} {found.bumps:.2f} {found.brdf:.2f}, {found.frequency:.0f} / m")
        0.040 0.19 0.08, 65 / m
    """
    check_inside("share", share, 0.0, 1.0)
    check_positive("width", width)
    at = _Lit(relief, cutoff, cutoff_x, view, reach)
    e, w = as_float(share), as_float(width)
    steep = jnp.maximum(jnp.tan(at.reach), at.tan_view)
    lit, seen = over(1.0, at.slope * jnp.tan(at.reach)), over(1.0, at.slope * steep)
    valid = at.valid & (w > 0) & (e > 0) & (e < 1)
    pixel = averaged_from(e, jnp.isfinite(at.relief.frequency_across)) / w
    found = ReliefCutoffs(
        jnp.minimum(over(e, at.parallax + at.turn), lit),
        jnp.minimum(root(at.parallax, at.shifted, e), lit),
        jnp.minimum(at.broken_root(at.left(w), e), seen),
        at.cutoff_x + pixel + 0.0 * at.slope,
    )
    return ReliefCutoffs(*(nan_unless(valid, a) for a in found))


class _Lit:
    """Checked numbers of relief under light, and what the three errors share."""

    def __init__(self, relief: Relief, cutoff, cutoff_x, view, reach):
        check_kind("relief", relief, Relief, "a Relief")
        check_not_negative("cutoff", cutoff)
        check_not_negative("cutoff_x", cutoff_x)
        check_inside("view", view, -0.5 * np.pi, 0.5 * np.pi)
        check_not_negative("reach", reach)
        check_below("reach", reach, 0.5 * np.pi)
        B, Bx, view, reach = (as_float(g) for g in (cutoff, cutoff_x, view, reach))
        self.relief, self.slope, self.cutoff_x, self.reach = relief, relief.slope, Bx, reach
        self.tan_view = jnp.abs(jnp.tan(view))
        self.sight = 2.0 * np.pi * Bx * (self.tan_view + jnp.tan(reach))  # phase per height
        self.parallax = self.sight * relief.height
        self.turn = 4.0 * np.pi * B * relief.slope  # of the mirrored normal
        moved = relief.curvature * relief.height * self.tan_view  # by the eye's parallax
        self.shifted = 4.0 * np.pi * B * moved
        self._phases(4.0 * np.pi * B)
        self.valid = relief.valid & (B >= 0) & (Bx >= 0)
        self.valid &= (jnp.abs(view) < 0.5 * np.pi) & (reach >= 0) & (reach < 0.5 * np.pi)

    def _phases(self, turns: Array) -> None:
        """RMS phases, and the mean's error: `linear + quadratic` in the height, twice if two do."""
        relief = self.relief
        p, slope = self.sight * relief.rms_height, relief.rms_slope
        if relief.balanced:
            self.modulation = safe_sqrt((turns * slope) ** 2 + p**2)
            self.means = ((0.0 * p, 0.5 * p**2),)
            return
        slope = slope * jnp.where(self.tan_view > 0.0, np.sqrt(2.0), 1.0)
        self.modulation = turns * slope + p
        drift = 4.0 * np.pi * self.cutoff_x * relief.rms_height * slope / jnp.cos(self.reach) ** 2
        self.means = ((p, 0.0 * p), (0.0 * p, 0.5 * p**2 + turns * slope * p + drift))

    def limited(self, error: Array) -> Array:
        """At most 2, and that where the relief shadows itself."""
        lit = self.slope * jnp.tan(self.reach) < 1.0
        return nan_unless(self.valid, jnp.where(lit, jnp.minimum(error, 2.0), 2.0))

    def left(self, width: Array) -> Array:
        """Share that a pixel leaves of relief that is all modulation; infinite if too coarse."""
        relief = self.relief
        return left_by_pixel(width, self.cutoff_x, relief.frequency, relief.frequency_across)

    def mean_error(self) -> Array:
        """The least of the bounds of what parallax does to the mean."""
        found = [linear + quadratic for linear, quadratic in self.means]
        return found[0] if len(found) == 1 else jnp.minimum(*found)

    def broken_root(self, left: Array, e: Array) -> Array:
        """Where `mean error + left min(1, modulation)` is e, all in proportion to the height."""
        finite = jnp.isfinite(left)
        left = jnp.where(finite, left, 1.0)
        highest = jnp.zeros(())
        for linear, quadratic in self.means:
            early = root(linear + left * self.modulation, quadratic, e)
            late = root(linear, quadratic, jnp.maximum(e - left, 0.0))
            found = jnp.where(early * self.modulation <= 1.0, early, late)
            highest = jnp.maximum(highest, found)
        return jnp.where(finite, highest, 0.0)
