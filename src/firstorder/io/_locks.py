"""Programs that write the same files at once: with equal settings they may, with others not.

The lock is the system's own (`flock`), which ends with the program that holds it, killed or not.
Where there is none (Windows, some network folders) nothing is locked.
"""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
from collections.abc import Iterator
from typing import IO, Any

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None


@contextlib.contextmanager
def at_work(file: str | os.PathLike[str], settings: dict[str, Any]) -> Iterator[None]:
    """Says that a program is at work on a file, and refuses if another one is with other settings.

    Meanwhile `.a.exr.lock` lies beside `a.exr`. What a killed program leaves of it binds nobody.

    Args:
        file: that will be written.
        settings: on which its content depends; of numbers and words.

    Raises:
        ValueError: if a program with other settings is at work on it.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io._locks import at_work
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.exr")
        >>> with at_work(file, {"passes": 8}), at_work(file, {"passes": 8}):
        ...     print([f.name for f in file.parent.iterdir()])
        ['.a.exr.lock']
        >>> list(file.parent.iterdir())
        []
    """
    file = pathlib.Path(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    lock = _shared(file.with_name(f".{file.name}.lock"), settings)
    if lock is None:
        yield
        return
    with lock:
        known = json.loads(lock.read())
        if known["settings"] != settings:
            raise ValueError(_refusal(file, known, settings))
        try:
            yield
        finally:
            if _alone(lock):
                os.unlink(lock.name)


def _shared(path: pathlib.Path, settings: dict[str, Any]) -> IO[str] | None:
    """A lock file that this program shares with all of its settings, which the first one writes."""
    while fcntl is not None:
        try:
            lock = path.open("a+", encoding="utf-8")
        except OSError:  # a folder that is for reading only
            return None
        try:
            if _alone(lock):
                lock.truncate(0)
                json.dump({"process": os.getpid(), "settings": settings}, lock)
                lock.flush()
            fcntl.flock(lock, fcntl.LOCK_SH)  # waits while another program writes its settings
        except OSError:  # a folder that knows no locks
            lock.close()
            return None
        lock.seek(0)
        if _is_there(lock, path):
            return lock
        lock.close()
    return None


def _is_there(lock: IO[str], path: pathlib.Path) -> bool:
    """Whether the lock is the file of that name; another program may have ended and removed it."""
    try:
        return os.path.samestat(os.fstat(lock.fileno()), path.stat())
    except FileNotFoundError:
        return False


def _alone(lock: IO[str]) -> bool:
    """Whether no other program holds the lock; then this one has it for itself."""
    if fcntl is None:
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _refusal(file: pathlib.Path, known: dict[str, Any], settings: dict[str, Any]) -> str:
    """The sentence for a file that is another program's."""
    theirs = known["settings"]
    words = ", ".join(
        f"{k} {theirs.get(k)} and not {mine}" if isinstance(mine, int) else k
        for k, mine in settings.items()
        if theirs.get(k) != mine
    )
    return (
        f"{file.name}: process {known['process']} is writing it now with other settings ({words}): "
        "wait until it ends, or choose another file."
    )
