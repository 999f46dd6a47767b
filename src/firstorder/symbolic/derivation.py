"""Formulas of paths: every portrait, at the end and at every step."""

from __future__ import annotations

import functools
from itertools import accumulate
from typing import Any

import sympy

from firstorder._argument_checks import check_kind
from firstorder._display import in_notebook
from firstorder.conventions import FLATLAND, Frame
from firstorder.errors import Refused
from firstorder.fields.field import Field
from firstorder.laws import Law
from firstorder.laws.base import FieldImage
from firstorder.symbolic import _laws, _spectra
from firstorder.symbolic._edges import differentiated
from firstorder.symbolic._formula import Formula
from firstorder.symbolic._programs.reading import matrix, read
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
        TypeError: if it is no field.

    Example:
        >>> import sympy
        >>> from firstorder.fields import GaussianProfile
        >>> from firstorder.symbolic import formula
        >>> formula(GaussianProfile(sympy.Symbol("sigma", positive=True))).expression
        sqrt(2)*exp(-theta**2/(2*sigma**2))/(2*sqrt(pi)*sigma)
    """
    check_kind("field", field, Field, "a field")
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
        TypeError: if `path` is none of these.

    Reference: what comes out so, each held to the printed one (`derivations.derived`):
    R07 eqs. 1-37, 44-46, 50, 52-55, 68-69, 72; J12 eqs. 16, 24, 26, 31-32, 38, 40, 43, 46, 49, 51,
    58, 66, 74, 76-78, 83; E11 eqs. 1, 3-12, 14, 16-18; D05 eqs. 1-21.
    `examples/equations_of_a_path.py` prints some.

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
            source, laws = _unwound(path.source)
            return Derivation(source, (*laws, *path.events))
        case Chain():
            return Derivation(UnknownField("L", frame=frame), path.events)
        case Field():
            return Derivation(*_unwound(path))
        case Event() | Law():
            return Derivation(UnknownField("L", frame=frame), (path,))
    raise TypeError(
        f"Argument `path` must be a path, events, a law or a field, but is {type(path).__name__}."
    )


def _unwound(field: Field) -> tuple[Field, tuple[Law, ...]]:
    """The light that laws were applied to, and the laws: so their rules are read, not its own."""
    laws: list[Law] = []
    while isinstance(field, FieldImage):
        laws.append(field.law)
        field = field.operand
    return field, tuple(reversed(laws))


class Derivation:
    """The formulas of a path, made by `derive`; each is derived when it is first asked for.

    Attributes:
        source: the light.
        events: what it meets, in order.

    Example:
        >>> from firstorder.symbolic import Derivation, UnknownField
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.transport import Travel
        >>> Derivation(UnknownField("L", frame=FLATLAND_SLOPE), (Travel(2.0),)).value.expression
        L(-2*v + x, v)
    """

    _repr_markdown_ = in_notebook

    def __init__(self, source: Field, events: tuple[Any, ...]):
        """Store the path."""
        self.source, self.events = source, events

    def __repr__(self) -> str:
        """The steps by name, and nothing derived for it."""
        steps = " >> ".join(
            getattr(e, "name", "") or type(e).__name__ for e in (self.source, *self.events)
        )
        return f"Derivation of {steps}: value, gradient, hessian, spectrum, covariance"

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
        first = _spectra.of_spectrum(self.source.spectrum())
        after = _spectra.spectrum_after
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
            S = _spectra.covariance_after(law, S, frame)
            frame = law.frame(frame)
        names = _spectra.frequencies_of(frame)
        return Formula(sympy.simplify(S), names, frame)

    def portrait(self, name: str) -> Any:
        """A portrait (or all `laws`) by its name, or the refusal that stopped it."""
        try:
            return getattr(self, name)
        except Refused as refusal:
            return refusal
