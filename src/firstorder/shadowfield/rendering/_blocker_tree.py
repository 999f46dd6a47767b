"""First and last blockers in receivers' frusta, from a tree of places, in machine code.

Places are sorted along a curve that fills space (Morton's) and cut into leaves; a box bounds each
leaf, and each pair of boxes is bounded by the next, up to one. A receiver goes down where a box
meets its frustum and may hold something shallower or deeper than what it has.
"""

from __future__ import annotations

import numpy as np

from firstorder.numerics._native import native
from firstorder.numerics._order import morton
from firstorder.shadowfield.rendering._culling import ROUNDING

LEAF = 8  # places

# What a box holds of its places: least and largest of p (two axes) and depth, least of the depths
# that receivers must exceed.
P0, TOP0, P1, TOP1, Z, DEEP, LEVEL = range(7)


def first_and_last(places, at, half, pixel: float) -> tuple[np.ndarray, np.ndarray]:
    """Depths of the first and last places before each receiver; infinity and minus infinity.

    Args:
        places: lateral, depth, and the depth that receivers must exceed, shape (k, 4) [m].
        at: receivers in the lamp's frame, shape (m, 3) [m].
        half: of the lamp's edges [m].
        pixel: side of a pixel on the receivers [m].
    """
    near, far = np.full(len(at), np.inf), np.full(len(at), -np.inf)
    if len(places):
        sorted_places = np.ascontiguousarray(places[np.argsort(morton(places[:, :3]))])
        _search(sorted_places, _boxes(sorted_places), at, half, 0.5 * pixel, near, far)
    return near, far


def _boxes(places: np.ndarray) -> np.ndarray:
    """Boxes of the tree: the root is 1, below k are 2 k and 2 k + 1; empty ones are inside out."""
    x, y, z, level = places.T
    values, starts = np.stack([x, -x, y, -y, z, -z, level]), np.arange(0, len(x), LEAF)
    leaves = 1 << int(np.ceil(np.log2(len(starts))))
    rows = [np.full((7, leaves), np.inf)]
    rows[0][:, : len(starts)] = np.minimum.reduceat(values, starts, axis=1)
    while rows[-1].shape[1] > 1:
        rows.append(np.minimum(rows[-1][:, ::2], rows[-1][:, 1::2]))
    boxes = np.concatenate([np.full((7, 1), np.inf), *rows[::-1]], 1).T.copy()
    boxes[:, [TOP0, TOP1, DEEP]] *= -1.0
    return boxes


@native
def _search(places, boxes, at, half, half_pixel, near, far):
    """Fills in the depths of blockers in frusta that are a pixel wide at their receivers.

    Each receiver looks first at what the one before it found: that leaves few boxes to open.
    """
    stack, leaves = np.empty(64, np.int64), boxes.shape[0] // 2
    before = np.zeros(2, np.int64)
    for k in range(at.shape[0]):
        first, last = np.inf, -np.inf
        for r in before:
            if _hides(places[r], at[k], half, half_pixel):
                first, last = min(first, places[r, 2]), max(last, places[r, 2])
        stack[0], left = 1, 1
        while left:
            left -= 1
            node = stack[left]
            if boxes[node, Z] >= first and boxes[node, DEEP] <= last:
                continue
            if not _meets(boxes[node], at[k], half, half_pixel):
                continue
            if node < leaves:
                stack[left], stack[left + 1] = 2 * node, 2 * node + 1
                left += 2
                continue
            start = (node - leaves) * LEAF
            for r in range(start, min(start + LEAF, places.shape[0])):
                if _hides(places[r], at[k], half, half_pixel):
                    if places[r, 2] < first:
                        first, before[0] = places[r, 2], r
                    if places[r, 2] > last:
                        last, before[1] = places[r, 2], r
        near[k], far[k] = first, last


@native
def _hides(place, at, half, half_pixel):
    """Whether a place lies in a receiver's frustum."""
    t = place[2] / at[2]
    edge0, edge1 = half[0] * (1.0 - t) + half_pixel * t, half[1] * (1.0 - t) + half_pixel * t
    inside = abs(place[0] - at[0] * t) <= edge0 and abs(place[1] - at[1] * t) <= edge1
    return inside and place[3] < at[2]


@native
def _meets(box, at, half, half_pixel):
    """Whether a box may hold places in the frustum, whose sides are straight."""
    if box[LEVEL] >= at[2]:
        return False
    a, b = box[Z] / at[2], min(box[DEEP] / at[2], 1.0)
    for axis in range(2):
        slope = half_pixel - half[axis]
        more = half[axis] + ROUNDING * (half[axis] + abs(at[axis]))
        left, right = at[axis] - slope, at[axis] + slope
        if box[2 * axis + 1] < min(left * a, left * b) - more:
            return False
        if box[2 * axis] > max(right * a, right * b) + more:
            return False
    return True
