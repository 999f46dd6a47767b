"""How D05's words are read as numbers: once, for all of its figures."""

from __future__ import annotations

from figures.verdicts import Rule, at_least, at_most

ALIKE = 0.1  # "excellent agreement", "very similar", "no significant error": a tenth at most
EQUAL = 1e-9  # two routes in double precision


def equal() -> Rule:
    """An identity, to rounding."""
    return at_most(EQUAL, "rounding")


def alike(words: str) -> Rule:
    """Words that admit a small difference: a tenth."""
    return at_most(ALIKE, f"'{words}': a tenth")


def most(words: str = "most") -> Rule:
    """Of a share: more than half."""
    return at_least(0.5, f"'{words}': more than half")


def more(words: str) -> Rule:
    """Of a ratio: larger than 1."""
    return at_least(1.0, f"'{words}': larger than 1")


def less(words: str) -> Rule:
    """Of a ratio: smaller than 1."""
    return at_most(1.0, f"'{words}': smaller than 1")
