"""Pages that the code writes itself: laws, events, equations, claims, keys, the API, our own words.

`python -m docs.generate` writes them into `docs/_generated`; so does Sphinx when it starts. Links
between pages are plain: `[words](other.md)` by file, `[words](#label)` to a `(label)=` anywhere,
and `` {py:obj}`words <firstorder.laws.Move>` `` to a public name.
"""

from __future__ import annotations

import pathlib
import shutil
from collections.abc import Mapping

from docs.generate import (
    api,
    claims,
    drawn,
    equations,
    own_words,
    peers,
    scene_files,
    steps,
    stills,
)

FOLDER = pathlib.Path(__file__).parents[1] / "_generated"

Pages = dict[str, str]


def pages() -> Pages:
    """All generated pages: Markdown by the path below `docs/_generated`."""
    found: Pages = {}
    for chapter in (steps, equations, claims, api, own_words, scene_files, drawn, stills, peers):
        for path, text in chapter.pages().items():
            if path in found:
                raise ValueError(f"Two pages are called {path}.")
            found[path] = text
    return found


def write(folder: pathlib.Path = FOLDER, pages: Mapping[str, str] | None = None) -> None:
    """Write pages, all if none are given, and remove those that are no longer there."""
    written = globals()["pages"]() if pages is None else pages
    shutil.rmtree(folder, ignore_errors=True)
    for path, text in written.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
