"""Light nodes beside a shadow's edge."""

from __future__ import annotations

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
