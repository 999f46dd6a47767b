"""Names for the array shapes in annotations.

`n` is the number of coordinates of a ray: 2 in flatland, 4 in space.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import jax.numpy as jnp
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
    """
    if isinstance(x, SymbolicArray):
        return x
    try:
        x = jnp.asarray(x)
    except TypeError:
        symbols = symbolic(x)
        if symbols is not None:
            return symbols
        raise TypeError(f"A number or an array is asked for, but {x!r} is given.") from None
    return x if jnp.issubdtype(x.dtype, jnp.inexact) else x.astype(jnp.result_type(float))
