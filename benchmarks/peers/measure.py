"""Processor time, taken in turns, and what a run was made with."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import pathlib
import platform
import resource
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np

PACKAGES = (
    "firstorder",
    "jax",
    "jaxlib",
    "numpy",
    "scipy",
    "numba",
    "mitsuba",
    "drjit",
    "pyradiance",
    "karellen-llvm-core",
)


class Spent(NamedTuple):
    """Seconds of one call, or of the median of several, with their quartiles."""

    median: float
    low: float
    high: float


def clock() -> float:
    """Processor time of this process, all its threads, and the programs it has run [s]."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """What a call gives, when its arrays are there, and its seconds."""
    start = clock()
    found = jax.block_until_ready(call())
    return found, clock() - start


def spent(seconds: Any) -> Spent:
    """The median of several times.

    Example:
        >>> from benchmarks.peers.measure import spent
        >>> spent([1.0, 3.0, 2.0]).median
        2.0
    """
    low, median, high = np.percentile(np.asarray(seconds, float), [25.0, 50.0, 75.0])
    return Spent(float(median), float(low), float(high))


def in_turns(calls: dict[str, Callable[[], Any]], rounds: int) -> dict[str, Spent]:
    """Seconds of calls, each once unmeasured and then in turns."""
    found: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        timed(call)
    for _ in range(rounds):
        for name, call in calls.items():
            found[name].append(timed(call)[1])
    return {name: spent(seconds) for name, seconds in found.items()}


def is_there(package: str) -> bool:
    """Whether a peer can be imported, without importing it."""
    return importlib.util.find_spec(package) is not None


def missing(package: str) -> str:
    """The sentence for a peer that is not there."""
    return f"{package} is not installed here (`pip install 'firstorder[peers]'`): it was left out."


def setting() -> dict[str, Any]:
    """Machine, cores and versions."""
    versions = {}
    for package in PACKAGES:
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "python": platform.python_version(),
        "versions": versions,
        "date": time.strftime("%Y-%m"),
    }


def _processor() -> str:
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.machine()
