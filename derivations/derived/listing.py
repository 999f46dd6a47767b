"""All equations that the library derives, and their list in words."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable, Iterator

import derivations.derived
from derivations.catalogue import PAPERS, load
from derivations.derived.compare import Equation


def equations() -> dict[str, Equation]:
    """Every derived equation by its id, in the catalogue's order.

    Raises:
        ValueError: if two modules derive one equation.
    """
    found: dict[str, Equation] = {}
    for info in pkgutil.iter_modules(derivations.derived.__path__, "derivations.derived."):
        table = getattr(importlib.import_module(info.name), "DERIVED", {})
        for twice in table.keys() & found.keys():
            raise ValueError(f"Equation {twice} is derived twice.")
        found |= table
    return {k: found.pop(k) for k in load() if k in found} | found


def listed() -> str:
    """The numbered equations: `R07 eqs. 1-3, 5; D05 eqs. 2`.

    Example:
        >>> from derivations.derived.listing import listed
        >>> listed().startswith("R07 eqs. 1-")
        True
    """
    catalogue = load()
    numbered = [k.split(".") for k in equations() if catalogue[k].numbered]
    by_paper = {p: [int(n) for paper, n in numbered if paper == p] for p in PAPERS}
    told = (f"{p} eqs. {', '.join(_ranges(numbers))}" for p, numbers in by_paper.items() if numbers)
    return "; ".join(told)


def _ranges(numbers: Iterable[int]) -> Iterator[str]:
    """Numbers that follow one another, as `1-3`."""
    row: list[int] = []
    for n in [*sorted(numbers), None]:
        if row and (n is None or n != row[-1] + 1):
            yield str(row[0]) if len(row) == 1 else f"{row[0]}-{row[-1]}"
            row = []
        if n is not None:
            row.append(n)
