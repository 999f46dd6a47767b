"""Masks: fields that jump. The half-plane is the one from which the others are made."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.conventions import FLATLAND, Frame, fourier_kernel
from firstorder.fields.field import Affine, Constant, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.series import Series, axis_series
from firstorder.fields.spectrum import Grid
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
        """A square wave along the level, one period of it being the window's longest reach.

        `level = a . u + b = s - s_0` with the coordinate `s = a . u`: on a period P about the edge
        the half-plane is `mean + jump * sum_odd exp(2 pi i k (s - s_0) / P) / (pi i k)`.
        """
        jump, mean = self.above - self.below, 0.5 * (self.above + self.below)
        edge = -self.level.offset
        axis = self.frame.positions[0]

        def coefficients(k, period):
            odd = k % 2 != 0
            wave = np.where(odd, 1.0 / (1j * np.pi * np.where(odd, k, 1)), 0.0)
            phase = fourier_kernel(jnp.asarray(k[:, None] / period), edge[None, None])
            return jump * wave * phase + jnp.where(k == 0, mean, 0.0)

        return axis_series(coefficients, self.level.normal, window, axis)


def half_plane(edge, below=0.0, above=1.0, axis: str = "x", frame: Frame = FLATLAND) -> HalfPlane:
    """Transparency that jumps where the coordinate `axis` passes `edge`.

    Example:
        >>> from firstorder.fields import half_plane
        >>> half_plane(0.0)(-1.0, 0.0).item()
        0.0
    """
    normal = jnp.zeros(frame.dims).at[frame.axis(axis)].set(1.0)
    return HalfPlane(Affine(normal, -as_float(edge), frame), below, above)
