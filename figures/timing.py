"""Ratios of processor times, taken in turns, with their spread: a loaded machine flips none.

Processors share caches and memory, and two often one core. So a call takes more processor time
beside a busy neighbour, and not every call as much more: beside four busy processes on two
processors some thirty ratios of our figures were 0.7 to 1.7 times what they are on a quiet machine.
If other processes had more than a tenth of the machine, that is added to a ratio's error.
"""

from __future__ import annotations

import os
import pathlib
import time
from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np

QUIET = 0.1  # share of the machine that others may have
LOADED = 0.3  # standard error that more of it adds to the logarithm of a ratio


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
    others = Others()
    return of_times([(seconds(slow), seconds(fast)) for _ in range(rounds)], others)


class Others:
    """What other processes take of the machine from the moment at which this is made."""

    def __init__(self):
        self._start = self._now()

    @staticmethod
    def _now() -> tuple[float, float, float]:
        return _busy(), time.process_time(), time.perf_counter()

    def share(self) -> float:
        """Their processor time over that of all processors; NaN where no system tells."""
        busy, own, passed = np.subtract(self._now(), self._start)
        return float((busy - own) / (passed * (os.cpu_count() or 1)))


def _busy() -> float:
    """Seconds for which processors have worked since the machine started; NaN if nobody tells."""
    counted = pathlib.Path("/proc/stat")
    if not counted.exists():
        return float("nan")
    user, nice, system, _, _, *interrupts = counted.read_text().split("\n")[0].split()[1:9]
    ticks = sum(map(int, (user, nice, system, *interrupts)))
    return ticks / os.sysconf("SC_CLK_TCK")


def of_times(spent: list[tuple[float, float]], others: Others) -> Ratio:
    """The ratio of pairs of times, with the error that a loaded machine adds."""
    found = of_rounds(spent)
    if others.share() <= QUIET:
        return found
    return Ratio(found.mean, float(np.hypot(found.error, LOADED * found.mean)))


def of_rounds(spent: list[tuple[float, float]]) -> Ratio:
    """The ratio of pairs that were measured in turns, at least two.

    Example:
        >>> of_rounds([(2.0, 1.0), (2.0, 1.0)])
        Ratio(mean=2.0, error=0.0)
    """
    if len(spent) < 2:
        raise ValueError(f"A spread needs at least two rounds, not {len(spent)}.")
    logarithms = np.log([slow / fast for slow, fast in spent])
    mean = float(np.exp(np.mean(logarithms)))
    return Ratio(mean, mean * float(np.std(logarithms, ddof=1)) / len(spent) ** 0.5)
