"""Which side of a shape is its front, and shapes that are turned round to show it to a point."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_shape, is_concrete, nan_unless
from firstorder.scene._arguments import numbers


def closed_front(kind: str) -> str:
    """The sentence that answers `facing` for a closed kind."""
    return (
        f"Argument `facing` must be left out for {kind}, whose front is their outside: "
        "`two_sided=True` lets their inside shine too."
    )


def facing_point(point: Any, dims: int) -> Float[Array, " d"]:
    """The point towards which a front must look [m].

    Raises:
        TypeError: if it is no point.
        ValueError: if it has another number of coordinates, or is not finite.
    """
    point = numbers("facing", point)
    check_shape("facing", point, (dims,))
    check_finite("facing", point)
    return point


def turned_to(shape: Any, height: Float[Array, " n"]) -> Any:
    """Shapes whose fronts look towards a point.

    Args:
        shape: of one kind, with `turned(which)`.
        height: of the point above the front of each; negative where it is behind.

    Returns:
        The shapes; traced ones are NaN where the point lies in their own plane.

    Raises:
        ValueError: if the kind is closed, or the point lies in the plane of a shape.
    """
    made = shape.turned(height < 0.0)
    beside = height == 0.0
    if is_concrete(beside):
        if bool(jnp.any(beside)):
            raise ValueError(
                "Argument `facing` must lie on one side of every shape, but lies in the plane of "
                f"shape {int(jnp.argmax(beside))}."
            )
        return made
    return jax.tree.map(lambda a: nan_unless(~beside.reshape(-1, *(1,) * (a.ndim - 1)), a), made)
