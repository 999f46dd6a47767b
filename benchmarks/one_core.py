"""Times of calls, and measurements in a process of their own, pinned to some cores."""

import json
import os
import pathlib
import subprocess
import sys
import time


def best(run, *args, repeats=5):
    """The shortest of several later calls."""
    import jax

    jax.block_until_ready(run(*args))
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        jax.block_until_ready(run(*args))
        times.append(time.perf_counter() - start)
    return min(times)


def pinned(cores, cache="off", optimize=True):
    """Keeps this process on some cores; before JAX starts. Double precision."""
    os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[:cores]))
    from firstorder import session

    session.start(cache=cache, optimize=optimize)


def answer(file, *words, **environment):
    """What a benchmark's file prints last, as JSON, when it is run with these words.

    Args:
        file: of the benchmark.
        words: for its command line.
        environment: variables that this process has otherwise, or not at all.
    """
    path = pathlib.Path(file)
    command = [sys.executable, "-m", f"benchmarks.{path.stem}", *map(str, words)]
    how = {"cwd": path.parent.parent, "env": {**os.environ, **environment}}
    out = subprocess.run(command, **how, capture_output=True, text=True, check=True).stdout
    return json.loads(out.splitlines()[-1])
