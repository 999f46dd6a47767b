"""Powers of two near the size of numbers: a change of unit that costs no digit.

Directions do not depend on the unit of length, but squares and products of coordinates leave the
range of single precision at a scene of a micrometre or of a million kilometres. Divided by a power
of two, numbers keep their digits; with the power held fixed, so does every derivative.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


def power_of_two(a: Float[Array, "*n k"]) -> Float[Array, "*n"]:
    """The power of two at or below the largest of some numbers by size; 1 if all are zero.

        2^floor(log2(max |a|))

    The bits of its exponent alone, so that a division by it rounds nothing. It has no derivative.

    Valid for numbers between the smallest normal one and the largest; below it is 1. NaN and
    infinity give infinity.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._scale import power_of_two
        >>> power_of_two(jnp.array([[3.0, -20.0], [0.0, 0.0]])).tolist()
        [16.0, 1.0]
    """
    a = jax.lax.stop_gradient(a)
    most = jnp.max(jnp.abs(a), -1)
    exponent = int(np.asarray(np.inf, a.dtype).view(f"i{a.dtype.itemsize}"))
    bits = jax.lax.bitcast_convert_type(most, f"i{a.dtype.itemsize}") & exponent
    power = jax.lax.bitcast_convert_type(bits, a.dtype)
    return power + (power == 0.0)
