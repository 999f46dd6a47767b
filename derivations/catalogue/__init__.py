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

from firstorder import ledger

PAPERS = ("R07", "J12", "E11", "D05")
SOURCES = (*PAPERS, "C")
KINDS = ("identity", "definition", "approximation")

_NUMBERED = re.compile(r"(R07|J12|E11|D05)\.\d+")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Entry(ledger.Entry):
    """One statement of a paper.

    Attributes:
        issue: the issue that proves it.
        numbered: whether the paper numbers it.
    """

    issue: int
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
            entries[equation] = Entry(equation=equation, **fields, numbered=numbered)
    return entries
