"""Vectors of space, their frames, and 3x3 matrices by their columns."""

from __future__ import annotations

from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Shaped

from firstorder.numerics._compiled import compiled
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import either

Vectors = Float[Array, "*#n 3"]
Numbers = Float[Array, "*#n"]
Coordinates = tuple[Array, Array, Array]
Tree = TypeVar("Tree")


def settled(tree: Tree) -> Tree:
    """A tree of arrays, each computed once before it is used (an optimisation barrier).

    Shuffled coordinates of short vectors otherwise send the compiler through every product of
    products again: minutes instead of a second. Each array settles by itself, so that what nobody
    uses is not computed for the sake of its neighbours.
    """
    return jax.tree.map(jax.lax.optimization_barrier, tree)


def dot(a: Vectors, b: Vectors) -> Numbers:
    """The scalar product.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics import dot
        >>> dot(jnp.array([1.0, 2.0, 3.0]), jnp.array([1.0, 0.0, 1.0])).item()
        4.0
    """
    return jnp.sum(a * b, -1)


def cross(a: Vectors, b: Vectors) -> Vectors:
    """The vector product, right-handed.

    In whole vectors: written out by coordinates it compiles five times as long.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics import cross
        >>> x, y, z = jnp.eye(3)
        >>> cross(x, y).tolist()
        [0.0, 0.0, 1.0]
    """
    return _next(a * _next(b) - _next(a) * b)


def _next(a: Vectors) -> Vectors:
    """(y, z, x) of (x, y, z)."""
    return jnp.concatenate([a[..., 1:], a[..., :1]], -1)


def apart(a: Vectors) -> Coordinates:
    """The coordinates of vectors, each an array of its own.

    Long sums over many vectors run several times faster on those: all of a formula is one loop over
    numbers side by side, and a coordinate that nobody asks for is not computed.
    """
    x, y, z = jnp.unstack(a, axis=-1)
    return x, y, z


def dot_apart(a: Coordinates, b: Coordinates) -> Array:
    """The scalar product, of coordinates."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross_apart(a: Coordinates, b: Coordinates) -> Coordinates:
    """The vector product, of coordinates."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def matvec_apart(matrix: Float[Array, "3 3"], a: Coordinates) -> Coordinates:
    """Matrix times vectors, of coordinates."""
    one, two, three = (dot_apart((row[0], row[1], row[2]), a) for row in matrix)
    return one, two, three


def norm(a: Vectors) -> Numbers:
    """Length; zero, with zero derivative, for the zero vector.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics import norm
        >>> norm(jnp.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])).tolist()
        [5.0, 0.0]
    """
    square = dot(a, a)
    none = square <= 0.0
    return either(none, 0.0, jnp.sqrt(either(none, 1.0, square)))


def unit(a: Vectors) -> Vectors:
    """The vector of length one along a; the zero vector stays what it is.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics import unit
        >>> unit(jnp.array([0.0, 0.0, 4.0])).tolist()
        [0.0, 0.0, 1.0]
    """
    length = norm(a)
    return a / either(length > 0.0, length, 1.0)[..., None]


def orthonormal_frame(normal: Vectors) -> Float[Array, "*n 3 3"]:
    """A right-handed frame (t, b, n) with the axes as columns, local to global.

    The mirror that takes z to -n, or to n below the horizon, takes x and y to tangents. They are
    smooth in n but for a jump at n_z = 0; on neither side do they degenerate.

    Example:
        >>> import jax.numpy as jnp
        >>> orthonormal_frame(jnp.array([0.0, 0.0, 1.0])).tolist()
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    across, z = normal[..., :2], normal[..., 2:]
    sign = either(z >= 0.0, jnp.ones_like(z), -1.0)
    turned = across[..., :, None] * (across / (1.0 + sign * z))[..., None, :]
    flat = np.eye(2, dtype=normal.dtype) - turned
    tangents = jnp.concatenate([flat, -(sign * across)[..., None, :]], -2)
    hand = jnp.concatenate([jnp.ones_like(sign), sign], -1)[..., None, :]
    return settled(jnp.concatenate([tangents * hand, normal[..., :, None]], -1))


@compiled
def frame_along(a: Vectors) -> Float[Array, "*n 3 3"]:
    """The frame whose third axis looks along vectors of any length and unit."""
    return orthonormal_frame(unit(near_one(a)))


def near_one(a: Vectors) -> Vectors:
    """Vectors divided by a power of two so that they are nearly as long as one; zero stays zero.

    For those in metres whose squares may leave the range of the precision.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._vectors import near_one
        >>> near_one(jnp.array([0.0, 3.0, -6.0])).tolist()
        [0.0, 0.75, -1.5]
    """
    return a / power_of_two(a)[..., None]


def inverse_3x3(axes: Float[Array, "*n 3 3"]) -> Float[Array, "*n 3 3"]:
    """The inverse of a matrix: the vector products of its columns are its rows.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics import inverse_3x3
        >>> jnp.diag(inverse_3x3(jnp.diag(jnp.array([1.0, 2.0, 4.0])))).tolist()
        [1.0, 0.5, 0.25]
    """
    return inverse_and_det(axes)[0]


@jax.custom_jvp
def inverse_and_det(axes: Float[Array, "*n 3 3"]) -> tuple[Float[Array, "*n 3 3"], Numbers]:
    """The inverse of a matrix, and its determinant, of which only the inverse has derivatives.

    Zeros for a matrix whose columns all lie on one line, as those of a flat shape without area: its
    inverse takes no direction anywhere. Infinite for any other that is singular.
    """
    columns = jnp.swapaxes(axes, -1, -2)
    one, two = jnp.roll(columns, -1, -2), jnp.roll(columns, -2, -2)
    rows = settled(cross(one, two))
    det = jnp.sum(columns * rows, -1)[..., 0]
    on_a_line = jnp.all(rows == 0.0, (-2, -1))
    return settled(rows / (det + on_a_line)[..., None, None]), det


@inverse_and_det.defjvp
def _inverse_rule(primals, tangents):
    """d(1/A) = -(1/A) dA (1/A): the square of a determinant would leave the range of float32."""
    turn, det = inverse_and_det(*primals)
    return (turn, det), (-settled(turn @ tangents[0] @ turn), jnp.zeros_like(det))


def rows(a: Shaped[Array, "n *k"], which: Int[Array | np.ndarray, "*m"]) -> Shaped[Array, "..."]:
    """Rows by numbers of which none is negative or too large: one copy and no questions."""
    whole = range(which.ndim, which.ndim + a.ndim - 1)
    take = jax.lax.GatherDimensionNumbers(tuple(whole), (0,), (0,))
    start = which.astype(np.int32)[..., None]
    return jax.lax.gather(a, start, take, (1, *a.shape[1:]), mode="promise_in_bounds")


def matvec(matrix: Float[Array, "*#n 3 3"], a: Vectors) -> Vectors:
    """Matrix times vector, by columns.

    As sums over rows rays run four times slower, and jaxlib 0.10 to 0.12 compile some of those
    wrongly for CPUs (tests/numerics/test_vectors.py).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics import matvec
        >>> matvec(jnp.diag(jnp.array([1.0, 2.0, 4.0])), jnp.ones(3)).tolist()
        [1.0, 2.0, 4.0]
    """
    x, y, z = jnp.unstack(matrix, axis=-1)
    return x * a[..., :1] + y * a[..., 1:2] + z * a[..., 2:]
