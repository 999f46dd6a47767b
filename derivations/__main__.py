"""Print the ledger: `python -m derivations [ID ...] [--json FILE] [--jobs N]`.

Exit code 1 if anything that should hold does not.
"""

from __future__ import annotations

import collections
import concurrent.futures
import multiprocessing
import os
import pathlib
import sys
from dataclasses import dataclass, field
from typing import Annotated

import tyro
from tqdm import tqdm

from derivations.catalogue import SOURCES
from derivations.ledger import REASONS, ROUTES, Result, judge, table
from firstorder import io, session


@dataclass
class Options:
    """Judge every equation of the papers and print one row for each."""

    equations: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Ids such as R07.25 or D05; all if none is given."""
    json: pathlib.Path | None = None
    """Also write the rows to this file."""
    jobs: int = field(default_factory=lambda: min(2, os.cpu_count() or 1))
    """Processes that judge rows side by side."""


def main(options: Options) -> int:
    """Judge, print, write."""
    _start()  # before any derivation is imported: arrays keep the precision they were made with
    chosen = [k for k in table() if not options.equations or _matches(k, options.equations)]
    if not chosen:
        raise SystemExit(f"Argument `equations` matches no row: {' '.join(options.equations)}.")
    results = _judge_all(chosen, options.jobs)
    for result in results:
        print(_line(result))
    print(_summary(results))
    for equation, _, row, _ in results:
        for route in ROUTES:
            if row[route]["verdict"] == "fail":
                print(f"{equation} fails by {route}: {row[route]['reason'] or row[route]['error']}")
    if options.json:
        io.write_json(options.json, [r for _, _, r, _ in results])
    return int(any(status == "fail" for _, status, _, _ in results))


def _matches(equation: str, wanted: tuple[str, ...]) -> bool:
    return any(equation == w or equation.startswith(f"{w}.") for w in wanted)


def _judge_all(equations: list[str], jobs: int):
    context = multiprocessing.get_context("spawn")
    progress = {"total": len(equations), "unit": "row", "disable": not sys.stderr.isatty()}
    if jobs == 1:
        _start()
        return [_judge(e) for e in tqdm(equations, **progress)]
    with concurrent.futures.ProcessPoolExecutor(jobs, context, initializer=_start) as pool:
        return list(tqdm(pool.map(_judge, equations, chunksize=4), **progress))


def _start() -> None:
    session.start()


def _judge(equation: str) -> tuple[str, str, dict, float]:
    """Judge one row; the answer is plain data, so that it travels between processes."""
    result: Result = judge(*table()[equation])
    return equation, result.status, result.as_json(), result.seconds


def _line(result) -> str:
    equation, status, row, seconds = result
    routes = "  ".join(f"{route[0]}:{_short(row[route])}" for route in ROUTES)
    return (
        f"{equation:26} {status:8} {row['kind']:14} {routes}  {seconds:5.1f} s  {row['statement']}"
    )


def _short(verdict) -> str:
    short = {"pass": "ok", "fail": "FAIL", "not applicable": "n/a", "not yet": "-"}
    error = "" if verdict["error"] is None else f" {verdict['error']:.0e}"
    return f"{short[verdict['verdict']] + error:10}"


def _summary(results) -> str:
    """Counts per paper: statuses, and routes left out with their reasons."""
    lines = []
    for paper in SOURCES:
        mine = [r for r in results if r[0].startswith(f"{paper}.")]
        if not mine:
            continue
        statuses = collections.Counter(status for _, status, _, _ in mine)
        kinds = collections.Counter(
            row["kind"] for _, status, row, _ in mine if status != "not yet"
        )
        reasons = collections.Counter(
            row[route]["reason"]
            for _, _, row, _ in mine
            for route in ROUTES
            if row[route]["reason"]
        )
        lines.append(f"\n{paper}: " + ", ".join(f"{n} {s}" for s, n in sorted(statuses.items())))
        lines.append("  kinds of those judged: " + ", ".join(f"{n} {k}" for k, n in kinds.items()))
        lines += [f"  left out {reasons[r]} times: {r}" for r in REASONS.values() if reasons[r]]
    return "\n".join(lines)


if __name__ == "__main__":
    # Functions travel to other processes by name, and `__main__` is not a name that they know.
    from derivations.__main__ import Options, main

    sys.exit(main(tyro.cli(Options, description=__doc__)))
