"""Preparations of arguments: by NumPy where there are numbers, by JAX where they are traced.

Called alone, each of JAX's operations is a program that takes some 20 ms to compile, and a scene or
a path would be a hundred of them before any light is computed. NumPy compiles nothing.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import jax
import jax.experimental
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import is_concrete
from firstorder.typing import as_array


def hosted(*arrays: Any) -> tuple[Any, ...]:
    """The module to compute with, and the arrays in its form.

    NumPy and its arrays, if all are numbers; else `jax.numpy`, and the arrays as they are. A scalar
    that takes the precision of what it meets becomes Python's number, which does so in NumPy.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._host import hosted
        >>> xp, a = hosted(jnp.array([3.0, 4.0]))
        >>> xp.__name__, xp.linalg.norm(a).item()
        ('numpy', 5.0)
    """
    if not is_concrete(arrays) or any(_weak(a) and a.ndim for a in arrays):
        return jnp, *arrays
    return np, *(a.item() if _weak(a) else np.asarray(a) for a in arrays)


def joined_arrays(arrays: list[Any]) -> Any:
    """Several arrays as one, along the leading axis."""
    xp, *parts = hosted(*arrays)
    return as_array(xp.concatenate(parts))


def spread(a: Any, shape: tuple[int, ...]) -> Any:
    """An array broadcast to a shape."""
    xp, a = hosted(a)
    return as_array(xp.broadcast_to(a, shape))


@contextlib.contextmanager
def double_precision() -> Iterator[None]:
    """Inside, JAX computes in double precision, whatever it does outside."""
    # Older versions have it among the experiments, newer ones only here.
    home: Any = jax if hasattr(jax, "enable_x64") else jax.experimental
    with home.enable_x64(True):
        yield


def with_floats(tree: Any, dtype: Any) -> Any:
    """A tree of concrete arrays whose floating numbers have a given type.

    Example:
        >>> import numpy as np
        >>> from firstorder.numerics._host import with_floats
        >>> number, index = with_floats((np.float32(0.5), np.int32(1)), np.float64)
        >>> number.dtype.name, index.dtype.name
        ('float64', 'int32')
    """

    def one(a):
        return a.astype(dtype) if jnp.issubdtype(a.dtype, jnp.floating) else a

    return jax.tree.map(lambda a: one(a) if hasattr(a, "dtype") else a, tree)


def _weak(a: Any) -> bool:
    """Whether an array takes the precision of what it meets."""
    return getattr(a, "weak_type", False)
