"""What bounds need to know of a relief: its largest and mean heights, slopes and curvatures."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder._argument_checks import (
    check_finite,
    check_not_negative,
    check_positive,
    check_shape,
    nan_unless,
)
from firstorder._display import Module
from firstorder.bandwidth._harmonics import check_frequency_across
from firstorder.bandwidth._spectral_norm import spectral_norm
from firstorder.numerics._compiled import compiled
from firstorder.numerics._select import safe_sqrt
from firstorder.typing import RealLike, as_float

_FINER = 8  # places for each sample


class Relief(Module):
    """Numbers of a relief from which its bounds follow, in flatland or in space.

    Heights are measured from the base, which lies at their mean: `mean h = 0`. Numbers, or arrays
    that broadcast.

    Args:
        height: the largest `|h|` [m].
        slope: the largest `|grad h|`.
        curvature: the largest `|h''|`, in space the largest spectral norm of the Hessian [1/m].
        frequency: of what repeats, the fundamental; in space the shortest frequency at which the
            relief has harmonics. 0 if nothing repeats [cycles per metre].
        frequency_across: in space, how far the rows of harmonics along that frequency are apart:
            the other frequency of a rectangular pattern, and infinite for grooves, the default, and
            in flatland [cycles per metre].
        rms_height: root mean square of h, not more than the largest, the default [m].
        rms_slope: that of `|grad h|`, not more than the largest, the default.
        balanced: whether crests are troughs upside down, with alike sides: `h(-x) = -h(x)` about
            some place, and `h(x + s) = -h(x)` for some shift s. What is balanced errs in second
            order where anything else may err in first.

    Raises:
        ValueError: if a number is negative; traced ones make the bounds NaN.

    Example:
        >>> from firstorder.bandwidth import Relief
        >>> Relief(1e-3, 0.1, 20.0, 50.0).rms_slope.item()
        0.1
    """

    height: Float[Array, "..."]
    slope: Float[Array, "..."]
    curvature: Float[Array, "..."]
    frequency: Float[Array, "..."]
    frequency_across: Float[Array, "..."]
    rms_height: Float[Array, "..."]
    rms_slope: Float[Array, "..."]
    balanced: bool = eqx.field(static=True)

    def __init__(
        self,
        height: RealLike,
        slope: RealLike,
        curvature: RealLike,
        frequency: RealLike = 0.0,
        frequency_across: RealLike = np.inf,
        *,
        rms_height: RealLike | None = None,
        rms_slope: RealLike | None = None,
        balanced: bool = False,
    ):
        check_not_negative("height", height)
        check_not_negative("slope", slope)
        check_not_negative("curvature", curvature)
        check_not_negative("frequency", frequency)
        check_frequency_across(frequency_across)
        rms_height = height if rms_height is None else rms_height
        rms_slope = slope if rms_slope is None else rms_slope
        check_not_negative("rms_height", rms_height)
        check_not_negative("rms_slope", rms_slope)
        self.height, self.slope, self.curvature = map(as_float, (height, slope, curvature))
        self.frequency, self.frequency_across = as_float(frequency), as_float(frequency_across)
        self.rms_height, self.rms_slope = as_float(rms_height), as_float(rms_slope)
        self.balanced = balanced

    @classmethod
    def waves(cls, amplitude: RealLike, frequency: RealLike) -> Relief:
        """Relief `a sin(2 pi f x)`, in flatland; in space it is of straight grooves.

        Args:
            amplitude: a [m].
            frequency: f [cycles per metre].

        Raises:
            ValueError: if the amplitude is negative or the frequency not positive.

        Example:
            >>> from firstorder.bandwidth import Relief
            >>> round(Relief.waves(0.01, 2.0).slope.item(), 4)
            0.1257
        """
        check_not_negative("amplitude", amplitude)
        check_positive("frequency", frequency)
        f = as_float(frequency)
        a = nan_unless(f > 0, as_float(amplitude))
        k, share = 2.0 * np.pi * f, np.sqrt(0.5)
        slope = k * a
        return cls(
            a, slope, k * slope, f, rms_height=share * a, rms_slope=share * slope, balanced=True
        )

    @classmethod
    def of(cls, heights: ArrayLike, periods: ArrayLike, *, balanced: bool = False) -> Relief:
        """Relief whose heights are sampled over one period, in flatland or in space.

        Its heights are the trigonometric polynomial through the samples, less their mean, and its
        numbers bounds of that polynomial's: a polynomial of degree n rises between M places to at
        most `1 / cos(pi n / M)` of the largest there, and it is evaluated at eight times as many
        places as there are samples along each axis. So maxima may be 2 % too large, in space 4 %.

        Args:
            heights: at places `j period / count`, shape (n,) in flatland, (n, m) in space, x
                first [m].
            periods: one number, in space one for each axis, shape (2,) [m].
            balanced: as in `Relief`; it is not looked for.

        Raises:
            ValueError: if there are not one or two axes and as many periods, no sample, or one that
                is not finite, or a period is not positive; traced ones make the bounds NaN.

        Example:
            >>> import numpy as np
            >>> from firstorder.bandwidth import Relief
            >>> x = 0.02 * np.arange(64) / 64
            >>> round(Relief.of(1e-4 * np.cos(2 * np.pi * x / 0.02) ** 8, 0.02).slope.item(), 4)
            0.0568
        """
        h, P = jnp.asarray(as_float(heights)), jnp.atleast_1d(as_float(periods))
        if h.ndim not in (1, 2):
            raise ValueError(
                f"Argument `heights` must have one axis or two, but has shape {h.shape}."
            )
        if not h.size:
            raise ValueError(f"Argument `heights` must hold samples, but has shape {h.shape}.")
        check_finite("heights", h)
        check_shape("periods", P, (h.ndim,))
        check_positive("periods", P)
        *most, f, across, rms_height, rms_slope = _numbers_of(h, P)
        if h.ndim == 1:
            across = np.inf
        return cls(*most, f, across, rms_height=rms_height, rms_slope=rms_slope, balanced=balanced)

    @property
    def valid(self) -> Bool[Array, "..."]:
        """Whether the numbers can be those of a relief."""
        signs = self.height, self.slope, self.curvature, self.rms_height, self.rms_slope
        fine = (self.frequency >= 0) & (self.frequency_across > 0)
        for number in signs:
            fine &= number >= 0
        return fine


@compiled
def _numbers_of(h: Array, P: Array) -> tuple[Array, ...]:
    """Bounds and frequencies of a relief of samples, and its root mean squares."""
    h = nan_unless(jnp.all(P > 0), h - jnp.mean(h))
    f = 1.0 / P
    axes = np.eye(h.ndim, dtype=int)
    rise = [_derivative(h, f, a) for a in axes]
    bend = [[_derivative(h, f, a + b) for a in axes] for b in axes]
    norm = spectral_norm if h.ndim == 2 else lambda J: jnp.abs(J[..., 0, 0])
    steep = sum(r**2 for r in rise)
    between = jnp.asarray([_rises_between(count) for count in h.shape]).prod()
    fine = _derivative(h, f, np.zeros(h.ndim, int))
    return (
        between * jnp.max(jnp.abs(fine)),
        between * safe_sqrt(jnp.max(steep)),
        between * jnp.max(norm(jnp.moveaxis(jnp.asarray(bend), (0, 1), (-2, -1)))),
        jnp.min(f),
        jnp.max(f),
        safe_sqrt(jnp.mean(fine**2)),
        safe_sqrt(jnp.mean(steep)),
    )


def _rises_between(count: int) -> float:
    """How far a polynomial through that many samples may rise above its largest fine sample."""
    return 1.0 / np.cos(np.pi * (count // 2) / (_FINER * count))


def _derivative(h: Array, f: Array, orders: np.ndarray) -> Array:
    """A derivative of the trigonometric polynomial through samples, at finer places."""
    for axis, order in enumerate(orders):
        h = _along(jnp.moveaxis(h, axis, -1), f[axis], int(order))
        h = jnp.moveaxis(h, -1, axis)
    return h


def _along(h: Array, f: Array, order: int) -> Array:
    """Derivative along the last axis; of an even count the highest wave is a cosine."""
    count = h.shape[-1]
    F = jnp.fft.rfft(h, axis=-1)
    k = np.arange(F.shape[-1])
    half = np.where((count % 2 == 0) & (k == count // 2), 0.5, 1.0)
    F = F * half * (2j * np.pi * k * f) ** order * _FINER
    return jnp.fft.irfft(F, _FINER * count, axis=-1)
