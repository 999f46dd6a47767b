"""Loops over numbers in machine code, where numba is there to make it (extra `fast`).

It is imported here alone. What no array says well, windows of sorted rays that differ from receiver
to receiver and sums into few bins, takes a tenth to a twentieth of the time of the best that XLA
makes of it on a processor. Whoever uses it has a second way, for those who do without numba.
"""

from __future__ import annotations

import importlib.util
import inspect
from collections.abc import Callable
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable)

HAVE_NATIVE = importlib.util.find_spec("numba") is not None


def native(function: Function, fastmath: bool = True) -> Function:
    """A loop over NumPy arrays as machine code; as it is, and slow, without numba.

    Sums may be taken in another order, and what is infinite or NaN may be mistaken for a number,
    unless `fastmath` is false. What is compiled is kept beside the source. A loop that calls others
    finds them in its own file: numba does not see when those of another one change.

    Example:
        >>> import numpy as np
        >>> from firstorder.numerics._native import native
        >>> @native
        ... def total(values):
        ...     found = 0.0
        ...     for k in range(values.size):
        ...         found += values[k]
        ...     return found
        >>> float(total(np.ones(3)))
        3.0
    """
    bare = inspect.unwrap(function)  # of checks of shapes, which numba cannot read
    if not HAVE_NATIVE:
        return bare  # pyright: ignore[reportReturnType]
    import numba  # half a second: whoever has such loops is imported when they are called

    options: dict[str, Any] = {"fastmath": fastmath, "error_model": "numpy"}
    try:
        return numba.njit(bare, cache=True, **options)  # pyright: ignore[reportReturnType]
    except RuntimeError:  # no file to keep it beside: a notebook's cell
        return numba.njit(bare, **options)  # pyright: ignore[reportReturnType]
