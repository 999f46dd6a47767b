"""Formulas of paths: every portrait, at the end and at every step."""

from __future__ import annotations

import functools
from itertools import accumulate
from typing import Any

import sympy

from firstorder.conventions import FLATLAND, Frame
from firstorder.errors import Refused
from firstorder.fields.field import Field
from firstorder.laws import Law
from firstorder.symbolic import _laws
from firstorder.symbolic._edges import differentiated
from firstorder.symbolic._formula import Formula
from firstorder.symbolic._reading import matrix, read
from firstorder.symbolic.unknown import UnknownField
from firstorder.transport import Chain, Event, Path


def formula(field: Field) -> Formula:
    """Radiance of a field as a formula of its coordinates.

    It is read out of the field's own code, with symbols in place of the ray (and of parameters that
    are symbols), so it cannot differ from what the field computes.

    Args:
        field: a field; parameters may be symbols.

    Raises:
        Refused: if the field computes something that is no expression, such as a search.

    Example:
        >>> import sympy
        >>> from firstorder.fields import GaussianProfile
        >>> from firstorder.symbolic import formula
        >>> formula(GaussianProfile(sympy.Symbol("sigma", positive=True))).expression
        sqrt(2)*exp(-theta**2/(2*sigma**2))/(2*sqrt(pi)*sigma)
    """
    return _laws.of_field(field)


def derive(path: Any, frame: Frame = FLATLAND) -> Derivation:
    """The equations of a path: value, gradient, Hessian, spectrum and covariance.

    The formulas are read out of the code of the events (`formula`). Parameters may
    be symbols, `Travel(d)`; light, lobes, masks and normal maps may be unknown (`UnknownField`,
    `UnknownLobe`).

    Args:
        path: a path; or events, a law or a field. Events and laws act on an unknown light `L`.
        frame: of that light.

    Raises:
        Refused: when a portrait is asked that the path has not, with the reason of the event.

    Reference: R07 eqs. 10-17, 20, 24-25, 29; D05 eqs. 2-5, 9-16, 18. A test holds each to the
    printed one (tests/symbolic/test_derivation.py), `examples/equations_of_a_path.py` prints some.

    Example:
        >>> import sympy
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.symbolic import derive
        >>> from firstorder.transport import Travel
        >>> far = derive(Travel(sympy.Symbol("d", positive=True)), FLATLAND_SLOPE)
        >>> far.value.expression
        L(-d*v + x, v)
        >>> far.gradient.expression
        [L_x(-d*v + x, v), -d*L_x(-d*v + x, v) + L_v(-d*v + x, v)]
        >>> far.spectrum.expression
        L_hat(Omega_x, Omega_v + Omega_x*d)
    """
    match path:
        case Path():
            return Derivation(path.source, path.events)
        case Chain():
            return Derivation(UnknownField("L", frame=frame), path.events)
        case Field():
            return Derivation(path, ())
        case Event() | Law():
            return Derivation(UnknownField("L", frame=frame), (path,))
    raise TypeError(
        f"Argument `path` must be a path, events, a law or a field, but is {type(path).__name__}."
    )


class Derivation:
    """The formulas of a path, made by `derive`; each is derived when it is first asked for.

    Attributes:
        source: the light.
        events: what it meets, in order.
    """

    def __init__(self, source: Field, events: tuple[Any, ...]):
        """Store the path."""
        self.source, self.events = source, events

    @functools.cached_property
    def laws(self) -> tuple[Law, ...]:
        """The law of each event, in the frame of the light that it meets."""
        return _laws.laws_of(self.events, self.source.frame)

    @functools.cached_property
    def values(self) -> tuple[Formula, ...]:
        """Radiance before, between and after the events."""
        first = _laws.of_field(self.source)
        return tuple(accumulate(self.laws, lambda f, law: _laws.of_law(law, f), initial=first))

    @property
    def value(self) -> Formula:
        """Radiance at the end."""
        return self.values[-1]

    @functools.cached_property
    def gradient(self) -> Formula:
        """Gradient between edges: one entry for each coordinate."""
        names = self.value.coordinates
        return self.value.mapped(lambda e: sympy.Array([differentiated(e, a) for a in names]))

    @functools.cached_property
    def hessian(self) -> Formula:
        """Hessian between edges."""
        rows = [
            [differentiated(g, b) for b in self.value.coordinates] for g in self.gradient.expression
        ]
        return self.value.mapped(lambda _: sympy.Matrix(rows))

    @functools.cached_property
    def spectra(self) -> tuple[Formula, ...]:
        """Spectrum before, between and after the events."""
        first = _laws.of_spectrum(self.source.spectrum())
        after = _laws.spectrum_after
        return tuple(accumulate(self.laws, lambda F, law: after(law, F), initial=first))

    @property
    def spectrum(self) -> Formula:
        """Spectrum at the end, over frequencies in cycles per unit."""
        return self.spectra[-1]

    @functools.cached_property
    def covariance(self) -> Formula:
        """Covariance of the power spectrum at the end."""
        S = matrix(read(lambda source: source.covariance().matrix, self.source))
        frame = self.source.frame
        for law in self.laws:
            S = _laws.covariance_after(law, S, frame)
            frame = law.frame(frame)
        names = _laws.frequencies_of(frame)
        return Formula(sympy.simplify(S), names, frame)

    def portrait(self, name: str) -> Any:
        """A portrait (or all `laws`) by its name, or the refusal that stopped it."""
        try:
            return getattr(self, name)
        except Refused as refusal:
            return refusal
