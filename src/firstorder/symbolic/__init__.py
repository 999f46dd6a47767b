"""Symbols: the formula of any field and path, and events and lobes from expressions.

Formulas are read out of the code that computes the numbers (`derive`, `formula`); an expression
becomes an event with all its portraits (`event`, `lobe`). Nothing here is loaded by
`import firstorder`: SymPy comes with this package.
"""

from firstorder.symbolic._energy import LobeBandLimit
from firstorder.symbolic._formula import Formula, coordinates_of, frequencies_of
from firstorder.symbolic.derivation import Derivation, derive, formula
from firstorder.symbolic.events import FactorEvent, RayEvent, event
from firstorder.symbolic.explanation import ExplainedStep, Explanation, explain
from firstorder.symbolic.lobes import ExpressionLobe, lobe
from firstorder.symbolic.texts import parse_expression
from firstorder.symbolic.unknown import UnknownField, UnknownLobe

__all__ = [
    "Derivation",
    "Explanation",
    "ExpressionLobe",
    "FactorEvent",
    "Formula",
    "LobeBandLimit",
    "RayEvent",
    "ExplainedStep",
    "UnknownField",
    "UnknownLobe",
    "coordinates_of",
    "derive",
    "event",
    "explain",
    "formula",
    "frequencies_of",
    "lobe",
    "parse_expression",
]
