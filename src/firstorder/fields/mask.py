"""Masks: fields that jump. The half-plane is the one from which the others are made."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtr
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_finite,
    check_kind,
    check_positive,
    is_concrete,
    nan_unless,
)
from firstorder.conventions import UNSTATED, Frame, fourier_kernel, frame_with
from firstorder.errors import Refused
from firstorder.fields._level_series import level_range, level_series, stair_series
from firstorder.fields._series import Series
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Affine, Constant, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.typing import Ray, Scalar, as_float


class HalfPlane(Field):
    """`below` where `level < 0`, `above` where `level > 0`, their mean on the edge.

    Args:
        level: straight edge, an affine function of the ray.
        below: transparency of the one side, in [0, 1] for a blocker.
        above: transparency of the other.

    Raises:
        ValueError: if the level has no normal, or a transparency is not finite.

    Example:
        >>> from firstorder.fields import Affine, HalfPlane
        >>> HalfPlane(Affine([1.0, 0.0], -0.5), 0.0, 1.0)(0.7, 0.0).item()
        1.0
    """

    level: Affine
    below: Scalar = eqx.field(converter=as_float)
    above: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse an edge that is nowhere."""
        check_kind("level", self.level, Affine, "an `Affine`")
        for name, value in (("below", self.below), ("above", self.above)):
            check_finite(name, value)
        if is_concrete(self.level.normal) and not np.any(np.asarray(self.level.normal)):
            raise ValueError("Argument `level` must have a normal, but it is zero.")

    @property
    def frame(self) -> Frame:
        """Frame of the level."""
        return self.level.frame

    def at(self, u: Ray) -> Scalar:
        """Transparency; the mean of the sides on the edge."""
        side = 0.5 * (1.0 + jnp.sign(self.level.at(u)))
        return self.below + (self.above - self.below) * side

    def jet(self, u: Ray) -> Jet:
        """Flat on both sides; the jump is `edges`' business."""
        n = u.size
        return Jet(self.at(u), jnp.zeros(n, u.dtype), jnp.zeros((n, n), u.dtype), self.frame)

    def edges(self) -> tuple[Edge, ...]:
        """The one edge."""
        return (Edge(self.level, Constant(self.above - self.below, self.frame)),)

    def steps(self) -> tuple[Affine, Float[Array, "1"], Float[Array, "2"]]:
        """Level, the one place where it jumps, and the heights below and above."""
        heights = jnp.stack([self.below, self.above])
        return self.level, jnp.zeros(1, heights.dtype), heights

    def series(self, window: Grid) -> Series:
        """A stair of one step; each coefficient is exact on the window (see `stair_series`)."""
        return stair_series(*self.steps(), window)

    def spectrum(self) -> Spectrum:
        """Refused: it does not die out."""
        raise Refused("an edge has half a Dirac for a spectrum: let it multiply light on a window")

    def covariance(self) -> Covariance:
        """Refused: the power of an edge falls off too slowly."""
        raise Refused("an edge has an infinite covariance: its power falls off as 1 / Omega^2")


class SoftEdge(Field):
    """A half-plane whose edge is blurred: `below + (above - below) Phi(level / width)`.

    Phi is the normal distribution function: the shadow of a straight blocker in a Gaussian light.
    Smooth, but it never dies out, so it has a covariance only as a factor of what does.

    Args:
        level: straight edge, an affine function of the ray.
        width: standard deviation of the blur, in the unit of the level.
        below: transparency far on the one side.
        above: transparency far on the other.

    Raises:
        ValueError: if `width` is not positive.

    Example:
        >>> from firstorder.fields import Affine, SoftEdge
        >>> SoftEdge(Affine([1.0, 0.0], -0.5), 0.1)(0.5, 0.0).item()
        0.5
    """

    level: Affine
    width: Scalar = eqx.field(converter=as_float)
    below: Scalar = eqx.field(converter=as_float, default=0.0)
    above: Scalar = eqx.field(converter=as_float, default=1.0)

    def __check_init__(self):
        """Refuse a blur that is none."""
        check_kind("level", self.level, Affine, "an `Affine`")
        check_positive("width", self.width)

    @property
    def frame(self) -> Frame:
        """Frame of the level."""
        return self.level.frame

    @property
    def _blur(self) -> Scalar:
        """The width; NaN for a traced one that is none."""
        return nan_unless(self.width > 0, self.width)

    def at(self, u: Ray) -> Scalar:
        """Transparency."""
        return self.below + (self.above - self.below) * ndtr(self.level.at(u) / self._blur)

    def jet(self, u: Ray) -> Jet:
        """Chain rule along the level's normal."""
        a, t = self.level.normal, self.level.at(u) / self._blur
        bell = jnp.exp(-0.5 * t**2) / jnp.sqrt(2.0 * jnp.pi) / self._blur
        slope = (self.above - self.below) * bell
        bend = -t / self._blur * slope
        return Jet(self.at(u), slope * a, bend * a[:, None] * a, self.frame)

    def series(self, window: Grid) -> Series:
        """A stair's coefficients with the rise damped by `exp(-2 pi^2 width^2 s^2)`.

        The period takes in the whole rise, up to 8.5 widths, where the rest is below 1e-16.
        """
        low, high = level_range(self.level, window)
        far = 8.5 * self._blur
        low, high = jnp.minimum(low, -far), jnp.maximum(high, far)

        def coefficients(k, period):
            s = jnp.asarray(k) / period
            wrap = fourier_kernel(s[:, None], high[None])
            rise = jnp.exp(-2.0 * (jnp.pi * self._blur * s) ** 2) - wrap
            wave = jnp.where(k == 0, high / period, rise / (2j * jnp.pi * np.where(k == 0, 1, k)))
            return (self.above - self.below) * wave + jnp.where(k == 0, self.below, 0.0)

        return level_series(coefficients, self.level, low, high, window)

    def covariance(self) -> Covariance:
        """Refused: it does not die out."""
        raise Refused("a soft edge never dies out: see its covariance under a stated window")


def half_plane(edge, below=0.0, above=1.0, axis: str = "x", frame: Frame = UNSTATED) -> HalfPlane:
    """Transparency that jumps where the coordinate `axis` passes `edge`.

    Args:
        edge: where it jumps, in the unit of the coordinate.
        below: transparency before the edge.
        above: transparency after it.
        axis: name of the coordinate.
        frame: names of all coordinates; left out, those of the light that it meets, or those that
            `axis` names.

    Raises:
        ValueError: if `edge` is not finite or there is no such coordinate.

    Example:
        >>> from firstorder.fields import half_plane
        >>> half_plane(0.0)(-1.0, 0.0).item()
        0.0
    """
    check_finite("edge", edge)
    frame = frame_with(axis, frame)
    normal = jnp.zeros(frame.dims).at[frame.axis(axis)].set(1.0)
    return HalfPlane(Affine(normal, -as_float(edge), frame), below, above)
