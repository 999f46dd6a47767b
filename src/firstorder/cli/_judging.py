"""Commands on files of a user's own: events explained and checked, rows of equations judged."""

from __future__ import annotations

import functools
import pathlib
from dataclasses import dataclass
from typing import Annotated

import tyro


@dataclass(frozen=True)
class Explain:
    """Print the equations of the paths and events of a Python file, step by step."""

    source: Annotated[pathlib.Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """A .py file with events, chains and paths as variables of its module."""
    at: tuple[float, ...] = ()
    """A ray, for numbers beside the formulas of paths."""

    def run(self) -> int:
        """One passage for each path and event."""
        from firstorder.symbolic import explain
        from firstorder.transport import Chain, Path

        for name, found in _events(self.source).items():
            path = found if isinstance(found, (Path, Chain)) else Chain((found,))
            told = explain(path, self.at or None if isinstance(found, Path) else None)
            print(f"{name}:\n{told}\n")
        return 0


@dataclass(frozen=True)
class Check:
    """Judge the events of a Python file by all squares, with faults made on purpose.

    Exit code 1 if a square does not hold or a fault is not seen.
    """

    source: Annotated[pathlib.Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """A .py file with events and chains as variables of its module."""

    def run(self) -> int:
        """One table for each event."""
        from firstorder.checks import check
        from firstorder.transport import Path

        found = {n: e for n, e in _events(self.source).items() if not isinstance(e, Path)}
        if not found:
            raise ValueError(f"{self.source.name} has no variable that is an event or a chain.")
        reports = [check(e, name=n) for n, e in found.items()]
        print(*reports, sep="\n\n")
        return int(not all(report.sound for report in reports))


@dataclass(frozen=True)
class Ledger:
    """Judge the ledger of equations in a folder, and print one line for each.

    Its Python files list `ROWS` (`firstorder.ledger.Row`); TOML catalogues may stand beside them.
    Exit code 1 if anything that should hold does not.
    """

    folder: Annotated[pathlib.Path, tyro.conf.Positional, tyro.conf.arg(metavar="FOLDER")]
    """With .py files, or a package of them."""
    equations: Annotated[
        tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="EQUATIONS")
    ] = ()
    """Ids, or what stands in them before a dot; all if none is given."""
    json: pathlib.Path | None = None
    """Also write the rows to this file."""
    jobs: int = 1
    """Processes that judge rows side by side."""
    attack: bool = False
    """Try instead whether each row notices that the function it names is off."""

    def run(self) -> int:
        """Judge, print, write."""
        from firstorder._argument_checks import check_positive
        from firstorder.ledger import gather, report

        check_positive("jobs", self.jobs)
        rows = functools.partial(gather, self.folder)
        return report(rows, self.equations, json=self.json, jobs=self.jobs, attacked=self.attack)


def _events(source: pathlib.Path) -> dict:
    """Events, chains and paths of a Python file, by the names of their variables."""
    import runpy

    from firstorder.transport import Chain, Event, Path

    if source.suffix != ".py" or not source.is_file():
        raise ValueError(f"Argument `source` must be a .py file, but is {source.name}.")
    try:
        variables = runpy.run_path(str(source))
    except SyntaxError as error:
        where = pathlib.Path(error.filename or source).name  # of a module that it imports, too
        raise ValueError(f"{where}, line {error.lineno}: {error.msg}.") from None
    kinds = Event, Chain, Path
    found = {k: v for k, v in variables.items() if isinstance(v, kinds) and k[0] != "_"}
    if not found:
        raise ValueError(f"{source.name} has no variable that is an event, a chain or a path.")
    return found
