"""Factors of one angle, and BRDFs made of them: `f(theta_i) rho(theta_o - theta_r) g(theta_o)`."""

import abc
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from firstorder._argument_checks import is_concrete
from firstorder.conventions import Frame, fourier_kernel
from firstorder.fields._coerce import field_of
from firstorder.fields._series import Series, axis_series
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.kernel import Kernel
from firstorder.fields.spectrum import Grid
from firstorder.laws.base import Law
from firstorder.laws.convolve import Domain, Line
from firstorder.laws.multiply import Multiply
from firstorder.numerics._quadrature import composite_gauss_legendre
from firstorder.transport.event import Chain, Event, require_frame
from firstorder.transport.events.mirror import Mirror
from firstorder.transport.events.reflection import Reflection
from firstorder.typing import Ray, Scalar


class Angular(Field):
    """A function of one angle alone, smooth between `breaks`: a cosine, a Fresnel term.

    A break is an angle and the formula above it minus the formula below it, itself such a
    function. A kink is a break whose difference vanishes there: values and gradients of integrals
    do not notice it, their Hessians do, and quadrature splits at it.

    With `periodic`, the angle is first brought into [-pi, pi): the same function on the circle.
    """

    axis: eqx.AbstractVar[str]
    periodic: eqx.AbstractVar[bool]

    @abc.abstractmethod
    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """`p(t), p'(t), p''(t)` in closed form."""

    def breaks(self) -> "tuple[tuple[Scalar, Angular], ...]":
        """Angles at which the formula changes, with the formula above minus the one below."""
        return ()

    def _wrapped(self, t: Scalar) -> Scalar:
        """The angle in [-pi, pi) on the circle, as it is on the line."""
        return t - 2.0 * np.pi * jnp.round(t / (2.0 * np.pi)) if self.periodic else t

    def at(self, u: Ray) -> Scalar:
        """The function of the axis' angle."""
        return self.derivatives(self._wrapped(u[self.frame.axis(self.axis)]))[0]

    def jet(self, u: Ray) -> Jet:
        """Derivatives along the axis, zeros elsewhere."""
        a = self.frame.axis(self.axis)
        p, d, dd = self.derivatives(self._wrapped(u[a]))
        zero = jnp.zeros((u.size, u.size), u.dtype)
        return Jet(p, zero[0].at[a].set(d), zero.at[a, a].set(dd), self.frame)

    def edges(self) -> tuple[Edge, ...]:
        """One edge per break; on the circle valid along any interval of at most 2 pi."""
        normal = jnp.zeros(self.frame.dims).at[self.frame.axis(self.axis)].set(1.0)
        if not self.periodic:
            return tuple(Edge(Affine(normal, -t, self.frame), jump) for t, jump in self.breaks())
        return tuple(
            Edge(_HalfTurn(t, 0.0, self.axis, self.frame), Multiply(_side(t, self))(jump))
            for t, jump in self.breaks()
        )

    def series(self, window: Grid) -> Series:
        """Fourier coefficients by Gauss-Legendre quadrature that splits at the breaks.

        Of a traced window of more than a turn the outermost breaks are not split at.
        """
        a = self.frame.axis(self.axis)
        half = 0.5 * window.extent[a]
        ends = jnp.asarray(window.center[a] - half), jnp.asarray(window.center[a] + half)
        turns = _turns(window.center[a], half) if self.periodic else (0.0,)
        breaks = [jnp.asarray(b) + turn for b, _ in self.breaks() for turn in turns]
        # A harmonic of order k has k waves on the window, and two nodes resolve a wave.
        t, w = composite_gauss_legendre(*ends, breaks, 24 + 2 * window.size[a])
        samples = w * jax.vmap(lambda s: self.derivatives(self._wrapped(s))[0])(t)

        def coefficients(k, period):
            return fourier_kernel(jnp.asarray(k / period)[:, None, None], t[:, None]) @ (
                samples / period
            )

        return axis_series(coefficients, jnp.eye(self.frame.dims)[a], window, a)


