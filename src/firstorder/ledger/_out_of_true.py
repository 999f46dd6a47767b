"""Functions put out of true where they stand: their results are off by a factor.

The factor is read from a dial. What runs at once reads it as a number; a program reads it whenever
it runs, so that it need not be compiled again for another factor.
"""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import functools
import inspect
import types
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from firstorder.fields.spectrum import Spectrum, SumSpectrum


@dataclasses.dataclass
class Dial:
    """The factor by which results are off, while `turned` holds.

    Attributes:
        factor: to be changed at will.
        calls: how often one of the functions was called, or the factor read by a program.
        baked: whether a program holds a number that is off by the factor of its time for good, for
            it was computed while the program was traced.
    """

    factor: float
    calls: int = 0
    baked: bool = False

    def times(self, x: Any) -> Any:
        """A number or an array times the factor."""
        if isinstance(x, Tracer):
            return x * self.number(jnp.finfo(x.dtype).dtype)
        self.baked |= isinstance(jnp.add(0.0, 0.0), Tracer)
        return x * self.factor

    def number(self, dtype: Any) -> jax.Array:
        """The factor as an array; in a program, what it is when that runs."""
        read = functools.partial(self._read, dtype)
        return jax.pure_callback(read, jax.ShapeDtypeStruct((), dtype))

    def _read(self, dtype: Any) -> np.ndarray:
        self.calls += 1
        return np.asarray(self.factor, dtype)


@contextlib.contextmanager
def put_out(functions: Sequence[types.FunctionType], factor: float) -> Iterator[None]:
    """Inside, the results of some functions are off by a factor, whoever calls them.

    Args:
        functions: as `functions_of` finds them.
        factor: of every floating number in a result, and of what a returned function returns.

    Example:
        >>> from firstorder.ledger import functions_of, put_out
        >>> from firstorder.conventions import mirror_direction
        >>> with put_out(functions_of("firstorder.conventions.mirror_direction"), 2.0):
        ...     mirror_direction(0.25, 0.0)
        -0.5
        >>> mirror_direction(0.25, 0.0)
        -0.25
    """
    with turned(functions, Dial(factor)):
        yield


@contextlib.contextmanager
def turned(functions: Sequence[types.FunctionType], dial: Dial) -> Iterator[None]:
    """Inside, the results of some functions are off by what a dial says."""
    right = [(f, f.__code__) for f in functions]
    scaling: list[None] = []  # not empty while a result is scaled: what that calls is not meant
    try:
        for f, code in right:
            f.__code__ = _detour(code, _wrong(f, dial, scaling))
        yield
    finally:
        for f, code in right:
            f.__code__ = code


def _wrong(f: types.FunctionType, dial: Dial, scaling: list[None]) -> Callable[..., Any]:
    """A copy of a function whose results are off."""
    right = types.FunctionType(f.__code__, f.__globals__, f.__name__, f.__defaults__, f.__closure__)
    right.__kwdefaults__ = f.__kwdefaults__
    wrongly = _scale_fields if f.__name__ == "__init__" else _scaled

    def wrong(*args, **kwargs):
        result = right(*args, **kwargs)
        if scaling:
            return result
        dial.calls += 1
        scaling.append(None)
        try:
            return wrongly(args[0] if wrongly is _scale_fields else result, dial)
        finally:
            scaling.pop()

    return wrong


def _detour(code: types.CodeType, to: Callable[..., Any]) -> types.CodeType:
    """Code that calls another function, for a function that has this code.

    A function takes only code of as many free variables as it has; these are named and not read.
    """
    free = ", ".join(f"free{k}" for k in range(len(code.co_freevars)))
    made = compile(_DETOUR.format(free=free, read=free or "None"), "<detour>", "exec")
    detour = _codes_in(_codes_in(made)[0])[0]
    consts = tuple(to if c == "other" else c for c in detour.co_consts)
    return detour.replace(co_consts=consts, co_filename=code.co_filename, co_name=code.co_name)


_DETOUR = """
def outer({free}):
    def detour(*args, **kwargs):
        other = "other"
        return other(*args, **kwargs)
        {read}
"""


def _codes_in(code: types.CodeType) -> list[types.CodeType]:
    return [c for c in code.co_consts if isinstance(c, types.CodeType)]


def _scaled(x: Any, dial: Dial) -> Any:
    """All floating numbers in a result times the factor, and all values of a spectrum.

    A spectrum is not known by its numbers: if all its lengths grow alike, it may stay what it was.
    """
    scale = functools.partial(_scaled_leaf, dial=dial)
    return jax.tree.map(scale, x, is_leaf=lambda part: isinstance(part, Spectrum))


def _scaled_leaf(x: Any, dial: Dial) -> Any:
    if isinstance(x, (float, complex, np.inexact)) or _floating(x):
        return dial.times(x)
    if isinstance(x, Spectrum):
        return SumSpectrum((x,), dial.number(jnp.result_type(float))[None])
    if inspect.isfunction(x) or isinstance(x, (functools.partial, types.MethodType)):
        return lambda *args, **kwargs: _scaled(x(*args, **kwargs), dial)
    if dataclasses.is_dataclass(x) and not inspect.isclass(x):  # one that is no tree
        x = copy.copy(x)
        _scale_fields(x, dial)
    return x


def _floating(x: Any) -> bool:
    """Whether something is an array of floating or complex numbers."""
    return isinstance(x, (np.ndarray, jax.Array)) and np.issubdtype(x.dtype, np.inexact)


def _scale_fields(x: Any, dial: Dial) -> None:
    """Scale the numbers of a record where they stand, in a frozen one too."""
    for field in dataclasses.fields(x):
        if hasattr(x, field.name):
            object.__setattr__(x, field.name, _scaled(getattr(x, field.name), dial))
