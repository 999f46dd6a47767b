"""R07 §9.1: the importance of a square by its gradient, and what becomes of it in a split.

Starts from the picture and from the squares that a tree is shown, not from the metric's formula.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na
from firstorder.reconstruction.importance import ShadedSamples, by_gradient
from firstorder.reconstruction.quadtree import sample_image

SLOPE = np.array([0.3, -0.7])


def shared_by_quarters():
    """Over any square of a plane picture `|grad I|` integrates to its part of the whole's."""
    x, y, p, q, h = sp.symbols("x y p q h", positive=True)
    a, b = sp.symbols("a b", real=True)
    picture = a * x + b * y
    size = sp.sqrt(sp.diff(picture, x) ** 2 + sp.diff(picture, y) ** 2)

    def importance(left, low, side):
        return sp.integrate(size, (x, left, left + side), (y, low, low + side))

    whole, half = importance(p, q, h), h / 2
    quarters = [importance(p + i * half, q + j * half, half) for i in (0, 1) for j in (0, 1)]
    return [sum(quarters) - whole, *(each - whole / 4 for each in quarters)]


def one_split() -> float:
    """A tree of one square, split once: importances that it was shown, and two sides of a picture.

    On a plane picture quarters share the whole evenly; where only one side of it has a slope, what
    was in the middle counts for all until gradients are found anew, and then a half is left.
    """

    def plane(p):
        return ShadedSamples(p @ SLOPE, np.broadcast_to(SLOPE, p.shape))

    def half(p):
        return ShadedSamples(
            np.maximum(p[:, 0] - 8.0, 0.0), (p[:, :1] >= 8.0) * np.array([1.0, 0.0])
        )

    even, sloped = _importances(plane), _importances(half)
    errors = [np.max(np.abs(4.0 * even[1] / even[0] - 1.0)), abs(even[1].sum() / even[0][0] - 1.0)]
    return float(max(*errors, abs(sloped[1].sum() / sloped[0][0] - 0.5)))


def _importances(shade) -> list[np.ndarray]:
    """Of the first square of 16 x 16 pixels, and of its quarters."""
    kept: list[np.ndarray] = []

    def asked(squares):
        kept.append(by_gradient(squares))
        return kept[-1]

    sample_image(shade, 16, 16, 5, asked, block=16)
    assert [len(k) for k in kept] == [1, 4]
    return kept


ROWS = [
    Row(
        "R07.s9.1c",
        "definition",
        "firstorder.reconstruction.importance.by_gradient",
        shared_by_quarters,
        autodiff=na("definition"),
        fourier=na("no spectrum"),
        brute_force=Check(one_split, 1e-12),
        note="Each quarter has a quarter of it and all four the whole: splitting lowers the "
        "largest importance and not the sum, until gradients are found anew.",
    ),
]
