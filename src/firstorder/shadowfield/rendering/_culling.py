"""Groups of receivers that are near each other, each with its candidates, by halving both at once.

Receivers are halved across their longest side until few are left; at each step the list of
candidates (rays, or places of blockers) shrinks to those that can matter to that half. So each
receiver meets few that are not its own, wherever and however deep it lies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from jaxtyping import Bool, Float, Int

Rows = Int[np.ndarray, " k"]

ROUNDING = 1e-9  # by which share of its coordinates rounding may move a place across a bound


def narrowed(
    points: Float[np.ndarray, "m 3"],
    count: int,
    keep: Callable[[Rows, Int[np.ndarray, " c"]], Bool[np.ndarray, " c"]],
    size: int,
) -> Iterator[tuple[Rows, Int[np.ndarray, " c"]]]:
    """Groups of at most `size` points that are near each other, each with its candidates.

    Args:
        points: to be grouped.
        count: of candidates, numbered from 0; their order is kept.
        keep: from points of a group and candidates to whether these can matter to any of those.
        size: of the largest group.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield.rendering._culling import narrowed
        >>> at = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
        >>> x = np.array([0.0, 9.0])
        >>> near = lambda rows, c: abs(x[c, None] - at[rows, 0]).min(1) < 1.0
        >>> [(r.tolist(), c.tolist()) for r, c in narrowed(at, 2, near, 2)]
        [([2, 1], [0, 1]), ([0], [0])]
    """
    left = [(np.arange(len(points)), np.arange(count))] if len(points) else []
    while left:
        rows, candidates = left.pop()
        candidates = candidates[keep(rows, candidates)]
        if len(rows) <= size:
            yield rows, candidates
            continue
        axis = int(np.argmax(np.ptp(points[rows], axis=0)))
        order = rows[np.argsort(points[rows, axis], kind="stable")]
        half = len(rows) // 2
        left += [(order[:half], candidates), (order[half:], candidates)]
