"""Symbols: the formula of any field and path, read out of the code that computes its numbers.

Nothing here is loaded by `import firstorder`: SymPy comes with this package.
"""

from firstorder.symbolic._formula import Formula, coordinates_of, frequencies_of
from firstorder.symbolic.derivation import Derivation, derive, formula
from firstorder.symbolic.unknown import UnknownField, UnknownLobe

__all__ = [
    "Derivation",
    "Formula",
    "UnknownField",
    "UnknownLobe",
    "coordinates_of",
    "derive",
    "formula",
    "frequencies_of",
]
