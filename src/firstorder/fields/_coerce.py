"""Fields and rays from plain functions, numbers and lists that a user gives in their place."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypeAlias

import equinox as eqx
import jax
import numpy as np

from firstorder._argument_checks import what
from firstorder._display import Module
from firstorder.conventions import UNSTATED, Frame
from firstorder.fields.field import Constant, Field, Function
from firstorder.typing import as_float

FieldLike: TypeAlias = Any
"""A field, a plain function of the coordinates (or of one of them), or a number."""


class Plain(Module):
    """A plain callable as a function of all coordinates, whatever kind of number it returns.

    Args:
        function: of all coordinates, or of one.
        axis: which one; None for all.
    """

    function: Callable
    axis: int | None = eqx.field(static=True, default=None)

    def __call__(self, *u):
        """Value of the function as a floating array."""
        given = u if self.axis is None else (u[self.axis],)
        # A function that returns a plain number is constant, and differentiable like any other.
        return as_float(self.function(*given)) + 0.0 * u[0]


def as_field(
    x: FieldLike, name: str, frame: Frame = UNSTATED, axis: int = 0, extra: str = ""
) -> Field:
    """A field from a field, a plain function, or a number.

    A function of one argument is one of the coordinate `axis` (a position, if nothing else is
    said); any other takes all coordinates in the order of the frame.

    Args:
        x: what the user gave.
        name: of the argument, for errors.
        frame: of the field that is made.
        axis: the coordinate that a function of one argument depends on.
        extra: what else may be given, for errors.

    Raises:
        TypeError: if it is none of these, or a function of another number of arguments.

    Example:
        >>> from firstorder.fields._coerce import as_field
        >>> as_field(lambda x: 2.0 * x, "normal")(1.5, 0.3).item()
        3.0
    """
    if isinstance(x, Field):
        return x
    if isinstance(x, (int, float, np.generic, np.ndarray, jax.Array)) and np.ndim(x) == 0:
        return Constant(x, frame)
    if callable(x) and not isinstance(x, (type, eqx.Module)):
        count, names = _arguments(x), " and ".join(frame.coordinates)
        if count is None or count == frame.dims:
            return Function(Plain(x), frame)
        if count == 1:
            return Function(Plain(x, axis), frame)
        raise TypeError(
            f"Argument `{name}` must be a function of {frame.coordinates[axis]} or of {names}, "
            f"but takes {count} arguments."
        )
    raise TypeError(
        f"Argument `{name}` must be a field, a function or a number{extra}, but is {what(x)}."
    )


def field_of(name: str, frame: Frame = UNSTATED, axis: int = 0) -> Callable[[FieldLike], Field]:
    """The converter of an attribute that is a field (see `as_field`)."""
    return lambda x: as_field(x, name, frame, axis)


def field_or_none(name: str) -> Callable[[FieldLike], Field | None]:
    """Converter to a field that lets None pass."""
    return lambda x: None if x is None else as_field(x, name)


def fields_of(name: str) -> Callable[[Any], tuple[Field, ...]]:
    """The converter of an attribute that is several fields: one alone is a tuple of one."""

    def convert(x: Any) -> tuple[Field, ...]:
        many = x if isinstance(x, (tuple, list)) else (x,)
        return tuple(as_field(part, name) for part in many)

    return convert


def field_or_fields(name: str) -> Callable[[Any], Field | tuple[Field, ...]]:
    """One field, or a tuple of them."""
    return lambda x: fields_of(name)(x) if isinstance(x, (tuple, list)) else as_field(x, name)


def several(name: str, kinds: tuple[type, ...], words: str) -> Callable[[Any], tuple]:
    """The converter of an attribute that is a tuple: one alone is a tuple of one.

    Args:
        name: of the argument.
        kinds: what each entry must be.
        words: the same in words, for errors.
    """

    def convert(x: Any) -> tuple:
        many = tuple(x) if isinstance(x, (tuple, list)) else (x,)
        for part in many:
            if not isinstance(part, kinds):
                raise TypeError(f"Argument `{name}` must hold {words}, but holds {what(part)}.")
        return many

    return convert


def _arguments(function: Callable) -> int | None:
    """Number of arguments a function must be given; None if it takes any number, or if unknown."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # a builtin does not say
        return None
    kind = inspect.Parameter
    if any(p.kind is kind.VAR_POSITIONAL for p in parameters):
        return None
    positional = (kind.POSITIONAL_ONLY, kind.POSITIONAL_OR_KEYWORD)
    return sum(p.kind in positional and p.default is p.empty for p in parameters)
