"""Public functions that compile themselves: a second call of the same form costs microseconds.

Under a transformation of the caller's (`jit`, `vmap`, `grad`) such a function is the plain one, so
that it adds nothing to the caller's program. Outside of any it runs as one compiled program.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import itertools
import types
import weakref
from collections.abc import Callable, Iterator
from typing import Any, ParamSpec, TypeVar

import equinox as eqx
import jax
import numpy as np
from jax.core import Tracer

P = ParamSpec("P")
R = TypeVar("R")

_met: weakref.WeakSet = weakref.WeakSet()  # nameless functions that came once
_eras = itertools.count()
_era = [next(_eras)]


def compiled_after(
    *checks: Callable[..., None],
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A function as `compiled` makes it, whose numbers are looked at before they go in.

    The checks are called with the same arguments, by NumPy and only where all of them are numbers:
    they cost nothing under a transformation. They are kept as the attribute `checks`, by which
    functions that call this one under a transformation of their own can ask them first
    (`derivatives`).

    Args:
        checks: raise or warn.

    Example:
        >>> import jax, jax.numpy as jnp
        >>> from firstorder.numerics._compiled import compiled_after
        >>> seen = []
        >>> @compiled_after(lambda x: seen.append(float(x)))
        ... def half(x):
        ...     return 0.5 * x
        >>> half(jnp.array(3.0)).item(), jax.vmap(half)(jnp.ones(2)).tolist(), seen
        (1.5, [0.5, 0.5], [3.0])
    """
    return lambda function: _entry(function, checks)


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """A function that is compiled when it is called with numbers, and plain under a transformation.

    Arrays and floats are arguments of the program; integers, words, flags and functions are part
    of it, and another one is another program. A function without a name of its own (a lambda, one
    defined inside another) may be made anew for every call, and each would be compiled and kept: so
    the first call that brings it runs as it is written, and the program is made when the same
    object comes again. What such a function reads from outside is read once, as under `jax.jit`.

    Valid for: functions whose checks on values come before this, for inside every number is traced;
    checks on types, shapes, words and integers work as ever. Results are arrays, or trees of them.

    Args:
        function: pure, of any trees.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._compiled import compiled
        >>> traced = []
        >>> @compiled
        ... def half(x):
        ...     traced.append(type(x))
        ...     return 0.5 * x
        >>> half(jnp.array(3.0)).item(), half(jnp.array(5.0)).item(), len(traced)
        (1.5, 2.5, 1)
    """
    return _entry(function, ())


def _entry(function: Callable[P, R], checks: tuple[Callable[..., None], ...]) -> Callable[P, R]:
    """A function that compiles itself, after some checks."""

    @functools.partial(jax.jit, static_argnums=0)
    def program(form: _Form, numbers: list[Any]):
        args, kwargs = form.filled(numbers)
        return function(*args, **kwargs)

    known: set[_Form] = set()

    @functools.wraps(function)
    def entry(*args: P.args, **kwargs: P.kwargs) -> R:
        leaves, tree = jax.tree.flatten((args, kwargs))
        if any(isinstance(leaf, Tracer) for leaf in leaves):
            return function(*args, **kwargs)
        for check in checks:
            check(*args, **kwargs)
        form = _Form(tree, tuple(None if _number(leaf) else leaf for leaf in leaves), _era[0])
        try:
            if form not in known:
                if not _lasting((args, kwargs)):
                    return function(*args, **kwargs)
                known.add(form)
        except TypeError:  # something that has no hash cannot be part of a program
            return function(*args, **kwargs)
        return program(form, [leaf for leaf in leaves if _number(leaf)])

    entry.__dict__["checks"] = checks
    return entry


@contextlib.contextmanager
def own_programs() -> Iterator[None]:
    """Programs compiled before do not count in here, and those compiled here not afterwards.

    For whoever puts another function in the place of one that compiled functions call.
    """
    before, _era[0] = _era[0], next(_eras)
    try:
        yield
    finally:
        _era[0] = before


@dataclasses.dataclass(frozen=True)
class _Form:
    """All of a call's arguments but its numbers.

    Attributes:
        tree: in which they stand.
        parts: leaves that are part of the program; None where a number stands.
        era: see `own_programs`.
    """

    tree: Any
    parts: tuple[Any, ...]
    era: int

    def filled(self, numbers: list[Any]) -> Any:
        """The arguments, with these numbers."""
        rest = iter(numbers)
        # A tree's leaf is never None.
        leaves = [next(rest) if part is None else part for part in self.parts]
        return jax.tree.unflatten(self.tree, leaves)


def _number(leaf: Any) -> bool:
    """Whether a leaf is an argument of the program."""
    if isinstance(leaf, np.ndarray):
        return leaf.dtype != object
    return isinstance(leaf, (jax.Array, float, complex, np.inexact))


def _lasting(arguments: Any) -> bool:
    """Whether every function in the arguments has a name to come back by, or came before."""
    nameless = [f for f in _functions(arguments) if "<" in getattr(f, "__qualname__", "<")]
    fresh = [f for f in nameless if f not in _met]
    _met.update(fresh)
    return not fresh


def _functions(x: Any) -> Iterator[Any]:
    """All functions in a tree, and in the fields of modules that are no leaves."""
    if isinstance(x, (tuple, list)):
        for part in x:
            yield from _functions(part)
    elif isinstance(x, dict):
        yield from _functions(list(x.values()))
    elif isinstance(x, jax.tree_util.Partial):
        yield from _functions([x.func, x.args, x.keywords])
    elif isinstance(x, types.MethodType):
        yield from _functions([x.__func__, x.__self__])
    elif isinstance(x, eqx.Module):
        yield from _functions(list(vars(x).values()))
    elif callable(x) and not isinstance(x, type):
        yield x
