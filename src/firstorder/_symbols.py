"""Symbols where numbers are asked: an array whose entries are expressions.

`as_float` makes one of what holds SymPy expressions, so that every event and field takes them.
It has a shape and no numbers: `firstorder.symbolic` reads formulas out of it, and nothing else
computes with it. SymPy is not imported here.
"""

from __future__ import annotations

import sys
from typing import Any

import jax
import numpy as np

from firstorder.errors import Refused


class SymbolicArray(jax.Array):
    """Expressions in place of numbers.

    Args:
        entries: an array of SymPy expressions, or one.
    """

    def __init__(self, entries: Any):
        """Store the expressions."""
        self.entries = np.asarray(entries, dtype=object)

    @property
    def dtype(self) -> np.dtype:
        """Expressions stand for floating numbers."""
        return np.dtype(float)

    @property
    def weak_type(self) -> bool:
        """Never: their precision is that of what they meet."""
        return False

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        return self.entries.shape

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return self.entries.ndim

    @property
    def size(self) -> int:
        """Number of entries."""
        return self.entries.size

    def __repr__(self) -> str:
        """The expressions."""
        return str(self.entries.tolist())

    def _refuse(self, *args: Any):
        """Say what it is to whoever wants numbers of it."""
        raise Refused(
            f"{self!r} holds symbols and no numbers: ask `firstorder.symbolic.derive` for the "
            "formula, and lower that."
        )

    # What JAX asks for first, and what Python's operators ask for.
    refuse: Any = _refuse
    aval: Any = property(_refuse)
    sharding: Any = property(_refuse)
    __array__ = __float__ = __bool__ = __getitem__ = __neg__ = __add__ = __radd__ = refuse
    __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __pow__ = refuse


# Its parent leaves the operators open; nobody calls them.
SymbolicArray.__abstractmethods__ = frozenset()  # pyright: ignore[reportAttributeAccessIssue]


def symbolic(x: Any) -> SymbolicArray | None:
    """An array of symbols from expressions, alone or in nested lists; None if there are none."""
    if isinstance(x, SymbolicArray):
        return x
    if "sympy" not in sys.modules:
        return None
    from sympy import Expr, MatrixBase

    if isinstance(x, MatrixBase):
        return SymbolicArray(x.tolist())
    entries = np.array(x, dtype=object)
    if not any(isinstance(entry, Expr) for entry in entries.flat):
        return None
    return SymbolicArray(entries)
