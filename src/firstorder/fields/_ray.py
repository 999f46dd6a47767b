"""Rays as they are given: one vector of all coordinates, checked before a field sees it."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from firstorder._argument_checks import check_real, is_concrete, what
from firstorder.conventions import Frame
from firstorder.numerics._compiled import compiled
from firstorder.typing import Ray, as_float


def of_ray(method: Callable) -> Callable:
    """A method of a field that takes one ray, and takes it as a list or tuple too.

    Called with numbers it runs as one compiled program: operation by operation, the first jet of a
    path would compile some two hundred.

    Raises:
        ValueError: if the ray does not have one entry for each coordinate.
    """

    @functools.wraps(method)
    def checked(self, u, *more, **named):
        if isinstance(u, Tracer):
            _check_ray(self, u)
            return method(self, as_float(u), *more, **named)
        return _called(method, self, _ray(self, u), *more, **named)

    return checked


@compiled
def _called(method: Callable, *args, **named):
    return method(*args, **named)


def _ray(field, u) -> Ray:
    """A concrete ray as an array of its own, or one sentence."""
    try:
        ray = as_float(u)
    except (TypeError, ValueError):
        raise TypeError(
            f"Argument `u` of {type(field).__name__} must be one ray, the numbers "
            f"{', '.join(field.frame.coordinates)}, but is {u!r}."
        ) from None
    _check_ray(field, ray)
    return ray


def _check_ray(field, ray: Array) -> None:
    """Refuse what has not one entry for each coordinate; traced rays have a shape too."""
    dims, names = field.frame.dims, ", ".join(field.frame.coordinates)
    if ray.shape != (dims,):
        raise ValueError(
            f"Argument `u` of {type(field).__name__} must be one ray, the {dims} coordinates "
            f"{names}, but has shape {ray.shape}: for many rays call the field itself, or `jets`."
        )


def stack(frame: Frame, coordinates: tuple, whose: str = "") -> Float[Array, "*b n"]:
    """Broadcast separate coordinates into rays with the coordinates last."""
    names, of = ", ".join(frame.coordinates), f" of {whose}" if whose else ""
    if len(coordinates) != frame.dims:
        raise ValueError(
            f"Arguments{of} must be the {frame.dims} coordinates {names}, "
            f"but are {len(coordinates)}."
        )
    try:
        numbers = [as_float(c) for c in coordinates]
    except (TypeError, ValueError):
        raise TypeError(
            f"Arguments{of} must be numbers or arrays, the coordinates {names}, "
            f"but are {', '.join(map(repr, coordinates))}."
        ) from None
    return jnp.stack(jnp.broadcast_arrays(*numbers), axis=-1)


def plain_row(name: str) -> Callable[[Any], tuple[Any, ...]]:
    """The converter of an attribute that is a tuple of Python's numbers, one for each coordinate.

    A program is kept with the numbers that it was compiled for: of a list that is changed
    afterwards it would go on with the old ones, and take others for them.

    Args:
        name: of the attribute, for errors.

    Raises:
        TypeError: by what it returns, if something is no row of numbers.
        ValueError: by what it returns, if they are traced or complex.

    Example:
        >>> import numpy as np
        >>> from firstorder.fields._ray import plain_row
        >>> plain_row("step")(np.array([0.5, 1.0]))
        (0.5, 1.0)
    """

    def convert(x: Any) -> tuple[Any, ...]:
        if isinstance(x, (np.ndarray, jax.Array)) and x.ndim == 1:
            x = tuple(x)
        if not isinstance(x, (tuple, list, range)):
            raise TypeError(
                f"Argument `{name}` must hold a number for each coordinate, but is {what(x)}."
            )
        if not is_concrete(x):
            raise ValueError(f"Argument `{name}` must hold numbers, but is traced.")
        return tuple(_plain(name, number) for number in x)

    return convert


def _plain(name: str, x: Any) -> Any:
    """One number, as Python has it."""
    check_real(name, x)
    if not isinstance(x, (int, float, np.generic, np.ndarray, jax.Array)) or np.ndim(x):
        raise TypeError(f"Argument `{name}` must hold numbers, but holds {what(x)}.")
    return np.asarray(x).item()
