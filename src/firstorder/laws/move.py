"""Move: a linear change of ray coordinates, `h(u) = f(M u + c)`.

Written once; every shear, scale, flip and shift of the library is one of these, in flatland and
in space.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_invertible
from firstorder.conventions import Frame, _check_frame, fourier_kernel
from firstorder.errors import Refused
from firstorder.fields._series import Series
from firstorder.fields.covariance import Covariance
from firstorder.fields.extent import Extent
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.laws.base import Law
from firstorder.numerics._small_matrices import congruence, product
from firstorder.typing import ComplexScalar, Frequency, Ray, Scalar, as_float


class Move(Law):
    """`h(u) = f(M u + c)`.

    Jet: `grad h = M^T grad f`, `Hess h = M^T Hess f M` at `M u + c` (R07 eq. 7).
    Spectrum: `H(Omega) = exp(2 pi i Omega . M^-1 c) F(M^-T Omega) / |det M|` (R07 eq. 54): the
    *argument* is pulled back by `M^-T`, while a *point of energy* moves by `M^T`.
    Covariance: `M^T Sigma M`.

    Args:
        M: matrix, rows in the operand's coordinates. A matrix that is not square (a projection)
            is allowed for values and jets; spectra then refuse.
        c: shift, a vector, zero if left out.
        to: frame of the result, the operand's if left out.

    Raises:
        ValueError: if `M` is square and singular, or not finite.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import gaussian
        >>> from firstorder.laws import Move
        >>> shear = Move([[1.0, -2.0], [0.0, 1.0]])
        >>> shear(gaussian((0.0, 0.0), (1.0, 1.0)))(2.0, 1.0).item() == jnp.exp(-0.5).item()
        True
    """

    M: Array = eqx.field(converter=as_float)
    c: Array
    to: Frame | None = eqx.field(static=True)

    def __init__(self, M, c=None, to: Frame | None = None):
        """Store the map; see the class."""
        self.M = as_float(M)
        self.c = as_float(np.zeros(self.M.shape[0], self.M.dtype) if c is None else c)
        self.to = to
        if to is not None:
            _check_frame(to, "to")
        if self.M.ndim != 2 or self.c.shape != (self.M.shape[0],):
            shapes = f"{self.M.shape} and {self.c.shape}"
            raise ValueError(
                f"Arguments `M` and `c` must be a matrix and its shift, but are {shapes}."
            )
        check_invertible("M", self.M)
        check_finite("M", self.M)
        check_finite("c", self.c)

    def frame(self, frame: Frame) -> Frame:
        """The named frame, or the operand's."""
        return self.to or frame

    def preimage(self, u: Ray) -> Float[Array, " m"]:
        """`M u + c`, as a sum that fuses under `vmap`."""
        return jnp.stack(product(self.M, u)) + self.c

    def value(self, f: Field, u: Ray) -> Scalar:
        """`f(M u + c)`."""
        return f.at(self.preimage(u))

    def jet(self, f: Field, u: Ray) -> Jet:
        """`(f, M^T grad f, M^T Hess f M)` at `M u + c`."""
        return self.push(f.jet(self.preimage(u)), u)

    def push(self, jet: Jet, u: Ray) -> Jet:
        """Jet after the move at u, from numbers at `M u + c`."""
        gradient = jnp.stack(product(self.M.T, jet.gradient))
        hessian = congruence(self.M, jet.hessian)
        return Jet(jet.value, gradient, hessian, self.frame(jet.frame))

    def edges(self, f: Field) -> tuple[Edge, ...]:
        """Edges move with the light."""
        return tuple(Edge(self.level(e.level), self(e.jump)) for e in f.edges())

    def level(self, level: Field) -> Field:
        """A moved level; a straight one stays a straight one, and its crossing a quotient."""
        if isinstance(level, Affine):
            normal = jnp.sum(self.M * level.normal[:, None], axis=0)
            offset = level.offset + jnp.sum(level.normal * self.c)
            return Affine(normal, offset, self.frame(level.frame))
        return self(level)

    def series(self, f: Field, window: Grid) -> Series:
        """Frequencies are points of energy and move by `M^T`; the shift is a phase.

        The operand is expanded on the box around the window's image, where its light is.
        """
        s = f.series(window.moved(self.M, self.c))
        phase = fourier_kernel(s.frequencies, -self.c)
        return Series(s.frequencies @ self.M, s.coefficients * phase)

    def spectrum(self, F: Spectrum, Omega: Frequency) -> ComplexScalar:
        """Argument pulled back by `M^-T`; phase for the shift; `1 / |det M|`."""
        if self.M.shape[0] != self.M.shape[1]:
            raise Refused("a move that is not square has no spectrum of its own: integrate first")
        inverse = jnp.linalg.inv(self.M)
        back = jnp.sum(inverse.T * Omega, axis=-1)
        # exp(+2 pi i Omega . M^-1 c) is the Fourier kernel at the point -M^-1 c.
        phase = fourier_kernel(Omega, -jnp.sum(inverse * self.c, axis=-1))
        return phase / jnp.abs(jnp.linalg.det(self.M)) * F.at(back)

    def extent(self, extent: Extent, frame: Frame) -> Extent | None:
        """Light at M u + c before is at u after; a move that is not square says nothing."""
        if self.M.shape[0] != self.M.shape[1]:
            return None
        inverse = jnp.linalg.inv(self.M)
        return extent.moved(inverse, -inverse @ self.c)

    def covariance(self, S: Covariance) -> Covariance:
        """`M^T Sigma M`: energy moves by `M^T`."""
        return Covariance(congruence(self.M, S.matrix), self.frame(S.frame))
