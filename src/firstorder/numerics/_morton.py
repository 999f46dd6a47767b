"""An order of points in which those that follow each other lie together: Morton's curve."""

import numpy as np

BITS = 10  # of each coordinate


def morton(points: np.ndarray) -> np.ndarray:
    """Numbers of points along the curve: the bits of their cells in turns.

    Args:
        points: shape (n, 3), n at least 1.

    Example:
        >>> import numpy as np
        >>> from firstorder.numerics._morton import morton
        >>> np.argsort(morton(np.array([[0.0, 0, 0], [1, 1, 1], [0.1, 0, 0]]))).tolist()
        [0, 2, 1]
    """
    low = points.min(0)
    wide = np.maximum(points.max(0) - low, 1e-300)
    cells = np.minimum((points - low) / wide * 2**BITS, 2**BITS - 1).astype(np.int64)
    found = np.zeros(len(points), np.int64)
    for bit in range(BITS):
        for axis in range(3):
            found |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return found
