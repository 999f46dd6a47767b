"""Values for the receivers below a lamp, NaN for the others."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import jax
import numpy as np
from jaxtyping import Float

from firstorder.shadowfield.rendering.lamp import LampFrame, _receiver_rows, below

Answer = TypeVar("Answer")


def where_below(
    lamp: LampFrame,
    receivers: Float[np.ndarray, "m 3"],
    answer: Callable[..., Answer],
    *each,
) -> Answer:
    """Values of `answer(receivers, *each)` for receivers `below` the lamp, NaN for the others.

    A single one that is nowhere would spoil the box of all its neighbours.

    Args:
        lamp: the lamp.
        receivers: in the world [m].
        answer: arrays, in tuples or not, with a number for each receiver along their last axis.
        each: what it wants besides: arrays of m, in tuples or not, or None.
    """
    receivers = _receiver_rows(receivers)
    some = below(lamp, receivers)
    if np.all(some):
        return answer(receivers, *each)

    def whole(values):
        found = np.full((*values.shape[:-1], len(some)), np.nan)
        found[..., some] = values
        return found

    return jax.tree.map(whole, answer(*jax.tree.map(lambda a: a[some], (receivers, *each))))
