"""Steps that scenes of flatland and of space share: sides, shares of light, numbers and names.

A shape has a front and a back; whatever differs between them is a pair of columns. Shapes of one
kind are kept together, and a shape's number counts through the groups in the order of the kinds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_known,
    check_not_negative,
    is_concrete,
    nan_unless,
)
from firstorder.numerics._host import hosted, joined_arrays
from firstorder.scene._arguments import numbers
from firstorder.scene._bands import bands_of
from firstorder.typing import as_array

FRONT, BACK = 0, 1
TOO_MUCH = 1.0 + 1e-6  # what rounded shares may add up to


def each(value: Any, shape: Any, name: str = "value") -> Float[Array, " n"]:
    """One number for each of the n shapes of a kind.

    Raises:
        TypeError: if it is no number.
        ValueError: if there are more or fewer.
    """
    xp, value = _of_shape(name, value, shape)
    n = shape.count
    if value.shape not in ((), (1,), (n,)):
        raise ValueError(
            f"Argument `{name}` must be one number, or one for each shape (here {n}), "
            f"but has shape {value.shape}."
        )
    return as_array(xp.broadcast_to(value, (n,)))


def sides(value: Any, shape: Any, both: bool, name: str = "value") -> Float[Array, "n 2 *bands"]:
    """Front and back of each of the n shapes of a kind, with a last axis if there are bands.

    A single number, or a single row of bands, is the front's, and perhaps both's. Three numbers or
    more are bands, unless there are as many shapes: then they are one number for each.

    Raises:
        TypeError: if it is no number.
        ValueError: if there are more or fewer.
    """
    xp, value = _of_shape(name, value, shape)
    n = shape.count
    if n == 0:
        raise ValueError("Argument `shape` must hold at least one shape, but holds none.")
    if value.shape in ((1, 2), (2,), (n, 2)):
        return as_array(xp.broadcast_to(value, (n, 2)))
    if value.shape in ((), (1,), (n,)):
        front = xp.broadcast_to(value, (n,))
    elif value.ndim and value.shape[-1] > 2 and value.shape[:-1] in ((), (1,), (n,), (2,)):
        if value.shape[:-1] == (2,):
            return as_array(xp.broadcast_to(value, (n, *value.shape)))
        front = xp.broadcast_to(value, (n, value.shape[-1]))
    elif value.ndim == 3 and value.shape[:-1] in ((1, 2), (n, 2)):
        return as_array(xp.broadcast_to(value, (n, *value.shape[1:])))
    else:
        raise ValueError(
            f"Argument `{name}` must be one number, two (front and back), those of each shape "
            f"(here {n}), or three or more bands in place of each number, but has shape "
            f"{value.shape}."
        )
    return as_array(xp.stack([front, front if both else xp.zeros_like(front)], 1))


def _of_shape(name: str, value: Any, shape: Any) -> tuple[Any, Any]:
    """The module to compute with, and numbers of a material in the precision of their shapes."""
    value = numbers(name, value)
    xp, value = hosted(value)
    if isinstance(value, float):
        sizes = [
            leaf for leaf in jax.tree.leaves(shape) if jnp.issubdtype(leaf.dtype, jnp.floating)
        ]
        value = np.asarray(value, jnp.result_type(*sizes))
    return xp, value


def checked(given: Mapping[str, Array], shares: Sequence[str]) -> dict[str, Array]:
    """A material's numbers, each of which is at least 0, and of which some are shares of one light.

    Args:
        given: numbers by name, a row for each shape; a second axis holds front and back.
        shares: names of those that may add up to 1 at most, on either side.

    Returns:
        The same; traced ones are NaN where they are negative, and their sum is not judged.

    Raises:
        ValueError: if a number is negative or not finite, or a side would reflect more than all.
    """
    for key, value in given.items():
        check_not_negative(key, value)
    if not is_concrete(given):
        return {key: nan_unless(value >= 0.0, value) for key, value in given.items()}
    most = float(np.max(sum(_worse(np.asarray(given[key])) for key in shares)))
    if most > TOO_MUCH:
        *first, last = (f"`{key}`" for key in shares)
        raise ValueError(
            f"Arguments {', '.join(first)} and {last} must add up to at most 1, "
            f"but add up to {most:g}."
        )
    return dict(given)


def _worse(value: np.ndarray) -> np.ndarray:
    """The larger of two sides, in any band."""
    return np.max(value.reshape(len(value), -1), -1)


def grouped(
    things: Sequence, kinds: Sequence[type], join: Callable[[list], Any]
) -> tuple[list, list, tuple[str, ...]]:
    """Primitives kind by kind, those of a kind in the order in which they come.

    Args:
        things: each with a `shape` (that has a `count`), a `material` and a `name`.
        kinds: classes of shapes; there is a group for each of which there is a shape.
        join: makes several modules of one kind one.

    Returns:
        The groups of shapes, the material of each primitive, and the name of each shape.

    Raises:
        ValueError: if there is nothing.
    """
    if not things:
        raise ValueError(
            "Argument `things` must hold at least one shape, but is empty: for an open sky alone "
            "let it be a floor, which hides nothing of the sky above it."
        )
    groups, materials, names = [], [], []
    for kind in kinds:
        here = [t for t in things if isinstance(t.shape, kind)]
        if not here:
            continue
        groups.append(join([t.shape for t in here]))
        materials.extend(t.material for t in here)
        names.extend(t.name for t in here for _ in range(t.shape.count))
    return groups, materials, tuple(names)


def joined(parts: list) -> Any:
    """Several modules of one kind, shapes or materials, as one, along the leading axis.

    Raises:
        ValueError: if those that have bands have not equally many.
    """
    if len(parts) == 1:
        return parts[0]
    bands = bands_of(parts)

    def join(*leaves: Array) -> Array:
        most = max(leaf.ndim for leaf in leaves)
        return joined_arrays([a if a.ndim == most else _spread(a, bands) for a in leaves])

    return jax.tree.map(join, *parts)


def _spread(a: Array, bands: int | None) -> Array:
    """Numbers that are the same in all bands, in each of them."""
    xp, a = hosted(a)
    return as_array(xp.broadcast_to(a[..., None], (*a.shape, bands)))


def named(names: Sequence[str], name: str) -> tuple[int, ...]:
    """The numbers of the shapes of a name.

    Raises:
        ValueError: if there is none.
    """
    found = tuple(i for i, n in enumerate(names) if n == name)
    if not found:
        check_known("name", name, sorted({n for n in names if n}))
    return found
