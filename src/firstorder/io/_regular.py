"""What may be read at all: regular files, up to a number of bytes.

A pipe blocks whoever opens it, a device such as /dev/zero never ends, and a link leads to either.
Every reader of this package asks here before it opens a file.
"""

from __future__ import annotations

import contextlib
import os
import pathlib
import stat
from collections.abc import Iterator

# A picture or a mesh, and a text that people write: a scene or a drawing.
MOST_BYTES = 2**30
MOST_TEXT_BYTES = 2**26

_KINDS = (
    (stat.S_ISDIR, "is a directory"),
    (stat.S_ISFIFO, "is a pipe"),
    (stat.S_ISSOCK, "is a socket"),
    (stat.S_ISCHR, "is a device"),
    (stat.S_ISBLK, "is a device"),
)


@contextlib.contextmanager
def named_errors(path: str | os.PathLike[str]) -> Iterator[None]:
    """Says what the system refuses, in one sentence that names the file; its kind stays.

    Args:
        path: of the file.

    Raises:
        OSError: of the kind that was raised inside: FileNotFoundError, PermissionError, ...

    Example:
        >>> import pathlib
        >>> from firstorder.io._regular import named_errors
        >>> with named_errors("no.txt"):
        ...     pathlib.Path("no.txt").read_bytes()
        Traceback (most recent call last):
        FileNotFoundError: no.txt: the file cannot be opened (no such file or directory).
    """
    try:
        yield
    except OSError as error:
        why = (error.strerror or "unknown reason").lower()
        raise type(error)(f"{path}: the file cannot be opened ({why}).") from None


def check_regular_file(path: str | os.PathLike[str], most_bytes: int = MOST_BYTES) -> None:
    """Refuses what is no regular file, and what is too large, without opening it.

    Links are followed: where they lead is what counts.

    Args:
        path: of the file.
        most_bytes: how many it may have.

    Raises:
        ValueError: one sentence that names the file, for a folder, a pipe, a socket, a device, a
            file of more bytes, or a name that no file can have.
        FileNotFoundError: one sentence that names the path, if there is none.
        OSError: likewise, if the file system does not tell.

    Example:
        >>> import tempfile
        >>> from firstorder.io._regular import check_regular_file
        >>> with tempfile.TemporaryDirectory(prefix="x", suffix=".hdr") as folder:
        ...     try:
        ...         check_regular_file(folder)
        ...     except ValueError as error:
        ...         print(str(error).partition(": ")[2])
        the file cannot be opened (is a directory).
    """
    path = pathlib.Path(path)
    try:
        with named_errors(path):
            found = path.stat()
    except ValueError:  # a zero byte
        raise ValueError(f"{path.name!r}: no file can have such a name.") from None
    if not stat.S_ISREG(found.st_mode):
        kinds = (words for is_kind, words in _KINDS if is_kind(found.st_mode))
        why = next(kinds, "is no regular file")
        raise ValueError(f"{path.name or path}: the file cannot be opened ({why}).")
    if found.st_size > most_bytes:
        raise ValueError(
            f"{path.name}: the file has {found.st_size} bytes, but at most {most_bytes} are read."
        )


def read_regular_file(path: str | os.PathLike[str], most_bytes: int = MOST_BYTES) -> bytes:
    """The bytes of a regular file.

    Args:
        path: of the file.
        most_bytes: how many it may have.

    Raises:
        ValueError, OSError: as `check_regular_file`; OSError also if the file cannot be opened.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io._regular import read_regular_file
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.txt")
        >>> _ = file.write_bytes(b"light")
        >>> read_regular_file(file)
        b'light'
    """
    check_regular_file(path, most_bytes)
    with named_errors(path):
        return pathlib.Path(path).read_bytes()
