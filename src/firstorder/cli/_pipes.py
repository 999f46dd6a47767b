"""Commands whose output another program reads, which may stop before the end."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable


def piped(run: Callable[[], int]) -> int:
    """Runs a command; that who reads its output has read enough, as `head` does, is no error.

    What is printed is kept back until there is much of it, or until Python ends: it is sent off
    here, where somebody notices that nobody takes it.

    Args:
        run: the command, whose exit code is returned; 1 if the reader is gone.

    Example:
        >>> from firstorder.cli._pipes import piped
        >>> piped(lambda: print("one line") or 0)
        one line
        0
    """
    try:
        try:
            return run()
        finally:
            print(end="", flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
