"""Public functions that compile themselves: a second call of the same form costs microseconds.

Inside a program of the caller's (`jit`, `scan`) such a function is the plain one, so that it adds
nothing to that program. Elsewhere, also under `grad` and `vmap` alone, it runs as one program, of
which JAX then compiles the derivatives; it would compile every single operation otherwise.
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

# Functions that came once and have no name, or read something: what they read then.
_met: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()
_AT_ONCE = ("JVPTrace", "LinearizeTrace", "BatchTrace")  # of JAX: what they do goes to their parent
_eras = itertools.count()
_era = [next(_eras)]


def compiled_after(
    *checks: Callable[..., None], traced: Callable[..., None] | None = None
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A function as `compiled` makes it, whose numbers are looked at before they go in.

    The checks are called with the same arguments, by NumPy and only where all of them are numbers:
    they cost nothing under a transformation. They are kept as the attribute `checks`, by which
    functions that call this one under a transformation of their own can ask them first
    (`derivatives`).

    Args:
        checks: raise or warn.
        traced: called in their place under `grad` or `vmap`, where some arguments are numbers and
            others are not; inside the program none is.

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
    return lambda function: _entry(function, checks, traced)


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """A function that is compiled when it is called, and plain inside a program of the caller's.

    Arrays and floats are arguments of the program; integers, words, flags and functions are part
    of it, and another one is another program. A function without a name of its own (a lambda, one
    defined inside another) may be made anew for every call, and each would be compiled and kept: so
    the first call that brings it runs as it is written, and the program is made when the same
    object comes again. Numbers, arrays and functions that it reads from outside, from its closure
    or its module, are part of the program too; attributes of other objects are read once, as under
    `jax.jit`.

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


def _entry(
    function: Callable[P, R],
    checks: tuple[Callable[..., None], ...],
    check_traced: Callable[..., None] | None = None,
) -> Callable[P, R]:
    """A function that compiles itself, after some checks."""

    @functools.partial(jax.jit, static_argnums=0)
    def program(form: _Form, numbers: list[Any]):
        args, kwargs = form.filled(numbers)
        return function(*args, **kwargs)

    known: dict[_Form, tuple[Any, ...]] = {}  # the functions in a form, which is without `read`
    made: set[_Form] = set()

    @functools.wraps(function)
    def entry(*args: P.args, **kwargs: P.kwargs) -> R:
        leaves, tree = jax.tree.flatten((args, kwargs))
        traced = [leaf for leaf in leaves if isinstance(leaf, Tracer)]
        if not all(map(_is_evaluated, traced)):
            return function(*args, **kwargs)
        for check in () if traced else checks:
            check(*args, **kwargs)
        form = _Form(tree, tuple(None if _number(leaf) else leaf for leaf in leaves), _era[0])
        try:
            functions = known[form] if form in known else tuple(_functions((args, kwargs)))
            read = tuple(map(_read, functions))
            whole = dataclasses.replace(form, read=read) if functions else form
            if whole not in made:
                if not _lasting(functions, read):
                    return function(*args, **kwargs)
                known[form] = functions
                made.add(whole)
        except TypeError:  # something that has no hash cannot be part of a program
            return function(*args, **kwargs)
        if traced and check_traced is not None:
            check_traced(*args, **kwargs)
        return program(whole, [leaf for leaf in leaves if _number(leaf)])

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
        read: what each function in them reads from outside.
    """

    tree: Any
    parts: tuple[Any, ...]
    era: int
    read: tuple[Any, ...] = ()

    def filled(self, numbers: list[Any]) -> Any:
        """The arguments, with these numbers."""
        rest = iter(numbers)
        # A tree's leaf is never None.
        leaves = [next(rest) if part is None else part for part in self.parts]
        return jax.tree.unflatten(self.tree, leaves)


def _is_evaluated(tracer: Tracer) -> bool:
    """Whether what is done to a tracer is computed at once, as under `grad` or `vmap` alone.

    Under `jit` it goes into a program.
    """
    trace: Any = tracer._trace
    while type(trace).__name__ in _AT_ONCE:
        trace = trace.parent_trace
    return type(trace).__name__ == "EvalTrace"


def _number(leaf: Any) -> bool:
    """Whether a leaf is an argument of the program."""
    if isinstance(leaf, np.ndarray):
        return leaf.dtype != object
    return isinstance(leaf, (jax.Array, float, complex, np.inexact))


def _lasting(functions: tuple[Any, ...], read: tuple[Any, ...]) -> bool:
    """Whether every function has a name to come back by, or came before, and reads the same."""
    lasting = True
    for f, now in zip(functions, read, strict=True):
        nameless = "<" in getattr(f, "__qualname__", "<")
        if nameless or now:
            lasting &= _met[f] == now if f in _met else not nameless
            _met[f] = now
    return lasting


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


class _Same:
    """A thing that equals itself alone."""

    def __init__(self, thing: Any):
        self.thing = thing

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.thing is other.thing

    def __hash__(self) -> int:
        return id(self.thing)


def _read(f: Any, seen: frozenset[int] = frozenset()) -> tuple[Any, ...]:
    """Values that a user's function reads from outside: its closure, and globals that it names."""
    if not isinstance(f, types.FunctionType) or _own(f) or id(f) in seen:
        return ()
    empty = types.CellType()  # that of a name without a value so far
    cells = [cell.cell_contents for cell in f.__closure__ or () if cell != empty]
    named = [f.__globals__[name] for name in _names(f.__code__) if name in f.__globals__]
    return tuple(_value(x, f, seen | {id(f)}) for x in (*cells, *named))


def _own(f: types.FunctionType) -> bool:
    """Whether it is a function of the library, which reads nothing that changes."""
    return (f.__module__ or "").partition(".")[0] == __name__.partition(".")[0]


@functools.cache
def _names(code: types.CodeType) -> tuple[str, ...]:
    """Names that a function and those written inside it may look up in their module."""
    inner = [c for c in code.co_consts if isinstance(c, types.CodeType)]
    return tuple(dict.fromkeys([*code.co_names, *(n for c in inner for n in _names(c))]))


def _value(x: Any, f: types.FunctionType, seen: frozenset[int]) -> Any:
    """Something to know a value by: what it holds where that may change, and else itself."""
    if isinstance(x, (bool, int, float, complex, str, np.generic)):
        return type(x), x
    if isinstance(x, np.ndarray) and x.dtype != object:
        return x.shape, x.dtype, x.tobytes()
    if isinstance(x, (list, tuple, dict)) and id(x) not in seen:
        parts = x.items() if isinstance(x, dict) else x
        return type(x), tuple(_value(part, f, seen | {id(x)}) for part in parts)
    if isinstance(x, types.FunctionType) and x.__globals__ is f.__globals__:
        return () if id(x) in seen else (_Same(x), *_read(x, seen))
    return _Same(x)
