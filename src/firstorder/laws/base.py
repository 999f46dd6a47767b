"""Laws: one operator, applied to five portraits of light.

A law is written as pointwise rules, in the order of the columns of R07 Fig. 2: the value, the
jet (gradient and Hessian), the spectrum, the covariance and the wavelet coefficients of the
result, from those of the operand. A rule that does not exist refuses with the reason. Applied to
a portrait, a law returns a portrait of the same kind, evaluated lazily.
"""

from __future__ import annotations

import abc
from typing import TypeVar

import jax
import jax.numpy as jnp

from firstorder._argument_checks import check_real_attributes
from firstorder._display import Module, in_notebook
from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields._series import Series, sampled_series
from firstorder.fields.covariance import Covariance
from firstorder.fields.extent import Extent
from firstorder.fields.field import Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.fields.wavelet import Wavelet
from firstorder.typing import ComplexScalar, Frequency, Ray, Scalar

Portrait = TypeVar("Portrait", Field, Jet, Spectrum, Covariance, Wavelet)


class Law(Module):
    """One of the five operators of light transport (R07 Fig. 2).

    `law(portrait)` is the transformed portrait. A jet at one ray needs the ray: use `push`.
    """

    _repr_markdown_ = in_notebook

    def __check_init__(self):
        """Refuse complex numbers: light is real."""
        check_real_attributes(self)

    def frame(self, frame: Frame) -> Frame:
        """Frame of the result, given that of the operand."""
        return frame

    @abc.abstractmethod
    def value(self, f: Field, u: Ray) -> Scalar:
        """Radiance of the result at `u`."""

    @abc.abstractmethod
    def jet(self, f: Field, u: Ray) -> Jet:
        """Value, gradient and Hessian of the result at `u`, in closed form."""

    @abc.abstractmethod
    def edges(self, f: Field) -> tuple[Edge, ...]:
        """Edges of the result."""

    def push(self, jet: Jet, u: Ray) -> Jet:
        """Jet of the result at `u` from the operand's jet at the one ray that `u` comes from."""
        raise Refused(f"{_name(self)} looks at many rays, so it does not act on a jet at one ray")

    def spectrum(self, F: Spectrum, Omega: Frequency) -> ComplexScalar:
        """Spectral density of the result at `Omega`."""
        raise Refused(f"{_name(self)} has no simple Fourier formula")

    def extent(self, extent: Extent, frame: Frame) -> Extent | None:
        """Extent of the result for light in `frame` of the given extent; None if not known."""
        return None

    def series(self, f: Field, window: Grid) -> Series:
        """Fourier series of the result on a window, for a result that multiplies other light."""
        if self.edges(f):
            raise Refused(f"a {_name(self)} with edges has no closed-form series")
        return sampled_series(FieldImage(self, f), window)

    def covariance(self, S: Covariance) -> Covariance:
        """Covariance of the result's spectrum."""
        raise Refused(f"{_name(self)} has no covariance rule")

    def wavelet(self, W: Wavelet) -> Wavelet:
        """Haar coefficients of the result."""
        raise Refused(f"{_name(self)} has no simple wavelet formula")

    def __call__(self, portrait: Portrait) -> Portrait:
        """The law applied to a portrait of any kind."""
        match portrait:
            case Field():
                return FieldImage(self, portrait)
            case Spectrum():
                image = SpectrumImage(self, portrait)
                # Trace it once, abstractly: a law that refuses does so now and not when asked.
                zero = jax.ShapeDtypeStruct((image.frame.dims,), jnp.result_type(float))
                jax.eval_shape(image.at, zero)
                return image
            case Covariance():
                return self.covariance(portrait)
            case Wavelet():
                return self.wavelet(portrait)
            case Jet():
                raise Refused("a jet at one ray needs that ray: use push(jet, u)")
        raise TypeError(
            f"Argument `portrait` must be a portrait, but is {type(portrait).__name__}."
        )


def _name(law: Law) -> str:
    return type(law).__name__.lower()


class FieldImage(Field):
    """The field that a law makes of a field.

    Args:
        law: what happens to the light.
        operand: the light before.

    Example:
        >>> from firstorder.fields import Affine
        >>> from firstorder.laws import FieldImage, Move
        >>> FieldImage(Move([[1.0, -2.0], [0.0, 1.0]]), Affine([1.0, 0.0], 0.0))(5.0, 1.0).item()
        3.0
    """

    law: Law
    operand: Field

    @property
    def frame(self) -> Frame:
        """Frame after the law."""
        return self.law.frame(self.operand.frame)

    def at(self, u: Ray) -> Scalar:
        """The law's value."""
        return self.law.value(self.operand, u)

    def jet(self, u: Ray) -> Jet:
        """The law's jet."""
        return self.law.jet(self.operand, u)

    def edges(self) -> tuple[Edge, ...]:
        """The law's edges."""
        return self.law.edges(self.operand)

    def spectrum(self) -> Spectrum:
        """The law, applied to the operand's spectrum."""
        return self.law(self.operand.spectrum())

    def series(self, window: Grid) -> Series:
        """The law's series."""
        return self.law.series(self.operand, window)

    def covariance(self) -> Covariance:
        """The law, applied to the operand's covariance."""
        return self.law(self.operand.covariance())


class SpectrumImage(Spectrum):
    """The spectrum that a law makes of a spectrum."""

    law: Law
    operand: Spectrum

    @property
    def frame(self) -> Frame:
        """Frame after the law."""
        return self.law.frame(self.operand.frame)

    def at(self, Omega: Frequency) -> ComplexScalar:
        """The law's spectral density."""
        return self.law.spectrum(self.operand, Omega)

    def extent(self) -> Extent | None:
        """Extent that the law gives to that of its operand."""
        extent = self.operand.extent()
        return None if extent is None else self.law.extent(extent, self.operand.frame)
