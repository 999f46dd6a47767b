"""Modules and names that a package imports when they are first asked for, and lists before."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

NOTHING: Mapping[str, Sequence[str]] = {}


def on_demand(
    package: str, parts: Sequence[str], names: Mapping[str, Sequence[str]] = NOTHING
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The `__getattr__` and the `__dir__` of a package whose parts are imported on demand.

    Args:
        package: its name, `__name__`.
        parts: modules in it.
        names: by module, those of its names that the package shows as its own.

    Example:
        >>> import firstorder.space
        >>> firstorder.space.library.__name__
        'firstorder.space.library'
    """
    home = {name: module for module, some in names.items() for name in some}

    def asked(name: str) -> Any:
        if name in home:
            return getattr(importlib.import_module(f"{package}.{home[name]}"), name)
        if name in parts:
            return importlib.import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    def contents() -> list[str]:
        return sorted({*vars(sys.modules[package]), *parts, *home})

    return asked, contents
