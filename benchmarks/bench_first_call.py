"""First calls: what JAX traces and compiles of an entry point, and how long that takes.

A table of equations, seconds of processor time for tracing and for compiling, and the time of a
later call, on one core and without the cache of compiled functions. The first three are what a user
waits for at the first call; `tests/test_first_call.py` keeps the number of equations from growing.
"""

import json
import sys
import time

import numpy as np

from benchmarks.one_core import answer, best, pinned

HEAD = f"{'':26}{'equations':>10}{'trace':>9}{'compile':>9}{'later call':>14}"


def measured(names):
    """Lines to print, and the seconds of all later calls."""
    import jax

    from tests.first_calls import calls, equations

    lines, later = [HEAD], []
    for name, (function, args) in calls().items():
        if names and name not in names:
            continue
        start = time.process_time()
        lowered = jax.jit(function).lower(*args)
        traced = time.process_time()
        compiled = lowered.compile()
        done = time.process_time()
        later.append(min(best(repeated, compiled, args) for _ in range(3)) / CALLS)
        lines.append(
            f"{name:26}{equations(function, *args):10}{traced - start:7.2f} s"
            f"{done - traced:7.2f} s{1e6 * later[-1]:11.1f} us"
        )
    return lines, later


CALLS = 50


def repeated(compiled, args):
    """Several later calls; the last one's answer."""
    return [compiled(*args) for _ in range(CALLS)][-1]


def test_first_calls(capsys):
    lines, later = answer(__file__)
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert np.all(np.isfinite(later))


if __name__ == "__main__":
    pinned(1)
    print(json.dumps(measured(sys.argv[1:])))
