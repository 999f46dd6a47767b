"""Evaluation of many pixels in blocks of one size, and light nodes beside a shadow's edge."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool


def beside_seen(hidden: Bool[np.ndarray, "n r c"], wraps: bool) -> Bool[np.ndarray, "n r c"]:
    """Mask of hidden light nodes within two rows or columns of a visible one.

    Args:
        hidden: nodes of n points' lights in rows and columns.
        wraps: whether the last column is a neighbour of the first.

    Example:
        >>> import numpy as np
        >>> from firstorder.rendering._blocks import beside_seen
        >>> row = np.array([[[False, True, True, True, True]]])
        >>> [beside_seen(row, wraps).astype(int).ravel().tolist() for wraps in (False, True)]
        [[0, 1, 1, 0, 0], [0, 1, 1, 1, 1]]
    """
    near = np.zeros(hidden.shape, bool)
    for axis in (1, 2):
        for step in (-2, -1, 1, 2):
            there = np.roll(~hidden, step, axis)
            if axis == 1 or not wraps:
                came = slice(0, step) if step > 0 else slice(step, None)  # around the border
                np.moveaxis(there, axis, 0)[came] = False
            near |= there
    return near & hidden


def in_blocks(run: Callable[..., Any], block: int, *arrays: np.ndarray) -> Any:
    """A compiled function over many rows, in blocks of one size; the last one is filled up.

    Args:
        run: from arrays of `block` rows to a tree of such arrays.
        block: rows at a time.
        arrays: of any, equal number of rows.

    Returns:
        The same tree, of NumPy.

    Example:
        >>> import numpy as np
        >>> from firstorder.rendering._blocks import in_blocks
        >>> in_blocks(lambda a: 2 * a, 2, np.arange(3)).tolist()
        [0, 2, 4]
    """
    count = len(arrays[0])
    if not count:
        arrays = tuple(np.zeros((1, *a.shape[1:]), a.dtype) for a in arrays)
    full = max(len(arrays[0]), 1)
    rows = np.resize(np.arange(full), full + (-full) % block).reshape(-1, block)
    found = [jax.tree.map(np.asarray, run(*(jnp.asarray(a[r]) for a in arrays))) for r in rows]
    return jax.tree.map(lambda *parts: np.concatenate(parts)[:count], *found)
