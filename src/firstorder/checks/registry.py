"""The registry: every case and every fault, collected from the folder `cases`."""

from __future__ import annotations

import functools
import importlib
import pkgutil

from firstorder.checks import cases as folder
from firstorder.checks.faults import Fault
from firstorder.checks.squares import Case


@functools.cache
def all_cases() -> dict[str, Case]:
    """Cases by name, laws before events, in the order of the files' names.

    Example:
        >>> from firstorder.checks import all_cases
        >>> list(all_cases())[0]
        'convolve'
    """
    found = {}
    for module in _modules():
        for case in module.CASES:
            if case.name in found:
                raise ValueError(f"Case {case.name!r} is registered twice.")
            found[case.name] = case
    return found


@functools.cache
def all_faults() -> dict[str, tuple[Fault, ...]]:
    """Faults by the name of the case that they must turn red.

    Example:
        >>> from firstorder.checks import all_faults
        >>> [fault.name for fault in all_faults()["move"]][:2]
        ['rows for columns', 'invert M']
    """
    return {case.name: module.FAULTS for module in _modules() for case in module.CASES}


def _modules():
    """The modules of cases, folder by folder: laws come first."""
    walk = pkgutil.walk_packages(folder.__path__, f"{folder.__name__}.")
    names = sorted(i.name for i in walk if not i.ispkg)
    return [importlib.import_module(n) for n in names if not n.rpartition(".")[2].startswith("_")]
