"""One of two, number by number."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike


def either(which: ArrayLike, a: ArrayLike, b: ArrayLike) -> Array:
    """`jnp.where(which, a, b)`, in one equation of the program where that takes four.

    `jnp.where` is a program of its own, which converts and broadcasts on each call, and is
    transformed and lowered by itself. Here numbers are made arrays of the right kind at once.

    Args:
        which: true for `a`.
        a: array, or a number, which takes the precision of the other one.
        b: likewise; not both are numbers, for those have no precision.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._select import either
        >>> either(jnp.array([True, False]), jnp.array([1.0, 2.0]), 0.0).tolist()
        [1.0, 0.0]
    """
    assert hasattr(a, "dtype") or hasattr(b, "dtype")
    dtype = jnp.result_type(a, b)
    shape = jnp.broadcast_shapes(jnp.shape(which), jnp.shape(a), jnp.shape(b))
    a, b = (_filled(c, shape, dtype) for c in (a, b))
    return jax.lax.select(jnp.broadcast_to(which, shape), a, b)


def larger(a: Array, b: Array) -> Array:
    """The larger of two numbers, with the derivative of the one that is chosen; a, if none is.

    `jnp.maximum` finds whose derivative counts by comparing both with the result. A compiler may
    round one number in two ways in one program: then neither is the result, and the derivative is
    lost.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._select import larger
        >>> larger(jnp.array([1.0, 2.0]), jnp.array([3.0, -4.0])).tolist()
        [3.0, 2.0]
    """
    return either(b > a, b, a)


def smaller(a: Array, b: Array) -> Array:
    """The smaller of two numbers, likewise.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._select import smaller
        >>> smaller(jnp.array([1.0, 2.0]), jnp.array([3.0, -4.0])).tolist()
        [1.0, -4.0]
    """
    return either(b < a, b, a)


def whole_below(t: Array) -> Array:
    """The largest whole number up to t, without derivative; a t just below one counts as that one.

    It says where to look in a table, and the rest, `t - whole_below(t)`, how to weigh what is
    there. A compiler may round t in two ways in one program. At the nodes of a table, where many t
    lie, the place would be that of one cell and the weight that of the next. So the choice is made
    a hair before the nodes, where no t lies by design.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._select import whole_below
        >>> whole_below(jnp.array([1.5, 2.0, 2.0 - 1e-15, -0.5])).tolist()
        [1.0, 2.0, 2.0, -1.0]
    """
    t, eps = jax.lax.stop_gradient(t), float(jnp.finfo(t.dtype).eps)
    return jnp.floor(t + (eps**0.75 + 4.0 * eps * jnp.abs(t)))


def grazing(most: Array) -> Array:
    """The rounding error of a difference, in place of one that is not positive under a root.

    A compiler may round one difference in two ways in one program: it is not positive where the
    root is taken, and positive where the root is used. The root then is that of this number, which
    is off by rounding alone. With 1 in its place what a grazing ray meets would lie a radius off.

    Args:
        most: the first of the two terms that are subtracted.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._select import grazing
        >>> grazing(jnp.array(4.0, jnp.float32)).item() == 2.0**-21
        True
    """
    return jnp.finfo(most.dtype).eps * most


def _filled(c: ArrayLike, shape: tuple[int, ...], dtype) -> Array:
    """An array of that shape and kind."""
    if isinstance(c, (bool, int, float)):
        return jax.lax.full(shape, c, dtype)
    return jnp.broadcast_to(jnp.asarray(c, dtype), shape)


def safe_sqrt(square: Array) -> Array:
    """The square root; zero with the slope zero where the square is not positive. NaN stays."""
    none = square <= 0.0
    return jnp.where(none, 0.0, jnp.sqrt(jnp.where(none, 1.0, square)))
