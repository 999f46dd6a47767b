"""Files that are there whole or not at all: written beside their name, then renamed.

A program that is interrupted, or a disk that is full, leaves the old file or none, never half of
a new one. Renaming within one folder is a single step of the file system.

A program that is killed leaves a hidden part, `.a.k3_x9q0b.part.png` for `a.png`. The next writer
of the same file removes it once nothing was written to it for ten minutes; younger parts may be
another program's work and stay.
"""

from __future__ import annotations

import contextlib
import csv
import json
import math
import os
import pathlib
import re
import secrets
import zipfile
from collections.abc import Iterator, Mapping
from typing import Any

import jax
import numpy as np

from firstorder.io._parts import sweep_parts
from firstorder.scene._bands import band_columns


@contextlib.contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[pathlib.Path]:
    """Lends a name in the same folder to write to, and renames it to `path` if all went well.

    Parts of the same file that killed programs left are removed first, ten minutes after their last
    byte; several programs may write one file at once, and the last one's stays.

    Args:
        path: the file's final name; folders on the way are made.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import atomic_write
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> with atomic_write(folder / "answer.txt") as part:
        ...     _ = part.write_text("42")
        >>> [f.name for f in folder.iterdir()]
        ['answer.txt']
    """
    path = pathlib.Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    sweep_parts(path.parent, re.escape(path.stem), path.suffix)
    # The suffix stays last: writers of pictures choose the format by it.
    part = path.parent / f".{path.stem}.{secrets.token_hex(4)}.part{path.suffix}"
    try:
        part.touch(exist_ok=False)  # mkstemp's files are private to the user
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from None
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Writes a text file, whole or not at all.

    Args:
        path: of the file.
        text: what it will hold.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import write_text
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.txt")
        >>> write_text(file, "light")
        >>> file.read_text()
        'light'
    """
    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")


def write_json(path: str | os.PathLike[str], value: Any) -> None:
    """Writes a value as JSON, whole or not at all; NaN and infinity, which it lacks, as null.

    Args:
        path: of the file.
        value: of numbers, words, lists and dictionaries; arrays are lists.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import write_json
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.json")
        >>> write_json(file, {"E": [1.5, float("nan")]})
        >>> "".join(file.read_text().split())
        '{"E":[1.5,null]}'
    """
    words = json.dumps(_finite(value), indent=1, ensure_ascii=False, allow_nan=False)
    write_text(path, words + "\n")


def write_npz(path: str | os.PathLike[str], arrays: Mapping[str, Any]) -> None:
    """Writes arrays by name as a compressed NPZ file, whole or not at all.

    Args:
        path: of the file.
        arrays: by name.

    Example:
        >>> import pathlib, tempfile
        >>> import numpy as np
        >>> from firstorder.io import write_npz
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.npz")
        >>> write_npz(file, {"E": [1.0, 2.0]})
        >>> np.load(file)["E"].tolist()
        [1.0, 2.0]
    """
    with atomic_write(path) as part, part.open("wb") as file:
        _pack_npz(file, arrays)


def _pack_npz(file: Any, arrays: Mapping[str, Any]) -> None:
    """Writes arrays by name as `np.savez_compressed` does, which keeps two names for itself.

    Args:
        file: of bytes, open for writing.
        arrays: by any name; `file` and `allow_pickle` are arguments there.

    Example:
        >>> import io
        >>> import numpy as np
        >>> from firstorder.io.files import _pack_npz
        >>> file = io.BytesIO()
        >>> _pack_npz(file, {"file": [1.0]})
        >>> _ = file.seek(0)
        >>> np.load(file).files
        ['file']
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, array in arrays.items():
            with packed.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, np.asarray(array))


def write_csv(path: str | os.PathLike[str], columns: Mapping[str, Any]) -> None:
    """Writes columns of equal length under their names, whole or not at all.

    One with a second axis of bands is a column for each, `E.R`, `E.G` and `E.B`.

    Args:
        path: of the file.
        columns: vectors by name.

    Raises:
        ValueError: if a column is no vector, the lengths differ, or two columns have one name.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import write_csv
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.csv")
        >>> write_csv(file, {"x": [0.0, 0.5], "E": [1.0, 2.0]})
        >>> file.read_text().split()
        ['x,E', '0.0,1.0', '0.5,2.0']
    """
    vectors = band_columns(columns)
    shapes = {v.shape for v in vectors.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 1:
        listed = ", ".join(f"{name} {v.shape}" for name, v in vectors.items())
        raise ValueError(f"Argument `columns` must be vectors of one length, but is {listed}.")
    with atomic_write(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(vectors)
        writer.writerows(zip(*(v.tolist() for v in vectors.values()), strict=True))


def _finite(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray | jax.Array):
        value = np.asarray(value).tolist()
    match value:
        case float():
            return value if math.isfinite(value) else None
        case Mapping():
            return {k: _finite(v) for k, v in value.items()}
        case list() | tuple():
            return [_finite(v) for v in value]
    return value
