"""The cell of a grid in which a point lies."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float, Int


def cell_of(
    nodes: Float[Array, " n"], x: Float[Array, "..."], side: str = "right"
) -> Int[Array, "..."]:
    """Index of the node at which the cell that holds x begins.

    Args:
        nodes: positions in rising order; cells of no length, at breaks, hold nothing.
        x: where; outside, the nearest cell.
        side: the cell to which a node belongs.

    Raises:
        ValueError: if `side` is not "left" or "right".

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.reconstruction._cells import cell_of
        >>> nodes = jnp.array([0.0, 1.0, 1.0, 2.0])
        >>> cell_of(nodes, jnp.array(1.0)).item(), cell_of(nodes, jnp.array(1.0), "left").item()
        (2, 0)
    """
    if side not in ("left", "right"):
        raise ValueError(f"Argument `side` must be 'left' or 'right', but is {side!r}.")
    return jnp.clip(jnp.searchsorted(nodes, x, side=side) - 1, 0, nodes.size - 2)
