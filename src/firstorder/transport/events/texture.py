"""Texture: the light that leaves a point is multiplied by a colour of that point."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_finite, check_one
from firstorder.conventions import UNSTATED, Frame, frame_with
from firstorder.fields._coerce import field_of
from firstorder.fields._series import Series
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid
from firstorder.laws.base import Law
from firstorder.laws.multiply import Multiply
from firstorder.transport.event import Event
from firstorder.typing import Ray, Scalar, Vector, as_float


class Wave(Field):
    """`mean + amplitude cos(2 pi frequency . u + phase)`: a striped texture, or a rippled normal.

    Args:
        frequency: vector in cycles per unit of each coordinate.
        amplitude: height of the wave.
        phase: in radians.
        mean: level about which it swings.
        frame: names of the coordinates.

    Raises:
        ValueError: if the frequency is not finite or does not fit the frame.

    Example:
        >>> from firstorder.transport import Wave
        >>> Wave([0.5, 0.0], amplitude=0.2, mean=1.0)(1.0, 0.3).item()
        0.8
    """

    frequency: Vector = eqx.field(converter=as_float)
    amplitude: Scalar = eqx.field(converter=as_float, default=1.0)
    phase: Scalar = eqx.field(converter=as_float, default=0.0)
    mean: Scalar = eqx.field(converter=as_float, default=0.0)
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def __check_init__(self):
        """Refuse a frequency that is no number, or not one per coordinate."""
        check_finite("frequency", self.frequency)
        if self.frequency.shape != (self.frame.dims,):
            need = f"{self.frame.dims} entries, but has shape {self.frequency.shape}"
            raise ValueError(f"Argument `frequency` must have {need}.")

    def at(self, u: Ray) -> Scalar:
        """The wave."""
        return self.mean + self.amplitude * jnp.cos(self._phase(u))

    def _phase(self, u: Ray) -> Scalar:
        return 2.0 * np.pi * jnp.sum(self.frequency * u) + self.phase

    def jet(self, u: Ray) -> Jet:
        """`-a sin w` and `-a cos w w^T` with `w = 2 pi frequency`."""
        w, p = 2.0 * np.pi * self.frequency, self._phase(u)
        c, s = self.amplitude * jnp.cos(p), self.amplitude * jnp.sin(p)
        return Jet(self.mean + c, -s * w, -c * w[:, None] * w, self.frame)

    def series(self, window: Grid) -> Series:
        """Three harmonics, whatever the window: exact."""
        half = 0.5 * self.amplitude * jnp.exp(1j * self.phase)
        coefficients = jnp.stack([jnp.conj(half), self.mean + 0j, half])
        return Series(jnp.outer(jnp.array([-1.0, 0.0, 1.0]), self.frequency), coefficients)


def wave(
    frequency, amplitude=1.0, phase=0.0, mean=0.0, axis: str = "x", frame: Frame = UNSTATED
) -> Wave:
    """A wave along one coordinate.

    Args:
        frequency: in cycles per unit of the coordinate.
        amplitude: height of the wave.
        phase: in radians.
        mean: level about which it swings.
        axis: name of the coordinate.
        frame: names of all; left out, those that `axis` names.

    Raises:
        ValueError: if there is no such coordinate, or the frequency is not one finite number.

    Example:
        >>> from firstorder.transport import wave
        >>> wave(0.25, mean=1.0)(0.0, 0.0).item()
        2.0
    """
    check_one("frequency", frequency)
    frame = frame_with(axis, frame)
    along = jnp.zeros(frame.dims).at[frame.axis(axis)].set(1.0)
    return Wave(as_float(frequency) * along, amplitude, phase, mean, frame)


class Texture(Event):
    """`l_T(x, theta) = T(x) l(x, theta)`: an albedo that varies in space.

    Spectrum: a convolution along Omega_x alone, `T_hat(Omega_x) delta(Omega_theta) (*) F`.

    Args:
        pattern: T as a field over the light's coordinates that ignores the directions, or as a
            function of x.
        window: box for the spectrum (see `Multiply`); a `Wave` is exact on any.

    Called: texture mapping (D05 §4.4).

    Reference: D05 eq. 18; R07 eq. 20.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Texture, wave
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> Texture(wave(1.0, 0.5, mean=0.5))(L)(0.5, 0.0).item()  # the stripe is black there
        0.0
    """

    pattern: Field = eqx.field(converter=field_of("pattern"))
    window: Grid | None = None

    def law(self, frame: Frame) -> Law:
        """Multiply."""
        pattern = self.pattern.in_frame(frame, "pattern", type(self).__name__)
        return Multiply(pattern, self.window, type(self).__name__)
