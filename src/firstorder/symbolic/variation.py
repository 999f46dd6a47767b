"""R07's names for what makes reflected light vary along a surface: SV, DV, CV and CDV."""

from __future__ import annotations

import dataclasses
from typing import Any

import sympy

from firstorder.conventions import FLATLAND, Frame
from firstorder.errors import Refused
from firstorder.symbolic._edges import differentiated
from firstorder.symbolic._formula import Formula, in_cell
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.functions import Unknown
from firstorder.symbolic.derivation import Derivation, derive
from firstorder.symbolic.unknown import UnknownField

MEANINGS = {
    "SV": "spatial variation of the light",
    "DV": "directional variation of the light",
    "CV": "curvature: how fast the direction turns that is looked at",
    "CDV": "curvature-weighted directional variation",
    "MV": "variation of the material: textures, lobes and masks that change along the surface",
}


@dataclasses.dataclass(frozen=True)
class NamedTerms:
    """The spatial derivative of light, `B_x = SV + CDV + MV`, by R07's names.

    Attributes:
        SV: with the light's own spatial derivative, `L_x (*) rho`.
        DV: with its directional derivative, `L_theta (*) rho`.
        CV: what CDV multiplies DV by, `2 n_x` after a mirror; a refusal where it is not one number
            for all the directions that are added up.
        CDV: with the directional derivative, by how fast the direction turns.
        MV: with no derivative of the light.
    """

    SV: Formula
    DV: Formula
    CV: Formula | Refused
    CDV: Formula
    MV: Formula

    @property
    def total(self) -> Formula:
        """`SV + CDV + MV`: the derivative along the surface."""
        parts = (self.SV, self.CDV, self.MV)
        return self.SV.mapped(lambda _: sympy.Add(*(part.expression for part in parts)))

    def __str__(self) -> str:
        """One line for each term."""
        return "\n".join(f"{name} = {self._said(name)}" for name in MEANINGS)

    def _repr_markdown_(self) -> str:
        """A table, for a notebook."""
        told = ((name, self._said(name, latex=True)) for name in MEANINGS)
        rows = (f"| {name} | {MEANINGS[name]} | {said} |" for name, said in told)
        return "\n".join(("| term | what varies | formula |", "|---|---|---|", *rows))

    def _said(self, name: str, latex: bool = False) -> str:
        term = getattr(self, name)
        if isinstance(term, Refused):
            return f"refused: {term.reason}"
        return in_cell(term) if latex else str(term)


def named_terms(path: Any, frame: Frame = FLATLAND) -> NamedTerms:
    """The spatial derivative of the light at the end of a path, split into R07's terms.

    The place occurs in the formula of the light three times: as the place and in the direction at
    which the incident light is read, and in what it is multiplied by. Each occurrence is
    differentiated by itself: `B_x = SV + CDV + MV`. A source with numbers is called L.

    Args:
        path: as for `derive`.
        frame: of the unknown light, where the path has no source.

    Raises:
        Refused: for light that has not one position and one direction.

    Reference: R07 §5.2, eq. 25; MV is not in its Fig. 4.

    Example:
        >>> from firstorder.symbolic import UnknownField, named_terms
        >>> from firstorder.transport import Bump, Mirror
        >>> n = UnknownField("n", ("x",))
        >>> print(named_terms(Bump(n) >> Mirror() >> Bump(n, back=True)))
        SV = L_x(x, -theta + 2*n(x))
        DV = L_theta(x, -theta + 2*n(x))
        CV = 2*n_x(x)
        CDV = 2*L_theta(x, -theta + 2*n(x))*n_x(x)
        MV = 0
    """
    found = derive(path, frame)
    light = found.source
    if not isinstance(light, UnknownField):
        light = UnknownField("L", frame=light.frame)
    value = Derivation(light, found.events).value
    if len(light.frame.positions) != 1 or len(value.frame.positions) != 1:
        raise Refused("R07's terms are those of light with one position and one direction")
    x = value.coordinates[value.frame.positions[0]]
    place, turned, rest, more = (sympy.Dummy(real=True) for _ in range(4))
    along = [light.frame.coordinates[i] for i in light.frame.positions]

    def is_light(e: Expr) -> bool:
        return isinstance(e, Unknown) and e.base == light.name

    def marked(call: Expr) -> Expr:
        pairs = zip(call.names, call.args, strict=True)
        return call.func(
            *(a.xreplace({x: place}) if n in along else a.xreplace({x: turned}) + more
              for n, a in pairs)
        )  # fmt: skip

    expression = value.expression.replace(is_light, marked).xreplace({x: rest})

    def part(symbol: Expr) -> Formula:
        meant = {place: x, turned: x, rest: x, more: sympy.Integer(0)}
        return value.mapped(lambda _: differentiated(expression, symbol, meant))

    calls = filter(is_light, value.expression.atoms(Unknown))
    directions = (a for c in calls for n, a in zip(c.names, c.args, strict=True) if n not in along)
    rates = {sympy.simplify(sympy.diff(a, x)) for a in directions}
    return NamedTerms(part(place), part(more), _one(value, rates), part(turned), part(rest))


def _one(value: Formula, rates: set[Expr]) -> Formula | Refused:
    """The one rate at which the direction turns."""
    rate = rates.pop() if len(rates) == 1 else sympy.Dummy()
    if rate.atoms(sympy.Dummy):
        return Refused("the direction does not turn alike for all light that is added up")
    return value.mapped(lambda _: rate)
