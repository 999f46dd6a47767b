"""Packages that read files talk of what they find: here they do so to nobody."""

from __future__ import annotations

import contextlib
import logging
import sys
import threading
import warnings
from collections.abc import Iterator
from typing import Any

_ONE_AT_A_TIME = threading.Lock()


@contextlib.contextmanager
def quietly() -> Iterator[None]:
    """Nothing that this thread prints, warns of or logs with trimesh's logger is seen.

    Other threads' prints pass. What C++ writes to the error stream of the process does so too:
    closing that for a moment would take away what other threads, and children born meanwhile, say.

    Example:
        >>> from firstorder.io._quietly import quietly
        >>> with quietly():
        ...     print("nobody hears this")
    """
    log, nowhere = logging.getLogger("trimesh"), logging.NullHandler()
    with _ONE_AT_A_TIME, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        stdout, propagate = sys.stdout, log.propagate
        sys.stdout, log.propagate = _Others(stdout), False
        log.addHandler(nowhere)
        try:
            yield
        finally:
            log.removeHandler(nowhere)
            sys.stdout, log.propagate = stdout, propagate


class _Others:
    """A stream that drops what one thread writes, and passes on the rest."""

    def __init__(self, stream: Any):
        self._stream, self._silent = stream, threading.get_ident()

    def write(self, text: str) -> int:
        """As of the stream."""
        return len(text) if threading.get_ident() == self._silent else self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
