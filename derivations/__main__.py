"""Print the ledger: `python -m derivations [ID ...] [--json FILE] [--jobs N] [--attack]`.

Exit code 1 if anything that should hold does not.
"""

from __future__ import annotations

import os
import pathlib
import sys
from dataclasses import dataclass, field
from typing import Annotated

import tyro

from derivations import table
from firstorder.cli._pipes import piped
from firstorder.ledger import report


@dataclass
class Options:
    """Judge every equation of the papers and print one row for each."""

    equations: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Ids such as R07.25 or D05; all if none is given."""
    json: pathlib.Path | None = None
    """Also write the rows to this file."""
    jobs: int = field(default_factory=lambda: min(2, os.cpu_count() or 1))
    """Processes that judge rows side by side."""
    attack: bool = False
    """Try instead whether each row notices that what it names is off."""


def main(options: Options) -> int:
    """Judge, print, write."""
    o = options
    try:
        return report(table, o.equations, json=o.json, jobs=o.jobs, attacked=o.attack)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(piped(lambda: main(tyro.cli(Options, description=__doc__))))
