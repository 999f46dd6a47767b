"""The report: the rows of a folder judged, by several processes, as lines, counts and JSON."""

from __future__ import annotations

import collections
import concurrent.futures
import dataclasses
import functools
import multiprocessing
import pathlib
import sys
from collections.abc import Callable, Sequence
from typing import Any

from tqdm import tqdm

from firstorder import io, session
from firstorder.ledger.attacks import Attacked, attack
from firstorder.ledger.gathering import Ledger
from firstorder.ledger.judging import judge
from firstorder.ledger.rows import EXTRA, NUMERIC, REASONS, ROUTES, Check

# A function of no arguments that gathers, by which another process finds the same rows.
Gather = Callable[[], Ledger]


@dataclasses.dataclass(frozen=True)
class Judged:
    """A judged row as plain data, which travels between processes.

    Attributes:
        equation: id.
        status: fail, not yet, stated or pass.
        row: what `Result.as_json` says.
        seconds: that it took.

    Example:
        >>> from firstorder.ledger import Judged
        >>> Judged("R07.25", "pass", {}, 0.1).status
        'pass'
    """

    equation: str
    status: str
    row: dict[str, Any]
    seconds: float

    @property
    def verdicts(self) -> dict[str, dict[str, Any]]:
        """By route, in the order in which they are printed."""
        return {route: self.row[route] for route in (*ROUTES, EXTRA) if route in self.row}

    def __str__(self) -> str:
        """One line: id, status, kind, routes, seconds, statement."""
        routes = "  ".join(f"{route[0]}:{_short(v)}" for route, v in self.verdicts.items())
        return (
            f"{self.equation:26} {self.status:8} {self.row['kind']:14} {routes}  "
            f"{self.seconds:5.1f} s  {self.row['statement']}"
        )

    def failures(self) -> list[str]:
        """One sentence for each route that fails, and for a kind that is not so."""
        kind = {"kind": self.row["kind_judged"]} if self.row["kind_judged"] else {}
        return [
            f"{self.equation} fails by {route}: {v['reason'] or v['error']}"
            for route, v in (self.verdicts | kind).items()
            if v["verdict"] == "fail"
        ]


def _short(verdict: dict[str, Any]) -> str:
    short = {"pass": "ok", "fail": "FAIL", "not applicable": "n/a", "not yet": "-"}
    error = "" if verdict["error"] is None else f" {verdict['error']:.0e}"
    return f"{short[verdict['verdict']] + error:10}"


def report(
    gathered: Gather,
    equations: Sequence[str] = (),
    *,
    json: pathlib.Path | None = None,
    jobs: int = 1,
    attacked: bool = False,
) -> int:
    """Judge rows, print a line for each and the counts, and write them as JSON.

    Args:
        gathered: gathers the rows; with several processes it must be a function of a module, or a
            `functools.partial` of one.
        equations: ids, or papers, or what stands before a dot; all rows if there is none.
        json: a file for the rows.
        jobs: processes side by side.
        attacked: try instead whether the rows notice that what they name is off (`attack`).

    Returns:
        1 if anything fails that should hold, and otherwise 0.

    Raises:
        ValueError: if no row is meant by `equations`.

    Example:
        >>> import contextlib, functools, io, pathlib, tempfile
        >>> from firstorder.ledger import gather, report
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> _ = (folder / "definitions.py").write_text('''
        ... from firstorder.ledger import ROUTES, Row, na
        ... OUT = dict.fromkeys(ROUTES, na("definition"))
        ... ROWS = [Row("P.1", "definition", statement="Radiance is L.", **OUT)]
        ... ''')
        >>> with contextlib.redirect_stdout(io.StringIO()) as told:
        ...     code = report(functools.partial(gather, folder))
        >>> code, told.getvalue().splitlines()[2]
        (0, 'P: 1 stated')
    """
    session.start()  # before any row is imported: arrays keep the precision they were made with
    ledger = gathered()
    chosen = [k for k in ledger if not equations or _meant(k, equations)]
    if not chosen:
        raise ValueError(f"Argument `equations` matches no row: {' '.join(equations)}.")
    if attacked:
        return _attack(gathered, ledger, chosen, json, jobs)
    results: list[Judged] = _each(functools.partial(_judge, gathered), chosen, jobs, chunk=4)
    print(*results, _summary(results), sep="\n")
    print(*(line for r in results for line in r.failures()), sep="\n", end="")
    if json:
        io.write_json(json, [r.row for r in results])
    return int(any(r.status == "fail" for r in results))


