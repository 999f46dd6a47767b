"""The catalogue: every numbered equation of the four papers, and the unnumbered ones in scope.

After the papers come our own corollaries, which tie them together ("C.slice").

What is printed, in our own words and as ASCII mathematics, and what we suspect. No verdicts: those
are the ledger's, which judges each row against a derivation.
"""

import dataclasses
import functools
import re
import tomllib
from importlib import resources

PAPERS = ("R07", "J12", "E11", "D05")
SOURCES = (*PAPERS, "C")
KINDS = ("identity", "definition", "approximation")

_NUMBERED = re.compile(r"(R07|J12|E11|D05)\.\d+")


@dataclasses.dataclass(frozen=True)
class Entry:
    """One statement of a paper.

    Attributes:
        equation: id, such as "R07.25", or "D05.s4.5" for a statement without a number.
        statement: what it says, in our words.
        formula: the printed formula in ASCII, in the paper's symbols.
        kind: a first guess, one of `KINDS`; the ledger's rows have the last word.
        section: section of the paper.
        issue: the issue that proves it.
        suspect: why it may be misprinted or claim too much, and what we derive instead; "" if it
            is not suspected.
        numbered: whether the paper numbers it.
    """

    equation: str
    statement: str
    formula: str
    kind: str
    section: str
    issue: int
    suspect: str
    numbered: bool


def load() -> dict[str, Entry]:
    """All entries by id, in the order of the papers and, within each, of its text."""
    return dict(_load())


@functools.cache
def _load() -> dict[str, Entry]:
    entries = {}
    for name in (*PAPERS, "corollaries"):
        text = resources.files(__package__).joinpath(f"{name}.toml").read_text(encoding="utf-8")
        for equation, fields in tomllib.loads(text).items():
            numbered = _NUMBERED.fullmatch(equation) is not None
            entries[equation] = Entry(equation, **{"suspect": "", **fields}, numbered=numbered)
    return entries
