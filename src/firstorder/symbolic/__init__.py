"""Symbols: the formula of any field and path, and events and lobes from expressions.

Formulas are read out of the code that computes the numbers (`derive`, `formula`); an expression
becomes an event with all its portraits (`event`, `lobe`). Nothing here is loaded by
`import firstorder`: SymPy comes with this package.
"""

from firstorder.symbolic._energy import LobeBandLimit
from firstorder.symbolic._formula import Formula, coordinates_of, frequencies_of
from firstorder.symbolic.derivation import Derivation, derive, formula
from firstorder.symbolic.effect_table import Effect, EffectTable, effects, table_1
from firstorder.symbolic.events import FactorEvent, RayEvent, event
from firstorder.symbolic.explanation import ExplainedStep, Explanation, explain
from firstorder.symbolic.lobes import ExpressionLobe, lobe
from firstorder.symbolic.texts import parse_expression
from firstorder.symbolic.unknown import UnknownField, UnknownLobe, UnknownVaryingLobe
from firstorder.symbolic.variation import NamedTerms, named_terms

__all__ = [
    "Derivation",
    "Effect",
    "EffectTable",
    "Explanation",
    "ExpressionLobe",
    "FactorEvent",
    "Formula",
    "LobeBandLimit",
    "NamedTerms",
    "RayEvent",
    "ExplainedStep",
    "UnknownField",
    "UnknownLobe",
    "UnknownVaryingLobe",
    "coordinates_of",
    "derive",
    "effects",
    "event",
    "explain",
    "formula",
    "frequencies_of",
    "lobe",
    "named_terms",
    "parse_expression",
    "table_1",
]
