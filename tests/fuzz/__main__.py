"""Nasty scenes, damaged files, killed programs and workers: `make fuzz N=100000 SEED=0`.

    python -m tests.fuzz 100000 --seed 0              scenes of flatland in each precision, a tenth
                                                      as many of space, 3 in 100 as many files
    python -m tests.fuzz 100000 --only space files    a part of it
    python -m tests.fuzz --only workers --kills 100   a hundred workers killed while they render
    python -m tests.fuzz --case files/svg/0/17        one case again, as a report names it

Every line of a report that says WRONG has the command that repeats its worst cases. What is known
to fail stands in `tests/fuzz/limits.py`, is counted, and is no failure. Exit code 1 for any other.
"""

from __future__ import annotations

import argparse
import itertools
import os
import time

import numpy as np

from firstorder import session
from tests.fuzz import kills, mutants, parts, worlds
from tests.fuzz.report import Tally

PARTS = ("flatland", "space", "files", "kills", "workers")
FEWER = {"flatland": 1.0, "space": 0.1, "files": 0.03}  # for each scene of flatland
KILLS = 5  # of each program, and four times as many of a cluster
PRECISIONS = tuple(worlds.PRECISIONS)


def main() -> int:
    """Fuzz what is asked for, and report."""
    parser = argparse.ArgumentParser(description="Nasty scenes, damaged files, killed programs.")
    parser.add_argument("count", type=int, nargs="?", default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kills", type=int, default=0, help="of each program, or of a cluster")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--precision", nargs="+", choices=PRECISIONS, default=PRECISIONS)
    parser.add_argument("--case", default="", help="one case again, as a report names it")
    given = parser.parse_args()
    os.environ["FIRSTORDER_CACHE"] = str(session.start() or session.OFF)
    tally = Tally()
    with np.errstate(all="ignore"):  # references divide by zero where nothing is hit
        if given.case:
            for line in parts.repeat(tally, given.case):
                print(line, flush=True)
        else:
            print(f"seed {given.seed}, {given.count} scenes", flush=True)
            for part in given.only:
                _fuzz(tally, part, given)
    print(*tally.lines, sep="\n")
    return int(tally.failures > 0)


def _fuzz(tally: Tally, part: str, given: argparse.Namespace) -> None:
    """One part, with its time."""
    begin = time.process_time()
    count = int(given.count * FEWER.get(part, 0.0))
    if part in worlds.WORLDS:
        classes = worlds.WORLDS[part].classes
        for precision, name in itertools.product(given.precision, classes):
            parts.fuzz_scenes(tally, part, precision, given.seed, count // len(classes), name)
            print(f"... {part} {precision} {name}: {tally.failures} failures so far", flush=True)
    elif part == "files":
        for name in mutants.SAMPLES:
            parts.fuzz_files(tally, name, given.seed, range(count // len(mutants.SAMPLES)))
            print(f"... files {name}: {tally.failures} failures so far", flush=True)
    elif part == "workers":
        for line in parts.fuzz_workers(tally, given.seed, given.kills or 4 * KILLS):
            print(line, flush=True)
    else:
        for name in kills.PROGRAMS:
            for line in parts.fuzz_kills(tally, name, given.seed, range(given.kills or KILLS)):
                print(line, flush=True)
    print(f"{part}: {time.process_time() - begin:.0f} s of the processor", flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
