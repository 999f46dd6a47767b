"""Masks: fields that jump. The half-plane is the one from which the others are made."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp

from firstorder.conventions import FLATLAND, Frame
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Affine, Constant, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.series import Series, stair_series
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.typing import Ray, Scalar, as_float


class HalfPlane(Field):
    """`below` where `level < 0`, `above` where `level > 0`, their mean on the edge.

    Args:
        level: straight edge, an affine function of the ray.
        below: transparency of the one side, in [0, 1] for a blocker.
        above: transparency of the other.

    Example:
        >>> from firstorder.fields import Affine, HalfPlane
        >>> HalfPlane(Affine([1.0, 0.0], -0.5), 0.0, 1.0)(0.7, 0.0).item()
        1.0
    """

    level: Affine
    below: Scalar = eqx.field(converter=as_float)
    above: Scalar = eqx.field(converter=as_float)

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

    def series(self, window: Grid) -> Series:
        """A stair of one step, exact on the window (see `stair_series`)."""
        heights = jnp.stack([self.below, self.above])
        return stair_series(self.level, jnp.zeros(1, heights.dtype), heights, window)

    def spectrum(self) -> Spectrum:
        """Refused: it does not die out."""
        raise Refused("an edge has half a Dirac for a spectrum: let it multiply light on a window")

    def covariance(self) -> Covariance:
        """Refused: the power of an edge falls off too slowly."""
        raise Refused("an edge has an infinite covariance: its power falls off as 1 / Omega^2")


def half_plane(edge, below=0.0, above=1.0, axis: str = "x", frame: Frame = FLATLAND) -> HalfPlane:
    """Transparency that jumps where the coordinate `axis` passes `edge`.

    Example:
        >>> from firstorder.fields import half_plane
        >>> half_plane(0.0)(-1.0, 0.0).item()
        0.0
    """
    normal = jnp.zeros(frame.dims).at[frame.axis(axis)].set(1.0)
    return HalfPlane(Affine(normal, -as_float(edge), frame), below, above)
