"""Memory of a process, cleared for an attack: compiled programs and results of cached functions."""

from __future__ import annotations

import contextlib
import functools
import inspect
import os
import pathlib
import sys
import types
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import jax

from firstorder.numerics._compiled import own_programs


@contextlib.contextmanager
def forgotten(folders: Sequence[pathlib.Path]) -> Iterator[None]:
    """A context in which nothing computed before counts, and nothing of which counts afterwards.

    Args:
        folders: of the modules whose cached functions forget, with the folders below them.
    """
    forget(folders)
    try:
        with own_programs():
            yield
    finally:
        forget(folders)


def forget(folders: Sequence[pathlib.Path], *, programs: bool = True) -> None:
    """Clears the caches of all cached functions of some folders, and of JAX's programs or not."""
    if programs:
        jax.clear_caches()
    key = (*folders, len(sys.modules))  # to look through them again takes longer than to forget
    if key not in _known:
        _known.clear()
        _known[key] = cached_functions(folders)
    for cached in _known[key]:
        cached.cache_clear()


_known: dict[tuple[Any, ...], list[Any]] = {}  # cached functions of the folders asked for last


def cached_functions(folders: Sequence[pathlib.Path]) -> list[Any]:
    """The functions under `functools.cache` that modules of some folders, or their classes, name.

    To look through all objects of the process instead takes a second in a large one.

    Args:
        folders: of the modules, with the folders below them.

    Example:
        >>> import pathlib
        >>> import firstorder
        >>> from firstorder.ledger._process_memory import cached_functions
        >>> folder = pathlib.Path(firstorder.__file__).parent / "numerics"
        >>> sorted(f.__name__ for f in cached_functions([folder]))
        ['_names', '_rule']
    """
    below = tuple(f"{folder}{os.sep}" for folder in folders)
    held: dict[int, Any] = {}
    for module in list(sys.modules.values()):
        if (getattr(module, "__file__", None) or "").startswith(below):
            held |= {id(cached): cached for cached in _cached_in(vars(module), module.__name__)}
    return list(held.values())


def _cached_in(names: Mapping[str, Any], module: str) -> list[Any]:
    found: list[Any] = []
    for value in list(names.values()):
        if inspect.isclass(value) and value.__module__ == module:
            found += _cached_in(vars(value), module)
        else:
            found += [layer for layer in layers(value) if type(layer) is _CACHED]
    return found


_CACHED = type(functools.lru_cache(forget))


def layers(member: Any) -> list[Any]:
    """A function or property, then the one that it wraps, and so on inwards."""
    found: list[Any] = []
    while len(found) < 20:  # a mock has whatever it is asked for, without end
        if not isinstance(member, _WRAPPERS) and (not callable(member) or inspect.isclass(member)):
            break
        found.append(member)
        inner = (getattr(member, name, None) for name in _INNER.get(type(member), _OTHERS))
        member = next((wrapped for wrapped in inner if callable(wrapped)), None)
    return found


_INNER = {
    types.FunctionType: ("__wrapped__",),
    property: ("fget",),
    functools.cached_property: ("func",),
    functools.partial: ("func",),
    classmethod: ("__func__",),
    staticmethod: ("__func__",),
}
_WRAPPERS = (property, functools.cached_property, classmethod)  # that are not callable themselves
_OTHERS = ("__wrapped__", "method", "__func__")