def _turns(center: float | Scalar, half: float | Scalar) -> Sequence | np.ndarray:
    """Whole turns by which angles around zero may come into a window [rad]."""
    middle, reach = center / (2.0 * np.pi), half / (2.0 * np.pi) + 0.5
    if not is_concrete((middle, reach)):
        return [2.0 * np.pi * (jnp.round(middle) + k) for k in (-1, 0, 1)]
    return 2.0 * np.pi * np.arange(np.floor(middle - reach), np.ceil(middle + reach) + 1.0)


class _HalfTurn(Angular):
    """`sin((t - angle) / 2 + phase)`: zeros one turn apart make it a level on the circle."""

    angle: Array
    phase: float
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=Frame())
    periodic: bool = eqx.field(static=True, default=False)

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Sine of half the angle."""
        half = 0.5 * (t - self.angle) + self.phase
        return jnp.sin(half), 0.5 * jnp.cos(half), -0.25 * jnp.sin(half)


def _side(angle: Array, of: Angular) -> _HalfTurn:
    """+1 where the level `_HalfTurn(angle)` rises, -1 where it falls, flat at both."""
    return _HalfTurn(angle, 0.5 * np.pi, of.axis, of.frame)


class AngularFactor(Event):
    """`l'(x, theta) = l(x, theta) f(theta)` in the local frame, of incoming or of outgoing light.

    Spectrum: a convolution along Omega_theta alone, `F (*) f_hat(Omega_theta) delta(Omega_x)`.

    Args:
        factor: function of the angle, as a field or a plain function.
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).

    Reference: D05 eqs. 12, 17.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import AngularFactor, Fresnel
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> round(AngularFactor(Fresnel(1.5))(L)(0.0, 0.0).item(), 12)
        0.04
    """

    factor: Field = eqx.field(converter=field_of("factor", axis=1))
    window: Grid | None = None

    def law(self, frame: Frame) -> Law:
        """Multiply."""
        fits = len(frame.directions) > 0 and not frame.uses_slopes
        require_frame(fits, self, frame, "light in angles")
        factor = self.factor.in_frame(frame, "factor", type(self).__name__)
        return Multiply(factor, self.window, type(self).__name__)


def separable(
    lobe: Kernel,
    incoming: Field | None = None,
    outgoing: Field | None = None,
    domain: Domain | None = None,
    nodes: int = 64,
    window: Grid | None = None,
) -> Chain:
    """Reflection by the separable BRDF `f(theta_i) rho(theta_o - theta_r) g(theta_o)`.

    A chain for incoming light in the local frame: multiply by f, mirror, convolve with rho,
    multiply by g. Spectrum:
    `((F (*) f_hat)(Omega_x, -Omega_theta) rho_hat(Omega_theta)) (*) g_hat`.
    A sum of such BRDFs is the sum of the reflected lights: every portrait but the covariance is
    linear.

    Args:
        lobe: rho, a kernel of the angle from the mirror direction.
        incoming: f, a function of the angle of incidence; 1 if left out.
        outgoing: g, a function of the outgoing angle; 1 if left out.
        domain: where the lobe's convolution lives; the line if left out.
        nodes: quadrature nodes per smooth piece of the convolution.
        window: box and number of waves for the spectra; left out, it holds the light.

    Reference: D05 eq. 17 and §4.3.

    Example:
        >>> from firstorder.fields import GaussianProfile
        >>> from firstorder.transport import Fresnel, separable
        >>> len(separable(GaussianProfile(0.1), incoming=Fresnel(1.5)).events)
        3
    """
    reflect = (Mirror(), Reflection(lobe, domain or Line(), nodes, window))
    before = () if incoming is None else (AngularFactor(incoming, window),)
    after = () if outgoing is None else (AngularFactor(outgoing, window),)
    return Chain((*before, *reflect, *after))
