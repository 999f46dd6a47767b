"""Damaged files: a clean read, or one line that begins with the file's name; soon, and in bounds.

A read runs in this process, under a limit of memory if the caller sets one (`bounded_memory`).
"""

from __future__ import annotations

import contextlib
import logging
import pathlib
import resource
import time
import warnings
from collections.abc import Iterator
from typing import NamedTuple

from tests.fuzz.mutants import SAMPLES, mutant

SECONDS = 2.0  # of the processor
MEMORY = 1 << 30  # bytes, beyond what the process has when it begins


class Read(NamedTuple):
    """What became of a file.

    Attributes:
        verdict: "read", "refused", or what is wrong with it.
        words: of the refusal.
        seconds: of the processor.
    """

    verdict: str
    words: str
    seconds: float

    @property
    def is_clean(self) -> bool:
        """Whether that is as it should be."""
        return self.verdict in ("read", "refused")


def judged(name: str, data: bytes, folder: pathlib.Path, number: int, seed: int) -> Read:
    """Reads a mutant, and judges what comes of it.

    Args:
        name: of the sample.
        data: its bytes.
        folder: for the file.
        number: of the mutant.
        seed: of the random numbers.
    """
    path = folder / SAMPLES[name].file
    path.write_bytes(mutant(name, data, seed, number))
    start = time.process_time()
    verdict, words = _tried(name, path)
    seconds = time.process_time() - start
    return Read("slow" if seconds > SECONDS else verdict, words, seconds)


def _tried(name: str, path: pathlib.Path) -> tuple[str, str]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what readers leave out
            SAMPLES[name].read(path)
    except (ValueError, OSError) as error:
        words = str(error)
        if "\n" in words or not words.startswith(path.name):
            return "loose words", words
        return "refused", words
    except Exception as error:
        return type(error).__name__, str(error)
    return "read", ""


@contextlib.contextmanager
def bounded_memory() -> Iterator[None]:
    """A process that asks for much more memory than it has now gets a MemoryError."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(pathlib.Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, before[1]))
    disabled = logging.root.manager.disable
    logging.disable(logging.CRITICAL)  # what packages say of broken files besides
    try:
        yield
    finally:
        logging.disable(disabled)
        resource.setrlimit(resource.RLIMIT_AS, before)
