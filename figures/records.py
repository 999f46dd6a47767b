"""Records of figures: which files were written, with which content, settings and claims.

A record is written last, so a figure that has one was finished. Whether its files are still those
is asked of their sizes and hashes; whether it would be drawn the same today, of its key (code and
versions) and of the settings of the compiler.
"""

from __future__ import annotations

import hashlib
import json
import pathlib
from collections.abc import Iterable
from typing import Any

from firstorder import io, session


def path_of(name: str, out: pathlib.Path) -> pathlib.Path:
    """Where a figure's record lies."""
    return out / f"{name}.json"


def write(name: str, out: pathlib.Path, key: str, files: list[str], claims: list) -> None:
    """Write a record of files that are written."""
    record = {
        "key": key,
        "made_with": session.settings(),
        "files": [_file(out / file) for file in files],
        "claims": claims,
    }
    io.write_json(path_of(name, out), record)


def read(name: str, out: pathlib.Path) -> dict[str, Any] | None:
    """A record, or None where there is none.

    Raises:
        ValueError: if it is damaged, or written by a version that kept no hashes.
    """
    file = path_of(name, out)
    try:
        record = json.loads(file.read_text(encoding="utf-8"))
        if _is_record(record):
            return record
    except FileNotFoundError:
        return None
    except ValueError:  # no JSON, or not even text
        pass
    raise ValueError(f"{file} is damaged or another version's")


def why_drawn(name: str, out: pathlib.Path, key: str, asked: Iterable[str]) -> str:
    """Why a figure is to be drawn, in words that follow its name; none if it is finished.

    Args:
        name: of the figure.
        out: folder of the files.
        key: of what it would be drawn from.
        asked: names of files that there must be.
    """
    try:
        record = read(name, out)
    except ValueError as error:
        return f"drawn again: {error}."
    if record is None:
        return "not drawn yet."
    if record["key"] != key:
        return "drawn again: its code, its size or a version has changed."
    if words := session.differing(record["made_with"], session.settings()):
        return f"drawn again: the compiler's settings differ ({words})."
    if lacking := set(asked) - {file["name"] for file in record["files"]}:
        return f"drawn again: {sorted(lacking)[0]} is asked for."
    for file in record["files"]:
        if words := _change(out / file["name"], file):
            return f"drawn again: {words}."
    return ""


def _is_record(record: Any) -> bool:
    """Whether a value has the parts of a record."""
    parts = {"key": str, "made_with": dict, "files": list, "claims": list}
    return (
        isinstance(record, dict)
        and all(isinstance(record.get(part), kind) for part, kind in parts.items())
        and all(isinstance(f, dict) and isinstance(f.get("name"), str) for f in record["files"])
        and all(isinstance(claim, dict) for claim in record["claims"])
    )


def _change(path: pathlib.Path, told: dict[str, Any]) -> str:
    """How a file is not as its record tells; its size is asked first, which costs nothing."""
    if not path.is_file():
        return f"{path.name} is missing"
    if (size := path.stat().st_size) != told.get("bytes"):
        return f"{path.name} has {size} bytes and not {told.get('bytes')}"
    return "" if _file(path) == told else f"{path.name} has another content"


def _file(path: pathlib.Path) -> dict[str, Any]:
    with path.open("rb") as file:
        content = hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16))
    return {"name": path.name, "bytes": path.stat().st_size, "blake2b": content.hexdigest()}
