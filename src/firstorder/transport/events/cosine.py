"""The cosine term: light that arrives aslant is spread over more surface."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from firstorder._argument_checks import check_kind, is_concrete
from firstorder.conventions import FLATLAND, Frame
from firstorder.fields._series import Series, axis_series
from firstorder.fields.spectrum import Grid
from firstorder.laws.base import Law
from firstorder.laws.multiply import Multiply
from firstorder.transport.event import Event, require_frame
from firstorder.transport.events.separable import Angular
from firstorder.typing import Scalar, as_float


class _Wave(Angular):
    """`sign cos(t)`: the clamped cosine's formula above minus below its horizon."""

    sign: float
    axis: str = eqx.field(static=True)
    frame: Frame = eqx.field(static=True)
    periodic: bool = eqx.field(static=True, default=False)

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Cosine and its derivatives."""
        c, s = self.sign * jnp.cos(t), self.sign * jnp.sin(t)
        return c, -s, -c


class ClampedCosine(Angular):
    """`cos+(theta) = max(cos theta, 0)` of the local angle, zero behind the surface.

    It has a kink and no jump at the horizons `-+ pi/2`. As a function on the line it is one hump,
    whose Fourier transform is `clamped_cosine_transform`; with `periodic` it repeats every turn,
    and has the Fourier coefficients `clamped_cosine_transform(m / (2 pi)) / (2 pi)`.

    Args:
        axis: name of the angle.
        frame: names of all coordinates.
        periodic: on the circle instead of the line.

    Reference: D05 eqs. 12-13.

    Example:
        >>> from firstorder.transport import ClampedCosine
        >>> round(ClampedCosine()(0.0, 1.0471975511965976).item(), 12)  # 60 degrees
        0.5
    """

    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=FLATLAND)
    periodic: bool = eqx.field(static=True, default=False)

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """`cos, -sin, -cos` above the horizon, zeros below."""
        below = jnp.abs(t) >= 0.5 * np.pi  # asked so that NaN is not taken for it
        c, s = jnp.where(below, 0.0, jnp.cos(t)), jnp.where(below, 0.0, jnp.sin(t))
        return c, -s, -c

    def breaks(self) -> "tuple[tuple[Scalar, Angular], ...]":
        """Both horizons; the difference of the formulas is the cosine, zero there but not flat."""
        horizon = jnp.asarray(0.5 * np.pi)
        return tuple((s * horizon, _Wave(-s, self.axis, self.frame)) for s in (-1.0, 1.0))

    def series(self, window: Grid) -> Series:
        """Closed form, if the window is known to hold the whole hump; else by quadrature."""
        a = self.frame.axis(self.axis)
        reach = 0.5 * window.extent[a] - abs(window.center[a])
        if self.periodic or not is_concrete(reach) or reach < 0.5 * np.pi:
            return super().series(window)

        def coefficients(k, period):
            return clamped_cosine_transform(k / period) / period

        return axis_series(coefficients, jnp.eye(self.frame.dims)[a], window, a)


def clamped_cosine_transform(Omega_theta) -> Array:
    """Fourier transform of the clamped cosine, `int cos+(t) exp(-2 pi i Omega t) dt`.

    `2 cos(pi^2 Omega) / (1 - (2 pi Omega)^2)`, and pi/2 at the removable singularity
    `|Omega| = 1 / (2 pi)`. Real, because the cosine is even; it falls off as Omega^-2.

    Computed as `(pi/2) (sinc((1 - w) / 2) + sinc((1 + w) / 2))`, w = 2 pi Omega and
    `sinc(s) = sin(pi s) / (pi s)`, which is smooth through the singularity, as are its derivatives.

    Args:
        Omega_theta: frequencies in cycles per radian, a number or an array.

    Returns:
        An array of that shape.

    Reference: D05 eq. 13, whose printed cosine and denominator follow different conventions.

    Example:
        >>> from firstorder.transport import clamped_cosine_transform
        >>> round(clamped_cosine_transform(0.0).item(), 12)  # the integral of the cosine
        2.0
    """
    w = 2.0 * np.pi * as_float(Omega_theta)
    return 0.5 * np.pi * (jnp.sinc(0.5 * (1.0 - w)) + jnp.sinc(0.5 * (1.0 + w)))


class Cosine(Event):
    """`dE(x, theta) = l(x, theta) cos+(theta)` in the local frame: differential irradiance.

    Spectrum: a narrow blur along Omega_theta,
    `F (*) cos_plus_transform(Omega_theta) delta(Omega_x)`.

    Args:
        axis: name of the angle from the normal (in space, near the plane of incidence).
        periodic: for light on the whole circle of directions.
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).

    Raises:
        TypeError: if `axis` is no name.

    Called: cosine term, or differential irradiance (D05 step 3).

    Reference: D05 eqs. 8, 12-13.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Cosine
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> Cosine()(L)(0.0, 2.0).item()  # below the horizon
        0.0
    """

    axis: str = eqx.field(static=True, default="theta")
    periodic: bool = eqx.field(static=True, default=False)
    window: Grid | None = None

    def __check_init__(self):
        """Refuse what is no name."""
        check_kind("axis", self.axis, str, "the name of an angle")

    def law(self, frame: Frame) -> Law:
        """Multiply by the clamped cosine."""
        fits = self.axis in frame.coordinates and not frame.uses_slopes
        require_frame(fits, self, frame, f"the angle {self.axis}")
        factor = ClampedCosine(self.axis, frame, self.periodic)
        return Multiply(factor, self.window, type(self).__name__)
