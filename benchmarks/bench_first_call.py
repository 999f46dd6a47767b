"""First calls: what JAX traces and compiles of an entry point, and how long that takes.

A table of equations; of seconds of processor time for tracing, for compiling, and for the first
answer of a second process (imports left out), which finds in the cache what the first one has
compiled; and of the time of a later call. What is quick is of a session that was started with
`optimize=False`. All on one core. The number of equations is the same on every machine, and
`tests/test_first_call.py` keeps it from growing.

The last table that was kept is `benchmarks/first_calls.md`, and a new one is printed beside it as
ratios. `python -m benchmarks.bench_first_call keep` puts a new one in its place.
"""

import json
import pathlib
import sys
import tempfile
import time

import numpy as np

from benchmarks.one_core import answer, best, pinned

KEPT = pathlib.Path(__file__).with_name("first_calls.md")
COLUMNS = (
    "equations",
    "trace [s]",
    "compile [s]",
    "second process [s]",
    "later call [us]",
    "quick compile [s]",
    "quick, later [us]",
)
CALLS = 50
COLD, QUICK, WARM, KEEP = "cold", "quick", "warm", "keep"


# --- in a process of its own ---------------------------------------------------------------------


def cold():
    """Equations, tracing, compiling and later calls, by name."""
    import jax

    from tests.first_calls import calls, equations

    rows = {}
    for name, (function, args) in calls().items():
        start = time.process_time()
        lowered = jax.jit(function).lower(*args)
        traced = time.process_time()
        compiled = lowered.compile()
        done = time.process_time()
        later = min(best(repeated, compiled, args) for _ in range(3)) / CALLS
        rows[name] = equations(function, *args), traced - start, done - traced, 1e6 * later
    return rows


def repeated(compiled, args):
    """Several later calls; the last one's answer."""
    return [compiled(*args) for _ in range(CALLS)][-1]


def first_answers():
    """Seconds to the first answer, by name."""
    import jax

    from tests.first_calls import calls

    seconds = {}
    for name, (function, args) in calls().items():
        start = time.process_time()
        jax.block_until_ready(jax.jit(function)(*args))
        seconds[name] = time.process_time() - start
    return seconds


# --- the table -----------------------------------------------------------------------------------


def table():
    """Rows of numbers in the order of COLUMNS, by name."""
    rows, quick = answer(__file__, COLD), answer(__file__, QUICK)
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(2):
            again = answer(__file__, WARM, folder)
    return {name: (*row[:3], again[name], row[3], *quick[name][2:]) for name, row in rows.items()}


def markdown(rows):
    """The table as text."""
    lines = ["| | " + " | ".join(COLUMNS) + " |", "|---|" + "--:|" * len(COLUMNS)]
    for name, (count, *numbers) in rows.items():
        units = zip(numbers, COLUMNS[1:], strict=True)
        words = f"{count:,}", *(f"{t:.2f}" if "[s]" in unit else f"{t:,.1f}" for t, unit in units)
        lines.append(f"| {name} | " + " | ".join(words) + " |")
    return "\n".join(lines) + "\n"


def kept():
    """The rows of the kept table, by name."""
    rows = [line.strip("| ").split(" | ") for line in KEPT.read_text().splitlines()[2:]]
    return {name: [float(word.replace(",", "")) for word in words] for name, *words in rows}


def ratios(rows, old):
    """What has changed: new over kept, for what both have."""
    lines = [f"{'new over kept':26}" + "".join(f"{c.split(' [')[0]:>16}" for c in COLUMNS)]
    for name in (name for name in rows if name in old):
        both = zip(rows[name], old[name], strict=True)
        lines.append(f"{name:26}" + "".join(f"{new / max(was, 1e-3):16.2f}" for new, was in both))
    return "\n".join(lines)


def test_first_calls(capsys):
    rows = table()
    with capsys.disabled():
        print("\n" + markdown(rows) + "\n" + ratios(rows, kept()))
    assert np.all(np.isfinite(list(rows.values())))


if __name__ == "__main__":
    role = sys.argv[1]
    if role == KEEP:
        KEPT.write_text(markdown(table()))
    elif role in (COLD, QUICK):
        pinned(1, optimize=role == COLD)
        print(json.dumps(cold()))
    else:
        pinned(1, cache=sys.argv[2])
        print(json.dumps(first_answers()))