def _meant(equation: str, wanted: Sequence[str]) -> bool:
    return any(equation == w or equation.startswith(f"{w}.") for w in wanted)


def _each(work: Callable[[Any], Any], items: Sequence[Any], jobs: int, chunk: int = 1) -> list[Any]:
    """The work on every item, in their order, in this process or in several."""
    progress = {"total": len(items), "unit": "row", "disable": not sys.stderr.isatty()}
    if jobs == 1:
        return [work(item) for item in tqdm(items, **progress)]
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(jobs, context, initializer=session.start) as pool:
        return list(tqdm(pool.map(work, items, chunksize=chunk), **progress))


@functools.lru_cache(maxsize=1)
def _table(gathered: Gather) -> Ledger:
    """A process gathers once."""
    return gathered()


def _judge(gathered: Gather, equation: str) -> Judged:
    result = judge(*_table(gathered)[equation])
    return Judged(equation, result.status, result.as_json(), result.seconds)


def _summary(results: Sequence[Judged]) -> str:
    """Counts per paper: statuses, kinds, derived proofs, and routes left out with their reasons."""
    papers = collections.defaultdict(list)
    for r in results:
        papers[r.equation.partition(".")[0]].append(r)
    return "\n".join(line for paper, mine in papers.items() for line in _counts(paper, mine))


def _counts(paper: str, mine: Sequence[Judged]) -> list[str]:
    statuses = collections.Counter(r.status for r in mine)
    kinds = collections.Counter(r.row["kind"] for r in mine if r.status != "not yet")
    told = [f"{n} {kind}" for kind, n in kinds.items()]
    reasons = collections.Counter(r.row[route]["reason"] for r in mine for route in ROUTES)
    derived = collections.Counter(r.row[EXTRA]["verdict"] for r in mine if EXTRA in r.row)
    return [
        f"\n{paper}: " + ", ".join(f"{n} {s}" for s, n in sorted(statuses.items())),
        *(["  kinds of those judged: " + ", ".join(told)] if told else []),
        *(f"  derived by the library: {n} {v}" for v, n in derived.items()),
        *(f"  left out {reasons[r]} times: {r}" for r in REASONS.values() if reasons[r]),
    ]


def _attack(
    gathered: Gather,
    ledger: Ledger,
    chosen: Sequence[str],
    json: pathlib.Path | None,
    jobs: int,
) -> int:
    """Attack what the rows name, all rows of one function together."""
    groups = collections.defaultdict(list)
    for equation in chosen:
        row = ledger[equation][1]
        if row.implements and any(isinstance(getattr(row, r), Check) for r in NUMERIC):
            groups[row.implements].append(equation)
    work = functools.partial(_attack_group, gathered)
    found: list[Attacked] = [a for g in _each(work, list(groups.values()), jobs) for a in g]
    found.sort(key=lambda a: list(ledger).index(a.equation))
    print(*found, sep="\n")
    counts = collections.Counter(a.status for a in found)
    print("\n" + ", ".join(f"{n} {status}" for status, n in counts.items()))
    if json:
        io.write_json(json, [a.as_json() for a in found])
    return int(not all(a.sound for a in found))


def _attack_group(gathered: Gather, equations: Sequence[str]) -> list[Attacked]:
    """Rows that name one function; a name that is none is told of each."""
    rows = [_table(gathered)[e][1] for e in equations]
    try:
        return attack(rows)
    except ValueError as refused:
        told = {"noticed": {}, "called": False, "refused": str(refused)}
        return [Attacked(r.equation, r.implements, r.unnoticed, **told) for r in rows]
