"""Kernels of convolutions along one axis."""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from firstorder._argument_checks import check_positive, nan_unless
from firstorder.conventions import UNSTATED, Frame, frame_with
from firstorder.errors import Refused
from firstorder.fields._series import Series
from firstorder.fields.field import Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid
from firstorder.typing import Ray, Scalar, as_float


class Kernel(Field):
    """A field g whose coordinate `axis` is the *difference* of the two sides of a convolution.

    A kernel that varies in the other coordinates is an ordinary field over them. One that does
    not is a `Profile`.
    """

    axis: eqx.AbstractVar[str]

    @abc.abstractmethod
    def half_width(self) -> Scalar:
        """Distance along the axis at which the kernel ends or is negligible."""

    def local_half_width(self) -> Field | None:
        """`half_width` as a field over the other coordinates; None where it is the same for all."""
        return None

    def edges_along(self) -> tuple[Edge, ...]:
        """Edges that a line along the axis may cross; those of other coordinates alone are none."""
        return self.edges()

    def knots(self) -> Float[Array, " m"]:
        """Points on the axis at which the kernel is less smooth: quadrature splits there."""
        return jnp.zeros(0)

    def parts(self) -> "tuple[Kernel, ...]":
        """Kernels of which it is the sum: each is integrated as far as it reaches itself."""
        return (self,)

    @abc.abstractmethod
    def semi_series(self, Omega_axis: Scalar, window: Grid | None) -> "Series":
        """Fourier series over the other coordinates of the kernel's transform along its axis.

        D05 §4.5's semi-Fourier space: `g(x, Omega_axis) = sum_k c_k exp(2 pi i s_k . u)`.
        """

    def spread(self) -> Scalar:
        """Second moment of `|transform|^2` along the axis, for the covariance rule."""
        raise Refused(f"{type(self).__name__} has no closed-form covariance")


class Profile(Kernel):
    """A kernel of the difference alone, `g(u) = p(u_axis)`: shift-invariant."""

    def _state_frame(self) -> None:
        """Let the axis' name say what the frame leaves open; refuse an axis that is not there."""
        object.__setattr__(self, "frame", frame_with(self.axis, self.frame))
        self.frame.axis(self.axis)

    @abc.abstractmethod
    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """`p(t), p'(t), p''(t)` in closed form."""

    @abc.abstractmethod
    def transform(self, Omega: Scalar) -> Complex[Array, ""]:
        """`int p(t) exp(-2 pi i Omega t) dt`."""

    def at(self, u: Ray) -> Scalar:
        """The profile at the axis' coordinate."""
        return self.derivatives(u[self.frame.axis(self.axis)])[0]

    def jet(self, u: Ray) -> Jet:
        """Derivatives along the axis, zeros elsewhere."""
        a = self.frame.axis(self.axis)
        p, d, dd = self.derivatives(u[a])
        zero = jnp.zeros((u.size, u.size), u.dtype)
        return Jet(p, zero[0].at[a].set(d), zero.at[a, a].set(dd), self.frame)

    def semi_series(self, Omega_axis: Scalar, window: Grid | None) -> "Series":
        """One harmonic, of frequency zero: the convolution theorem."""
        c = self.transform(Omega_axis).astype(jnp.result_type(Omega_axis, 1j))
        return Series(jnp.zeros((1, self.frame.dims)), c[None])


class GaussianProfile(Profile):
    """`weight / (sigma sqrt(2 pi)) exp(-t^2 / (2 sigma^2))`: the Gaussian lobe.

    Args:
        sigma: standard deviation, in the unit of the axis.
        axis: name of the coordinate it acts along.
        frame: names of all coordinates; left out, those that `axis` names, or of the light.
        weight: its integral (an albedo).

    Raises:
        ValueError: if `sigma` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import GaussianProfile
        >>> GaussianProfile(0.5).transform(jnp.array(0.0)).item()
        1.0
    """

    sigma: Scalar = eqx.field(converter=as_float)
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=UNSTATED)
    weight: Scalar = eqx.field(converter=as_float, default=1.0)

    def __check_init__(self):
        """Refuse a width that is not one."""
        check_positive("sigma", self.sigma)
        self._state_frame()

    def half_width(self) -> Scalar:
        """9 standard deviations: the tail beyond is below 1e-18."""
        return 9.0 * self.sigma

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """`p, -t/s^2 p, (t^2/s^2 - 1)/s^2 p`."""
        sigma = nan_unless(self.sigma > 0, self.sigma)
        s2 = sigma**2
        p = self.weight / (sigma * float(np.sqrt(2.0 * np.pi))) * jnp.exp(-0.5 * t**2 / s2)
        slope = -t / s2 * p
        # From the slope, which is zero far away, where the square of t leaves the range.
        return p, slope, -(p + t * slope) / s2

    def transform(self, Omega: Scalar) -> Array:
        """`weight exp(-2 pi^2 sigma^2 Omega^2)`."""
        sigma = nan_unless(self.sigma > 0, self.sigma)
        return self.weight * jnp.exp(-2.0 * (np.pi * sigma * Omega) ** 2)

    def spread(self) -> Scalar:
        """`1 / (8 pi^2 sigma^2)`."""
        return 1.0 / (8.0 * np.pi**2 * nan_unless(self.sigma > 0, self.sigma) ** 2)
