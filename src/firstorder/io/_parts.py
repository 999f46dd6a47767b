"""Parts of files: what a program that was killed had begun to write, and the rule when it goes."""

from __future__ import annotations

import contextlib
import os
import pathlib
import re
import time

ABANDONED = 600.0  # seconds without a byte written after which a part is a killed program's


def sweep_parts(folder: pathlib.Path, stems: str, suffix: str) -> None:
    """Removes what programs that were killed had begun to write, `ABANDONED` seconds after.

    Args:
        folder: of the files.
        stems: a regular expression for their names without suffix; parts of others stay.
        suffix: of the files, with its dot.

    Example:
        >>> import os, pathlib, tempfile
        >>> from firstorder.io._parts import sweep_parts
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> part = folder / ".a.k3_x9q0b.part.png"
        >>> part.touch()
        >>> sweep_parts(folder, "a", ".png"), part.exists()  # young: another may be writing it
        (None, True)
        >>> os.utime(part, (0, 0))
        >>> sweep_parts(folder, "a", ".png"), part.exists()
        (None, False)
    """
    parts = re.compile(rf"\.(?:{stems})\.[a-z0-9_]{{8}}\.part{re.escape(suffix)}")
    with os.scandir(folder) as entries:
        for entry in entries:
            if parts.fullmatch(entry.name):
                with contextlib.suppress(OSError):  # another program was quicker
                    if time.time() - entry.stat().st_mtime > ABANDONED:
                        os.unlink(entry)
