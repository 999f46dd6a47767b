"""Diffuse shading in slopes: weigh by the cosine and the Jacobian, then add all directions."""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import (
    check_count,
    check_kind,
    check_not_negative,
    check_positive,
    nan_unless,
)
from firstorder.conventions import FLATLAND_SLOPE, Frame, fourier_kernel
from firstorder.fields._series import Series
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid
from firstorder.laws.base import Law
from firstorder.laws.integrate import Integrate
from firstorder.laws.multiply import Multiply
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.transport.event import Chain, Event, require_frame
from firstorder.typing import Array, Ray, Scalar, as_float


class SlopeWeight(Field):
    """Projected area of a direction in slopes: `g = scale (1 + |v|^2)^(-(m + 2) / 2)`.

    The cosine times the Jacobian of the slopes, m directions: `cos(theta) d theta = g(v) dv` in
    flatland, exponent 3/2; `cos(theta) dw = G(v, w) dv dw` in space, exponent 2. It does not
    depend on the position.

    Its transform is `2 z K_1(z)` in flatland and `pi z K_1(z)` in space, `z = 2 pi |Omega|`, K_1
    the modified Bessel function: one and the same curve (`transform`).

    Args:
        frame: names of the coordinates; directions must be slopes.
        scale: constant factor.

    Raises:
        TypeError: if `frame` is none.
        ValueError: if a direction of the frame is no slope.

    Reference: D05 §3.3 (g and its transform), §5.1 (G), Fig. 5.

    Example:
        >>> from firstorder.transport import SlopeWeight
        >>> SlopeWeight()(0.0, 0.0).item()
        1.0
    """

    frame: Frame = eqx.field(static=True, default=FLATLAND_SLOPE)
    scale: Scalar = eqx.field(converter=as_float, default=1.0)

    def __check_init__(self):
        """Refuse angles."""
        check_kind("frame", self.frame, Frame, "a `Frame`, such as FLATLAND_SLOPE")
        if not self.frame.uses_slopes or len(self.frame.directions) > 2:
            raise ValueError(
                f"Argument `frame` must name one or two slopes, but is {self.frame.coordinates}."
            )

    @property
    def _exponent(self) -> float:
        return 0.5 * len(self.frame.directions) + 1.0

    def _slopes(self, u: Ray) -> Array:
        """The ray with its positions set to zero."""
        return u * np.isin(np.arange(u.size), self.frame.directions)

    def at(self, u: Ray) -> Scalar:
        """The weight."""
        return self.scale * (1.0 + jnp.sum(self._slopes(u) ** 2)) ** -self._exponent

    def jet(self, u: Ray) -> Jet:
        """`-2 p v g / s` and `(4 p (p + 1) v v^T / s - 2 p) g / s`, s = 1 + |v|^2, exponent p."""
        p, v = self._exponent, self._slopes(u)
        s = 1.0 + jnp.sum(v**2)
        g = self.scale * s**-p
        directions = jnp.diag(self._slopes(jnp.ones_like(u)))
        bend = 4.0 * p * (p + 1.0) / s**2 * v[:, None] * v - 2.0 * p / s * directions
        return Jet(g, -2.0 * p / s * g * v, g * bend, self.frame)

    def transform(self, Omega: Array) -> Scalar:
        """Fourier transform over the m slopes at the frequency `Omega`, shape (m,)."""
        z2 = (2.0 * np.pi) ** 2 * jnp.sum(Omega**2)
        total = 2.0 if len(self.frame.directions) == 1 else np.pi
        return self.scale * total * bessel_zk1(z2)

    def series(self, window: Grid) -> Series:
        """Fourier coefficients on the window's extent along the slopes, by Gauss-Legendre.

        On the window the periodic continuation *is* the weight, although it has a kink at the
        border, so products with light inside the window are exact.
        """
        axes = self.frame.directions
        harmonics = [np.arange(-(window.size[a] // 2), window.size[a] // 2 + 1) for a in axes]
        frequencies = [
            jnp.asarray(k) / window.extent[a] for k, a in zip(harmonics, axes, strict=True)
        ]
        rules = [_composite(max(8, k.size // 4)) for k in harmonics]
        slopes = [
            window.center[a] + 0.5 * window.extent[a] * t
            for (t, _), a in zip(rules, axes, strict=True)
        ]
        c = self(*self._placed(jnp.meshgrid(*slopes, indexing="ij")))
        for i, (Omega, v, (_, w)) in enumerate(zip(frequencies, slopes, rules, strict=True)):
            kernel = fourier_kernel(Omega[:, None, None], v[None, :, None]) * (0.5 * w)
            c = jnp.moveaxis(jnp.tensordot(kernel, c, axes=(1, i)), 0, i)
        nodes = self._placed(jnp.meshgrid(*frequencies, indexing="ij"))
        return Series(
            jnp.stack([jnp.broadcast_to(n, c.shape).ravel() for n in nodes], -1), c.ravel()
        )

    def _placed(self, along: Sequence[Array]) -> list:
        """One entry per coordinate: those given on the directions, zero on positions."""
        given = dict(zip(self.frame.directions, along, strict=True))
        return [given.get(i, 0.0) for i in range(self.frame.dims)]

    def covariance(self) -> Covariance:
        """`int |grad g|^2 / (4 pi^2 int g^2)`: 15/16 in flatland, 6/5 per slope in space.

        Adding it to that of light is an approximation: the weight is no Gaussian.
        """
        second = 15.0 / 16.0 if len(self.frame.directions) == 1 else 6.0 / 5.0
        diagonal = np.isin(np.arange(self.frame.dims), self.frame.directions)
        return Covariance(jnp.diag(second / (4.0 * np.pi**2) * diagonal), self.frame)


def _composite(panels: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre on [-1, 1], 32 nodes on each of equal panels: enough for two waves a panel."""
    t, w = gauss_legendre(32)
    middle = (2.0 * np.arange(panels)[:, None] + 1.0) / panels - 1.0
    return (middle + t / panels).ravel(), np.tile(w / panels, panels)


def bessel_zk1(z2: Array) -> Array:
    """`z K_1(z)` of `z2 = z^2 >= 0`, K_1 the modified Bessel function of the second kind.

    `z K_1(z) = int_0^inf exp(-sqrt(q^2 + z^2)) dq`, by the trapezoid rule in log q, exponentially
    accurate: relative error below 1e-13 up to z = 100; value 1 and slope 0 at zero. It takes the
    square of z, so that no absolute value stands in the way of a derivative.

    Args:
        z2: squares, an array, not negative.

    Returns:
        The product, between 1 and 0; an array of that shape.

    Reference: D05 §3.3.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.transport import bessel_zk1
        >>> round(bessel_zk1(jnp.array(1.0)).item(), 12)  # K_1(1)
        0.601907230197
    """
    h = 0.125
    q = jnp.asarray(np.exp(h * np.arange(-300, 53)), jnp.result_type(z2, float))
    return h * jnp.sum(q * jnp.exp(-jnp.sqrt(q**2 + as_float(z2)[..., None])), axis=-1)


class DifferentialIrradiance(Event):
    """Contribution of each direction to the reflected light: `dE(x, v) = rho l_i(x, v) g(v)`.

    With rho = 1 it is D05's differential irradiance. The spectrum is convolved with that of g
    along the slope.

    Args:
        rho: diffuse BRDF, not negative.
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).

    Raises:
        ValueError: if `rho` is negative. A traced `rho < 0` gives NaN.

    Reference: D05 §3.3.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import Constant
        >>> from firstorder.transport import DifferentialIrradiance
        >>> dE = DifferentialIrradiance(0.5)(Constant(1.0, FLATLAND_SLOPE))
        >>> dE(0.0, 0.0).item()
        0.5
    """

    rho: Scalar = eqx.field(converter=as_float, default=1.0)
    window: Grid | None = None

    def __check_init__(self):
        """Refuse a surface that takes light away twice."""
        check_not_negative("rho", self.rho)

    def law(self, frame: Frame) -> Law:
        """Multiply by the weight."""
        fits = frame.sense == "incoming" and frame.uses_slopes
        require_frame(fits, self, frame, "incoming light in slopes")
        weight = SlopeWeight(frame, nan_unless(self.rho >= 0, self.rho))
        return Multiply(weight, self.window, type(self).__name__)


class Gather(Event):
    """The sum over one direction: `E(x) = int dE(x, v) dv`, split at the shadow edges.

    The spectrum is the slice at zero angular frequency.

    Args:
        axis: name of the slope.
        reach: slopes beyond it are left out; light and window must fit in [-reach, reach].
        nodes: Gauss-Legendre nodes per smooth piece.

    Raises:
        ValueError: if `reach` or `nodes` is not positive.

    Called: diffuse integration (D05 §3.3).

    Reference: D05 eqs. 6-7.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Gather
        >>> E = Gather(reach=9.0)(gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE))
        >>> round(E(0.0).item(), 12)  # sqrt(2 pi)
        2.506628274631
    """

    axis: str = eqx.field(static=True, default="v")
    reach: Scalar = eqx.field(converter=as_float, default=8.0)
    nodes: int = eqx.field(static=True, default=64)

    def __check_init__(self):
        """Refuse an interval that is none."""
        check_positive("reach", self.reach)
        check_count("nodes", self.nodes)

    def law(self, frame: Frame) -> Law:
        """Integrate along the slope."""
        fits = frame.sense == "incoming" and self.axis in frame.coordinates
        require_frame(fits, self, frame, f"incoming light with a coordinate {self.axis}")
        reach = nan_unless(self.reach > 0, self.reach)
        return Integrate(self.axis, -reach, reach, self.nodes)


def diffuse(rho=1.0, reach=8.0, window: Grid | None = None, nodes: int = 64, axes=("v",)) -> Chain:
    """Light that a diffuse surface reflects: `l_o(x) = rho int l_i(x, v) g(v) dv`.

    Two events, `DifferentialIrradiance` and one `Gather` per direction, so a path shows the
    differential irradiance too. Spectrum: `rho [l_i(Omega_x, .) (*) g](0)` in Fourier space.

    rho is the BRDF. A surface that reflects the fraction `albedo` of its irradiance has
    `rho = albedo / 2` in flatland (`int g dv = 2`), `albedo / pi` in space; D05 calls rho itself
    the albedo, with which a white surface doubles the light. Valid when the light vanishes beyond
    `reach`: a sky down to the horizon needs angles instead.

    Args:
        rho: diffuse BRDF, not negative.
        reach: largest slope that is looked at.
        window: box and number of waves for the spectrum; left out, it holds the light (see
            `Multiply`).
        nodes: quadrature nodes per smooth piece.
        axes: names of the slopes: `("v",)` in flatland, `("v", "w")` in space.

    Returns:
        The chain of events, whose light depends on position alone.

    Raises:
        ValueError: if `rho` is negative, or `reach` or `nodes` is not positive.

    Reference: D05 eqs. 6-7.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import Constant
        >>> from firstorder.transport import diffuse
        >>> white = diffuse(0.5, reach=20.0, nodes=256)  # albedo 1
        >>> round(white(Constant(1.0, FLATLAND_SLOPE))(0.0).item(), 2)  # a furnace
        1.0
    """
    events: tuple[Event, ...] = tuple(Gather(axis, reach, nodes) for axis in axes)
    return Chain((DifferentialIrradiance(rho, window), *events))
