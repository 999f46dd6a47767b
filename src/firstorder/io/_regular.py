"""What may be read at all: regular files, up to a number of bytes.

A pipe blocks whoever opens it, a device such as /dev/zero never ends, and a link leads to either.
Every reader of this package asks here before it opens a file.
"""

from __future__ import annotations

import os
import pathlib
import stat

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


def check_regular_file(path: str | os.PathLike[str], most_bytes: int = MOST_BYTES) -> None:
    """Refuses what is no regular file, and what is too large, without opening it.

    Links are followed: where they lead is what counts.

    Args:
        path: of the file.
        most_bytes: how many it may have.

    Raises:
        ValueError: one sentence that names the file, for a folder, a pipe, a socket, a device, a
            file of more bytes, or a name that no file can have.
        FileNotFoundError: if there is none.
        OSError: if the file system does not tell.

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
    return pathlib.Path(path).read_bytes()
