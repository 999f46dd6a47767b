"""The Gaussian field: the one light that has every portrait in closed form."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from firstorder._argument_checks import (
    check_finite,
    check_positive,
    check_shape,
    is_concrete,
    nan_unless,
)
from firstorder.conventions import UNSTATED, Frame, fourier_kernel
from firstorder.fields.covariance import Covariance
from firstorder.fields.extent import Extent
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Spectrum
from firstorder.numerics._host import hosted
from firstorder.numerics._small_matrices import inner, product, quadratic
from firstorder.typing import ComplexScalar, Frequency, Matrix, Ray, Scalar, Vector, as_float


class Gaussian(Field):
    """`amplitude * exp(-(u - center)^T precision (u - center) / 2)`, in any dimension.

    Off-centre and correlated by choice: a centred Gaussian hides phase errors, an uncorrelated
    one hides the sign of a shear.

    Args:
        center: n coordinates of the peak [units of the coordinates].
        precision: symmetric positive definite n x n matrix, the inverse of the covariance in
            primal space.
        amplitude: radiance at the peak [any units].
        frame: names of the coordinates.

    Raises:
        ValueError: if `precision` is not symmetric positive definite, or a shape is wrong.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import Gaussian
        >>> L = Gaussian(jnp.zeros(2), jnp.eye(2))
        >>> L.jet(jnp.array([0.0, 0.0])).hessian[0, 0].item()
        -1.0
    """

    center: Vector = eqx.field(converter=as_float)
    precision: Matrix = eqx.field(converter=lambda P: _precision(P))
    amplitude: Scalar = eqx.field(converter=as_float, default=1.0)
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def __check_init__(self):
        """Refuse a shape that is not a bell."""
        n = self.frame.dims
        check_shape("center", self.center, (n,))
        check_shape("precision", self.precision, (n, n))
        check_finite("center", self.center)
        check_finite("precision", self.precision)
        check_finite("amplitude", self.amplitude)
        if is_concrete(self.precision):
            P = _in_own_units(np.asarray(self.precision))
            if not np.allclose(P, P.T) or np.min(np.linalg.eigvalsh(P)) <= 0:
                raise ValueError(
                    "Argument `precision` must be symmetric and positive definite, but is not."
                )

    def at(self, u: Ray) -> Scalar:
        """The bell."""
        return self.amplitude * jnp.exp(-0.5 * quadratic(self.precision, u - self.center))

    def jet(self, u: Ray) -> Jet:
        """`grad = -f P h`, `Hess = f (P h h^T P - P)` with `h = u - center`."""
        h = u - self.center
        slopes = [-p for p in product(self.precision, h)]
        f = self.amplitude * jnp.exp(0.5 * inner(slopes, h))
        g = jnp.stack(slopes)
        # The gradient first: far away it is zero, where squares of g leave the range.
        gradient = f * g
        return Jet(f, gradient, gradient[:, None] * g - f * self.precision, self.frame)

    def spectrum(self) -> Spectrum:
        """A Gaussian again, with a phase for the centre."""
        return _GaussianSpectrum(self)

    def covariance(self) -> Covariance:
        """`precision / (8 pi^2)`: of the *power* spectrum, hence 8 and not 4."""
        return Covariance(self.precision / (8.0 * np.pi**2), self.frame)


def _precision(P) -> Array:
    """A precision; NaN for a traced one whose leading minors are not all positive (Sylvester)."""
    P = as_float(P)
    if is_concrete(P) or P.ndim != 2:
        return P
    minors = jnp.stack([jnp.linalg.det(P[:k, :k]) for k in range(1, P.shape[0] + 1)])
    return nan_unless(jnp.all(minors > 0.0), P)


def _in_own_units(P: np.ndarray) -> np.ndarray:
    """A matrix in units of the roots of its diagonal: what is asked of it knows no metre."""
    own = np.diagonal(P)
    root = np.sqrt(np.where(own > 0.0, own, 1.0))
    return P / root / root[:, None]


class _GaussianSpectrum(Spectrum):
    """`a sqrt(det(2 pi P^-1)) exp(-2 pi^2 Omega^T P^-1 Omega) exp(-2 pi i Omega . center)`."""

    gaussian: Gaussian

    @property
    def frame(self) -> Frame:
        """Frame of the field."""
        return self.gaussian.frame

    def at(self, Omega: Frequency) -> ComplexScalar:
        """Closed form."""
        g = self.gaussian
        spread = jnp.linalg.inv(g.precision)
        scale = g.amplitude * jnp.sqrt(jnp.linalg.det(2.0 * np.pi * spread))
        bell = scale * jnp.exp(-2.0 * np.pi**2 * quadratic(spread, Omega))
        return bell * fourier_kernel(Omega, g.center)

    def extent(self) -> Extent:
        """Extent of the light: its own covariance about its centre."""
        g = self.gaussian
        return Extent.bell(g.center, jnp.linalg.inv(g.precision))


def gaussian(center, sigma, correlation=0.0, amplitude=1.0, frame: Frame = UNSTATED) -> Gaussian:
    """Flatland Gaussian from standard deviations and a correlation coefficient.

    Args:
        center: (x, theta) of the peak.
        sigma: standard deviations along x and theta.
        correlation: in (-1, 1); it tilts the bell.
        amplitude: radiance at the peak.
        frame: names of the coordinates.

    Raises:
        ValueError: if a standard deviation is not positive, or |correlation| >= 1.

    Example:
        >>> from firstorder.fields import gaussian
        >>> gaussian((0.0, 0.0), (1.0, 2.0))(0.0, 0.0).item()
        1.0
    """
    sigma, c = as_float(sigma), as_float(correlation)
    check_shape("sigma", sigma, (2,))
    check_positive("sigma", sigma)
    if is_concrete(c) and not np.all(np.abs(c) < 1):
        raise ValueError(f"Argument `correlation` must lie in (-1, 1), but is {c}.")
    xp, sigma, c = hosted(sigma, c)
    c = xp.asarray(c, dtype=jnp.result_type(sigma, c))
    sigma, c = nan_unless(sigma > 0, sigma), nan_unless(abs(c) < 1, c)
    tilt = xp.stack([xp.stack([xp.ones_like(c), -c]), xp.stack([-c, xp.ones_like(c)])])
    precision = tilt / (sigma[:, None] * sigma) / (1.0 - c**2)
    return Gaussian(as_float(center), as_float(precision), as_float(amplitude), frame)
