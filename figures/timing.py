"""Ratios of processor times, taken in turns, with their spread: a loaded machine flips none."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np


class Ratio(NamedTuple):
    """A ratio of two times: geometric mean over the rounds, and its standard error."""

    mean: float
    error: float


def seconds(call: Callable[[], object]) -> float:
    """Processor time of one call, over all threads, until its arrays are there."""
    start = time.process_time()
    jax.block_until_ready(call())
    return time.process_time() - start


def ratio(slow: Callable[[], object], fast: Callable[[], object], rounds: int = 9) -> Ratio:
    """Time of `slow` over that of `fast`, each called once unmeasured and then in turns."""
    for call in (slow, fast):
        seconds(call)
    return of_rounds([(seconds(slow), seconds(fast)) for _ in range(rounds)])


def of_rounds(spent: list[tuple[float, float]]) -> Ratio:
    """The ratio of pairs of times that were measured in turns, at least two.

    Example:
        >>> of_rounds([(2.0, 1.0), (2.0, 1.0)])
        Ratio(mean=2.0, error=0.0)
    """
    if len(spent) < 2:
        raise ValueError(f"A spread needs at least two rounds, not {len(spent)}.")
    logarithms = np.log([slow / fast for slow, fast in spent])
    mean = float(np.exp(np.mean(logarithms)))
    return Ratio(mean, mean * float(np.std(logarithms, ddof=1)) / len(spent) ** 0.5)
