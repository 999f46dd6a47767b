"""The command `firstorder`: numbers and tables without writing a program.

Arguments are read before JAX is imported, so that help is there at once: a command imports what it
needs when it runs.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import tyro

import firstorder
from firstorder.cli._judging import Check, Explain, Ledger
from firstorder.cli._paths import Jet, Table
from firstorder.cli._pipes import piped
from firstorder.cli._scenes import Agreements, Render, Scene

__all__ = ["Agreements", "Check", "Explain", "Jet", "Ledger", "Render", "Scene", "Table", "main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; a bad argument is one sentence, and exit code 2.

    Example:
        >>> from firstorder.cli import main
        >>> main(["--version"])
        firstorder 0.1.0
        0
    """
    return piped(lambda: _run(sys.argv[1:] if arguments is None else list(arguments)))


def _run(arguments: list[str]) -> int:
    """`main`, for somebody who reads to the end."""
    if arguments == ["--version"]:
        print(f"firstorder {firstorder.__version__}")
        return 0
    command = tyro.cli(
        Jet | Table | Scene | Agreements | Render | Explain | Check | Ledger,
        args=arguments,
        prog="firstorder",
        description=__doc__,
    )
    from firstorder import session
    from firstorder.errors import Refused

    session.start()
    try:
        return command.run()
    except BrokenPipeError:  # it is a ConnectionError, and `piped` knows what to do
        raise
    except (ValueError, ModuleNotFoundError, ConnectionError, Refused) as error:
        print(error, file=sys.stderr)
    except OSError as error:  # a file that cannot be read, in a sentence, or written
        words = f"{error.strerror.lower()}." if error.strerror else str(error)
        named = error.filename2 or error.filename
        print(": ".join(map(str, filter(None, (named, words)))), file=sys.stderr)
    return 2
