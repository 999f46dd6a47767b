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


def pinned(cores, cache="off"):
    """Keeps this process on some cores; before JAX starts. Double precision."""
    os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[:cores]))
    from firstorder import session

    session.start(cache=cache)


def answer(file, *words):
    """What a benchmark's file prints last, as JSON, when it is run with these words."""
    path = pathlib.Path(file)
    command = [sys.executable, "-m", f"benchmarks.{path.stem}", *map(str, words)]
    root = path.parent.parent
    out = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout
    return json.loads(out.splitlines()[-1])
