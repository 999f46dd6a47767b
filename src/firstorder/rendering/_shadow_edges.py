"""Shadow edges among the nodes of lamps, from shadow rays that are there, as sparse lists.

What they add to a gradient is `imaging._area_lights.shadow_edge_terms`: a sum over pairs of
neighbouring nodes of which one is seen. Few pixels have any, and those have few. Here each pair is
a row.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder.imaging._area_lights import at_limb, edge_rate

Rows = Int[np.ndarray, " e"]


class ShadowEdges(NamedTuple):
    """Pairs of neighbouring nodes of which one is seen.

    Attributes:
        row: the point from which they are looked at.
        axis: along which they are neighbours: 0 for rows, 1 for columns.
        before: number of the first of the two nodes.
        after: number of the second.
        hidden: the one of them that is not seen.
        behind: the next node on the side of the hidden one, -1 for none.
        jump: visibility of the second less that of the first.
    """

    row: Rows
    axis: Rows
    before: Rows
    after: Rows
    hidden: Rows
    behind: Rows
    jump: Float[np.ndarray, " e"]


def shadow_edges(seen: Bool[np.ndarray, "n r c"], wraps: bool) -> ShadowEdges:
    """All edges of the shadows on the lattices of n points.

    Args:
        seen: which nodes are seen, and above the surface.
        wraps: whether the last column is a neighbour of the first.

    Example:
        >>> import numpy as np
        >>> from firstorder.rendering._shadow_edges import shadow_edges
        >>> found = shadow_edges(np.array([[[True, False, False]]]), False)
        >>> [int(a[0]) for a in found]  # along columns, from node 0 to 1, and 2 is behind
        [0, 1, 0, 1, 1, 2, -1]
    """
    parts = [_along(seen, axis, wraps and axis == 1) for axis in (0, 1)]
    return ShadowEdges(*(np.concatenate(a) for a in zip(*parts, strict=True)))


def _along(seen: Bool[np.ndarray, "n r c"], axis: int, round_: bool) -> ShadowEdges:
    lines = seen if axis == 1 else seen.swapaxes(1, 2)  # [point, line, place on it]
    count = lines.shape[2]
    after = np.roll(lines, -1, 2) if round_ else lines[:, :, 1:]
    row, line, place = np.nonzero(after != (lines if round_ else lines[:, :, :-1]))
    jump = np.where(lines[row, line, place], -1.0, 1.0)
    ahead = (place + 1) % count
    next_ = np.where(jump < 0.0, place + 2, place - 1)
    if round_:
        next_ %= count
    else:
        next_[next_ >= count] = -1

    def number(place):
        return line * count + place if axis == 1 else place * lines.shape[1] + line

    before, then = number(place), number(ahead)
    hidden = np.where(jump < 0.0, then, before)
    behind = np.where(next_ < 0, -1, number(next_))
    return ShadowEdges(row, np.full(len(row), axis), before, then, hidden, behind, jump)


def edge_weights(
    edges: ShadowEdges,
    seen: Bool[np.ndarray, "n k"],
    above: Bool[np.ndarray, "n k"],
    depth: Callable[[Rows, Rows], Float[np.ndarray, " m"]],
    near: bool,
) -> Float[np.ndarray, " e"]:
    """Jump of each edge times how fast its blocker moves it over the light (`edge_rate`).

    Args:
        edges: from `shadow_edges`.
        seen: which nodes are seen.
        above: which are above the surface; others are hidden by its horizon, which stands still.
        depth: where nodes are hidden, by the numbers of points and nodes: the share of the way, or
            of distant light the distance [m].
        near: whether the light is.
    """
    row, hidden = edges.row, edges.hidden
    behind = np.maximum(edges.behind, 0)
    first, second = above[row, hidden], (edges.behind >= 0) & ~seen[row, behind]
    asked = np.zeros(seen.shape, bool)
    asked[row[first], hidden[first]] = asked[row[second], behind[second]] = True
    at = np.nonzero(asked & above)  # each node once
    found = np.zeros(seen.shape)
    found[at] = depth(*at)
    edge = at_limb(found[row, hidden], found[row, behind], second)
    return edges.jump * edge_rate(edge, near)


def beside_seen(hidden: Bool[np.ndarray, "n r c"], wraps: bool) -> Bool[np.ndarray, "n r c"]:
    """Mask of hidden light nodes within two rows or columns of a visible one.

    Args:
        hidden: nodes of n points' lights in rows and columns.
        wraps: whether the last column is a neighbour of the first.

    Example:
        >>> import numpy as np
        >>> from firstorder.rendering._shadow_edges import beside_seen
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
