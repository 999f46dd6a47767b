"""Names for the array shapes in annotations.

`n` is the number of coordinates of a ray: 2 in flatland, 4 in space.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Complex, Float

from firstorder._symbols import SymbolicArray, symbolic

Scalar: TypeAlias = Float[Array, ""]
Ray: TypeAlias = Float[Array, " n"]
Frequency: TypeAlias = Float[Array, " n"]
ComplexScalar: TypeAlias = Complex[Array, ""]
Vector: TypeAlias = Float[Array, " n"]
Matrix: TypeAlias = Float[Array, "n n"]
RealLike: TypeAlias = ArrayLike


def as_float(x: Any) -> Array:
    """Convert a number or array to a floating array of its own, or the default, precision.

    SymPy's expressions are kept, for `firstorder.symbolic`.

    Raises:
        TypeError: if it holds no numbers.

    Example:
        >>> from firstorder.typing import as_float
        >>> as_float([1, 2]).tolist()
        [1.0, 2.0]
    """
    if isinstance(x, SymbolicArray):
        return x
    if isinstance(x, str):  # JAX would look it up as a type
        raise TypeError(f"A number or an array is asked for, but {x!r} is given.")
    if _plain(x):
        x = np.array(x)
        return as_array(x if np.issubdtype(x.dtype, np.inexact) else x.astype(float))
    try:
        x = jnp.asarray(x)
    except (TypeError, ValueError):  # of rows of several lengths NumPy says ValueError
        symbols = symbolic(x)
        if symbols is not None:
            return symbols
        raise TypeError(f"A number or an array is asked for, but {x!r} is given.") from None
    return x if jnp.issubdtype(x.dtype, jnp.inexact) else x.astype(jnp.result_type(float))


def as_array(a: Any) -> Array:
    """JAX's array of NumPy's or of an integer, which must not be written to afterwards.

    With its type stated it is handed over; otherwise JAX compiles a program that copies it.

    Example:
        >>> import numpy as np
        >>> from firstorder.typing import as_array
        >>> as_array(np.arange(3)).tolist()
        [0, 1, 2]
    """
    if isinstance(a, (int, np.generic)):
        a = np.asarray(a)
    if not isinstance(a, np.ndarray):
        return jnp.asarray(a)
    return jnp.asarray(a, jax.dtypes.canonicalize_dtype(a.dtype))


def _plain(x: Any) -> bool:
    """Whether it is an integer, or a list of nothing but Python's and NumPy's numbers."""
    if isinstance(x, float):
        return False  # it takes the precision of what it meets
    if isinstance(x, (list, tuple)):
        return bool(x) and all(isinstance(a, float) or _plain(a) for a in x) and _even(x)
    return isinstance(x, (int, np.number, np.bool_)) or (
        isinstance(x, np.ndarray) and x.dtype.kind in "biufc"
    )


def _even(x: Any) -> bool:
    """Whether the entries of a list have one shape."""
    return len({np.shape(a) for a in x}) == 1
