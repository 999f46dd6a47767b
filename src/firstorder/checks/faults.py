"""Deliberate faults: a check that nobody has seen fail is not a check.

A fault is a one-line wrong twin of a law or event: a sign flipped, a 2 pi dropped, a matrix
transposed, a jump forgotten. The test-suite runs the square of every cell against its faults and
asserts that each turns it red.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from firstorder.checks.squares import Step


@dataclasses.dataclass(frozen=True)
class Fault:
    """A wrong twin for the named portraits of a step.

    Attributes:
        name: what is wrong, in a few words.
        wrong: makes the wrong step from the right one.
        portraits: in which squares it must be seen.
    """

    name: str
    wrong: Callable[[Any], Step]
    portraits: tuple[str, ...]


def twin(step, **rules):
    """A copy of `step` with some methods replaced, `twin(law, spectrum=lambda self, F, w: ...)`.

    A rule is called like the method it replaces, with the twin itself as `self`; the right method
    is still there as `Move.spectrum(self, ...)`.

    Args:
        step: a law or an event.
        rules: methods by their names.

    Example:
        >>> from firstorder.checks import twin
        >>> from firstorder.fields import Affine
        >>> from firstorder.laws import Move
        >>> wrong = twin(Move([[1.0, -2.0], [0.0, 1.0]]), value=lambda self, f, u: f.at(u))
        >>> wrong(Affine([1.0, 0.0], 0.0))(5.0, 1.0).item()  # and not 3
        5.0
    """
    # A plain subclass that shares the state; equinox modules are frozen dataclasses.
    cls = type(f"Wrong{type(step).__name__}", (type(step),), rules)
    copy = object.__new__(cls)
    for field in dataclasses.fields(step):
        if hasattr(step, field.name):
            object.__setattr__(copy, field.name, getattr(step, field.name))
    return copy


def twin_law(event, change: Callable):
    """A copy of an event whose law is `change(right law)`.

    Args:
        event: whose law is wrong.
        change: from the right law to a wrong one.

    Example:
        >>> from firstorder.checks import twin_law
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.laws import Move
        >>> from firstorder.transport import Travel
        >>> back = twin_law(Travel(2.0), lambda law: Move(-law.M))
        >>> back.law(FLATLAND_SLOPE).M.tolist()
        [[-1.0, 2.0], [-0.0, -1.0]]
    """
    right = type(event).law
    return twin(event, law=lambda self, frame: change(right(self, frame)))
