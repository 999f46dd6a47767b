"""Unknown light and unknown lobes: fields of which only the name is given."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import sympy

from firstorder.conventions import FLATLAND, UNSTATED, Frame, frame_with
from firstorder.errors import Refused
from firstorder.fields._series import Series
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.fields.kernel import Kernel, Profile
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.symbolic._programs.functions import unknown_function
from firstorder.symbolic._programs.reading import inserted
from firstorder.typing import Frequency, Ray, Scalar


class UnknownField(Field):
    """Light `L(x, theta)`, a mask `V(x)` or a normal map `n(x)` of which only the name is known.

    It stands wherever a field stands, and `derive` keeps it: `L`, its partial derivatives `L_x`,
    `L_theta`, its spectrum `hat L` and its covariance are symbols in the formula. It has no
    numbers.

    Args:
        name: of the function.
        names: of the coordinates that it depends on; all of the frame if left out.
        frame: of the light; left out, that of the light that it meets.

    Example:
        >>> from firstorder.conventions import FLATLAND
        >>> from firstorder.symbolic import UnknownField, derive
        >>> from firstorder.transport import Bump
        >>> bumpy = UnknownField("L", frame=FLATLAND) >> Bump(UnknownField("n", ("x",)))
        >>> derive(bumpy).gradient.expression[0]
        L_theta(x, theta + n(x))*n_x(x) + L_x(x, theta + n(x))
    """

    name: str = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True, default=())
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def __post_init__(self):
        """All coordinates, if none are named."""
        if not self.names:
            object.__setattr__(self, "names", self.frame.coordinates)
        elif self.frame.implied:
            object.__setattr__(self, "frame", frame_with(self.names[-1], self.frame))

    def _call(self, u: Ray, *along: str) -> Scalar:
        """A partial derivative, at a ray."""
        orders = tuple(along.count(name) for name in self.names)
        if sum(orders) < len(along):
            return 0.0 * u[0]
        axes = [self.frame.axis(name) for name in self.names]
        function = unknown_function(self.name, self.names, orders)
        return inserted(function, jnp.stack([u[i] for i in axes]))

    def at(self, u: Ray) -> Scalar:
        """The function: a symbol in formulas, not a number elsewhere."""
        return self._call(u)

    def jet(self, u: Ray) -> Jet:
        """The function and its partial derivatives."""
        names = self.frame.coordinates
        gradient = jnp.stack([self._call(u, a) for a in names])
        hessian = jnp.stack([jnp.stack([self._call(u, a, b) for b in names]) for a in names])
        return Jet(self.at(u), gradient, hessian, self.frame)

    def spectrum(self) -> Spectrum:
        """The unknown transform."""
        if self.names != self.frame.coordinates:
            raise Refused(
                f"{self.name} does not depend on all coordinates: its transform is a line"
            )
        return _UnknownSpectrum(self.name, self.frame)

    def covariance(self) -> Covariance:
        """A symmetric matrix of symbols `Sigma_L_xx`, `Sigma_L_xtheta`, ...

        Zero along coordinates that the function does not depend on.
        """
        names, n = self.frame.coordinates, range(self.frame.dims)

        def entry(i: int, j: int) -> Scalar:
            if {names[i], names[j]} <= set(self.names):
                return _constant(f"Sigma_{self.name}_{names[i]}{names[j]}", real=True)
            return jnp.zeros(())

        upper = {(i, j): entry(i, j) for i in n for j in n if i <= j}
        rows = [jnp.stack([upper[min(i, j), max(i, j)] for j in n]) for i in n]
        return Covariance(jnp.stack(rows), self.frame)


class _UnknownSpectrum(Spectrum):
    """The transform of an unknown field, `hat L(Omega)`."""

    name: str = eqx.field(static=True)
    frame: Frame = eqx.field(static=True, default=FLATLAND)

    def at(self, Omega: Frequency):
        """A symbol in formulas, not a number elsewhere."""
        names = tuple(f"Omega_{name}" for name in self.frame.coordinates)
        return inserted(unknown_function(f"{self.name}_hat", names), Omega, complex)


class UnknownLobe(Profile):
    """A lobe `rho(theta)` of which only the name is known, for `Reflection` and `Convolve`.

    Args:
        name: of the function.
        axis: the coordinate that it acts along.
        frame: left out, the one that the axis names.

    Example:
        >>> from firstorder.conventions import Frame
        >>> from firstorder.symbolic import UnknownField, UnknownLobe, derive
        >>> from firstorder.transport import Reflection
        >>> mirrored = UnknownField("L", frame=Frame(sense="outgoing"))
        >>> derive(mirrored >> Reflection(UnknownLobe("rho"))).spectrum.expression
        L_hat(Omega_x, Omega_theta)*rho_hat(Omega_theta)
    """

    name: str = eqx.field(static=True)
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def __check_init__(self):
        """The axis names the frame."""
        self._state_frame()

    def half_width(self) -> Scalar:
        """Not known: without an end."""
        return jnp.asarray(jnp.inf)

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """The lobe and its derivatives, as symbols."""
        functions = (unknown_function(self.name, (self.axis,), (k,)) for k in range(3))
        p, d, dd = (inserted(f, jnp.stack([t])) for f in functions)
        return p, d, dd

    def transform(self, Omega: Scalar):
        """The unknown transform."""
        function = unknown_function(f"{self.name}_hat", (f"Omega_{self.axis}",))
        return inserted(function, jnp.stack([Omega]), complex)

    def spread(self) -> Scalar:
        """The second moment of the lobe's power spectrum, as a symbol."""
        return _constant(f"s_{self.name}", positive=True)


class UnknownVaryingLobe(Kernel):
    """A lobe `rho(x, theta)` that changes over the surface, of which only the name is known.

    Args:
        name: of the function.
        axis: the coordinate that it acts along.
        frame: left out, the one that the axis names.

    Reference: R07 eq. 18; D05 §4.5.

    Example:
        >>> from firstorder.conventions import Frame
        >>> from firstorder.symbolic import UnknownVaryingLobe, derive
        >>> from firstorder.transport import Reflection
        >>> spotted = derive(Reflection(UnknownVaryingLobe("rho")), Frame(sense="outgoing"))
        >>> spotted.value.expression
        Integral(L(x, -_t + theta)*rho(x, _t), (_t, -oo, oo))
    """

    name: str = eqx.field(static=True)
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def __check_init__(self):
        """The axis names the frame."""
        object.__setattr__(self, "frame", frame_with(self.axis, self.frame))
        self.frame.axis(self.axis)

    @property
    def _field(self) -> UnknownField:
        return UnknownField(self.name, frame=self.frame)

    def half_width(self) -> Scalar:
        """Not known: without an end."""
        return jnp.asarray(jnp.inf)

    def at(self, u: Ray) -> Scalar:
        """The function: a symbol in formulas, not a number elsewhere."""
        return self._field.at(u)

    def jet(self, u: Ray) -> Jet:
        """The function and its partial derivatives."""
        return self._field.jet(u)

    def spectrum(self) -> Spectrum:
        """The unknown transform over all coordinates."""
        return self._field.spectrum()

    def semi_series(self, Omega_axis: Scalar, window: Grid | None) -> Series:
        """Refused: a series has numbers; the formula of the spectrum is an integral."""
        raise Refused(f"{self.name} is unknown and has no Fourier series")


def _constant(name: str, **assumed: bool) -> Scalar:
    """A number of which only the name is known."""
    symbol = sympy.Symbol(name, **assumed)
    return inserted(lambda _: symbol, jnp.zeros(1))
